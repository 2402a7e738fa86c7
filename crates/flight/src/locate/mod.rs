//! From a prior to a fix: region, candidate tiles, registration, `Fix` or `NoFix`.

mod answer;
mod area;
pub mod candidates;
mod coarse_search;
pub mod coverage;
mod fix;
mod hypotheses;
mod levels;
mod map;
mod pose;
mod refine;
mod request;
mod steps;
mod verdict;
mod wide;

pub use answer::{Answer, Fix, NoFix, Point, Reason};
pub use fix::{locate, locate_while};
pub use request::{FixRequest, HeadingPrior, LocateError, PositionPrior};
