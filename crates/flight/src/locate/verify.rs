//! `Verifier`: the fourth stage of a registration. Decides whether the best of the refined places is where the frame lies.

use super::answer::Reason;
use super::coarse_peaks::CoarsePeaks;
use super::error::LocateError;
use super::map::Map;
use super::measured_place::{Doubts, MeasuredPlace};
use super::near_maxima::near_maxima;
use super::observation::Observation;
use super::parts::Part;
use super::place_estimate::TiltFound;
use super::prepare::PreparedFrame;
use super::refined_place::{RefinedPlace, Vote};
use super::refusal::Refusal;
use super::rivals::{LEAST_T_SCORE, MOST_ALIAS_PROBABILITY, RivalReport, RivalSearch};
use super::search_context::SearchContext;
use nalgebra::{Matrix2, Vector2};
use overfly_core::geodesy::{EnuCovariance, LocalFrame, wrap_turn_rad};
use overfly_core::registration::a_contrario;
use overfly_core::registration::peak_z_score::{REACH_PX, peak_z_score};
use overfly_core::registration::seam::{Displacements, Seam, find_seam};
use overfly_core::registration::smear::{is_smeared, smear};
use overfly_core::tile::gsd_at;
use overfly_store::StoreError;

/// A fix is accepted where less than one false alarm is expected in 10^6 searches of its size.
const MAX_LOG10_FALSE_ALARMS: f64 = -6.0;
/// A fix this sure among the likely headings and scales ends the search.
const SURE_LOG10_FALSE_ALARMS: f64 = -15.0;
/// A second place with this much evidence in its own layer makes the first ambiguous.
pub const AMBIGUOUS_LOG10_FALSE_ALARMS: f64 = -3.0;
/// No term decides alone: a place that only the soft vote found, or of whose windows fewer than half agree, must also stand out as a whole
/// view, by so many standard deviations. Four false places of featureless frames had 1.0 to 4.0, a frame of which half lay a block beside
/// the other 4.0, right ones at least 4.5.
const LEAST_WHOLE_VIEW_Z_SCORE: f64 = 4.25;
/// Number of refined places whose whole view is compared.
const VERIFIED_PLACES: usize = 2;
/// A fix needs at least this many agreeing windows.
const MIN_INLIERS: usize = 4;

/// The smallest false-fix probability that is stated. None of more than 20,000 negative trials was accepted, which proves no rate
/// below 3 in 20,000.
const MIN_FALSE_FIX_PROBABILITY: f64 = 1.5e-4;

/// The decision on the places found so far.
pub struct Verdict {
    /// `None` where the best of `places` is a fix, or why it is not.
    pub refusal: Option<Refusal>,
    /// The verified places, best first.
    pub places: Vec<VerifiedPlace>,
    /// The refined places that were not verified.
    pub unverified: Vec<RefinedPlace>,
    /// Score of the best place in standard deviations, where there is a place or a peak.
    pub score: Option<f64>,
    /// log10 of the false alarms expected at the best place: [`VerifiedPlace::log10_false_alarms`], or of its windows alone.
    pub log10_false_alarms: Option<f64>,
}

/// A refined place with all its evidence.
#[derive(Debug, Clone)]
pub struct VerifiedPlace {
    /// The place and its windows.
    pub refined: RefinedPlace,
    /// z-score of the whole view's correlation peak.
    pub peak_z_score: f64,
    /// Offsets of the places around that the view fits almost as well, pixels.
    pub near_rivals_px: Vec<[f64; 2]>,
    /// What a second refined place within the 95 % ellipse adds to the covariance, pixels of the place's level squared.
    pub near_second_px2: Matrix2<f64>,
    /// The comparison with its rivals, made where nothing else spoke against it.
    pub rivals: Option<RivalReport>,
    /// The seam across the view, looked for only at a fix.
    pub seam: Option<Seam>,
    /// Whether the view is smeared, looked for only at a fix.
    pub is_smeared: bool,
    /// Whether nothing speaks against the place but a lack of evidence or a rival; stated where it is no fix.
    pub may_be_tracked: bool,
    /// log10 of the number of false alarms expected in a search of this size: of the correlation peak, and of the agreement of the windows
    /// given that peak, times the number of layers that may be searched.
    pub log10_false_alarms: f64,
    /// The same in its own layer alone, as few as if both were independent: by this a second place makes the first ambiguous.
    pub log10_rival_false_alarms: f64,
}

