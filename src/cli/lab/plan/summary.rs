//! `PlanSummary`: a plan as JSON.

use overfly_core::coupling::Calibration;
use overfly_ingest::plan::{Forecast, RouteForecast, Sensitivity};
use serde::Serialize;

/// What `plan` prints as JSON. Infinite numbers are null.
#[derive(Serialize)]
pub struct PlanSummary<'a> {
    /// The plan in one sentence.
    pub verdict: &'a str,
    /// What the models predict.
    #[serde(flatten)]
    pub forecast: &'a Forecast,
    /// The constants of the models.
    pub calibration: &'a Calibration,
    /// The predictions with one parameter changed at a time.
    pub sensitivity: &'a [Sensitivity],
    /// Where along the route fixes can be expected.
    pub route: Option<&'a RouteForecast>,
}
