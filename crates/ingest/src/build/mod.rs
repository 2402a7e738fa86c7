//! Building and merging stores: from orthophotos to tiles, in parallel, resumable.
//!
//! A layer is a function of its set of sources. A build compares what every tile was made from with what it is to be made
//! from, computes the tiles that differ, and drops those that are obsolete. So a build that was killed resumes, and the
//! order of sources and the number of threads change nothing.

mod build_estimate;
mod build_plan;
mod composite;
mod declare;
mod error;
mod gather;
mod layer_description;
mod merge;
mod outline;
mod overview;
mod pipeline;
mod recipe;
mod request;
mod run;
mod sample;
mod source_pool;
mod summary;
mod terrain;

pub use build_estimate::{BuildEstimate, dry_run};
pub use declare::OverriddenCrs;
pub use error::{BuildError, MAX_TILES, Rejected};
pub use layer_description::DescribeRequest;
pub use merge::{Conflict, MergeError, MergeRequest, Merged, MergedLayer, merge};
pub use pipeline::Progress;
pub use recipe::KEYPOINTS_PER_TILE;
pub use request::Request;
pub use run::run;
pub use summary::BuildSummary;
pub use terrain::{TERRAIN_LAYER, TerrainRequest};
