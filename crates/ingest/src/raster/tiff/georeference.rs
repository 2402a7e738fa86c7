//! Where a TIFF says that it lies: its geotransform tags.

use super::super::RasterError;
use super::super::affine::Affine;
use super::keys::{Keys, crs_of};
use crate::crs::Crs;
use std::path::Path;
use tiff_reader::{Ifd, TagValue};

const TAG_PIXEL_SCALE: u16 = 33550;
const TAG_TIEPOINT: u16 = 33922;
const TAG_TRANSFORMATION: u16 = 34264;

/// The geotransform and the CRS of an image's own tags; either may be missing.
///
/// # Errors
/// [`RasterError::BadGeoreference`] for tags that make no sense, [`RasterError::Crs`] for a refused CRS (unless
/// `crs_is_given`: then keys are not looked at).
pub(in super::super) fn placement(
    path: &Path,
    image: &Ifd,
    crs_is_given: bool,
) -> Result<(Option<Affine>, Option<Crs>), RasterError> {
    let keys = Keys::of(image);
    let affine = affine_of(path, image)?;
    let affine = affine.map(|a| if keys.is_pixel_point() { a.corner_based() } else { a });
    let crs = if crs_is_given { None } else { crs_of(path, &keys)? };
    Ok((affine, crs))
}

/// As GDAL reads them: scale and tie point first, else the matrix; pixels of a "point" raster are meant by their centre.
fn affine_of(path: &Path, image: &Ifd) -> Result<Option<Affine>, RasterError> {
    let doubles = |code: u16| match image.tag(code).map(|t| &t.value) {
        Some(TagValue::Double(values)) => values.clone(),
        _ => Vec::new(),
    };
    let (scale, tie, matrix) = (doubles(TAG_PIXEL_SCALE), doubles(TAG_TIEPOINT), doubles(TAG_TRANSFORMATION));
    if scale.len() >= 2 && tie.len() >= 6 {
        let (sx, sy) = (scale[0], -scale[1].abs());
        let origin = [tie[3] - tie[0] * sx, tie[4] - tie[1] * sy];
        return Ok(Some(Affine { origin, column: [sx, 0.0], row: [0.0, sy] }));
    }
    if matrix.len() == 16 {
        let (column, row) = ([matrix[0], matrix[4]], [matrix[1], matrix[5]]);
        return Ok(Some(Affine { origin: [matrix[3], matrix[7]], column, row }));
    }
    if tie.len() >= 12 {
        let reason = "it has ground control points but no geotransform; rectify it with gdalwarp";
        return Err(RasterError::bad_georeference(path, reason));
    }
    Ok(None)
}
