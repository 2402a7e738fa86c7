//! `WeighedPlace`: the best place of a registration and the evidence for it, accepted or not.

use super::verify::VerifiedPlace;
use overfly_core::geodesy::Geodetic;

/// The best place of a registration and the evidence for it, accepted or not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeighedPlace {
    /// Where the camera would be, before its attitude is fitted.
    pub nadir: Geodetic,
    /// The probability that the place is wrong, as a fix there states it.
    pub false_fix_probability: f64,
    /// Rivals that it was compared with, up to the first that makes it ambiguous; `None` where something else spoke against it.
    pub rivals: Option<usize>,
    /// By how many standard errors it beats the strongest of them; `None` without a rival.
    pub least_t_score: Option<f64>,
    /// Blocks of that comparison.
    pub blocks: Option<usize>,
}

impl WeighedPlace {
    /// The evidence of a verified place; `None` beyond the tile matrix.
    pub(super) fn new(place: &VerifiedPlace) -> Option<Self> {
        let pose = place.refined.pose;
        let strongest = place.rivals.and_then(|report| report.strongest).map(|rival| rival.difference);
        Some(Self {
            nadir: pose.nadir.to_geodetic(pose.zoom).ok()?,
            false_fix_probability: place.false_fix_probability(),
            rivals: place.rivals.map(|report| report.count),
            least_t_score: strongest.map(|difference| difference.t_score()),
            blocks: strongest.map(|difference| difference.blocks),
        })
    }
}
