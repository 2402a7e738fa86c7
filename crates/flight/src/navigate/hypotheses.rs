//! `Hypotheses`: the filters of a flight, and which of them a fix updates.
//!
//! The camera gives fixes and odometry alike. A camera that shows old or other images gives fixes that agree with each other and
//! with its odometry, and still are false. So a fix outside the gate does not move the position, however many agree with it,
//! unless the aircraft can have come there from the last accepted fix by its speed and compass alone.

use super::error::FilterError;
use super::filter::{Gate, NavigationFilter};
use super::measurements::{FixMeasurement, SensorReading, SensorSigmas};
use super::time_update::TimeUpdate;
use super::track::{PlaceEvidence, TRACK_GATE, Track};
use overfly_core::geodesy::{EnuCovariance, LocalFrame};
use overfly_core::integrity::{ErrorBelief, ErrorMixture};

/// Images with a motion that the aircraft can fly, after one that it cannot, until the position is no longer in doubt.
const DOUBTFUL_IMAGES: u32 = 3;
/// Fixes that must agree with each other before they end a doubt.
const AGREEING_FIXES: u32 = 2;
/// One standard deviation of an alternative filter's position before its first fix updates it, metres.
const ALTERNATIVE_SIGMA_M: f64 = 1e4;

/// The filters of a flight.
#[derive(Debug, Clone)]
pub struct Hypotheses {
    /// By all measurements that do not contradict each other.
    aided: NavigationFilter,
    /// By velocity, compass and altimeter alone since the last accepted fix: dead reckoning without the camera.
    unaided: NavigationFilter,
    /// Starts at a fix outside the gate, or at the first after a doubt.
    alternative: Option<Alternative>,
    /// Whether a fix has been accepted; before, there is only the stated start.
    has_fix: bool,
    doubtful_images: u32,
    /// Whether fixes contradicted the filter and were neither confirmed nor refuted since.
    is_unresolved: bool,
    /// What is true if the last accepted fix is false.
    fallback: Fallback,
    /// What places say that no image decides on alone, since the last accepted fix.
    track: Track,
}

/// What the filter would be without its last accepted fix.
#[derive(Debug, Clone)]
struct Fallback {
    /// Probability that this fix is false; 0 before the first.
    false_probability: f64,
    /// The filter without it, carried on since; `None` where the position may then be anywhere.
    filter: Option<NavigationFilter>,
    /// Probability that this filter is wrong as well.
    wrong_probability: f64,
}

#[derive(Debug, Clone)]
struct Alternative {
    filter: NavigationFilter,
    /// Fixes that agree.
    fixes: u32,
}

impl Fallback {
    /// Without this fix nothing is known.
    fn anywhere(fix: &FixMeasurement) -> Self {
        Self { false_probability: fix.false_probability, filter: None, wrong_probability: 1.0 }
    }
}

/// The time updates from one image to the next.
#[derive(Debug, Clone)]
pub struct ImageUpdate {
    /// With the camera.
    pub aided: TimeUpdate,
    /// Without the camera.
    pub unaided: TimeUpdate,
    /// What makes the camera doubtful.
    pub doubt: CameraDoubt,
}

/// What makes the camera doubtful at an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CameraDoubt {
    /// Nothing.
    None,
    /// The compass contradicts the filter's heading: one of the two is wrong, and no doubt ends.
    Heading,
    /// The compass contradicts the turn that the camera shows.
    Turn,
    /// The camera shows a motion that no aircraft can fly.
    Motion,
}

impl Hypotheses {
    /// Starts a flight.
    pub fn new(start: NavigationFilter) -> Self {
        Self {
            unaided: start.clone(),
            aided: start,
            alternative: None,
            has_fix: false,
            doubtful_images: 0,
            is_unresolved: false,
            fallback: Fallback { false_probability: 0.0, filter: None, wrong_probability: 0.0 },
            track: Track::default(),
        }
    }

    /// The filter that the navigator answers by.
    pub fn filter(&self) -> &NavigationFilter {
        &self.aided
    }

