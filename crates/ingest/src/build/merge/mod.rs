//! Merging several built stores into one. Layers of different names stay apart; in a layer that several stores have, newer
//! tiles cover older ones, as within a build.

mod blend;
mod error;
mod merged;
mod request;
mod run;
mod shard;
mod union;

pub use error::MergeError;
pub use merged::{Merged, MergedLayer};
pub use request::{Conflict, MergeRequest};
pub use run::merge;
