//! Locating a frame: the request, the fix, and why there is none.

use crate::border::{Place, fixed, object, optional, stated};
use crate::error::{call, overfly_status};
use crate::frame::overfly_frame;
use crate::store::overfly_store;
use overfly_core::camera::Intrinsics;
use overfly_flight::locate::{Answer, Fix, FixParameters, NoFix, PositionOf, ViewParameters, locate, requested_layer};
use std::ffi::c_char;

/// A pinhole camera with OpenCV's distortion model. Pixels are counted from the upper-left corner of the image.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct overfly_camera {
    /// Columns of the sensor.
    pub width_px: u32,
    /// Rows of the sensor.
    pub height_px: u32,
    /// Focal length, pixels.
    pub focal_length_px: f64,
    /// Principal point, pixels right of and below the corner.
    pub principal_point_px: [f64; 2],
    /// k1, k2, p1, p2, k3.
    pub distortion: [f64; 5],
}

/// What is known when a frame is to be located. Start from `overfly_fix_request_new()`, which states nothing.
/// Either `gsd_m_per_px`, or `camera` and `height_m`, must be stated.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct overfly_fix_request {
    /// The layer to search; null: the only one, or `ortho`; `any`: all layers, the newest first, older ones only on no fix.
    pub layer: *const c_char,
    /// Most likely latitude of the point straight below the camera, degrees; NaN: search the whole layer.
    pub latitude_deg: f64,
    /// Most likely longitude of that point, degrees; NaN: search the whole layer.
    pub longitude_deg: f64,
    /// One standard deviation of that position per axis, metres.
    pub sigma_m: f64,
    /// Direction of the upper edge of the image, degrees clockwise from true north; NaN: search a full turn.
    pub heading_deg: f64,
    /// One standard deviation of the heading, degrees (3 at first).
    pub heading_sigma_deg: f64,
    /// Ground sample distance of a camera that looks straight down, metres per pixel.
    pub gsd_m_per_px: f64,
    /// The camera, instead of a ground sample distance; null: none.
    pub camera: *const overfly_camera,
    /// Height of the camera above ground, metres.
    pub height_m: f64,
    /// Angle of the camera off nadir, degrees, positive ahead; NaN: unknown.
    pub pitch_deg: f64,
    /// Angle of the camera off nadir, degrees, positive left; NaN: unknown.
    pub roll_deg: f64,
    /// One standard deviation of pitch and of roll, degrees; NaN: 2 where both are stated, else 5.
    pub attitude_sigma_deg: f64,
    /// One standard deviation of the height or the ground sample distance, as a ratio of it (0.03 at first).
    pub scale_sigma_ratio: f64,
    /// Threads to search with (1 at first). The answer does not depend on it.
    pub threads: u32,
}

/// Which point of the ground the position of a fix is.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum overfly_position_of {
    /// The point straight below the camera.
    OVERFLY_NADIR = 0,
    /// The point at the centre of the image: no height is known.
    OVERFLY_IMAGE_CENTRE = 1,
}

/// Where the camera was.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct overfly_fix {
    /// Latitude of the point that `position_of` names, degrees.
    pub latitude_deg: f64,
    /// Longitude of that point, degrees.
    pub longitude_deg: f64,
    /// Variance of the position towards east, m^2.
    pub covariance_ee_m2: f64,
    /// Covariance of east and north, m^2.
    pub covariance_en_m2: f64,
    /// Variance of the position towards north, m^2.
    pub covariance_nn_m2: f64,
    /// The point that position and covariance are of.
    pub position_of: overfly_position_of,
    /// Latitude of the ground at the centre of the image, degrees.
    pub image_centre_latitude_deg: f64,
    /// Longitude of that ground, degrees.
    pub image_centre_longitude_deg: f64,
    /// Variance of that ground's position towards east, m^2.
    pub image_centre_covariance_ee_m2: f64,
    /// Covariance of east and north, m^2.
    pub image_centre_covariance_en_m2: f64,
    /// Variance towards north, m^2.
    pub image_centre_covariance_nn_m2: f64,
    /// Direction of the upper edge of the image, degrees clockwise from true north, [0, 360).
    pub heading_deg: f64,
    /// One standard deviation of the heading, degrees.
    pub heading_sigma_deg: f64,
    /// Ground sample distance of the frame, metres per pixel.
    pub gsd_m_per_px: f64,
    /// One standard deviation of the scale, as a ratio.
    pub scale_sigma_ratio: f64,
    /// Peak of the correlation surface in standard deviations (a z-score).
    pub score: f64,
    /// Probability that a fix with this evidence is wrong: by chance, or because the frame lies at a place that fits almost as well.
    /// Never below 1.5e-4, which is what trials prove.
    pub false_fix_probability: f64,
    /// Local windows that agree.
    pub inliers: u32,
    /// Base tiles whose imagery was searched.
    pub tiles_searched: u32,
    /// The map's own error that the covariances carry, one standard deviation per axis, metres.
    pub map_error_m: f64,
    /// Whether the map states that error; if not, it is a default: half a pixel of the map, at least 3 m.
    pub map_error_known: bool,
    /// The layer of the fix.
    pub layer: [c_char; 48],
    /// Newest acquisition date of the sources of that layer, ISO 8601; empty: unknown.
    pub layer_date: [c_char; 32],
}

/// Why there is no fix.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct overfly_no_fix {
    /// A stable word, such as `outside_map`.
    pub reason: [c_char; 32],
    /// The figures behind the reason, UTF-8, for people.
    pub detail: [c_char; 256],
    /// Base tiles whose imagery was searched.
    pub tiles_searched: u32,
    /// The layer that was searched; of several the one that came nearest to a fix.
    pub layer: [c_char; 48],
}

