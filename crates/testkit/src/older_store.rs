//! Stores as older versions of the program built them.

use overfly_core::feature::keypoint::CONTRACT;
use overfly_store::{Extract, LayerHead, LayerState, Reader, Terms};
use std::path::Path;

/// Writes the built store `from` to `to` in an older format, with all that the next build needs to know of its tiles. The terms of
/// its layers are left out: older formats have none.
pub fn older_copy(from: &Path, to: &Path, version: u32) {
    let reader = Reader::open(from).expect("the sound store opens");
    let extract = Extract::begin_version(&to.with_extension("draft"), CONTRACT, version).expect("a draft");
    for layer in reader.layers() {
        let state = LayerState::read(from, &layer.name).expect("the sound store is read");
        let head = LayerHead {
            name: layer.name.clone(),
            base_zoom: layer.base_zoom,
            min_zoom: layer.min_zoom,
            zoom_override: state.zoom_override,
            terms: Terms::default(),
            terrain: layer.terrain,
        };
        extract.begin_layer(&head).expect("a layer");
        for zoom in layer.min_zoom..=layer.base_zoom {
            for footprint in reader.footprints(layer, zoom).expect("the sound store is read") {
                let tile = reader.stored_tile(layer, footprint.tile).expect("the sound store is read");
                extract.put(&layer.name, &tile.expect("a footprint has a tile")).expect("a tile");
            }
        }
        for (tile, inputs_hash) in &state.inputs {
            extract.put_inputs(&layer.name, *tile, inputs_hash).expect("the inputs of a tile");
        }
        extract.end_layer(&head, reader.sources(layer).expect("the sound store is read")).expect("a finished layer");
    }
    extract.finish(to, None, 0).expect("a store of the rig");
}
