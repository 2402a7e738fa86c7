//! Before the flight: what the models of `coupling` say of one aircraft, which mode to use, and where along a route fixes
//! can be had. Reads files of aircraft, calibration and route, and a store; draws nothing.

mod aircraft;
mod error;
mod forecast;
mod matchability;
mod route;
mod sensitivity;
mod text_file;

pub use aircraft::{Aircraft, read_aircraft, read_calibration};
pub use error::PlanError;
pub use forecast::{Advice, CombinedForecast, Forecast, Mode, ParallelForecast, SequentialForecast};
pub use matchability::{Gap, RouteForecast, RouteStep, Thresholds, route_csv, route_geojson};
pub use route::{parse_route, parse_routes, read_route, read_routes};
pub use sensitivity::{FACTORS, Sensitivity, sensitivity};
