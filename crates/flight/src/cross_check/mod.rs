//! `CrossCheck`: how far the layers of a store lie off each other, measured by locating patches of one layer on another.
//!
//! Two maps of one place, made by different people, show where each of them errs: nothing else in a store does. The program locates
//! patches with the same search and the same bound on false fixes as it locates frames. The shift between two layers is the median over
//! patches, its scatter the median absolute deviation; what a layer is off by itself is its distance from the position on which most
//! layers agree.

mod consensus;
mod couples;
mod groups;
mod pair;

pub use pair::{LayerPair, PairShift};

use crate::locate::LocateError;
use consensus::consensus;
use couples::couples;
use overfly_core::geodesy::Enu;
use overfly_store::{Layer, Reader};
use pair::CommonGround;

/// The scatter within a pair is that of two layers: each has this share of its variance.
const OWN_SHARE: f64 = 0.5;

/// Layers of a store compared with each other.
#[derive(Debug, Clone, PartialEq)]
pub struct CrossCheck {
    /// The layers that have ground in common, each pair once.
    pub pairs: Vec<LayerPair>,
    /// What each layer is off by itself, in the order of the store.
    pub layers: Vec<LayerOffset>,
}

/// What a layer is off by itself.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerOffset {
    /// Its name.
    pub layer: String,
    /// How many others it was measured against.
    pub others: usize,
    /// From the position on which most layers agree; of two layers, half the shift between them. `None` where no other layer has ground in
    /// common on which patches were found.
    pub offset: Option<Enu>,
    /// Standard deviation per axis of what varies from place to place, metres: half the variance within a pair, the median over its pairs.
    /// What the measurement adds is in it.
    pub scatter_m: Option<f64>,
}

impl LayerOffset {
    /// The standard deviation per axis that offset and scatter speak for, metres: what `--horizontal-error-m` should state at least.
    pub fn error_m(&self) -> Option<f64> {
        let offset = self.offset?;
        let common_m2 = (offset.east_m.powi(2) + offset.north_m.powi(2)) / 2.0;
        Some((common_m2 + self.scatter_m?.powi(2)).sqrt())
    }
}

impl CrossCheck {
    /// Compares the finished layers of a store. `report` is told how many patches of how many are done.
    ///
    /// # Errors
    /// [`LocateError::Store`] where a tile cannot be read.
    pub fn new(store: &Reader, threads: usize, report: &dyn Fn(u64, u64)) -> Result<Self, LocateError> {
        let layers: Vec<&Layer> = store.imagery_layers().collect();
        let bounds: Vec<_> = layers.iter().map(|layer| layer.bounds_deg).collect();
        let couples = couples(&bounds, |a, b| CommonGround::new(store, [layers[a], layers[b]]))?;
        let mut pairs = Vec::new();
        for (done, (a, b, ground)) in couples.iter().enumerate() {
            let patches = |done_patches: usize| {
                report((done * pair::PATCHES + done_patches) as u64, (couples.len() * pair::PATCHES) as u64);
            };
            pairs.push((*a, *b, LayerPair::new(store, [layers[*a], layers[*b]], ground, threads, &patches)?));
        }
        let edges: Vec<_> = pairs.iter().filter_map(|(a, b, pair)| Some((*a, *b, pair.shift?.median))).collect();
        let offsets = consensus(layers.len(), &edges);
        let offset_of = |(index, layer): (usize, &&Layer)| {
            let own = pairs.iter().filter(|(a, b, _)| *a == index || *b == index);
            let scatters: Vec<_> = own.filter_map(|(_, _, pair)| Some(pair.shift?.scatter_m)).collect();
            LayerOffset {
                layer: layer.name.clone(),
                others: scatters.len(),
                offset: offsets[index].filter(|_| !scatters.is_empty()),
                scatter_m: pair::median(scatters).map(|scatter_m| scatter_m * OWN_SHARE.sqrt()),
            }
        };
        let layers = layers.iter().enumerate().map(offset_of).collect();
        Ok(Self { pairs: pairs.into_iter().map(|(_, _, pair)| pair).collect(), layers })
    }
}
