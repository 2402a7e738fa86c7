//! `TrackedPlace`: a place that one frame alone cannot decide on, with its evidence, for those who know where the frame before lay.

use super::answer::Fix;
use super::answering::{SearchSize, fix};
use super::search_context::SearchContext;
use super::verify::{Verdict, VerifiedPlace};
use overfly_core::camera::Camera;
use overfly_core::tile::gsd_at;
use overfly_store::StoreError;

/// A place where a frame may lie.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackedPlace {
    /// The fix that it would be.
    pub fix: Fix,
    /// log10 of the number of such places expected by chance in the search, all layers included.
    pub log10_false_alarms: f64,
    /// Distance of the place that fits almost as well, metres, where that is what the frame cannot decide.
    pub rival_m: Option<f64>,
}

impl TrackedPlace {
    /// The places of a verdict without a fix that nothing speaks against but a lack of evidence, or a rival; best first.
    ///
    /// # Errors
    /// Where the store cannot be read.
    pub(super) fn all(
        context: &SearchContext<'_>,
        camera: &Camera,
        size: SearchSize,
        verdict: &Verdict,
    ) -> Result<Vec<Self>, StoreError> {
        let mut places = Vec::new();
        if verdict.refusal.is_none() {
            return Ok(places);
        }
        for place in verdict.places.iter().filter(|place| place.may_be_tracked) {
            let Some(fix) = fix(context, camera, size, place)? else { continue };
            let rival_m = rival_m(place);
            places.push(Self { fix, log10_false_alarms: place.log10_false_alarms, rival_m });
        }
        Ok(places)
    }
}

/// Distance of the rival that makes a place ambiguous, metres.
fn rival_m(place: &VerifiedPlace) -> Option<f64> {
    let pose = place.refined.pose;
    let rival = place.rivals?.ambiguity()?.pose;
    let gsd = gsd_at(pose.nadir.to_geodetic(pose.zoom).ok()?, pose.zoom).mean_m_per_px();
    Some((rival.nadir.x_px - pose.nadir.x_px).hypot(rival.nadir.y_px - pose.nadir.y_px) * gsd)
}
