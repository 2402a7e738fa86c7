//! Scoring against truth: absolute registration on flights, relative registration on pairs and flights; and flights simulated by
//! the thousand, to score what is predicted.
//!
//! Reads flight folders and pairs files, runs the same library calls that the commands run, and counts. Truth goes
//! into the score and into the displaced prior, nowhere else.

mod calibration;
mod camera_file;
mod cost;
mod drift_curve;
mod ellipse;
mod error;
mod experiment;
mod fix_score;
mod fix_table;
mod fixes;
mod flight;
mod fly;
mod legs;
mod motions;
mod negatives;
mod pairs;
mod relative_cost;
mod relative_laws;
mod relative_sample;
pub mod simulation;
mod spread;
mod strangers;
mod table;
mod views;

pub use calibration::{Calibrated, calibration_toml};
pub use camera_file::read_camera;
pub use cost::{Cost, CostStep, CostTrial, write_cost};
pub use drift_curve::{DRIFT_BOUND_PX, DriftBin, DriftCurve, Estimator, MatchesNeeded};
pub use error::TrialError;
pub use experiment::{Experiment, OverlapRow, PaperFigures, Shape, images_csv};
pub use fix_score::{FixScore, Nees};
pub use fix_table::write_fixes;
pub use fixes::{FixOutcome, FixTrial};
pub use flight::{Flight, Frame};
pub use fly::{Disturbances, FlightScale, FlyOutcome, FlyScore, FlyTrial, RunScore, ScaleSource, write_positions};
pub use legs::{Comparison, Leg, LegScore, SensorSigmas, run_legs};
pub use motions::{MotionOutcome, MotionScore, OverlapScore, RIGHT_PX, run_motions, write_motions};
pub use negatives::{
    CalibrationStep, Kind, KindScore, NegativeOutcome, NegativeScore, NegativeSearch, NegativeTrial, RegionScore,
    write_negatives,
};
pub use pairs::{Pair, Pairs};
pub use relative_cost::{CutImage, OVERLAPS_PERCENT, RelativeMeasurement, RelativeTrial};
pub use relative_laws::{DescriptorRow, RelativeLaws};
pub use relative_sample::{Drifts, RelativeSample, StepTimes, samples_csv};
pub use spread::Spread;
pub use strangers::{StrangerScore, StrangerTrial};
pub use views::Place;