    /// The filter of dead reckoning without the camera.
    pub fn unaided(&self) -> &NavigationFilter {
        &self.unaided
    }

    /// The filter around which a fix is searched: what contradicts is confirmed or refuted first.
    pub fn searched(&self) -> &NavigationFilter {
        self.alternative.as_ref().map_or(&self.aided, |a| &a.filter)
    }

    /// Whether fixes contradict the filter.
    pub fn is_contradicted(&self) -> bool {
        self.alternative.is_some()
    }

    /// Whether the position is in doubt.
    pub fn is_lost(&self) -> bool {
        self.is_contradicted() || self.is_unresolved || self.doubtful_images > 0
    }

    /// Covariance of the position: of the filter, and of the fixes that contradict it.
    pub fn position_covariance(&self) -> EnuCovariance {
        let EnuCovariance { ee_m2, en_m2, nn_m2 } = self.aided.position_covariance();
        let Some(alternative) = &self.alternative else { return self.aided.position_covariance() };
        let off = LocalFrame::at(self.aided.position()).enu_from_geodetic(alternative.filter.position());
        EnuCovariance {
            ee_m2: ee_m2 + off.east_m.powi(2),
            en_m2: en_m2 + off.east_m * off.north_m,
            nn_m2: nn_m2 + off.north_m.powi(2),
        }
    }

    /// How the position may err: as the filter says; or, should its last fix be false, as the filter without that says. In doubt it may
    /// be anywhere.
    pub fn errors(&self) -> ErrorMixture {
        if self.is_lost() {
            return ErrorMixture::default();
        }
        let Fallback { false_probability, filter, wrong_probability } = &self.fallback;
        let aided = ErrorBelief {
            probability: 1.0 - false_probability,
            covariance: self.aided.position_covariance(),
            offset_m: 0.0,
        };
        let without = filter.as_ref().map(|filter| {
            let off = LocalFrame::at(self.aided.position()).enu_from_geodetic(filter.position());
            ErrorBelief {
                probability: false_probability * (1.0 - wrong_probability),
                covariance: filter.position_covariance(),
                offset_m: off.east_m.hypot(off.north_m),
            }
        });
        ErrorMixture::new(std::iter::once(aided).chain(without).collect())
    }

    /// Continues from an earlier filter: the next update begins there.
    pub fn go_back_to(&mut self, filter: NavigationFilter) {
        self.aided = filter;
    }

    /// Carries all filters to the next image. While fixes contradict the filter, the camera is not believed.
    ///
    /// # Errors
    /// As [`TimeUpdate::apply`].
    pub fn predict(&mut self, update: &ImageUpdate, sensors: &SensorSigmas) -> Result<(), FilterError> {
        update.unaided.apply(&mut self.unaided, sensors)?;
        self.track.predict(|filter| update.aided.apply(filter, sensors))?;
        if let Some(fallback) = &mut self.fallback.filter {
            update.aided.apply(fallback, sensors)?;
        }
        match &mut self.alternative {
            Some(alternative) => {
                update.aided.apply(&mut alternative.filter, sensors)?;
                self.aided = self.unaided.clone();
            }
            None if self.is_unresolved => update.unaided.apply(&mut self.aided, sensors)?,
            None => update.aided.apply(&mut self.aided, sensors)?,
        }
        let is_odometry = matches!(update.aided, TimeUpdate::Odometry { .. });
        self.doubtful_images = match update.doubt {
            CameraDoubt::None if is_odometry => self.doubtful_images.saturating_sub(1),
            CameraDoubt::None | CameraDoubt::Heading => self.doubtful_images,
            CameraDoubt::Turn | CameraDoubt::Motion => DOUBTFUL_IMAGES,
        };
        // Fixes before and after it agree by chance: images in turns show two places that are equally far off.
        if let (CameraDoubt::Motion, Some(alternative)) = (update.doubt, &mut self.alternative) {
            alternative.fixes = 0;
        }
        Ok(())
    }

