//! The position that a TIFF states: its geotransform tags and its CRS.

use super::keys::{GeoKeys, crs_from_keys};
use crate::crs::Crs;
use crate::raster::affine::Affine;
use crate::raster::error::RasterError;
use crate::remedy::Remedy;
use std::path::Path;
use tiff_reader::{Ifd, TagValue};

const TAG_PIXEL_SCALE: u16 = 33550;
const TAG_TIEPOINT: u16 = 33922;
const TAG_TRANSFORMATION: u16 = 34264;

/// Returns the geotransform and the CRS that an image's tags state; either may be missing. With `crs_is_given` the keys of
/// the CRS are ignored.
///
/// # Errors
/// [`RasterError::BadGeoreference`] for unusable tags, [`RasterError::Crs`] for a refused CRS.
pub(in crate::raster) fn placement(
    path: &Path,
    image: &Ifd,
    crs_is_given: bool,
) -> Result<(Option<Affine>, Option<Crs>), RasterError> {
    let keys = GeoKeys::from_image(image);
    let affine = affine_from_tags(path, image)?;
    let affine = affine.map(|a| if keys.is_pixel_point() { a.corner_based() } else { a });
    let crs = if crs_is_given { None } else { crs_from_keys(path, &keys)? };
    Ok((affine, crs))
}

/// Returns the geotransform as GDAL reads it: from scale and tie point, else from the matrix.
fn affine_from_tags(path: &Path, image: &Ifd) -> Result<Option<Affine>, RasterError> {
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
        let reason = "it has ground control points but no geotransform";
        return Err(RasterError::bad_georeference(path, reason, Some(Remedy::Rectify)));
    }
    Ok(None)
}
