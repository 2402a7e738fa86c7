//! The layers that a request searches: the one it names, or all of a store, the newest first.

use super::answer::{Answer, NoFix, Reason, SearchedMap};
use super::candidates::{CandidatesError, default_layer};
use overfly_store::{ANY_LAYER, Layer, Reader, StoreError};

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
        return Ok(vec![store.layer(name)?]);
    }
    let mut layers: Vec<&Layer> = store.finished_layers().collect();
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
            Answer::Fix(super::answer::Fix { tiles_searched: tiles, map, ..fix })
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
    use super::*;

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

    #[test]
    fn an_ambiguous_frame_ends_the_search_whatever_an_older_layer_would_say() {
        let ambiguous = no_fix("new", Reason::Ambiguous, Some(-9.0));
        assert!(ambiguous.0.stands() && !no_fix("new", Reason::InconsistentScale, Some(-9.0)).0.stands());
        let newer = no_fix("newest", Reason::TooFewAgreeingWindows, Some(-20.0));
        assert_eq!(nearest(vec![newer, ambiguous]).0.map().layer, "new");
    }
}