    /// Ends a contradiction that no further fix confirms; `false` where there is none. The place that contradicts is not refuted: the
    /// filter's covariance keeps it, and only fixes end the doubt.
    pub fn drop_alternative(&mut self) -> bool {
        let Some(alternative) = self.alternative.take() else { return false };
        let off = LocalFrame::at(self.aided.position()).enu_from_geodetic(alternative.filter.position());
        self.aided.widen_position(off);
        self.is_unresolved = true;
        true
    }

    /// Updates the filter with a fix of this very image, and returns whether the fix is accepted. In doubt, two fixes have to agree
    /// with each other and with dead reckoning. A fix outside the gate starts an alternative if it `is_sure`.
    ///
    /// # Errors
    /// [`FilterError`] where covariances are singular.
    pub fn update_fix(
        &mut self,
        fix: &FixMeasurement,
        is_sure: bool,
        reading: SensorReading,
        sensors: &SensorSigmas,
    ) -> Result<bool, FilterError> {
        const GATE: Gate = Gate::ONE_IN_A_MILLION;
        let is_reachable = !self.has_fix || self.unaided.fix_residual(fix, GATE)?.is_accepted;
        if let Some(alternative) = &mut self.alternative
            && alternative.filter.update_fix(fix, GATE)?.is_accepted
        {
            alternative.fixes += 1;
            if alternative.fixes >= AGREEING_FIXES && is_reachable {
                let filter = alternative.filter.clone();
                self.accept(filter, Fallback::anywhere(fix));
                return Ok(true);
            }
            return Ok(false);
        }
        let was_lost = self.is_lost();
        let mut updated = self.aided.clone();
        if !was_lost && updated.update_fix(fix, GATE)?.is_accepted {
            let without = self.without_fix(fix);
            self.accept(updated, without);
            return Ok(true);
        }
        if is_sure || was_lost && is_reachable {
            let mut filter = NavigationFilter::new(fix.position, ALTERNATIVE_SIGMA_M, reading, sensors);
            filter.update_fix(fix, Gate::OPEN)?;
            self.alternative = Some(Alternative { filter, fixes: 1 });
            self.aided = self.unaided.clone();
        }
        Ok(false)
    }

    /// Updates the filter with a place that this image cannot decide on alone, where the track of the images before decides; returns
    /// whether it does.
    ///
    /// # Errors
    /// [`FilterError`] where covariances are singular.
    pub fn update_place(
        &mut self,
        place: &FixMeasurement,
        evidence: PlaceEvidence,
        reading: SensorReading,
        sensors: &SensorSigmas,
    ) -> Result<bool, FilterError> {
        if self.has_fix && !self.is_lost() {
            if !self.track.agrees_with(&self.aided, place, evidence)? {
                return Ok(false);
            }
            let without = self.without_fix(place);
            let mut updated = self.aided.clone();
            updated.update_fix(place, TRACK_GATE)?;
            self.accept(updated, without);
            return Ok(true);
        }
        let is_reachable = !self.has_fix || self.unaided.fix_residual(place, Gate::ONE_IN_A_MILLION)?.is_accepted;
        let is_within = !self.has_fix && self.aided.fix_residual(place, Gate::ONE_IN_A_MILLION)?.is_accepted;
        if !is_reachable || !self.has_fix && !is_within {
            return Ok(false);
        }
        let Some(filter) = self.track.decided(place, evidence, reading, sensors)? else { return Ok(false) };
        self.accept(filter, Fallback::anywhere(place));
        Ok(true)
    }

    /// Takes over the track of filters that were updated with the places of an earlier image, and carries it on to this one.
    ///
    /// # Errors
    /// As [`Hypotheses::predict`].
    pub fn keep_track(
        &mut self,
        at_image: &Self,
        since: &[ImageUpdate],
        sensors: &SensorSigmas,
    ) -> Result<(), FilterError> {
        self.track = at_image.track.clone();
        since.iter().try_for_each(|update| self.track.predict(|filter| update.aided.apply(filter, sensors)))
    }

    /// What is true if a fix that the filter accepts is false.
    fn without_fix(&self, fix: &FixMeasurement) -> Fallback {
        Fallback {
            false_probability: fix.false_probability,
            filter: Some(self.aided.clone()),
            wrong_probability: self.fallback.false_probability,
        }
    }

