//! The search region as geometry on the ground, and the probability that the image's centre lies in a tile.
//!
//! The region is the rectangle of the sequential and the parallel mode (equations 3, 17), the reachable ground of the
//! combined mode (in place of equation 27), or the ellipse of a covariance. Lengths are true metres in the plane tangent at
//! the region's centre; tiles are rectangles of the Web Mercator plane. The edge is projected point by point, so headings
//! hold at every latitude. No I/O.

mod bearings;
mod error;
mod ground;
mod normal;
mod outline;
mod polygon;
mod reachable;
mod simplify;
mod turns;
mod uncertainty;

pub use error::{MAX_REACH_M, RegionError};
pub use ground::{Region, SIGMAS};
pub use uncertainty::{ImageOnGround, Uncertainty};
