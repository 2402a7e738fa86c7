//! `StatedHeight`: the height of a camera as stated, and the height above the ground that it means at a place.

use super::area::{centre, extent_m};
use super::camera_pose::CameraPose;
use super::error::LocateError;
use super::ground_heights::{GroundHeights, image_centre};
use super::request::FixRequest;
use overfly_core::camera::{Camera, CameraError, Height, View};
use overfly_core::geodesy::{BodyFrame, Enu, Geodetic, LocalFrame};
use overfly_core::tile::{WorldPixel, gsd_at};
use overfly_store::{Layer, StoreError};

/// Places along each side of the searched region at which the ground's height is taken.
const PLACES: i32 = 5;
/// The largest standard deviation of a scale that is searched.
const MOST_SIGMA_RATIO: f64 = 0.3;

/// The height of a camera as stated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StatedHeight {
    /// As stated; `None` where the view states none.
    height: Option<Height>,
    /// The height above ground that a height ratio of 1 stands for, metres.
    nominal_m: f64,
    /// One standard deviation of the stated height, as a ratio.
    pub sigma_ratio: f64,
}

impl StatedHeight {
    /// The height that a request states, and the request with the height above ground that this means around the searched region: on
    /// average, with a standard deviation that holds how much the ground there varies. Without terrain the request stays as it is.
    ///
    /// # Errors
    /// [`CameraError::NoGround`] where the height is above a datum and no ground is known there; [`CameraError::NotPositive`] where it
    /// is below the ground; where a tile of the terrain cannot be read.
    pub fn resolved(
        request: &FixRequest,
        layer: &Layer,
        ground: Option<&GroundHeights<'_>>,
    ) -> Result<(Self, FixRequest), LocateError> {
        let sigma_ratio = request.scale_sigma_ratio;
        let View::Posed { intrinsics, height, attitude } = &request.view else {
            return Ok((Self { height: None, nominal_m: 1.0, sigma_ratio }, request.clone()));
        };
        let unresolved = |stated: &Height| match stated {
            Height::AboveGround(nominal_m) => {
                Ok((Self { height: Some(*stated), nominal_m: *nominal_m, sigma_ratio }, request.clone()))
            }
            Height::AboveDatum(..) => Err(LocateError::Camera(CameraError::NoGround)),
        };
        let (Some(ground), Some(middle)) = (ground, centre(&request.position, layer)) else {
            return unresolved(height);
        };
        let at_height = |height_m: f64| View::Posed {
            intrinsics: intrinsics.clone(),
            height: Height::AboveGround(height_m),
            attitude: *attitude,
        };
        let Some(first_m) = height_above(height, ground, middle, middle)? else { return unresolved(height) };
        positive(first_m)?;
        let camera = Camera::new(&at_height(first_m), intrinsics.width_px, intrinsics.height_px)?;
        let offset = request.heading.map_or(Enu { east_m: 0.0, north_m: 0.0 }, |heading| {
            let centre = camera.image_centre_in_body().unwrap_or_default();
            BodyFrame::from_heading_rad(heading.heading_rad).enu_from_body(centre)
        });
        let heights = heights_around(height, ground, middle, extent_m(&request.position, layer), offset)?;
        if heights.is_empty() {
            return unresolved(height);
        }
        let mean_m = heights.iter().sum::<f64>() / heights.len() as f64;
        positive(mean_m)?;
        let spread_m = (heights.iter().map(|h| (h - mean_m).powi(2)).sum::<f64>() / heights.len() as f64).sqrt();
        let scale_sigma_ratio = sigma_ratio.hypot(spread_m / mean_m).min(MOST_SIGMA_RATIO).max(sigma_ratio);
        let resolved = FixRequest { view: at_height(mean_m), scale_sigma_ratio, ..request.clone() };
        Ok((Self { height: Some(*height), nominal_m: mean_m, sigma_ratio }, resolved))
    }

    /// The height ratio that the stated height means at a pose; 1 where the ground there is not known. `camera` is the one of a height
    /// ratio of 1.
    ///
    /// # Errors
    /// Where a tile of the terrain cannot be read.
    pub fn expected_ratio(
        &self,
        camera: &Camera,
        pose: &CameraPose,
        ground: Option<&GroundHeights<'_>>,
    ) -> Result<f64, StoreError> {
        let (Some(height), Some(ground)) = (&self.height, ground) else { return Ok(1.0) };
        let Ok(nadir) = pose.nadir.to_geodetic(pose.zoom) else { return Ok(1.0) };
        let seen = pose.camera(camera).and_then(|camera| image_centre(&camera, pose, gsd_at(nadir, pose.zoom)));
        let Some(Ok(centre)) = seen.map(|seen| seen.to_geodetic(pose.zoom)) else { return Ok(1.0) };
        Ok(height_above(height, ground, nadir, centre)?.map_or(1.0, |height_m| height_m / self.nominal_m))
    }
}

/// How far a camera of a stated height above a nadir is above the ground at another point, metres; `None` where ground is not known.
fn height_above(
    height: &Height,
    ground: &GroundHeights<'_>,
    nadir: Geodetic,
    point: Geodetic,
) -> Result<Option<f64>, StoreError> {
    let ground_m = |at: Geodetic| match WorldPixel::from_geodetic(at, ground.zoom()) {
        Ok(pixel) => ground.height_m(pixel, ground.zoom()),
        Err(_) => Ok(None),
    };
    let Some(below_m) = ground_m(point)? else { return Ok(None) };
    let camera_m = match *height {
        Height::AboveGround(height_m) => ground_m(nadir)?.map(|ground_m| ground_m + height_m),
        Height::AboveDatum(datum, height_m) => {
            Some(height_m + datum.undulation_m(nadir) - ground.vertical_datum().undulation_m(nadir))
        }
    };
    Ok(camera_m.map(|camera_m| camera_m - below_m))
}

/// The heights above ground over a region of a width and a height, metres, where they are known; `offset` leads from the nadir to the
/// ground under the image's centre.
fn heights_around(
    height: &Height,
    ground: &GroundHeights<'_>,
    middle: Geodetic,
    [width_m, height_m]: [f64; 2],
    offset: Enu,
) -> Result<Vec<f64>, StoreError> {
    let frame = LocalFrame::at(middle);
    let mut heights = Vec::new();
    for i in 0..PLACES * PLACES {
        let share = |k: i32| f64::from(k) / f64::from(PLACES - 1) - 0.5;
        let (east_m, north_m) = (share(i % PLACES) * width_m, share(i / PLACES) * height_m);
        let Ok(nadir) = frame.geodetic_from_enu(Enu { east_m, north_m }) else { continue };
        let seen = Enu { east_m: east_m + offset.east_m, north_m: north_m + offset.north_m };
        let Ok(point) = frame.geodetic_from_enu(seen) else { continue };
        heights.extend(height_above(height, ground, nadir, point)?.filter(|height_m| *height_m > 0.0));
    }
    Ok(heights)
}

fn positive(height_m: f64) -> Result<(), LocateError> {
    if height_m > 0.0 { Ok(()) } else { Err(LocateError::Camera(CameraError::BelowGround { height_m })) }
}
