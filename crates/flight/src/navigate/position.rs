//! `Position`: what is put out for an image.

use crate::locate::Fix;
use overfly_core::geodesy::Geodetic;
use serde::Serialize;

/// Where a position comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// An absolute registration of this very image.
    Absolute,
    /// One of an earlier image, or the start, carried forward.
    Propagated,
}

impl Source {
    /// As files spell it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Absolute => "absolute",
            Self::Propagated => "propagated",
        }
    }
}

/// Where the aircraft was when an image was taken.
#[derive(Debug, Clone)]
pub struct Position {
    /// When the image was taken, seconds.
    pub time_s: f64,
    /// Where the position comes from.
    pub source: Source,
    /// Straight below the camera.
    pub position: Geodetic,
    /// Radians clockwise from true north.
    pub heading_rad: f64,
    /// One standard deviation of it.
    pub heading_sigma_rad: f64,
    /// [[ee, en], [en, nn]], m^2.
    pub covariance_m2: [[f64; 2]; 2],
    /// True height over what the altimeter says, as far as fixes have told; the nominal focal length's error is in it.
    pub height_scale: f64,
    /// One standard deviation of it, as a ratio.
    pub height_scale_sigma_ratio: f64,
    /// Time since the image of the last fix; `None` before the first.
    pub fix_age_s: Option<f64>,
    /// Tiles that the absolute registration begun at this image searches; 0 where none was begun.
    pub tiles_searched: usize,
    /// 𝒩 of it.
    pub nominal_count: f64,
    /// Relative registrations tried at this image.
    pub relative_count: usize,
    /// Absolute registrations begun at this image.
    pub absolute_count: usize,
    /// What the absolute registration begun at this image will say, whether it is taken in or not.
    pub fix: Option<Fix>,
}
