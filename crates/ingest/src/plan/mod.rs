//! Planning a flight: the forecasts of the coupling models for one aircraft, the mode to use, and where along a route fixes are
//! expected. This module reads files of aircraft, calibration and route, and a store; it draws nothing.

mod aircraft;
mod error;
mod forecast;
mod matchability;
mod route;
mod route_files;
mod sensitivity;
mod text_file;
mod verdict;

pub use aircraft::{Aircraft, read_aircraft, read_calibration};
pub use error::PlanError;
pub use forecast::{Advice, CombinedForecast, Forecast, ParallelForecast, SequentialForecast};
pub use matchability::{Gap, RouteForecast, RouteStep, Thresholds};
pub use route::{parse_route, parse_routes, read_route, read_routes};
pub use route_files::{route_csv, route_geojson};
pub use sensitivity::{FACTORS, Sensitivity, sensitivity};
