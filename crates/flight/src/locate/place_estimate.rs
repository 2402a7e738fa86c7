//! `PlaceEstimate`: the ground under the image's centre, the heading and the height that the windows of a place measure.
//!
//! The windows agreed on a similarity. Here the camera itself is fitted to them, with its tilt and what a sensor or a lens may add,
//! so that none of these shifts the answer, and each widens its covariance. The tilt that the windows show is compared with the
//! stated attitude.

use super::camera_pose::CameraPose;
use super::refined_place::RefinedPlace;
use nalgebra::{Matrix2, Vector2};
use overfly_core::camera::{Attitude, Camera, DEFAULT_UNSTATED_SIGMA_DEG, Height, Intrinsics, View};
use overfly_core::geodesy::BodyFrame;
use overfly_core::registration::resection::{Correspondence, DeviationSigmas, Resection, ResectionStart, resect};
use overfly_core::registration::seam::Seam;
use overfly_core::tile::WorldPixel;

/// Neighbouring windows see the same edges, so fewer of them are independent than there are: variances from their residuals are
/// too small by this factor. Measured where frame and map are of one date and nothing else disturbs.
const VARIANCE_FACTOR: f64 = 1.4;
/// The 99.9 % quantile of the F distribution with 2 and n degrees of freedom exceeds that of infinitely many by nearly 1 + 9 / n:
/// few windows know their own scatter badly (n = 8: 2.7 against 2.1, 20: 1.44 against 1.45, 40: 1.19 against 1.22).
const FEW_WINDOWS: f64 = 9.0;
/// One standard deviation of the ground's slope per axis, degrees. A slope looks as a tilt does, but does not move the nadir.
const SLOPE_SIGMA_DEG: f64 = 1.4;
/// That of the slope that a terrain model leaves unknown.
const RESIDUAL_SLOPE_SIGMA_DEG: f64 = 0.3;
/// One standard deviation of what cameras add that nobody states: aspect, shear, and the first radial coefficient.
const ASPECT_SIGMA: f64 = 0.02;
const SHEAR_SIGMA: f64 = 0.02;
const RADIAL_SIGMA: f64 = 0.1;
/// The tilt that is compared with the stated attitude is measured under a prior this wide, degrees: by the windows alone.
const OPEN_TILT_SIGMA_DEG: f64 = 20.0;
/// A tilt further than this from the stated attitude, in standard deviations of both, contradicts it. Of right attitudes
/// exp(-3.2^2 / 2), 0.6 %, are refused. The 99.9 % ellipse of a nadir reaches to 3.7 standard deviations of the attitude: an
/// attitude further off must be refused although the windows measure it only to some degrees.
const MAX_TILT_SIGMAS: f64 = 3.2;
/// Beyond this many standard deviations the attitude is doubtful. Few windows measure the tilt badly: one of four standard
/// deviations of the attitude was seen to pass as one of three of both.
const DOUBTFUL_TILT_SIGMAS: f64 = 2.0;

/// One standard deviation of the place, as a share of the offset between the parts on both sides of a seam.
const SEAM_SHARE: f64 = 0.5;

/// One standard deviation per axis of those offsets, px.
const SEAM_SIGMA_PX: f64 = 0.7;

/// What the windows of a place measure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaceEstimate {
    /// The ground under the image's centre, in pixels of the world at `zoom`.
    pub image_centre: WorldPixel,
    /// The level of `image_centre`.
    pub zoom: u8,
    /// Covariance of `image_centre`, px^2, columns to the east and rows to the south.
    pub covariance_px2: Matrix2<f64>,
    /// Heading, radians clockwise from true north.
    pub heading_rad: f64,
    /// Variance of the heading, rad^2.
    pub heading_variance_rad2: f64,
    /// True height over the stated height.
    pub height_ratio: f64,
    /// Variance of the logarithm of the height.
    pub log_height_variance: f64,
    /// Root mean square residual per axis of the agreeing windows, px.
    pub rms_px: f64,
}

