//! `Track`: decides over several images on places that none of them decides on alone.
//!
//! Each such place has an evidence, the number of places as good that chance would give in its search. Places of successive images that
//! lie as far apart as the aircraft moved are one track, and the logarithms of their evidence add; every pair that was compared counts as
//! one more chance.

use super::error::FilterError;
use super::filter::{Gate, NavigationFilter, Residual};
use super::measurements::{FixMeasurement, SensorReading, SensorSigmas};

/// The quantile of chi-square with two degrees of freedom within which a place agrees with a prediction: 99.9 %.
pub const TRACK_GATE: Gate = Gate { max_nis: 13.8 };
/// A place that agrees with a filter which an accepted fix has told where it is needs, with those before it since that fix, no more
/// evidence than this.
const KNOWN_LOG10_FALSE_ALARMS: f64 = -2.0;
/// A track without such a filter needs this, a decade more than a single image.
const UNKNOWN_LOG10_FALSE_ALARMS: f64 = -7.0;
/// A second track with this much evidence makes the first ambiguous.
const AMBIGUOUS_LOG10_FALSE_ALARMS: f64 = -3.0;
/// Tracks kept.
const MOST_TRACKS: usize = 6;
/// One standard deviation of a track's position before its first place updates it, metres.
const UNKNOWN_SIGMA_M: f64 = 1e4;

/// What speaks for a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaceEvidence {
    /// log10 of the number of such places expected by chance in the search.
    pub log10_false_alarms: f64,
    /// Distance of a rival that fits almost as well, metres.
    pub rival_m: Option<f64>,
}

impl PlaceEvidence {
    /// Whether its rival lies where the filter cannot be: then it is none.
    fn is_told_from_rival(&self, residual: &Residual) -> bool {
        let Some(rival_m) = self.rival_m else { return true };
        let [[a, b], [_, d]] = residual.covariance;
        let (middle, spread) = ((a + d) / 2.0, ((a - d) / 2.0).hypot(b));
        let reach_m = (TRACK_GATE.max_nis * (middle + spread)).max(0.0).sqrt();
        let [east_m, north_m] = residual.innovation;
        rival_m > reach_m + east_m.hypot(north_m)
    }
}

/// The tracks since the last accepted fix.
#[derive(Debug, Clone, Default)]
pub struct Track {
    /// Sum of the evidence of places that agree with the filter.
    with_filter: f64,
    /// Tracks of their own, best first.
    own: Vec<OwnTrack>,
    /// Pairs of a track and a place that were compared.
    compared: f64,
}

#[derive(Debug, Clone)]
struct OwnTrack {
    filter: NavigationFilter,
    log10_false_alarms: f64,
    places: u32,
}

impl Track {
    /// Carries the tracks to the next image.
    ///
    /// # Errors
    /// Those of `carry`.
    pub fn predict(
        &mut self,
        carry: impl Fn(&mut NavigationFilter) -> Result<(), FilterError>,
    ) -> Result<(), FilterError> {
        self.own.iter_mut().try_for_each(|track| carry(&mut track.filter))
    }

    /// Whether a place of this image is where a filter that knows its place says, by the evidence of this and the images before.
    ///
    /// # Errors
    /// [`FilterError`] where covariances are singular.
    pub fn agrees_with(
        &mut self,
        filter: &NavigationFilter,
        place: &FixMeasurement,
        evidence: PlaceEvidence,
    ) -> Result<bool, FilterError> {
        let residual = filter.fix_residual(place, TRACK_GATE)?;
        if !residual.is_accepted || !evidence.is_told_from_rival(&residual) {
            return Ok(false);
        }
        self.with_filter += evidence.log10_false_alarms.min(0.0);
        Ok(self.with_filter <= KNOWN_LOG10_FALSE_ALARMS)
    }

