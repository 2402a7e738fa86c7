//! `CameraError`: why a stated view cannot be used.

/// Why a stated view cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CameraError {
    /// A length or size is not positive.
    #[error("{name} = {value} must be a positive number")]
    NotPositive {
        /// Its name in requests.
        name: &'static str,
        /// The given value.
        value: f64,
    },
    /// A value is NaN or infinite.
    #[error("{name} = {value} is not a finite number")]
    NotFinite {
        /// Its name in requests.
        name: &'static str,
        /// The given value.
        value: f64,
    },
    /// Pitch or roll is beyond the limit.
    #[error(
        "pitch_deg = {pitch_deg:.1}, roll_deg = {roll_deg:.1} is too far off nadir; at most {limit_deg} degrees each"
    )]
    TooFarOffNadir {
        /// Stated pitch, degrees.
        pitch_deg: f64,
        /// Stated roll, degrees.
        roll_deg: f64,
        /// The limit, degrees.
        limit_deg: f64,
    },
    /// A standard deviation of the attitude is out of range.
    #[error("attitude_sigma_deg = {sigma_deg} must be degrees in [0, {limit_deg}]")]
    AttitudeSigma {
        /// The given value, degrees.
        sigma_deg: f64,
        /// The limit, degrees.
        limit_deg: f64,
    },
    /// The height is stated above sea or ellipsoid, and the ground's own height is not known.
    #[error(
        "a height above sea or ellipsoid needs the ground's height: the store has no terrain there; state height_m above ground"
    )]
    NoGround,
    /// The height is stated above sea or ellipsoid, and lies below the ground.
    #[error("the stated height lies {:.0} m below the ground there", -height_m)]
    BelowGround {
        /// The height above ground that follows from it, metres.
        height_m: f64,
    },
    /// The frame has another aspect than the camera's image.
    #[error(
        "the frame is {width_px} x {height_px} px but the camera is {expected_width_px} x {expected_height_px} px; state the intrinsics of the frame itself"
    )]
    OtherAspect {
        /// Columns of the frame.
        width_px: u32,
        /// Rows of the frame.
        height_px: u32,
        /// Columns of the camera.
        expected_width_px: u32,
        /// Rows of the camera.
        expected_height_px: u32,
    },
}

impl CameraError {
    /// A stable word for scripts and HTTP.
    pub fn code(&self) -> &'static str {
        match self {
            Self::NotPositive { .. } | Self::NotFinite { .. } | Self::AttitudeSigma { .. } => "bad_camera",
            Self::NoGround => "no_terrain",
            Self::BelowGround { .. } => "below_ground",
            Self::TooFarOffNadir { .. } => "too_far_off_nadir",
            Self::OtherAspect { .. } => "camera_does_not_fit_frame",
        }
    }
}