/// The tilt that the windows of a place show, and how far it is from the stated attitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TiltFound {
    /// Pitch less assumed pitch and roll less assumed roll, radians.
    pub off_rad: [f64; 2],
    /// The distance from the assumed attitude in standard deviations of both.
    pub sigmas: f64,
}

impl TiltFound {
    /// Whether the tilt contradicts the stated attitude.
    pub fn contradicts(&self) -> bool {
        self.sigmas > MAX_TILT_SIGMAS
    }

    /// Whether the tilt is so far from the stated attitude that this may be further off than it states: one in seven right
    /// attitudes is. The nadir's covariance then holds the tilt found.
    pub fn is_doubtful(&self) -> bool {
        self.sigmas > DOUBTFUL_TILT_SIGMAS
    }

    /// The greatest accepted distance, standard deviations.
    pub fn most_sigmas() -> f64 {
        MAX_TILT_SIGMAS
    }
}

impl PlaceEstimate {
    /// The estimate with the doubt that a seam leaves: the true place may be that of either part. Both lie in the 95 % ellipse.
    pub fn doubted(mut self, seam: &Seam) -> Self {
        for offset in seam.offsets_px.map(|offset| offset * SEAM_SHARE) {
            self.covariance_px2 += offset * offset.transpose();
        }
        self.covariance_px2 += Matrix2::identity() * SEAM_SIGMA_PX.powi(2);
        self
    }

    /// The estimate of a smeared view. Where fewer than half of its windows agree, those err together, the more so the fewer they are.
    pub fn smeared(mut self, place: &RefinedPlace) -> Self {
        let windows_per_agreeing = place.matches.len() as f64 / place.fit.inliers.len().max(1) as f64;
        if windows_per_agreeing > 2.0 {
            self.covariance_px2 *= windows_per_agreeing;
        }
        self
    }

    /// Returns what the windows of a place measure. `camera` is the stated camera of the frame.
    pub fn new(place: &RefinedPlace, view: &View, camera: &Camera) -> Self {
        let windows = PlacedWindows::new(place, view, camera);
        match windows.resection(windows.tilt_sigma_rad()) {
            Some(resection) => Self::from_resection(place, &resection),
            None => Self::from_similarity(place, windows.image_centre_px),
        }
    }

    fn from_resection(place: &RefinedPlace, found: &Resection) -> Self {
        let factor = variance_factor(found.agreeing) * doubt_factor(found.within_tolerance, place.matches.len());
        Self {
            image_centre: world_pixel(place, found.image_centre_px),
            zoom: place.pose.zoom,
            covariance_px2: found.image_centre_covariance_px2 * factor,
            heading_rad: found.heading_rad,
            heading_variance_rad2: found.heading_variance_rad2 * factor,
            height_ratio: found.deviation.log_height.exp(),
            log_height_variance: found.log_height_variance * factor,
            rms_px: found.rms_px,
        }
    }

    /// The estimate of the similarity alone. `image_centre_px` is where the view shows the image's centre, from its nadir.
    fn from_similarity(place: &RefinedPlace, image_centre_px: Vector2<f64>) -> Self {
        let fit = &place.fit;
        let factor = variance_factor(fit.inliers.len() as f64);
        Self {
            image_centre: world_pixel(place, fit.map_from_view.apply(image_centre_px)),
            zoom: place.pose.zoom,
            covariance_px2: fit.covariance_at(image_centre_px) * factor,
            heading_rad: place.pose.heading_rad,
            heading_variance_rad2: fit.covariance[(3, 3)] * factor,
            height_ratio: place.pose.height_ratio,
            log_height_variance: fit.covariance[(2, 2)] * factor,
            rms_px: fit.rms_px,
        }
    }
}

