//! Candidate tiles: which tiles to search for a position and its uncertainty, best first.
//!
//! The store's R-tree filters, the region's exact check decides, and the probability that the image's centre lies in a tile ranks. No
//! tile that meets the region is missing.

mod candidate_tiles;
mod error;
mod geometry;
mod index;
mod parameters;
mod query;
mod ranking;
mod residents;
mod search;
mod search_cost;
mod searched;
#[cfg(test)]
mod tests;

pub use candidate_tiles::{Candidate, Candidates};
pub use error::CandidatesError;
pub use geometry::Geometry;
pub use index::ResidentIndex;
pub use parameters::CandidateParameters;
pub use query::{CandidateQuery, MAX_TILES};
pub use ranking::rank;
pub use residents::Residents;
pub use search::{candidates, default_layer, named_layer};
pub use search_cost::SearchCost;
pub use searched::searched_candidates;
