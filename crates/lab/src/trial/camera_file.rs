//! Reads `camera.toml`.

use super::error::TrialError;
use overfly_core::camera::CameraFile;
use overfly_store::read_small_text;
use std::path::Path;

/// Returns the camera that a `camera.toml` describes.
///
/// # Errors
/// [`TrialError::Unreadable`]; [`TrialError::NotACamera`] if a key is missing or of the wrong type, or if no camera
/// has these numbers.
pub fn read_camera(path: &Path) -> Result<CameraFile, TrialError> {
    let not_a_camera = |reason: String| TrialError::NotACamera { path: path.into(), reason };
    let text = read_small_text(path).map_err(|cause| TrialError::Unreadable { path: path.into(), cause })?;
    let camera: CameraFile =
        toml::from_str(&text).map_err(|e| not_a_camera(e.to_string().trim().replace('\n', " ")))?;
    camera.check().map_err(|e| not_a_camera(e.to_string()))?;
    Ok(camera)
}
