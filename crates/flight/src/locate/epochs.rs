//! The layers that a request searches: the one it names, or all of a store, the newest first.

use super::answer::{Answer, Fix, NoFix, Reason, SearchedMap};
use super::candidates::{CandidatesError, default_layer};
use super::verify::AMBIGUOUS_LOG10_FALSE_ALARMS;
use super::weighed_place::WeighedPlace;
use overfly_store::{ANY_LAYER, Layer, Reader, StoreError};

/// Places nearer than this are one, metres: the maps of two epochs may be shifted against each other. Three standard deviations of two
/// unknown errors of 3 m are 13 m.
const SAME_PLACE_M: f64 = 15.0;

/// The answer of one layer.
pub struct LayerAnswer<T> {
    /// The answer.
    pub answer: Answer,
    /// The verified places of the layer, best first.
    pub places: Vec<WeighedPlace>,
    /// What the caller wants beside the answer.
    pub more: T,
}

/// Returns the answer of a layer, whose best place is `place`, beside the verified places of newer layers. A fix is ambiguous where a newer layer has another place with
/// as much evidence as would make it ambiguous within one layer.
pub fn beside_newer(answer: Answer, place: Option<&WeighedPlace>, newer: &[WeighedPlace]) -> Answer {
    let (Answer::Fix(fix), Some(place)) = (&answer, place) else { return answer };
    let is_rival = |other: &&WeighedPlace| {
        other.log10_rival_false_alarms < AMBIGUOUS_LOG10_FALSE_ALARMS && other.distance_m(place) > SAME_PLACE_M
    };
    let Some(rival) = newer.iter().find(is_rival) else { return answer };
    let detail = format!(
        "layer {}, which is newer, shows the frame {:.0} m away: 10^{:.1} such places are expected there by chance, and 10^{:.1} in layer {}",
        rival.layer,
        rival.distance_m(place),
        rival.log10_rival_false_alarms,
        place.log10_false_alarms,
        place.layer
    );
    Answer::NoFix(NoFix {
        reason: Reason::Ambiguous,
        detail,
        score: Some(fix.score),
        log10_false_alarms: fix.log10_false_alarms,
        tiles_searched: fix.tiles_searched,
        nominal_count: fix.nominal_count,
        map: fix.map.clone(),
        time_s: fix.time_s,
    })
}

/// Returns the name of the layer that a caller asks for: a finished layer, or [`ANY_LAYER`]; without a name, the default layer.
///
/// # Errors
/// Where the store has no such layer, or no default one.
pub fn requested_layer(store: &Reader, name: Option<&str>) -> Result<String, CandidatesError> {
    match name {
        Some(name) => Ok(searched_layers(store, name).map(|_| name.to_owned())?),
        None => Ok(default_layer(store)?.name.clone()),
    }
}

/// Returns the layers that a request searches, in this order: for [`ANY_LAYER`] all finished ones, the newest first, those without a
/// date last, those of one date by name; else the one of that name.
///
/// No build makes a layer called [`ANY_LAYER`] any more. A store that has one is older: there the name is that of the layer.
///
/// # Errors
/// [`StoreError::NoLayer`], [`StoreError::Unfinished`].
pub fn searched_layers<'a>(store: &'a Reader, name: &str) -> Result<Vec<&'a Layer>, StoreError> {
    if name != ANY_LAYER || store.layers().iter().any(|layer| layer.name == ANY_LAYER) {
        return Ok(vec![store.imagery_layer(name)?]);
    }
    let mut layers: Vec<&Layer> = store.imagery_layers().collect();
    layers.sort_by(|a, b| a.newest_first(b));
    Ok(layers)
}

impl Answer {
    /// Whether no older layer is searched after this answer: after a fix, and where several places fit. An older layer that shows only
    /// one of these places cannot tell which it is.
    pub(super) fn stands(&self) -> bool {
        match self {
            Self::Fix(_) => true,
            Self::NoFix(none) => none.reason == Reason::Ambiguous,
        }
    }

    fn log10_false_alarms(&self) -> f64 {
        match self {
            Self::Fix(fix) => fix.log10_false_alarms,
            Self::NoFix(none) => none.log10_false_alarms,
        }
        .unwrap_or(f64::INFINITY)
    }

    fn tiles_searched(&self) -> usize {
        match self {
            Self::Fix(fix) => fix.tiles_searched,
            Self::NoFix(none) => none.tiles_searched,
        }
    }
}

