//! `refine_peaks`: the third stage of a registration. From coarse peaks through ever finer levels by local windows to similarities.

use super::camera_pose::CameraPose;
use super::coarse_peaks::{CoarsePeak, CoarsePeaks};
use super::error::LocateError;
use super::hard_refine::hard_refine;
use super::map::Map;
use super::parts::Part;
use super::prepare::PreparedFrame;
use super::refined_place::{REFINED_PEAKS, RefinedPlace, Vote};
use super::search_context::SearchContext;
use super::soft_refine::SoftRefinement;
use overfly_store::StoreError;

/// The peaks refined so far: a search in steps meets its peaks again.
#[derive(Default)]
pub struct RefinedPeaks(Vec<(CameraPose, Option<RefinedPlace>)>);

/// Where the windows of one place agree by chance less often than this, peaks that are no rivals are skipped.
const SURE_LOG10_FALSE_ALARMS: f64 = -6.0;
/// Where the windows of the hard vote agree by chance less often than this, they measure the place.
const MEASURED_LOG10_FALSE_ALARMS: f64 = -1.0;
/// A peak of at least this share of the highest is a rival, whatever the windows say.
const RIVAL_SHARE: f64 = 0.6;

/// Where the windows of a place of an earlier step agree by chance no more often than this, it stays a place.
const KEPT_LOG10_FALSE_ALARMS: f64 = 0.0;

/// Refines the best coarse peaks to distinct places. `known` holds those that were refined before; of these, places with evidence stay,
/// though under headings and scales searched since there are higher peaks.
///
/// # Errors
/// [`LocateError::Store`] where a tile cannot be read; [`LocateError::Cancelled`].
pub fn refine_peaks(
    context: &SearchContext<'_>,
    map: &Map<'_>,
    prepared: &PreparedFrame<'_>,
    coarse: &CoarsePeaks,
    known: &mut RefinedPeaks,
) -> Result<Vec<RefinedPlace>, LocateError> {
    let mut found: Vec<RefinedPlace> = Vec::new();
    let highest = coarse.peaks.first().map_or(0.0, |p| p.statistic);
    for peak in coarse.peaks.iter().take(REFINED_PEAKS) {
        context.cancellation.check()?;
        let is_sure = found.iter().any(|r| r.log10_window_false_alarms < SURE_LOG10_FALSE_ALARMS);
        if is_sure && peak.statistic < RIVAL_SHARE * highest {
            break;
        }
        let refined = match known.0.iter().find(|(pose, _)| *pose == peak.pose) {
            Some((_, refined)) => refined.clone(),
            None => {
                let refined = refine_by_both_votes(context, map, prepared, *peak)?;
                known.0.push((peak.pose, refined.clone()));
                refined
            }
        };
        found.extend(refined.filter(|r| !found.iter().any(|other| other.is_same_place(r))));
    }
    for before in known.0.iter().filter_map(|(_, refined)| refined.as_ref()) {
        let has_evidence = before.log10_window_false_alarms < KEPT_LOG10_FALSE_ALARMS;
        if has_evidence && !found.iter().any(|other| other.is_same_place(before)) {
            found.push(before.clone());
        }
    }
    // Each place counts as one of as many as are refined in one step.
    let log10_steps = (known.0.len() as f64 / REFINED_PEAKS as f64).max(1.0).log10();
    found.iter_mut().for_each(|place| place.log10_window_false_alarms += log10_steps);
    Ok(found)
}

/// The vote with the fewest false alarms; the soft one is held only where the hard one leaves a doubt.
fn refine_by_both_votes(
    context: &SearchContext<'_>,
    map: &Map<'_>,
    prepared: &PreparedFrame<'_>,
    peak: CoarsePeak,
) -> Result<Option<RefinedPlace>, StoreError> {
    let hard = hard_refine(map, prepared, peak)?;
    let is_sure = hard.as_ref().is_some_and(|place| place.log10_window_false_alarms < SURE_LOG10_FALSE_ALARMS);
    if is_sure || !context.parts.has(Part::SoftVote) {
        return Ok(hard);
    }
    let soft = SoftRefinement { view: &context.request.view, parts: context.parts, map, prepared, peak }.run()?;
    Ok(match (hard, soft) {
        (Some(hard), Some(soft)) => Some(better_of(hard, soft)),
        (hard, soft) => hard.or(soft),
    })
}

/// The place with the fewer false alarms. Where both votes found one place and the hard one has evidence of its own, the place is that of
/// the hard one, which its windows measure at the finest level, with the evidence of the soft one.
fn better_of(hard: RefinedPlace, soft: RefinedPlace) -> RefinedPlace {
    if hard.log10_window_false_alarms <= soft.log10_window_false_alarms {
        return hard;
    }
    if hard.log10_window_false_alarms <= MEASURED_LOG10_FALSE_ALARMS && hard.is_same_place(&soft) {
        let log10_window_false_alarms = soft.log10_window_false_alarms;
        return RefinedPlace { log10_window_false_alarms, vote: Vote::Soft, ..hard };
    }
    soft
}
