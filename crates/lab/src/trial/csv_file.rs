//! The CSV files that trials write. A row is a struct; its fields are the columns.

use super::error::TrialError;
use overfly_store::write_output;
use serde::{Serialize, Serializer};
use std::path::{Path, PathBuf};

/// A number with a fixed count of decimals.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Decimals<const N: usize>(pub f64);

impl<const N: usize> Serialize for Decimals<N> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&format_args!("{:.N$}", self.0))
    }
}

/// A number with as many digits as it needs: `1`, not `1.0`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Shortest(pub f64);

impl Serialize for Shortest {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&self.0)
    }
}

/// The text of a CSV file: a header, which names the fields of `R`, and a line for each row. An absent value is an empty cell.
pub fn csv_text<R: Serialize + Default>(rows: impl IntoIterator<Item = R>) -> String {
    let mut rows = rows.into_iter().peekable();
    if rows.peek().is_none() {
        // Only a row tells the writer its columns.
        let header_and_row = csv_text([R::default()]);
        return header_and_row.split_inclusive('\n').take(1).collect();
    }
    let mut writer = csv::WriterBuilder::new().from_writer(Vec::new());
    rows.for_each(|row| writer.serialize(row).expect("rows have the same cells, and memory takes them"));
    let bytes = writer.into_inner().expect("writing to memory does not fail");
    String::from_utf8(bytes).expect("cells are text")
}

/// Writes a CSV file into a folder, which is made if absent, and returns the path of the file.
///
/// # Errors
/// [`TrialError::Unwritable`].
pub fn write_csv<R: Serialize + Default>(
    folder: &Path,
    name: &str,
    rows: impl IntoIterator<Item = R>,
) -> Result<PathBuf, TrialError> {
    let path = folder.join(name);
    std::fs::create_dir_all(folder)
        .and_then(|()| write_output(&path, csv_text(rows)))
        .map_err(|cause| TrialError::Unwritable { path: path.clone(), cause })?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Serialize, Default)]
    struct Row<'a> {
        name: &'a str,
        error_m: Decimals<2>,
        area: Shortest,
        age_s: Option<Decimals<3>>,
    }

    #[test]
    fn digits_are_fixed_and_text_is_quoted_where_it_must_be() {
        let row = Row { name: "a \"1\", b", error_m: Decimals(0.125), area: Shortest(100.0), age_s: None };
        let other = Row { name: "c d", error_m: Decimals(-2.0), area: Shortest(0.1), age_s: Some(Decimals(1.0)) };
        let expected = "name,error_m,area,age_s\n\"a \"\"1\"\", b\",0.12,100,\nc d,-2.00,0.1,1.000\n";
        assert_eq!(csv_text([row, other]), expected);
    }

    #[test]
    fn a_file_without_rows_has_its_header() {
        assert_eq!(csv_text(Vec::<Row>::new()), "name,error_m,area,age_s\n");
    }
}
