//! `Judge`: whether the best of the places found is where the frame lies, and if not, why.

use super::answer::Reason;
use super::coarse_search::CoarseResult;
use super::map::Map;
use super::pose::Frame;
use super::refine::{Refined, peak_z_score_of, refine};
use super::request::{FixRequest, LocateError};
use overfly_core::registration::a_contrario;
use std::f64::consts::{PI, TAU};

/// Coarse peaks that are looked at closely.
const LOOKED_AT: usize = 5;
/// A fix is expected to be accidental less often than once in 10^6 searches of its size, by the count of its windows.
const MOST_LOG10_FALSE_ALARMS: f64 = -6.0;
/// A fix this sure among the likely headings and scales needs no look at the rest.
const SURE_LOG10_FALSE_ALARMS: f64 = -15.0;
/// A second place with this much evidence makes the first ambiguous.
const AMBIGUOUS_LOG10_FALSE_ALARMS: f64 = -3.0;
/// Where the windows of one place agree by accident less often than this, peaks that are no rivals are passed over.
const SURE_LOG10_ACCIDENTS: f64 = -6.0;
/// A peak of this share of the highest is a rival whatever the windows say.
const RIVAL_SHARE: f64 = 0.6;
/// Of the places looked at closely, those whose whole view is weighed.
const WEIGHED: usize = 2;
/// Fewer agreeing windows than this are no fix, whatever else speaks for it.
const LEAST_INLIERS: usize = 4;

/// What the search so far comes to.
pub struct Verdict {
    /// The place, or why none is accepted.
    pub outcome: Result<Candidate, (Reason, String)>,
    /// Of the best place, standard deviations.
    pub score: Option<f64>,
    /// Of the best place; see [`Candidate::log10_false_alarms`].
    pub log10_false_alarms: Option<f64>,
}

/// A place looked at closely, with all its evidence.
pub struct Candidate {
    /// Where, and its windows.
    pub refined: Refined,
    /// How high the whole view stands there, standard deviations.
    pub peak_z_score: f64,
    /// log10 of the number of accidents to expect in a search of this size: of the whole view's z-score and of the
    /// agreement of the windows, which at a wrong place have little to do with each other.
    pub log10_false_alarms: f64,
}

impl Verdict {
    fn refused(reason: Reason, detail: impl Into<String>, score: Option<f64>) -> Self {
        Self { outcome: Err((reason, detail.into())), score, log10_false_alarms: None }
    }

    /// Whether nothing that is still to be searched could change it.
    pub fn is_sure(&self) -> bool {
        self.outcome.as_ref().is_ok_and(|c| c.log10_false_alarms <= SURE_LOG10_FALSE_ALARMS)
    }
}

/// Looks at places and decides.
pub struct Judge<'a> {
    /// Where the places lie.
    pub map: &'a Map<'a>,
    /// Prepared for every level down to `finest`.
    pub frame: &'a Frame<'a>,
    /// What was asked.
    pub request: &'a FixRequest,
    /// The level that positions are measured on.
    pub finest: u8,
    /// Whether the caller still waits.
    pub wanted: &'a dyn Fn() -> bool,
}

