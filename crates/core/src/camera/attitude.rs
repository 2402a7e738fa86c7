//! `Attitude`: how far off nadir the camera looks, as far as that is stated, and how exactly it is known.

/// One standard deviation per axis of an attitude whose pitch and roll are stated without one, degrees.
pub const DEFAULT_STATED_SIGMA_DEG: f64 = 2.0;
/// One standard deviation per axis where pitch or roll is not stated, degrees: the camera is taken to look straight down.
pub const DEFAULT_UNSTATED_SIGMA_DEG: f64 = 5.0;

/// Pitch and roll of the camera off nadir, as far as stated, and their standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attitude {
    /// Pitch off nadir, radians, positive ahead; `None` where it is not stated.
    pub pitch_rad: Option<f64>,
    /// Roll off nadir, radians, positive to the left; `None` where it is not stated.
    pub roll_rad: Option<f64>,
    /// One standard deviation of pitch and of roll, radians; 0 where both are exact.
    pub sigma_rad: f64,
}

impl Attitude {
    /// An attitude of which nothing is stated.
    pub const UNSTATED: Self =
        Self { pitch_rad: None, roll_rad: None, sigma_rad: DEFAULT_UNSTATED_SIGMA_DEG * std::f64::consts::PI / 180.0 };

    /// Makes an attitude from what is stated, radians. Without a standard deviation it is [`DEFAULT_STATED_SIGMA_DEG`] where both
    /// angles are stated, else [`DEFAULT_UNSTATED_SIGMA_DEG`].
    ///
    /// # Example
    /// ```
    /// use overfly_core::camera::Attitude;
    /// assert!((Attitude::new(Some(0.1), Some(0.0), None).sigma_rad.to_degrees() - 2.0).abs() < 1e-12);
    /// assert!((Attitude::new(Some(0.1), None, None).sigma_rad.to_degrees() - 5.0).abs() < 1e-12);
    /// ```
    pub fn new(pitch_rad: Option<f64>, roll_rad: Option<f64>, sigma_rad: Option<f64>) -> Self {
        let is_stated = pitch_rad.is_some() && roll_rad.is_some();
        let usual_deg = if is_stated { DEFAULT_STATED_SIGMA_DEG } else { DEFAULT_UNSTATED_SIGMA_DEG };
        Self { pitch_rad, roll_rad, sigma_rad: sigma_rad.unwrap_or(usual_deg.to_radians()) }
    }

    /// Makes an attitude that is known exactly, radians.
    pub fn exact(pitch_rad: f64, roll_rad: f64) -> Self {
        Self { pitch_rad: Some(pitch_rad), roll_rad: Some(roll_rad), sigma_rad: 0.0 }
    }

    /// Whether both pitch and roll are stated.
    pub fn is_stated(&self) -> bool {
        self.pitch_rad.is_some() && self.roll_rad.is_some()
    }

    /// Pitch and roll, radians, that a search assumes: an angle that is not stated is taken as 0.
    pub fn assumed_rad(&self) -> [f64; 2] {
        [self.pitch_rad, self.roll_rad].map(|angle| angle.unwrap_or(0.0))
    }
}