impl TiltFound {
    /// Returns the tilt at a place; `None` where no height is known, or too few windows agree.
    pub fn new(place: &RefinedPlace, view: &View, camera: &Camera) -> Option<Self> {
        let View::Posed { attitude, .. } = view else { return None };
        let found = PlacedWindows::new(place, view, camera).resection(OPEN_TILT_SIGMA_DEG.to_radians())?;
        let off = Vector2::new(found.deviation.pitch_rad, found.deviation.roll_rad);
        let known_rad2 = attitude.sigma_rad.powi(2) + slope_sigma_rad(place.relief.is_some()).powi(2);
        let covariance =
            found.tilt_covariance_rad2 * variance_factor(found.agreeing) + Matrix2::identity() * known_rad2;
        let sigmas = off.dot(&(covariance.try_inverse()? * off)).sqrt();
        Some(Self { off_rad: [off.x, off.y], sigmas })
    }
}

/// One standard deviation of a view's tilt per axis, that of the ground included, radians; `None` where no height is known. `on_relief`:
/// the ground's own slope is known.
pub fn tilt_sigma_rad(view: &View, on_relief: bool) -> Option<f64> {
    let View::Posed { attitude, .. } = view else { return None };
    Some(attitude.sigma_rad.hypot(slope_sigma_rad(on_relief)))
}

/// One standard deviation of what is not known of the ground's slope per axis, radians.
fn slope_sigma_rad(on_relief: bool) -> f64 {
    let sigma_deg = if on_relief { RESIDUAL_SLOPE_SIGMA_DEG } else { SLOPE_SIGMA_DEG };
    sigma_deg.to_radians()
}

/// The pose with the tilt that the windows of a place show, under the attitude's standard deviation; `None` where no height is known or
/// too few windows agree.
pub fn pose_with_tilt(place: &RefinedPlace, view: &View, camera: &Camera) -> Option<CameraPose> {
    let View::Posed { .. } = view else { return None };
    let windows = PlacedWindows::new(place, view, camera);
    windows.pose(&windows.resection(windows.tilt_sigma_rad())?)
}

/// Where few of the windows lie within the tolerance of the camera found (smear, water, changes), those that do are not right for
/// sure: they err together, and their residuals do not show it. Of 2,193 disturbed frames 13 had the truth outside their 99.9 %
/// ellipse, all of them smeared, with 7 to 11 of some 20 windows; errors were up to twice as long as the ellipses.
fn doubt_factor(within_tolerance: usize, windows: usize) -> f64 {
    (windows as f64 / within_tolerance.max(1) as f64).powi(2)
}

fn variance_factor(windows: f64) -> f64 {
    VARIANCE_FACTOR * (1.0 + FEW_WINDOWS / (2.0 * windows).max(1.0))
}

/// A place in pixels from the nadir from which the last pass started, as a pixel of the world.
fn world_pixel(place: &RefinedPlace, from_nadir_px: Vector2<f64>) -> WorldPixel {
    let WorldPixel { x_px, y_px } = place.last_pass.1.nadir;
    WorldPixel { x_px: x_px + from_nadir_px.x, y_px: y_px + from_nadir_px.y }
}

/// The windows of the last pass as correspondences of frame and map.
struct PlacedWindows<'a> {
    place: &'a RefinedPlace,
    camera: Camera,
    attitude: Attitude,
    correspondences: Vec<Correspondence>,
    /// Those that agree on the similarity.
    inliers: Vec<usize>,
    /// Where the view shows the image's centre, pixels from its nadir.
    image_centre_px: Vector2<f64>,
    px_from_enu: Matrix2<f64>,
}

