//! Trials against truth: absolute registration on flights, relative registration on pairs and flights, and thousands of simulated flights
//! to check the predictions.
//!
//! Reads flight folders and pairs files, makes the same library calls as the commands, and counts. The truth enters the score
//! and the displaced prior, nothing else.

pub mod bands;
mod calibration;
mod camera_file;
mod cost;
mod csv_file;
mod damage;
mod disturb;
mod drift_curve;
mod error;
mod experiment;
mod fix_score;
mod fix_table;
mod fixes;
mod fly;
mod input_table;
mod integrity_score;
mod legs;
mod mapped_ground;
mod mirrored_pairs;
mod motion_table;
mod motions;
mod negatives;
mod pairs;
mod photo_cuts;
mod quantiles;
mod rate_bound;
mod recorded_flight;
mod relative_cost;
mod relative_laws;
mod relative_sample;
mod rival_pairs;
pub mod simulation;

pub use calibration::{Calibrated, calibration_toml};
pub use camera_file::read_camera;
pub use cost::{Cost, CostStep, CostTrial, write_cost};
pub use damage::{
    DamageOutcome, DamageResult, DamageScore, DamageScoreRow, DamageTrial, FileChange, FrameFormat, write_damage,
};
pub use disturb::{
    DisturbanceKind, DisturbanceScore, DisturbedErrors, DisturbedFrame, DisturbedKindScore, DisturbedOutcome,
    DisturbedTrial, SourceFrame, write_disturbed,
};
pub use drift_curve::{DRIFT_BOUND_PX, DriftBin, DriftCurve, Estimator, MatchesNeeded};
pub use error::TrialError;
pub use experiment::{Experiment, OverlapRow, PaperFigures, Shape, images_csv};
pub use fix_score::{FixScore, Nees, Refusals};
pub use fix_table::write_fixes;
pub use fixes::{FixOutcome, FixTrial, TruthPoint};
pub use fly::{
    Disturbances, FaultScore, FlightScale, FlyOutcome, FlyScore, FlyTrial, RunScore, ScaleSource, SequenceFault,
    SequenceTrial, SourceScore, SourceScores, write_positions,
};
pub use integrity_score::{IntegrityScore, ProtectedError};
pub use legs::{Leg, LegComparison, LegScore, LegSensorSigmas, run_legs};
pub use mirrored_pairs::{MirroredPairScore, MirroredPairTrial};
pub use motion_table::write_motions;
pub use motions::{MotionOutcome, MotionScore, OverlapScore, RIGHT_PX, run_motions};
pub use negatives::{
    CalibrationStep, DrawnPattern, KindScore, NegativeKind, NegativeOutcome, NegativeScore, NegativeSearch,
    NegativeTrial, PatternKind, PatternScore, ProbabilityBin, RegionScore, TruePlace, write_negatives,
};
pub use pairs::{ImagePair, ImagePairs};
pub use photo_cuts::ImagePlacement;
pub use quantiles::Quantiles;
pub use recorded_flight::{RecordedFlight, RecordedFrame};
pub use relative_cost::{CutImage, OVERLAPS_PERCENT, RelativeMeasurement, RelativeTrial};
pub use relative_laws::{DescriptorRow, RelativeLaws};
pub use relative_sample::{Drifts, RelativeSample, StepTimes, samples_csv};
pub use rival_pairs::{RivalPairKind, RivalPairScore, RivalPairTrial};