/// Returns a request that states nothing, with the usual standard deviations.
#[unsafe(no_mangle)]
pub extern "C" fn overfly_fix_request_new() -> overfly_fix_request {
    overfly_fix_request {
        layer: std::ptr::null(),
        latitude_deg: f64::NAN,
        longitude_deg: f64::NAN,
        sigma_m: f64::NAN,
        heading_deg: f64::NAN,
        heading_sigma_deg: 3.0,
        gsd_m_per_px: f64::NAN,
        camera: std::ptr::null(),
        height_m: f64::NAN,
        pitch_deg: f64::NAN,
        roll_deg: f64::NAN,
        attitude_sigma_deg: f64::NAN,
        scale_sigma_ratio: 0.03,
        threads: 1,
    }
}

/// Locates a frame. `OVERFLY_OK`: `*fix` is set. `OVERFLY_NO_FIX`: `*no_fix` is set, unless `no_fix` is null.
/// Neither holds memory to free.
///
/// # Safety
/// `store` and `frame` come from this interface and are not freed; `request`, and the strings and the camera in it, may be
/// read; `fix` and `no_fix` may be written. Null is an error, except for `no_fix`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn overfly_locate(
    store: *const overfly_store,
    frame: *const overfly_frame,
    request: *const overfly_fix_request,
    fix: *mut overfly_fix,
    no_fix: *mut overfly_no_fix,
) -> overfly_status {
    call(|| {
        let store = &unsafe { object(store, "store") }?.reader;
        let frame = &unsafe { object(frame, "frame") }?.gray;
        let stated_request = unsafe { object(request, "request") }?;
        let out = unsafe { Place::new(fix, "fix") }?;
        let layer = requested_layer(store, unsafe { optional(stated_request.layer, "layer") }?)?;
        let request = unsafe { stated_request.parameters() }.request(&layer)?;
        let threads = stated_request.threads.clamp(1, 1024) as usize;
        match locate(store, frame, &request, threads)? {
            Answer::Fix(fix) => {
                out.set(overfly_fix::from(&fix));
                Ok(overfly_status::OVERFLY_OK)
            }
            Answer::NoFix(none) => {
                if !no_fix.is_null() {
                    unsafe { Place::new(no_fix, "no_fix") }?.set(overfly_no_fix::from(&none));
                }
                Ok(overfly_status::OVERFLY_NO_FIX)
            }
        }
    })
}

impl overfly_fix_request {
    /// # Safety
    /// `camera` is null or may be read.
    unsafe fn parameters(&self) -> FixParameters {
        let heading_deg = stated(self.heading_deg);
        let camera = unsafe { self.camera.as_ref() };
        FixParameters {
            latitude_deg: stated(self.latitude_deg),
            longitude_deg: stated(self.longitude_deg),
            sigma_m: stated(self.sigma_m),
            heading_deg,
            heading_sigma_deg: heading_deg.and(stated(self.heading_sigma_deg)),
            view: ViewParameters {
                gsd_m_per_px: stated(self.gsd_m_per_px),
                height_m: stated(self.height_m),
                camera: camera.map(overfly_camera::intrinsics),
                pitch_deg: stated(self.pitch_deg),
                roll_deg: stated(self.roll_deg),
                attitude_sigma_deg: stated(self.attitude_sigma_deg),
                ..ViewParameters::default()
            },
            height_sigma_ratio: stated(self.scale_sigma_ratio),
            ..FixParameters::default()
        }
    }
}

impl overfly_camera {
    fn intrinsics(&self) -> Intrinsics {
        Intrinsics {
            width_px: self.width_px,
            height_px: self.height_px,
            focal_length_px: self.focal_length_px,
            principal_point_px: self.principal_point_px,
            distortion: self.distortion,
        }
    }
}

impl From<&Fix> for overfly_fix {
    fn from(fix: &Fix) -> Self {
        Self {
            latitude_deg: fix.position.latitude_deg(),
            longitude_deg: fix.position.longitude_deg(),
            covariance_ee_m2: fix.covariance.ee_m2,
            covariance_en_m2: fix.covariance.en_m2,
            covariance_nn_m2: fix.covariance.nn_m2,
            position_of: match fix.position_of {
                PositionOf::Nadir => overfly_position_of::OVERFLY_NADIR,
                PositionOf::ImageCentre => overfly_position_of::OVERFLY_IMAGE_CENTRE,
            },
            image_centre_latitude_deg: fix.image_centre.latitude_deg(),
            image_centre_longitude_deg: fix.image_centre.longitude_deg(),
            image_centre_covariance_ee_m2: fix.image_centre_covariance.ee_m2,
            image_centre_covariance_en_m2: fix.image_centre_covariance.en_m2,
            image_centre_covariance_nn_m2: fix.image_centre_covariance.nn_m2,
            heading_deg: fix.heading.degrees(),
            heading_sigma_deg: fix.heading_sigma_rad.to_degrees(),
            gsd_m_per_px: fix.gsd_m_per_px,
            scale_sigma_ratio: fix.scale_sigma_ratio,
            score: fix.score,
            false_fix_probability: fix.false_fix_probability,
            inliers: count(fix.inliers),
            tiles_searched: count(fix.tiles_searched),
            map_error_m: fix.map_error_m,
            map_error_known: fix.map_error_known,
            layer: fixed(&fix.map.layer),
            layer_date: fixed(fix.map.layer_date.as_deref().unwrap_or_default()),
        }
    }
}

impl From<&NoFix> for overfly_no_fix {
    fn from(none: &NoFix) -> Self {
        Self {
            reason: fixed(none.reason.word()),
            detail: fixed(&none.detail),
            tiles_searched: count(none.tiles_searched),
            layer: fixed(&none.map.layer),
        }
    }
}

fn count(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}
