//! Navigation of a flight: visual odometry, sensors and absolute registration coupled by an extended Kalman filter.
//!
//! [`Navigator`] takes image after image and returns a position for each. Its state is a [`NavigationFilter`]: relative
//! registrations predict, sensors and fixes update. A fix is a delayed measurement: it arrives when its execution time is over,
//! updates the filter at its own image, and the predictions since are applied again. Dead reckoning by the last velocity
//! bridges images that show nothing. Time is taken from the images and from a model of [`ExecutionTimes`], so a replay is the
//! same on every machine.

mod error;
mod execution_times;
mod filter;
mod flight_image;
mod flight_limits;
mod hypotheses;
mod image_clock;
mod image_history;
mod keyframes;
mod measurements;
mod navigator;
mod options;
mod pending_registration;
mod position;
mod search_widening;
mod stuck_sensors;
mod time_update;
mod track;
mod velocity;

pub use error::{FilterError, NavigateError};
pub use execution_times::ExecutionTimes;
pub use filter::{Gate, NavigationFilter, Residual};
pub use flight_image::FlightImage;
pub use flight_limits::Manoeuvre;
pub use measurements::{FixMeasurement, OdometryStep, SensorReading, SensorSigmas};
pub use navigator::Navigator;
pub use options::NavigateOptions;
pub use position::{Position, PositionSource};
pub use time_update::TimeUpdate;