impl Judge<'_> {
    /// What the best places found so far are worth.
    ///
    /// # Errors
    /// Where the store cannot give a tile; [`LocateError::GivenUp`].
    pub fn weigh(&self, coarse: &CoarseResult) -> Result<Verdict, LocateError> {
        let Some(first) = coarse.peaks.first() else {
            let detail = "nothing in the frame or the region can be compared";
            return Ok(Verdict::refused(Reason::TooLittleStructure, detail, None));
        };
        let (looked, hopeless) = self.look_closely(coarse)?;
        let mut looked = looked.into_iter();
        let Some(best) = looked.next() else {
            let score = coarse.score(first.statistic);
            let detail = "no windows agree on a similarity";
            let refused = Verdict::refused(Reason::TooFewAgreeingWindows, detail, Some(score));
            return Ok(Verdict { log10_false_alarms: hopeless, ..refused });
        };
        let (score, log10_false_alarms) = (Some(best.peak_z_score), Some(best.log10_false_alarms));
        let objection = self.objection(&best, looked.next().as_ref());
        Ok(Verdict { outcome: objection.map_or(Ok(best), Err), score, log10_false_alarms })
    }

    /// The most likely places with all their evidence, best first; and the log10 of accidents to expect, of windows alone,
    /// at the best of the others.
    fn look_closely(&self, coarse: &CoarseResult) -> Result<(Vec<Candidate>, Option<f64>), LocateError> {
        let mut found: Vec<Refined> = Vec::new();
        let highest = coarse.peaks.first().map_or(0.0, |p| p.statistic);
        for peak in coarse.peaks.iter().take(LOOKED_AT) {
            if !(self.wanted)() {
                return Err(LocateError::GivenUp);
            }
            let sure = found.iter().any(|r| r.log10_accidents < SURE_LOG10_ACCIDENTS);
            if sure && peak.statistic < RIVAL_SHARE * highest {
                break;
            }
            let refined = refine(self.map, self.frame, peak.pose, self.finest, LOOKED_AT as f64)?;
            found.extend(refined.filter(|r| !found.iter().any(|other| same_place(other, r))));
        }
        let accidents = |r: &Refined| r.log10_accidents;
        let hopeless = found.iter().filter(|r| r.is_hopeless()).map(accidents).reduce(f64::min);
        found.retain(|r| !r.is_hopeless());
        found.sort_by(|a, b| a.log10_accidents.total_cmp(&b.log10_accidents));
        let mut candidates = Vec::new();
        for refined in found.into_iter().take(WEIGHED) {
            let peak_z_score = peak_z_score_of(self.map, self.frame, &refined)?;
            let by_chance = a_contrario::log10_peak_nfa(peak_z_score, refined.windows, coarse.places);
            let log10_false_alarms = by_chance + refined.log10_accidents;
            candidates.push(Candidate { refined, peak_z_score, log10_false_alarms });
        }
        candidates.sort_by(|a, b| a.log10_false_alarms.total_cmp(&b.log10_false_alarms));
        Ok((candidates, hopeless))
    }

    /// Why the best place is not a fix.
    fn objection(&self, best: &Candidate, second: Option<&Candidate>) -> Option<(Reason, String)> {
        let too_few = best.refined.fit.inliers.len() < LEAST_INLIERS;
        if too_few || best.log10_false_alarms > MOST_LOG10_FALSE_ALARMS {
            let detail = format!(
                "{} of {} windows agree, the view stands {:.1} standard deviations high; expected accidents 10^{:.1}, at most 10^{MOST_LOG10_FALSE_ALARMS} and {LEAST_INLIERS} windows are accepted",
                best.refined.fit.inliers.len(),
                best.refined.windows,
                best.peak_z_score,
                best.log10_false_alarms
            );
            return Some((Reason::TooFewAgreeingWindows, detail));
        }
        if let Some(second) = second.filter(|s| s.log10_false_alarms < AMBIGUOUS_LOG10_FALSE_ALARMS) {
            let detail = format!(
                "a second place agrees as well: expected accidents 10^{:.1} and 10^{:.1}",
                best.log10_false_alarms, second.log10_false_alarms
            );
            return Some((Reason::Ambiguous, detail));
        }
        self.inconsistency(&best.refined)
    }

    fn inconsistency(&self, best: &Refined) -> Option<(Reason, String)> {
        let off = best.pose.height_ratio.ln().abs();
        let bound = 4.0 * self.request.scale_sigma_ratio + 0.02;
        if off > bound {
            let detail = format!("scale {:.3} of the stated one, at most {:.3} off", best.pose.height_ratio, bound);
            return Some((Reason::InconsistentScale, detail));
        }
        let prior = self.request.heading?;
        let turn = (best.pose.heading_rad - prior.heading_rad + PI).rem_euclid(TAU) - PI;
        let bound = 4.0 * prior.sigma_rad + 2f64.to_radians();
        (turn.abs() > bound).then(|| {
            let detail = format!("heading {:.1} degrees from the stated one", turn.to_degrees());
            (Reason::InconsistentHeading, detail)
        })
    }
}

fn same_place(a: &Refined, b: &Refined) -> bool {
    const SAME_PX: f64 = 6.0;
    let (dx, dy) = (a.pose.nadir.x_px - b.pose.nadir.x_px, a.pose.nadir.y_px - b.pose.nadir.y_px);
    dx.hypot(dy) < SAME_PX
}
