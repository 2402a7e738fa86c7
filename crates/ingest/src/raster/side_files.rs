//! Files beside an image: the world file that places it, the `.prj` that names its CRS, GDAL's mask.

use super::affine::Affine;
use super::error::RasterError;
use super::wkt::epsg_from_wkt;
use crate::crs::Crs;
use overfly_store::read_bounded;
use std::path::{Path, PathBuf};

/// Larger files are neither world files nor `.prj` files.
const MAX_TEXT_BYTES: u64 = 64 << 10;

/// Returns the existing side files of an image, in a fixed order.
pub(super) fn side_files(path: &Path) -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = world_file(path).into_iter().collect();
    found.extend(prj_file(path));
    let mut mask = path.as_os_str().to_owned();
    mask.push(".msk");
    found.extend(Some(PathBuf::from(mask)).filter(|p| p.is_file()));
    found
}

/// Returns the geotransform of the world file beside an image; `None` without such a file.
///
/// # Errors
/// [`RasterError::BadGeoreference`] where it does not hold six numbers.
pub(super) fn world_placement(path: &Path) -> Result<Option<Affine>, RasterError> {
    let Some(beside) = world_file(path) else { return Ok(None) };
    let text = read_text(&beside)?;
    let numbers: Vec<f64> = text.split_whitespace().map_while(|word| word.replace(',', ".").parse().ok()).collect();
    let [column_x, column_y, row_x, row_y, x, y] = numbers[..] else {
        let reason = format!("a world file holds six numbers, this one {}", numbers.len());
        return Err(RasterError::bad_georeference(&beside, reason, None));
    };
    // A world file gives the centre of the first pixel.
    Ok(Some(Affine { origin: [x, y], column: [column_x, column_y], row: [row_x, row_y] }.corner_based()))
}

/// Returns the CRS of the `.prj` file beside an image; `None` without such a file.
///
/// # Errors
/// [`RasterError::NoCrs`] where its text names no EPSG code, [`RasterError::Crs`] where the code is refused.
pub(super) fn prj_crs(path: &Path) -> Result<Option<Crs>, RasterError> {
    let Some(beside) = prj_file(path) else { return Ok(None) };
    let text = read_text(&beside)?;
    let Some(code) = epsg_from_wkt(&text) else {
        let start: String = text.trim().chars().take(60).collect();
        let detail = format!(" by an EPSG code ({} holds '{start}...')", beside.display());
        return Err(RasterError::NoCrs { path: path.into(), detail });
    };
    Crs::from_epsg(code).map(Some).map_err(|e| RasterError::crs(path, e))
}

fn read_text(path: &Path) -> Result<String, RasterError> {
    let io = |e| RasterError::io(path, e);
    let size = std::fs::metadata(path).map_err(io)?.len();
    if size > MAX_TEXT_BYTES {
        let reason = format!("it is {size} bytes long, a file of its kind a few hundred");
        return Err(RasterError::bad_georeference(path, reason, None));
    }
    let bytes = read_bounded(path, MAX_TEXT_BYTES).map_err(io)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// Returns the world file beside an image. Its extension is the first and the last letter of the image's and a w (`a.pgw`),
/// the image's whole extension and a w (`a.pngw`), or `wld`; in lower or upper case.
fn world_file(path: &Path) -> Option<PathBuf> {
    let extension = path.extension()?.to_str()?.to_ascii_lowercase();
    let (first, last) = (extension.chars().next()?, extension.chars().last()?);
    [format!("{first}{last}w"), format!("{extension}w"), "wld".into()].iter().find_map(|e| beside(path, e))
}

fn prj_file(path: &Path) -> Option<PathBuf> {
    beside(path, "prj")
}

fn beside(path: &Path, extension: &str) -> Option<PathBuf> {
    [extension.to_string(), extension.to_uppercase()].iter().map(|e| path.with_extension(e)).find(|p| p.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder_with(name: &str, text: &str) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(name), text).unwrap();
        let image = folder.path().join("photo.png");
        (folder, image)
    }

    #[test]
    fn a_world_file_gives_pixel_centres() {
        for name in ["photo.pgw", "photo.pngw", "photo.wld", "photo.PGW"] {
            let (_folder, image) = folder_with(name, "2.0\n0\n0\n-2.0\n1001.0\n4999.0\n");
            let affine = world_placement(&image).unwrap().unwrap();
            assert_eq!(affine.plane_from_pixel(0.0, 0.0), (1000.0, 5000.0), "{name}");
        }
    }

    #[test]
    fn refuses_a_truncated_world_file() {
        let (_folder, image) = folder_with("photo.pgw", "2.0\n0\n0\nabc");
        assert_eq!(world_placement(&image).unwrap_err().code(), "source_bad_georeference");
    }

    #[test]
    fn refuses_a_prj_without_a_code() {
        let (_folder, image) = folder_with("photo.prj", "PROJCS[\"My own grid\",GEOGCS[\"x\"]]");
        let error = prj_crs(&image).unwrap_err();
        assert!(error.to_string().contains("My own grid"), "{error}");
        assert_eq!(error.remedy(), Some(crate::Remedy::StateCrs));
    }
}
