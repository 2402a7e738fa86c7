//! `Height`: how high a camera flies, and above what.

use crate::geodesy::VerticalDatum;

/// How high a camera flies, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Height {
    /// Above the ground straight below.
    AboveGround(f64),
    /// Above the zero of a vertical datum: above sea or above the ellipsoid. A camera follows from it where the ground's height is
    /// known.
    AboveDatum(VerticalDatum, f64),
}

impl Height {
    /// The height above ground; `None` where the ground's height is needed for it.
    pub fn above_ground_m(self) -> Option<f64> {
        match self {
            Self::AboveGround(height_m) => Some(height_m),
            Self::AboveDatum(..) => None,
        }
    }
}
