//! `IntrinsicsJson`: a camera.

use overfly_core::camera::Intrinsics;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A pinhole camera, with the keys of `camera.toml`. Pixels are counted from the image's upper-left corner.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, ToSchema)]
#[schema(as = Intrinsics)]
#[serde(deny_unknown_fields)]
pub(crate) struct IntrinsicsJson {
    /// Columns of the sensor.
    #[schema(minimum = 1)]
    width_px: i32,
    /// Rows of the sensor.
    #[schema(minimum = 1)]
    height_px: i32,
    /// Focal length, pixels.
    #[schema(exclusive_minimum = 0.0)]
    focal_length_px: f64,
    /// Principal point from the image's corner, pixels.
    #[schema(min_items = 2, max_items = 2)]
    principal_point_px: [f64; 2],
    /// Distortion coefficients k1, k2, p1, p2, k3 (the OpenCV model).
    #[serde(default)]
    #[schema(min_items = 5, max_items = 5)]
    distortion: [f64; 5],
}

impl From<&IntrinsicsJson> for Intrinsics {
    fn from(camera: &IntrinsicsJson) -> Self {
        // The library refuses 0.
        let pixels = |given: i32| u32::try_from(given).unwrap_or(0);
        Self {
            width_px: pixels(camera.width_px),
            height_px: pixels(camera.height_px),
            focal_length_px: camera.focal_length_px,
            principal_point_px: camera.principal_point_px,
            distortion: camera.distortion,
        }
    }
}