impl<'a> PlacedWindows<'a> {
    fn new(place: &'a RefinedPlace, view: &View, camera: &Camera) -> Self {
        let (camera, attitude) = match view {
            View::Posed { attitude, .. } => (camera.clone(), *attitude),
            View::Nadir { .. } => (with_usual_field_of_view(camera), Attitude::UNSTATED),
        };
        let (start, grid) = (place.last_pass.1, &place.grid);
        let turn = BodyFrame::from_heading_rad(start.heading_rad);
        let seen = start.camera(&camera).unwrap_or_else(|| camera.at_height_ratio(start.height_ratio));
        let mut windows = Self {
            place,
            attitude,
            correspondences: Vec::new(),
            inliers: Vec::new(),
            image_centre_px: Vector2::zeros(),
            px_from_enu: Matrix2::new(1.0 / grid.gsd_m_per_px[0], 0.0, 0.0, -1.0 / grid.gsd_m_per_px[1]),
            camera,
        };
        let centre = turn.enu_from_body(seen.image_centre_in_body().unwrap_or_default());
        windows.image_centre_px = windows.px_from_enu * Vector2::new(centre.east_m, centre.north_m);
        for (index, window) in place.matches.iter().enumerate().filter(|(_, window)| !window.on_rim) {
            let ground = turn.body_from_enu(grid.enu_from_grid(window.centre_px));
            let rise_m = |at: [f64; 2]| place.relief.as_ref().map_or(0.0, |relief| relief.at(at));
            let Some(frame_px) = seen.frame_from_ground(ground, rise_m(window.centre_px)) else { continue };
            if place.fit.inliers.contains(&index) {
                windows.inliers.push(windows.correspondences.len());
            }
            let found_px = Vector2::from(window.centre_px) + window.displacement_px;
            let (map_px, rise_m) = (found_px - Vector2::from(grid.nadir_px), rise_m(found_px.into()));
            let information = window.information;
            windows.correspondences.push(Correspondence { frame_px, map_px, information, rise_m });
        }
        windows
    }

    /// The pose of the camera that a resection found, at the level of the last pass.
    fn pose(&self, found: &Resection) -> Option<CameraPose> {
        let (heading_rad, height_ratio) = (found.heading_rad, found.deviation.log_height.exp());
        let centre = self.camera.at_height_ratio(height_ratio).image_centre_in_body()?;
        let centre = BodyFrame::from_heading_rad(heading_rad).enu_from_body(centre);
        let off_nadir_px = self.px_from_enu * Vector2::new(centre.east_m, centre.north_m);
        let nadir = world_pixel(self.place, found.image_centre_px - off_nadir_px);
        let tilt_rad = [found.deviation.pitch_rad, found.deviation.roll_rad];
        Some(CameraPose { nadir, zoom: self.place.pose.zoom, heading_rad, height_ratio, tilt_rad })
    }

    /// One standard deviation of the tilt per axis, that of the ground included.
    fn tilt_sigma_rad(&self) -> f64 {
        self.attitude.sigma_rad.hypot(slope_sigma_rad(self.place.relief.is_some()))
    }

    /// The camera under a prior of this standard deviation of its tilt.
    fn resection(&self, tilt_rad: f64) -> Option<Resection> {
        let start = ResectionStart {
            camera: &self.camera,
            px_from_enu: self.px_from_enu,
            image_centre_px: self.place.fit.map_from_view.apply(self.image_centre_px),
            heading_rad: self.place.pose.heading_rad,
            height_ratio: self.place.pose.height_ratio,
            inliers: &self.inliers,
            priors: DeviationSigmas { tilt_rad, aspect: ASPECT_SIGMA, shear: SHEAR_SIGMA, radial: RADIAL_SIGMA },
            radius_px: self.place.last_pass.0.radius_px as f64,
            tolerance_px: self.place.last_pass.0.tolerance_px,
        };
        resect(&self.correspondences, &start)
    }
}

/// A camera of the same scale with a usual field of view (45 degrees over the longer side), for a view whose height is not known.
fn with_usual_field_of_view(camera: &Camera) -> Camera {
    let (width_px, height_px) = camera.frame_size_px();
    let focal_length_px = 1.2 * f64::from(width_px.max(height_px));
    let view = View::Posed {
        intrinsics: Intrinsics::centred(width_px, height_px, focal_length_px),
        height: Height::AboveGround(camera.gsd_m_per_px() * focal_length_px),
        attitude: Attitude::new(None, None, Some(DEFAULT_UNSTATED_SIGMA_DEG.to_radians())),
    };
    Camera::new(&view, width_px, height_px).unwrap_or_else(|_| camera.clone())
}
