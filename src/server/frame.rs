//! An uploaded image to a camera frame: measured by its header against the service's own bounds, then decoded.

use super::error::ServerError;
use super::state::Limits;
use crate::pixels::Gray;
use crate::raster::decode_frame;
use image::ImageReader;
use std::io::Cursor;

/// The frame in `bytes`, the form's part `part`.
///
/// # Errors
/// What is not an image or a damaged one, or one beyond the limits, which its header tells before it is decoded.
pub(super) fn decode(part: &'static str, bytes: &[u8], limits: &Limits) -> Result<Gray, ServerError> {
    let header = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map(ImageReader::into_dimensions);
    if let Ok(Ok((width_px, height_px))) = header {
        let (limit_px, limit_edge_px) = (limits.image_px, limits.image_edge_px);
        if width_px.max(height_px) > limit_edge_px || u64::from(width_px) * u64::from(height_px) > limit_px {
            return Err(ServerError::ImageTooLarge { part, width_px, height_px, limit_px, limit_edge_px });
        }
    }
    decode_frame(bytes, part).map_err(|error| ServerError::Frame { part, error })
}
