//! The models of the coupling modes and of execution time: numbers in, numbers out, no clock.
//!
//! [`Sequential`], [`Parallel`] and [`Combined`] are models of [`CouplingParameters`]. Each computes the speed up to which
//! its mode works, the execution time at which searches settle, and their cost. `docs/equations.md` names the function and
//! the test of every equation.

mod calibration;
mod combined;
mod drift;
mod error;
mod execution;
mod fit;
mod imaging;
mod mission;
mod mode;
mod nominal;
mod parallel;
mod parameters;
mod sequence;
mod sequential;
mod tiles;
mod turning;

pub use calibration::{CalibratedImages, Calibration, PixelDriftLaw, SearchCost};
pub use combined::Combined;
pub use drift::{DriftGrowth, DriftLaw, PAPER_DRIFT_M, PAPER_DRIFT_MATCHES};
pub use error::CouplingError;
pub use execution::{
    PAPER_GSD_M_PER_PX, PAPER_IMAGE_PX, PAPER_LOAD_S, PAPER_SECONDS_PER_DESCRIPTOR, PROBABLE_LOAD_S, RelativeCost,
    descriptor_count,
};
pub use fit::{fit_line, fit_power, fit_power_above, fit_slope, r_squared};
pub use imaging::{displacement_sigma_m, ground_extent_m, overlap_limit_s, scan_limit_s};
pub use mission::{
    absolute_count, chance_of_no_failure, expected_failures, mission_of_one_failure_s, mission_within_risk_s,
};
pub use mode::Mode;
pub use nominal::{PAPER_TURN_RAD, nominal_count_combined, nominal_count_sequential, region_edges_m};
pub use parallel::Parallel;
pub use parameters::CouplingParameters;
pub use sequence::{ExecutionSequence, FixedPoints};
pub use sequential::Sequential;
pub use tiles::{mean_tile_count, seconds_per_image};
pub use turning::{
    circle_wing_area_m2, end_curve_area_m2, end_curve_area_paper_m2, shown_area_m2, swept_area_m2, swept_area_paper_m2,
    turn_point, turned_rad, wing_area_m2,
};