/// Of the answers of the layers, in the order of the search, at least one: the last one where it stands, else that of the layer with
/// the most evidence, of equals the newest. It states the tiles and layers of the whole search.
pub fn nearest<T>(answers: Vec<(Answer, T)>) -> (Answer, T) {
    let tiles: usize = answers.iter().map(|(answer, _)| answer.tiles_searched()).sum();
    let names: Vec<String> = answers.iter().map(|(answer, _)| answer.map().layer.clone()).collect();
    let stands = |answer: &Answer| answer.stands();
    let best = answers
        .into_iter()
        .reduce(|best, next| {
            let is_nearer = next.0.log10_false_alarms() < best.0.log10_false_alarms();
            if stands(&next.0) || is_nearer { next } else { best }
        })
        .expect("a store that opens has a finished layer");
    let whole = |map: SearchedMap| SearchedMap { layers_searched: names, ..map };
    let answer = match best.0 {
        Answer::Fix(fix) => {
            let map = whole(fix.map);
            Answer::Fix(Fix { tiles_searched: tiles, map, ..fix })
        }
        Answer::NoFix(none) => {
            let map = whole(none.map);
            Answer::NoFix(NoFix { tiles_searched: tiles, map, ..none })
        }
    };
    (answer, best.1)
}

#[cfg(test)]
mod tests {
    use super::super::answer::PositionOf;
    use super::*;
    use overfly_core::geodesy::{Geodetic, Heading};

    fn no_fix(layer: &str, reason: Reason, log10_false_alarms: Option<f64>) -> (Answer, ()) {
        let map = SearchedMap { layer: layer.into(), layers_charged: 3, ..SearchedMap::default() };
        let detail = String::new();
        let (score, time_s, tiles_searched, nominal_count) = (None, None, 5, 1.0);
        let none = NoFix { reason, detail, score, log10_false_alarms, tiles_searched, nominal_count, map, time_s };
        (Answer::NoFix(none), ())
    }

    #[test]
    fn without_a_fix_the_answer_is_that_of_the_layer_with_the_most_evidence() {
        let weak = no_fix("new", Reason::OutsideMap, None);
        let best = no_fix("middle", Reason::TooFewAgreeingWindows, Some(-4.0));
        let other = no_fix("old", Reason::TooFewAgreeingWindows, Some(-1.0));
        let Answer::NoFix(found) = nearest(vec![weak.clone(), best, other]).0 else { panic!("no fix") };
        assert_eq!((found.map.layer.as_str(), found.tiles_searched), ("middle", 15));
        assert_eq!(found.map.layers_searched, ["new", "middle", "old"]);
        let older = no_fix("old", Reason::OutsideMap, None);
        assert_eq!(nearest(vec![weak, older]).0.map().layer, "new");
    }

    fn fix() -> Answer {
        let position = Geodetic::from_degrees(48.0, 15.0).unwrap();
        let covariance = [[1.0, 0.0], [0.0, 1.0]];
        Answer::Fix(Fix {
            position,
            position_of: PositionOf::Nadir,
            heading: Heading::from_degrees(12.0),
            heading_sigma_rad: 0.01,
            gsd_m_per_px: 1.0,
            scale_sigma_ratio: 0.001,
            covariance: covariance.into(),
            score: 20.0,
            false_fix_probability: 1.5e-4,
            log10_false_alarms: Some(-19.7),
            image_centre: position,
            image_centre_covariance: covariance.into(),
            attitude_sigma_rad: None,
            inliers: 30,
            tiles_searched: 6,
            nominal_count: 4.0,
            map_error_m: 3.0,
            map_error_known: false,
            map_epoch: None,
            map: SearchedMap::default(),
            time_s: None,
        })
    }

    #[test]
    fn a_fix_beside_another_place_of_a_newer_layer_is_ambiguous() {
        let place = |longitude_deg: f64, log10_false_alarms: f64| WeighedPlace {
            layer: "new".into(),
            nadir: Geodetic::from_degrees(48.0, longitude_deg).unwrap(),
            log10_false_alarms,
            log10_rival_false_alarms: log10_false_alarms,
            false_fix_probability: 1.0,
            rivals: None,
            least_t_score: None,
            blocks: None,
        };
        // 0.001 degrees are 75 m there.
        let beside = |newer: &[WeighedPlace]| beside_newer(fix(), Some(&place(15.0, -20.0)), newer);
        let Answer::NoFix(none) = beside(&[place(15.001, -4.0)]) else { panic!("a fix") };
        assert!(none.reason == Reason::Ambiguous && none.detail.contains("75 m away"), "{none:?}");
        for newer in [vec![], vec![place(15.001, -2.0)], vec![place(15.0001, -9.0)]] {
            assert_eq!(beside(&newer), fix(), "{newer:?}");
        }
    }

    #[test]
    fn an_ambiguous_frame_ends_the_search_whatever_an_older_layer_would_say() {
        let ambiguous = no_fix("new", Reason::Ambiguous, Some(-9.0));
        assert!(ambiguous.0.stands() && !no_fix("new", Reason::InconsistentScale, Some(-9.0)).0.stands());
        let newer = no_fix("newest", Reason::TooFewAgreeingWindows, Some(-20.0));
        assert_eq!(nearest(vec![newer, ambiguous]).0.map().layer, "new");
    }
}
