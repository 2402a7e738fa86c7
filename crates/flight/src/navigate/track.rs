//! `Track`: decides over several images on places that none of them decides on alone.
//!
//! Each such place has an evidence, the number of places as good that chance would give in its search. Places of successive images that
//! lie as far apart as the aircraft moved are one track. Their evidence is combined by Fisher's method, since the product of many such
//! numbers is small by chance alone; and every comparison that was made counts as one more chance.
//!
//! # References
//! R. A. Fisher, *Statistical Methods for Research Workers*, 4th ed. (1932), section 21.1: combining probabilities.

use super::error::FilterError;
use super::filter::{Gate, NavigationFilter, Residual};
use super::measurements::{FixMeasurement, SensorReading, SensorSigmas};

/// The quantile of chi-square with two degrees of freedom within which a place agrees with a prediction: 99.9 %.
pub const TRACK_GATE: Gate = Gate { max_nis: 13.8 };
/// A place that agrees with a filter which an accepted fix has told where it is needs, with those before it since that fix, no more
/// evidence than this.
const KNOWN_LOG10_FALSE_ALARMS: f64 = -3.0;
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
    /// The evidence of places that agree with the filter.
    with_filter: CombinedEvidence,
    /// Tracks of their own, best first.
    own: Vec<OwnTrack>,
    /// Comparisons of a place with the filter or with a track.
    compared: u32,
}

#[derive(Debug, Clone)]
struct OwnTrack {
    filter: NavigationFilter,
    evidence: CombinedEvidence,
}

/// The evidence of several places for one track.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct CombinedEvidence {
    /// Sum of their log10, none of which is above 0.
    log10_product: f64,
    places: u32,
}

impl CombinedEvidence {
    fn with(self, evidence: PlaceEvidence) -> Self {
        let log10_product = self.log10_product + evidence.log10_false_alarms.min(0.0);
        Self { log10_product, places: self.places + 1 }
    }

    /// log10 of the number of tracks as good that chance gives in some comparisons: P times the sum of (-ln P)^k / k! over k below the
    /// number of places, with P the product.
    fn log10_false_alarms(self, compared: u32) -> f64 {
        let x = -self.log10_product * std::f64::consts::LN_10;
        let (_, sum) = (1..self.places).fold((1.0, 1.0), |(term, sum), k| {
            let term = term * x / f64::from(k);
            (term, sum + term)
        });
        self.log10_product + f64::log10(sum) + f64::from(compared.max(1)).log10()
    }
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
        self.compared = self.compared.saturating_add(1);
        if !residual.is_accepted || !evidence.is_told_from_rival(&residual) {
            return Ok(false);
        }
        self.with_filter = self.with_filter.with(evidence);
        Ok(self.with_filter.log10_false_alarms(self.compared) <= KNOWN_LOG10_FALSE_ALARMS)
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
            self.compared = self.compared.saturating_add(1);
            let mut filter = track.filter.clone();
            if filter.update_fix(place, TRACK_GATE)?.is_accepted {
                joined.push(OwnTrack { filter, evidence: track.evidence.with(evidence) });
            }
        }
        let mut filter = NavigationFilter::new(place.position, UNKNOWN_SIGMA_M, reading, sensors);
        filter.update_fix(place, Gate::OPEN)?;
        joined.push(OwnTrack { filter, evidence: CombinedEvidence::default().with(evidence) });
        self.own.extend(joined);
        let log10_false_alarms = |track: &OwnTrack| track.evidence.log10_false_alarms(self.compared);
        self.own.sort_by(|a, b| log10_false_alarms(a).total_cmp(&log10_false_alarms(b)));
        self.own.truncate(MOST_TRACKS);
        let Some(best) = self.own.first().filter(|best| best.evidence.places > 1) else { return Ok(None) };
        let is_other = |track: &&OwnTrack| !is_one_place(&best.filter, &track.filter);
        let is_rival = |track: &OwnTrack| track.evidence.log10_product <= AMBIGUOUS_LOG10_FALSE_ALARMS;
        let is_alone = !self.own[1..].iter().filter(is_other).any(is_rival);
        let is_decided = log10_false_alarms(best) <= UNKNOWN_LOG10_FALSE_ALARMS && is_alone;
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
    use super::super::measurements::fixtures::{READING, SENSORS};
    use super::*;
    use overfly_core::geodesy::{Enu, EnuCovariance, Geodetic, Heading, LocalFrame};

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
        assert!(!track.agrees_with(&filter, &place(5.0), evidence(-2.4)).unwrap());
        assert!(!track.agrees_with(&filter, &place(200.0), evidence(-5.9)).unwrap(), "it lies elsewhere");
        assert!(track.agrees_with(&filter, &place(-4.0), evidence(-2.4)).unwrap());
    }

    #[test]
    fn places_as_chance_gives_them_never_add_up() {
        let filter = NavigationFilter::new(start(), 6.0, READING, &SENSORS);
        let mut track = Track::default();
        for i in 0..500 {
            // The numbers of false alarms of places by chance spread evenly over [0, 1].
            let chance = (f64::from(i) * 0.618_034 + 0.01).fract();
            assert!(!track.agrees_with(&filter, &place(2.0), evidence(chance.log10())).unwrap(), "image {i}");
        }
    }

    #[test]
    fn combined_evidence_is_the_tail_of_a_product_of_even_numbers() {
        // P(u v w <= p) for three numbers even over [0, 1], by the sum over a grid of the first two.
        let of = |log10s: [f64; 3]| {
            let sum = log10s.into_iter().map(evidence).fold(CombinedEvidence::default(), CombinedEvidence::with);
            10f64.powf(sum.log10_false_alarms(1))
        };
        let (product, steps) = (10f64.powf(-1.3), 2000);
        let middle = |i: i32| (f64::from(i) + 0.5) / f64::from(steps);
        let cells = (0..steps).flat_map(|i| (0..steps).map(move |j| middle(i) * middle(j)));
        let tail = cells.map(|uv| (product / uv).min(1.0)).sum::<f64>() / f64::from(steps).powi(2);
        assert!((of([-1.0, -0.2, -0.1]) / tail - 1.0).abs() < 0.01, "{tail}");
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
        assert!(
            decide(&mut track, 2.0, -3.5).is_none(),
            "10^-7.5 is a product of two, which chance gives once in 10^6.2"
        );
        let filter = decide(&mut track, 1.0, -3.5).expect("three places agree");
        assert!(LocalFrame::at(start()).enu_from_geodetic(filter.position()).length_m() < 5.0);
        let mut two = Track::default();
        decide(&mut two, 0.0, -4.5);
        decide(&mut two, 900.0, -3.5);
        assert!(decide(&mut two, 1.0, -4.5).is_none(), "another place has evidence of its own");
    }
}
