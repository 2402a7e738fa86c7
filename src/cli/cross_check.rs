//! `overfly info --cross-check`: how far the layers of a store lie off each other.

use crate::cli::failure::Failure;
use crate::cli::output::Output;
use crate::cli::threads::default_threads;
use overfly_flight::cross_check::{CrossCheck, LayerOffset, LayerPair};
use overfly_store::{Reader, StoreError};
use serde::Serialize;

/// A stated error of at least this share of the measured one is none too small.
const STATED_SHARE: f64 = 0.8;

/// What the comparison says.
#[derive(Serialize)]
pub struct CrossCheckInfo {
    pairs: Vec<PairInfo>,
    layers: Vec<OffsetInfo>,
}

#[derive(Serialize)]
struct PairInfo {
    layer: String,
    against: String,
    zoom: u8,
    patches: usize,
    found: usize,
    /// Where the first layer puts a thing, less where the second does, metres: the median of the patches. `null` where too few were found.
    east_m: Option<f64>,
    north_m: Option<f64>,
    /// One standard deviation per axis around it, metres.
    scatter_m: Option<f64>,
    /// The farthest patch, metres.
    farthest_m: Option<f64>,
}

#[derive(Serialize)]
struct OffsetInfo {
    layer: String,
    others: usize,
    /// From the position on which most layers agree, metres; of two layers half the shift between them.
    east_m: Option<f64>,
    north_m: Option<f64>,
    scatter_m: Option<f64>,
    /// One standard deviation per axis that offset and scatter speak for, metres.
    error_m: Option<f64>,
    /// The largest that a source of the layer states, metres; `null` where one states none.
    stated_m: Option<f64>,
    /// Whether the layer states an error that is too small.
    is_understated: bool,
}

impl CrossCheckInfo {
    /// Compares the layers of a store.
    pub fn new(store: &Reader, output: &Output) -> Result<Self, Failure> {
        let threads = default_threads().get();
        let check = output.during("patches", |report| CrossCheck::new(store, threads, report))?;
        let offsets = check.layers.into_iter().map(|offset| OffsetInfo::new(store, offset));
        let layers = offsets.collect::<Result<_, StoreError>>()?;
        Ok(Self { pairs: check.pairs.into_iter().map(PairInfo::from_pair).collect(), layers })
    }

    /// The comparison as text.
    pub fn describe(&self) -> String {
        if self.pairs.is_empty() {
            return "\ncross-check: no two layers have enough ground of one level in common. To measure the error of a map, build another maker's map of the same ground into a layer of the same store: `overfly build --layer NAME`\n".into();
        }
        let width = self.layers.iter().map(|layer| layer.layer.chars().count()).fold(7, usize::max);
        let metres = |value: Option<f64>| value.map_or_else(|| "unknown".into(), |value| format!("{value:.2}"));
        let mut text = "\ncross-check: patches of a layer located on another. east_m, north_m: where the first puts a thing less where the second does\n".to_owned();
        text.push_str(&format!(
            "  {:<width$}  {:<width$}  zoom  patches  found   east_m  north_m  scatter_m  farthest_m\n",
            "layer", "against"
        ));
        for pair in &self.pairs {
            let PairInfo { layer, against, zoom, patches, found, .. } = pair;
            let [east, north, scatter, farthest] =
                [pair.east_m, pair.north_m, pair.scatter_m, pair.farthest_m].map(metres);
            text.push_str(&format!(
                "  {layer:<width$}  {against:<width$}  {zoom:>4}  {patches:>7}  {found:>5}  {east:>7}  {north:>7}  {scatter:>9}  {farthest:>10}\n"
            ));
        }
        text.push_str("\n  off the position on which most layers agree (of two layers: half the shift between them)\n");
        text.push_str(&format!("  {:<width$}  others   east_m  north_m  scatter_m  error_m  stated_m\n", "layer"));
        for layer in &self.layers {
            let [east, north, scatter, error, stated] =
                [layer.east_m, layer.north_m, layer.scatter_m, layer.error_m, layer.stated_m].map(metres);
            text.push_str(&format!(
                "  {:<width$}  {:>6}  {east:>7}  {north:>7}  {scatter:>9}  {error:>7}  {stated:>8}\n",
                layer.layer, layer.others
            ));
        }
        for layer in self.layers.iter().filter(|layer| layer.is_understated) {
            text.push_str(&format!(
                "note: layer {} states an error of {} m, and the others speak for {} m: build it again with `--horizontal-error-m {}`\n",
                layer.layer,
                metres(layer.stated_m),
                metres(layer.error_m),
                metres(layer.error_m)
            ));
        }
        text
    }
}

impl PairInfo {
    fn from_pair(pair: LayerPair) -> Self {
        let [layer, against] = pair.layers;
        Self {
            layer,
            against,
            zoom: pair.zoom,
            patches: pair.compared,
            found: pair.found,
            east_m: pair.shift.map(|shift| shift.median.east_m),
            north_m: pair.shift.map(|shift| shift.median.north_m),
            scatter_m: pair.shift.map(|shift| shift.scatter_m),
            farthest_m: pair.shift.map(|shift| shift.farthest_m),
        }
    }
}

impl OffsetInfo {
    fn new(store: &Reader, offset: LayerOffset) -> Result<Self, StoreError> {
        let stated: Option<Vec<f64>> =
            store.sources(store.layer(&offset.layer)?)?.into_iter().map(|source| source.horizontal_error_m).collect();
        let stated_m = stated.and_then(|stated| stated.into_iter().reduce(f64::max));
        let error_m = offset.error_m();
        let is_understated = error_m.zip(stated_m).is_some_and(|(error_m, stated_m)| stated_m < STATED_SHARE * error_m);
        Ok(Self {
            others: offset.others,
            east_m: offset.offset.map(|offset| offset.east_m),
            north_m: offset.offset.map(|offset| offset.north_m),
            scatter_m: offset.scatter_m,
            error_m,
            stated_m,
            is_understated,
            layer: offset.layer,
        })
    }
}
