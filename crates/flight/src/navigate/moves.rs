//! `Move`: how the aircraft came from one image to the next.

use super::{Estimate, Sensed, SensorSigmas, Step};
use overfly_core::geodesy::{Enu, GeodesyError};

/// From one image to the next.
#[derive(Debug, Clone)]
pub enum Move {
    /// By relative registration.
    Registered {
        /// What it said.
        step: Step,
        /// What the sensors say at the next image.
        sensed: Sensed,
    },
    /// By the last velocity.
    Led {
        /// Whereto.
        by: Enu,
        /// One standard deviation per axis, metres.
        sigma_m: f64,
        /// What the sensors say at the next image.
        sensed: Sensed,
    },
}

impl Move {
    /// Moves an estimate on.
    ///
    /// # Errors
    /// Where a position leaves its local frame, which no flight does.
    pub fn apply(&self, at: &mut Estimate, sensors: &SensorSigmas) -> Result<(), GeodesyError> {
        match self {
            Self::Registered { step, sensed } => {
                at.advance(step)?;
                at.sense(*sensed, sensors)
            }
            Self::Led { by, sigma_m, sensed } => at.drift(*by, *sigma_m, *sensed, sensors),
        }
    }
}
