//! `CandidateQuery`: a query for candidate tiles.

use overfly_core::geodesy::Geodetic;
use overfly_core::region::{ImageOnGround, Uncertainty};

/// The largest number of tiles that one query may consider: bounds its time (about a second) and the size of its answer.
pub const MAX_TILES: u64 = 250_000;

/// A query for candidate tiles.
#[derive(Debug, Clone, PartialEq)]
pub struct CandidateQuery {
    /// Most likely position of the image's centre; in the combined mode where the last fix was.
    pub centre: Geodetic,
    /// The ground that the image covers.
    pub image: ImageOnGround,
    /// The uncertainty of the centre.
    pub uncertainty: Uncertainty,
    /// Name of the layer; `None`: the only one, or `ortho` among several.
    pub layer: Option<String>,
    /// Number of the best tiles to return; `None`: all.
    pub max_tiles: Option<usize>,
    /// Chooses the level whose pixels are no larger than this at the centre; the base level otherwise.
    pub gsd_m_per_px: Option<f64>,
}