    fn accept(&mut self, filter: NavigationFilter, fallback: Fallback) {
        *self = Self {
            unaided: filter.clone(),
            aided: filter,
            alternative: None,
            has_fix: true,
            doubtful_images: 0,
            is_unresolved: false,
            fallback,
            track: Track::default(),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::super::flight_limits::Manoeuvre;
    use super::super::measurements::fixtures::{READING, SENSORS};
    use super::*;
    use overfly_core::geodesy::{Enu, Geodetic, Heading};

    fn at(north_m: f64) -> Geodetic {
        let origin = Geodetic::from_degrees(47.0, 8.0).unwrap();
        LocalFrame::at(origin).geodetic_from_enu(Enu { east_m: 0.0, north_m }).unwrap()
    }

    fn fix(north_m: f64) -> FixMeasurement {
        FixMeasurement {
            position: at(north_m),
            covariance: EnuCovariance::from_sigma_m(2.0),
            heading: Heading::from_radians(0.0),
            heading_sigma_rad: 0.002,
            log_height: 500f64.ln(),
            log_height_sigma: 0.002,
            false_probability: 1.5e-4,
        }
    }

    fn flight() -> Hypotheses {
        Hypotheses::new(NavigationFilter::new(at(0.0), 30.0, READING, &SENSORS))
    }

    fn tell(hypotheses: &mut Hypotheses, north_m: f64) -> bool {
        hypotheses.update_fix(&fix(north_m), true, READING, &SENSORS).unwrap()
    }

    /// 180 m north by velocity and compass, with and without the camera.
    fn fly(hypotheses: &mut Hypotheses, doubt: CameraDoubt) {
        let update = TimeUpdate::DeadReckoning {
            displacement: Enu { east_m: 0.0, north_m: 180.0 },
            sigma_m: 9.0,
            reading: READING,
            unseen: Manoeuvre::default(),
        };
        let update = ImageUpdate { aided: update.clone(), unaided: update, doubt };
        hypotheses.predict(&update, &SENSORS).unwrap();
    }

    #[test]
    fn fixes_that_agree_with_each_other_and_not_with_the_flight_move_nothing() {
        let mut told = flight();
        assert!(tell(&mut told, 0.0));
        for image in 1..12 {
            fly(&mut told, CameraDoubt::None);
            // The images of ten images ago.
            assert!(!tell(&mut told, 180.0 * f64::from(image) - 1800.0), "image {image}");
            assert!(told.is_lost());
            let truth = at(180.0 * f64::from(image));
            let off = LocalFrame::at(truth).enu_from_geodetic(told.filter().position());
            assert!(off.length_m() < 5.0, "image {image}: {off:?}");
            // Both places are in the ellipse.
            let [here, there] = [0.0, -1800.0].map(|north_m| Enu { east_m: 0.0, north_m });
            assert!([here, there].iter().all(|off| told.position_covariance().contains_95(*off)));
        }
        fly(&mut told, CameraDoubt::None);
        assert!(!tell(&mut told, 180.0 * 12.0) && told.is_lost());
        fly(&mut told, CameraDoubt::None);
        assert!(tell(&mut told, 180.0 * 13.0) && !told.is_lost());
    }

    #[test]
    fn two_fixes_that_agree_replace_a_wrong_start() {
        let mut told = flight();
        assert!(!tell(&mut told, 900.0) && told.is_lost());
        fly(&mut told, CameraDoubt::None);
        assert!(tell(&mut told, 1080.0) && !told.is_lost());
        assert!(LocalFrame::at(at(1080.0)).enu_from_geodetic(told.filter().position()).length_m() < 1.0);
    }

    #[test]
    fn after_a_motion_that_cannot_be_flown_one_fix_is_not_enough() {
        let mut told = flight();
        assert!(tell(&mut told, 0.0));
        fly(&mut told, CameraDoubt::Motion);
        assert!(told.is_lost() && !tell(&mut told, 180.0));
        fly(&mut told, CameraDoubt::None);
        assert!(tell(&mut told, 360.0) && !told.is_lost());
    }
}