    /// Joins a place to the tracks that it continues, and starts one there. Returns the filter of a track that now has evidence enough,
    /// and whose second is chance.
    ///
    /// # Errors
    /// [`FilterError`] where covariances are singular.
    pub fn decided(
        &mut self,
        place: &FixMeasurement,
        evidence: PlaceEvidence,
        reading: SensorReading,
        sensors: &SensorSigmas,
    ) -> Result<Option<NavigationFilter>, FilterError> {
        if evidence.rival_m.is_some() || evidence.log10_false_alarms >= 0.0 {
            return Ok(None);
        }
        let mut joined = Vec::new();
        for track in &self.own {
            self.compared += 1.0;
            let mut filter = track.filter.clone();
            if filter.update_fix(place, TRACK_GATE)?.is_accepted {
                let log10_false_alarms = track.log10_false_alarms + evidence.log10_false_alarms;
                joined.push(OwnTrack { filter, log10_false_alarms, places: track.places + 1 });
            }
        }
        let mut filter = NavigationFilter::new(place.position, UNKNOWN_SIGMA_M, reading, sensors);
        filter.update_fix(place, Gate::OPEN)?;
        joined.push(OwnTrack { filter, log10_false_alarms: evidence.log10_false_alarms, places: 1 });
        self.own.extend(joined);
        self.own.sort_by(|a, b| a.log10_false_alarms.total_cmp(&b.log10_false_alarms));
        self.own.truncate(MOST_TRACKS);
        let Some(best) = self.own.first().filter(|best| best.places > 1) else { return Ok(None) };
        let is_other = |track: &&OwnTrack| !is_one_place(&best.filter, &track.filter);
        let second = self.own[1..].iter().find(is_other).map_or(0.0, |track| track.log10_false_alarms);
        let charged = best.log10_false_alarms + self.compared.max(1.0).log10();
        let is_decided = charged <= UNKNOWN_LOG10_FALSE_ALARMS && second > AMBIGUOUS_LOG10_FALSE_ALARMS;
        Ok(is_decided.then(|| best.filter.clone()))
    }
}

/// Whether two filters are at one place, by both their covariances.
fn is_one_place(a: &NavigationFilter, b: &NavigationFilter) -> bool {
    use overfly_core::geodesy::{EnuCovariance, LocalFrame};
    let off = LocalFrame::at(a.position()).enu_from_geodetic(b.position());
    let sum = a.position_covariance().to_matrix() + b.position_covariance().to_matrix();
    EnuCovariance::from_matrix(sum).squared_mahalanobis(off) <= TRACK_GATE.max_nis
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::geodesy::{Enu, EnuCovariance, Geodetic, Heading, LocalFrame};

    const SENSORS: SensorSigmas = SensorSigmas {
        heading_offset_rad: 0.05,
        heading_noise_rad: 0.05,
        height_offset_ratio: 0.03,
        height_noise_ratio: 0.03,
    };
    const READING: SensorReading = SensorReading { heading_rad: 0.0, height_m: 500.0 };

    fn start() -> Geodetic {
        Geodetic::from_degrees(47.0, 8.0).unwrap()
    }

    fn place(east_m: f64) -> FixMeasurement {
        FixMeasurement {
            position: LocalFrame::at(start()).geodetic_from_enu(Enu { east_m, north_m: 0.0 }).unwrap(),
            covariance: EnuCovariance::from_sigma_m(4.0),
            heading: Heading::from_degrees(0.0),
            heading_sigma_rad: 0.02,
            log_height: 500f64.ln(),
            log_height_sigma: 0.01,
            false_probability: 1.5e-4,
        }
    }

    fn evidence(log10_false_alarms: f64) -> PlaceEvidence {
        PlaceEvidence { log10_false_alarms, rival_m: None }
    }

    #[test]
    fn places_that_agree_with_a_filter_add_until_they_are_enough() {
        let filter = NavigationFilter::new(start(), 6.0, READING, &SENSORS);
        let mut track = Track::default();
        assert!(!track.agrees_with(&filter, &place(5.0), evidence(-1.2)).unwrap());
        assert!(!track.agrees_with(&filter, &place(200.0), evidence(-5.9)).unwrap(), "it lies elsewhere");
        assert!(track.agrees_with(&filter, &place(-4.0), evidence(-1.0)).unwrap());
    }

    #[test]
    fn a_rival_beyond_reach_is_none_and_one_within_stays() {
        let filter = NavigationFilter::new(start(), 6.0, READING, &SENSORS);
        let with_rival = |rival_m| PlaceEvidence { log10_false_alarms: -8.0, rival_m: Some(rival_m) };
        assert!(Track::default().agrees_with(&filter, &place(3.0), with_rival(80.0)).unwrap());
        assert!(!Track::default().agrees_with(&filter, &place(3.0), with_rival(20.0)).unwrap());
    }

    #[test]
    fn a_track_of_its_own_needs_more_and_no_second_beside_it() {
        let mut track = Track::default();
        let decide =
            |track: &mut Track, at, log10| track.decided(&place(at), evidence(log10), READING, &SENSORS).unwrap();
        assert!(decide(&mut track, 0.0, -4.0).is_none());
        assert!(decide(&mut track, 2.0, -2.5).is_none(), "10^-6.5, less what was compared");
        let filter = decide(&mut track, 1.0, -2.0).expect("three places agree");
        assert!(LocalFrame::at(start()).enu_from_geodetic(filter.position()).length_m() < 5.0);
        let mut two = Track::default();
        decide(&mut two, 0.0, -4.5);
        decide(&mut two, 900.0, -3.5);
        assert!(decide(&mut two, 1.0, -4.5).is_none(), "another place has evidence of its own");
    }
}
