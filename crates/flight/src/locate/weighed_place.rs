//! `WeighedPlace`: a verified place of a registration and the evidence for it, accepted or not.

use super::search_context::SearchContext;
use super::verify::{Verdict, VerifiedPlace};
use overfly_core::geodesy::{Geodetic, LocalFrame};

/// A verified place of a registration and the evidence for it, accepted or not.
#[derive(Debug, Clone, PartialEq)]
pub struct WeighedPlace {
    /// The layer that it lies in.
    pub layer: String,
    /// Where the camera would be, before its attitude is fitted.
    pub nadir: Geodetic,
    /// log10 of the false alarms expected in that layer alone.
    pub log10_false_alarms: f64,
    /// The same, as few as may be: by this it makes a place in another layer ambiguous.
    pub log10_rival_false_alarms: f64,
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
    /// The verified places of a verdict that lie on the map, best first.
    pub(super) fn all(verdict: &Verdict, context: &SearchContext<'_>) -> Vec<Self> {
        verdict.places.iter().filter_map(|place| Self::new(place, context)).collect()
    }

    fn new(place: &VerifiedPlace, context: &SearchContext<'_>) -> Option<Self> {
        let pose = place.refined.pose;
        let strongest = place.rivals.and_then(|report| report.strongest).map(|rival| rival.difference);
        Some(Self {
            layer: context.layer.name.clone(),
            nadir: pose.nadir.to_geodetic(pose.zoom).ok()?,
            log10_false_alarms: place.log10_false_alarms - (context.layers as f64).log10(),
            log10_rival_false_alarms: place.log10_rival_false_alarms,
            false_fix_probability: place.false_fix_probability(),
            rivals: place.rivals.map(|report| report.count),
            least_t_score: strongest.map(|difference| difference.t_score()),
            blocks: strongest.map(|difference| difference.blocks),
        })
    }

    /// Distance from another place, metres.
    pub(super) fn distance_m(&self, other: &Self) -> f64 {
        LocalFrame::at(self.nadir).enu_from_geodetic(other.nadir).length_m()
    }
}
