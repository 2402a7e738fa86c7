//! `camera.toml`: a camera's intrinsics, and how exactly its attitude is known.

use crate::cli::failure::Failure;
use overfly_core::camera::CameraFile;
use overfly_store::read_small_text;
use std::path::Path;

/// Reads the camera that a `camera.toml` describes.
///
/// # Errors
/// If the file cannot be read, a key is missing or of the wrong kind, or the values do not describe a camera.
pub fn read_camera(path: &Path) -> Result<CameraFile, Failure> {
    let file = path.display();
    let refuse = |reason: String| {
        let error = anyhow::anyhow!("{file} does not describe a camera: {reason}");
        Failure::unusable("not_a_camera", error).with_remedy(Some("`overfly fix --help` describes camera.toml"))
    };
    let text = read_small_text(path).map_err(|cause| match cause.kind() {
        std::io::ErrorKind::InvalidData => refuse("it is not text".into()),
        _ => Failure::unusable("unreadable", anyhow::anyhow!("{file}: {cause}")).with_remedy(Some("check the name")),
    })?;
    let camera: CameraFile = toml::from_str(&text).map_err(|e| refuse(e.to_string().trim().replace('\n', " ")))?;
    camera.check().map_err(|e| refuse(e.to_string()))?;
    Ok(camera)
}
