//! `ImagePairs`: image pairs with the true motion between them.

use super::error::TrialError;
use super::input_table::InputTable;
use std::path::{Path, PathBuf};

/// Image pairs, in the order of the file; at least one.
#[derive(Debug, Clone)]
pub struct ImagePairs {
    /// The pairs.
    pub pairs: Vec<ImagePair>,
}

/// One image pair.
#[derive(Debug, Clone)]
pub struct ImagePair {
    /// Names in the file.
    pub names: [String; 2],
    /// Paths of the images.
    pub paths: [PathBuf; 2],
    /// Share of the scene that both images show, per cent.
    pub overlap_percent: f64,
    /// The true motion: takes a point (x, y, 1) of b to a, pixels from the corner.
    pub a_from_b: [[f64; 3]; 2],
}

const NEEDED: [&str; 9] = ["image_a", "image_b", "overlap_percent", "m00", "m01", "m02", "m10", "m11", "m12"];

impl ImagePairs {
    /// Reads a pairs file. Image names are relative to the file, and the images must exist.
    ///
    /// # Errors
    /// The first problem, with file, line and column.
    pub fn read(path: &Path) -> Result<Self, TrialError> {
        let table = InputTable::read(path, &NEEDED)?;
        let mut pairs = Vec::with_capacity(table.rows().len());
        for row in table.rows() {
            let m = |column| table.number(row, column, "a finite number", |_| true);
            let a_from_b = [[m("m00")?, m("m01")?, m("m02")?], [m("m10")?, m("m11")?, m("m12")?]];
            let determinant = a_from_b[0][0] * a_from_b[1][1] - a_from_b[0][1] * a_from_b[1][0];
            if determinant <= 0.0 {
                return Err(table.bad_cell(
                    row,
                    "m00",
                    "the matrix m00 m01 / m10 m11 must have a positive determinant",
                ));
            }
            pairs.push(ImagePair {
                names: ["image_a", "image_b"].map(|c| table.text(row, c).to_owned()),
                paths: [table.image(row, "image_a")?, table.image(row, "image_b")?],
                overlap_percent: table
                    .number(row, "overlap_percent", "a number in [0, 100]", |v| (0.0..=100.0).contains(&v))?,
                a_from_b,
            });
        }
        Ok(Self { pairs })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_the_line_of_what_is_wrong() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pairs.csv");
        std::fs::write(folder.path().join("a.png"), b"").unwrap();
        let header = "image_a,image_b,overlap_percent,m00,m01,m02,m10,m11,m12";
        let said = |row: &str| {
            std::fs::write(&path, format!("{header}\n{row}\n")).unwrap();
            ImagePairs::read(&path).map(|p| p.pairs[0].a_from_b[0][2]).map_err(|e| e.to_string())
        };
        assert_eq!(said("a.png,a.png,50,1,0,2.5,0,1,0"), Ok(2.5));
        assert!(said("a.png,a.png,150,1,0,0,0,1,0").unwrap_err().contains("line 2: overlap_percent"));
        assert!(said("a.png,b.png,50,1,0,0,0,1,0").unwrap_err().contains("line 2: there is no image"));
        assert!(said("a.png,a.png,50,1,0,inf,0,1,0").unwrap_err().contains("m02"));
        assert!(said("a.png,a.png,50,1,0,0,0,-1,0").unwrap_err().contains("determinant"));
    }
}