impl VerifiedPlace {
    /// The probability that the place is wrong: by chance, or because the frame lies at a rival.
    pub fn false_fix_probability(&self) -> f64 {
        let by_chance = 10f64.powf(self.log10_false_alarms);
        let alias = self.rivals.map_or(0.0, |report| report.calibrated_probability());
        (by_chance + alias).clamp(MIN_FALSE_FIX_PROBABILITY, 1.0)
    }
}

impl Verdict {
    /// The best place, where it is a fix.
    pub fn fix(&self) -> Option<&VerifiedPlace> {
        self.places.first().filter(|_| self.refusal.is_none())
    }

    /// Whether the place is a fix so sure that nothing still to be searched could change it.
    pub fn is_sure(&self) -> bool {
        self.fix().is_some_and(|place| place.log10_rival_false_alarms <= SURE_LOG10_FALSE_ALARMS)
    }
}

/// Verifies refined places.
pub struct Verifier<'a> {
    /// The map of the layer.
    pub map: &'a Map<'a>,
    /// The frame.
    pub prepared: &'a PreparedFrame<'a>,
    /// The request, whose scale and heading a fix must not contradict.
    pub context: &'a SearchContext<'a>,
}

impl Verifier<'_> {
    /// Decides on the refined places among the peaks of the coarse search.
    ///
    /// # Errors
    /// Where a tile cannot be read.
    pub fn verify(&self, coarse: &CoarsePeaks, refined: Vec<RefinedPlace>) -> Result<Verdict, LocateError> {
        let (hopeless, mut hopeful): (Vec<_>, Vec<_>) = refined.into_iter().partition(RefinedPlace::is_hopeless);
        hopeful.sort_by(|a, b| a.log10_window_false_alarms.total_cmp(&b.log10_window_false_alarms));
        let mut unverified = hopeful.split_off(VERIFIED_PLACES.min(hopeful.len()));
        let mut verified = Vec::new();
        for refined in hopeful {
            verified.push(self.verified(coarse, refined)?);
        }
        // A place that does not stand out as a whole view can be a rival, and no fix.
        let stands_out = |place: &VerifiedPlace| !self.lacks_whole_view(place);
        verified.sort_by(|(a, _), (b, _)| {
            stands_out(b).cmp(&stands_out(a)).then_with(|| a.log10_false_alarms.total_cmp(&b.log10_false_alarms))
        });
        let (mut places, observations): (Vec<_>, Vec<_>) = verified.into_iter().unzip();
        let hopeless_windows = hopeless.iter().map(|r| r.log10_window_false_alarms).reduce(f64::min);
        let least_hopeless = hopeless_windows.map(|windows| windows + self.log10_layers());
        unverified.extend(hopeless);
        let (refusal, score, log10_false_alarms) = match (coarse.peaks.first(), places.first()) {
            (None, _) => {
                let detail = "nothing in the frame or the region can be compared";
                (Some(Refusal::new(Reason::TooLittleStructure, detail)), None, None)
            }
            (Some(peak), None) => {
                let refusal = Refusal::new(Reason::TooFewAgreeingWindows, "no windows agree on a similarity");
                (Some(refusal), Some(coarse.z_score(peak.statistic)), least_hopeless)
            }
            (Some(_), Some(best)) => {
                let (score, log10_false_alarms) = (best.peak_z_score, best.log10_false_alarms);
                let near_second_px2 =
                    places.get(1).map(|second| self.near_second_px2(best, second)).transpose()?.flatten();
                places[0].near_second_px2 = near_second_px2.unwrap_or_default();
                let second = places.get(1).filter(|_| near_second_px2.is_none());
                let refusal = match self.refusal(&places[0], second)? {
                    Some(refusal) => Some(refusal),
                    None => self.compared(&mut places[0], coarse)?,
                };
                (refusal, Some(score), Some(log10_false_alarms))
            }
        };
        if refusal.is_none()
            && let (Some(best), Some(Some(observation))) = (places.first_mut(), observations.first())
        {
            let displacements = Displacements::default();
            let smear = smear(&observation.view_structure, &observation.map_structure, [REACH_PX; 2]);
            best.is_smeared = is_smeared(smear);
            best.seam = find_seam(&observation.window_surfaces(&displacements), &displacements);
        }
        if refusal.is_some() {
            for place in &mut places {
                place.may_be_tracked = self.may_be_tracked(place)?;
            }
        }
        Ok(Verdict { refusal, places, unverified, score, log10_false_alarms })
    }

    /// A place with all its evidence, and its observation.
    fn verified(
        &self,
        coarse: &CoarsePeaks,
        refined: RefinedPlace,
    ) -> Result<(VerifiedPlace, Option<Observation>), StoreError> {
        let observation = Observation::new(self.map, &self.prepared.frame, &refined.pose, REACH_PX)?;
        let z_score = |o: &Observation| peak_z_score(&o.view_structure, &o.map_structure, [REACH_PX; 2]);
        let peak_z_score = observation.as_ref().and_then(z_score).unwrap_or(0.0);
        let near_rivals_px = observation.as_ref().map(near_maxima).unwrap_or_default();
        let hard_px = observation.as_ref().map_or(refined.window_size_px, |o| o.window_size_px);
        let peak = a_contrario::log10_peak_nfa(peak_z_score, refined.large_windows(hard_px), coarse.places);
        let windows = refined.log10_window_false_alarms;
        let windows_given_peak = match refined.vote {
            Vote::Hard => windows,
            Vote::Soft => a_contrario::log10_soft_vote_nfa_given_peak(windows, peak_z_score),
        };
        let place = VerifiedPlace {
            refined,
            peak_z_score,
            near_rivals_px,
            near_second_px2: Matrix2::zeros(),
            rivals: None,
            seam: None,
            is_smeared: false,
            may_be_tracked: false,
            log10_false_alarms: peak + windows_given_peak + self.log10_layers(),
            log10_rival_false_alarms: peak + windows,
        };
        Ok((place, observation))
    }

    /// What the search of several layers adds to the log10 of the false alarms: the union bound over their searches, whichever of
    /// them are made.
    fn log10_layers(&self) -> f64 {
        (self.context.layers as f64).log10()
    }

    /// Why the best place is not a fix; `None` where it is.
    ///
    /// # Errors
    /// Where a tile of the terrain cannot be read.
    fn refusal(&self, best: &VerifiedPlace, second: Option<&VerifiedPlace>) -> Result<Option<Refusal>, StoreError> {
        let too_few = best.refined.fit.inliers.len() < MIN_INLIERS;
        if too_few || best.log10_false_alarms > MAX_LOG10_FALSE_ALARMS {
            let detail = format!(
                "{} of {} windows agree, the correlation peak has a z-score of {:.1}; 10^{:.1} such places are expected by chance, a fix needs at most 10^{MAX_LOG10_FALSE_ALARMS} and at least {MIN_INLIERS} windows",
                best.refined.fit.inliers.len(),
                best.refined.matches.len(),
                best.peak_z_score,
                best.log10_false_alarms
            );
            return Ok(Some(Refusal::new(Reason::TooFewAgreeingWindows, detail)));
        }
        if self.lacks_whole_view(best) {
            let detail = format!(
                "the correlation peak of the whole view has a z-score of {:.1}; where windows agree only together, or fewer than half of them, it must have {LEAST_WHOLE_VIEW_Z_SCORE}",
                best.peak_z_score
            );
            return Ok(Some(Refusal::new(Reason::TooFewAgreeingWindows, detail)));
        }
        let is_rival = |s: &&VerifiedPlace| s.log10_rival_false_alarms < AMBIGUOUS_LOG10_FALSE_ALARMS;
        if let Some(second) = second.filter(is_rival) {
            let detail = format!(
                "a second place agrees as well: 10^{:.1} and 10^{:.1} such places are expected by chance",
                best.log10_false_alarms, second.log10_false_alarms
            );
            return Ok(Some(Refusal::new(Reason::Ambiguous, detail)));
        }
        self.inconsistency(&best.refined)
    }

    /// Whether nothing speaks against a place but a lack of evidence or a rival.
    fn may_be_tracked(&self, place: &VerifiedPlace) -> Result<bool, StoreError> {
        let has_windows = place.refined.fit.inliers.len() >= MIN_INLIERS;
        Ok(has_windows && !self.lacks_whole_view(place) && self.inconsistency(&place.refined)?.is_none())
    }

    /// Whether a place must stand out as a whole view, and does not.
    fn lacks_whole_view(&self, place: &VerifiedPlace) -> bool {
        let is_minority = 2 * place.refined.fit.inliers.len() < place.refined.matches.len();
        self.context.parts.has(Part::WholeView)
            && (place.refined.vote == Vote::Soft || is_minority)
            && place.peak_z_score < LEAST_WHOLE_VIEW_Z_SCORE
    }

    /// What a second place adds to the covariance of the best, by the ratio of their false alarms, where it lies within the best one's 95 %
    /// ellipse; `None` where it lies outside and is another place.
    fn near_second_px2(
        &self,
        best: &VerifiedPlace,
        second: &VerifiedPlace,
    ) -> Result<Option<Matrix2<f64>>, StoreError> {
        if !self.context.parts.has(Part::NearRivals) {
            return Ok(None);
        }
        let Some(own) = self.measured(best)? else { return Ok(None) };
        let Some(other) = self.measured(second)? else { return Ok(None) };
        let offset = LocalFrame::at(own.image_centre).enu_from_geodetic(other.image_centre);
        if !own.covariances.image_centre.contains_95(offset) {
            return Ok(None);
        }
        let at_best_zoom = 2f64.powi(i32::from(own.estimate.zoom) - i32::from(other.estimate.zoom));
        let (a, b) = (own.estimate.image_centre, other.estimate.image_centre);
        let offset_px = Vector2::new(b.x_px * at_best_zoom - a.x_px, b.y_px * at_best_zoom - a.y_px);
        let share = 10f64.powf(best.log10_false_alarms - second.log10_false_alarms).min(1.0);
        Ok(Some(offset_px * offset_px.transpose() * share))
    }

    fn measured(&self, place: &VerifiedPlace) -> Result<Option<MeasuredPlace>, StoreError> {
        MeasuredPlace::new(self.context, self.prepared.frame.camera(), &place.refined, &Doubts::default())
    }

    fn contradicted_attitude(&self, best: &RefinedPlace) -> Option<Refusal> {
        let tilt = TiltFound::new(best, &self.context.request.view, self.prepared.frame.camera())?;
        tilt.contradicts().then(|| {
            let [pitch_deg, roll_deg] = tilt.off_rad.map(f64::to_degrees);
            let detail = format!(
                "the windows show a pitch {pitch_deg:.1} and a roll {roll_deg:.1} degrees off the stated or assumed attitude, {:.1} standard deviations; at most {:.1} are accepted",
                tilt.sigmas,
                TiltFound::most_sigmas()
            );
            Refusal::new(Reason::InconsistentAttitude, detail)
        })
    }

    /// Compares the best place with its rivals. Returns why it cannot be told from another, though nothing else speaks against it;
    /// `None` where it can.
    fn compared(&self, best: &mut VerifiedPlace, coarse: &CoarsePeaks) -> Result<Option<Refusal>, LocateError> {
        let search = RivalSearch { context: self.context, map: self.map, prepared: self.prepared };
        let measured = if self.context.parts.has(Part::NearRivals) { self.measured(best)? } else { None };
        let own = measured.map_or(EnuCovariance::from_sigma_m(0.0), |measured| measured.covariances.image_centre);
        let report = search.compare(&best.refined.pose, own, &best.near_rivals_px, best.peak_z_score, coarse)?;
        best.rivals = Some(report);
        Ok(report.ambiguity().map(|rival| {
            let place = &best.refined.pose;
            let away_m = (rival.pose.nadir.x_px - place.nadir.x_px).hypot(rival.pose.nadir.y_px - place.nadir.y_px)
                * gsd_at(self.prepared.centre, place.zoom).mean_m_per_px();
            let turn_deg = wrap_turn_rad(rival.pose.heading_rad - place.heading_rad).to_degrees();
            let detail = format!(
                "a place {away_m:.0} m away, turned by {turn_deg:.0} degrees, fits almost as well: the best is better by {:.1} standard errors over the {:.0} % of the ground that both show ({LEAST_T_SCORE} needed), and is a rival's with a probability of {:.1} % ({:.1} % allowed)",
                rival.difference.t_score(),
                100.0 * rival.difference.overlap,
                100.0 * report.alias_probability(),
                100.0 * MOST_ALIAS_PROBABILITY
            );
            Refusal::new(Reason::Ambiguous, detail)
        }))
    }

    fn inconsistency(&self, best: &RefinedPlace) -> Result<Option<Refusal>, StoreError> {
        let SearchContext { height, ground, .. } = self.context;
        let expected = height.expected_ratio(self.prepared.frame.camera(), &best.pose, ground.as_ref())?;
        let ratio = best.pose.height_ratio / expected;
        let bound = 4.0 * height.sigma_ratio + 0.02;
        if ratio.ln().abs() > bound {
            let detail =
                format!("the scale found is {ratio:.3} of the stated scale, at most {bound:.3} off is accepted");
            return Ok(Some(Refusal::new(Reason::InconsistentScale, detail)));
        }
        if let Some(refusal) = self.contradicted_attitude(best) {
            return Ok(Some(refusal));
        }
        let Some(prior) = self.context.request.heading else { return Ok(None) };
        let turn = wrap_turn_rad(best.pose.heading_rad - prior.heading_rad);
        let bound = 4.0 * prior.sigma_rad + 2f64.to_radians();
        Ok((turn.abs() > bound).then(|| {
            let detail = format!("the heading found is {:.1} degrees off the stated heading", turn.to_degrees());
            Refusal::new(Reason::InconsistentHeading, detail)
        }))
    }
}
