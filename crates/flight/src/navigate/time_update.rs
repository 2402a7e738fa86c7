//! `TimeUpdate`: the prediction of the navigation filter from one image to the next.

use super::error::FilterError;
use super::filter::NavigationFilter;
use super::flight_limits::Manoeuvre;
use super::measurements::{OdometryStep, SensorReading, SensorSigmas};
use overfly_core::geodesy::Enu;

/// What carries the filter from one image to the next. Recorded while a fix is computed, and applied again after the delayed
/// fix has updated the state at its own image.
#[derive(Debug, Clone)]
pub enum TimeUpdate {
    /// By visual odometry, then updated with the sensors' readings.
    Odometry {
        /// The displacement that relative registration measured.
        step: OdometryStep,
        /// The readings at the next image.
        reading: SensorReading,
    },
    /// By dead reckoning from the last velocity.
    DeadReckoning {
        /// The displacement.
        displacement: Enu,
        /// One standard deviation of the displacement per axis, metres.
        sigma_m: f64,
        /// The readings at the next image.
        reading: SensorReading,
        /// One standard deviation of the turn and climb, where there is no reading.
        unseen: Manoeuvre,
    },
}

impl TimeUpdate {
    /// Dead reckoning with another source of error, one standard deviation per axis, metres.
    pub fn widened(mut self, by_m: f64) -> Self {
        if let Self::DeadReckoning { sigma_m, .. } = &mut self {
            *sigma_m = sigma_m.hypot(by_m);
        }
        self
    }

    /// Carries a filter to the next image.
    ///
    /// # Errors
    /// As [`NavigationFilter::update_sensors`].
    pub fn apply(&self, filter: &mut NavigationFilter, sensors: &SensorSigmas) -> Result<(), FilterError> {
        match self {
            Self::Odometry { step, reading } => {
                filter.predict_odometry(step)?;
                filter.update_sensors(*reading, sensors).map(|_| ())
            }
            Self::DeadReckoning { displacement, sigma_m, reading, unseen } => {
                filter.predict_dead_reckoning(*displacement, *sigma_m, *reading, *unseen, sensors)
            }
        }
    }
}
