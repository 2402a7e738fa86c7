//! `export`: copies what one flight needs from a store to a new, sealed store.

use super::corridor::Corridor;
use super::coverage::{CorridorCoverage, coverage};
use super::error::ExportError;
use super::request::ExportRequest;
use super::selection::select;
use super::size_reduction::{reduce_size, stated_quality};
use overfly_store::package::{Dropped, Manifest, ManifestLayer, ManifestRoute, SEAL_LEN, write_seal};
use overfly_store::{
    AtomicFile, EMPTY_STORE_BYTES, Extract, FileKind, LayerPart, Reader, TileSizes, file_len, hex, larger_error,
    stored_bytes,
};
use serde::Serialize;
use std::path::Path;

/// What an export takes of one level of a layer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExportedLevel {
    /// The layer.
    pub layer: String,
    /// The zoom of the level.
    pub zoom: u8,
    /// Tiles taken.
    pub tiles: usize,
    /// Bytes of the tiles' imagery, descriptors and cells.
    #[serde(flatten)]
    pub bytes: TileSizes,
}

impl ExportedLevel {
    /// Bytes of all content.
    fn content(&self) -> u64 {
        self.bytes.imagery + self.rest()
    }

    /// Bytes of all content but the imagery.
    fn rest(&self) -> u64 {
        self.bytes.descriptors + self.bytes.cells
    }
}

/// What an export would take.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Preview {
    /// The levels, by layer.
    pub parts: Vec<ExportedLevel>,
    /// Bytes of their content. Footprints, indexes and partly filled pages add to the size of the file.
    pub bytes: u64,
    /// The file's size, estimated, as far as nothing has to be dropped and no imagery is encoded again.
    pub estimated_bytes: u64,
    /// How much of the corridor the map shows, by layer.
    pub coverage: Vec<CorridorCoverage>,
    /// The corridor's width at its widest place, metres on each side.
    pub widest_m: f64,
}

/// The result of an export.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Exported {
    /// The levels that were taken, by layer.
    pub parts: Vec<ExportedLevel>,
    /// The file's size.
    pub bytes: u64,
    /// The store's digest, hexadecimal.
    pub digest: String,
    /// The whole file's digest, which its seal states, hexadecimal.
    pub file_digest: String,
    /// What was dropped to reduce the size.
    pub dropped: Vec<Dropped>,
    /// The public key of the signer, hexadecimal.
    pub signed_by: Option<String>,
    /// The mission's name.
    pub name: Option<String>,
    /// The serial.
    pub serial: Option<u64>,
    /// The last day on which the export may be flown.
    pub valid_until: Option<String>,
    /// How much of the corridor the map shows, by layer.
    pub coverage: Vec<CorridorCoverage>,
    /// The corridor's width at its widest place, metres on each side.
    pub widest_m: f64,
}

/// Returns what an export would take, and how much of the corridor the map shows. Writes nothing.
///
/// # Errors
/// As [`export`], except for errors of writing.
pub fn preview(store: &Reader, request: &ExportRequest) -> Result<Preview, ExportError> {
    let corridor = Corridor::along(&request.routes, &request.width())?;
    let chosen = select(store, request, &corridor)?;
    let parts = exported_levels(store, &chosen)?;
    let bytes = parts.iter().map(ExportedLevel::content).sum();
    let tiles = |of: &dyn Fn(&ExportedLevel) -> bool| parts.iter().filter(|p| of(p)).map(|p| p.tiles as u64).sum();
    let estimated_bytes =
        EMPTY_STORE_BYTES + stored_bytes(bytes, tiles(&|_| true), tiles(&|p| p.bytes.descriptors > 0));
    Ok(Preview {
        parts,
        bytes,
        estimated_bytes,
        coverage: coverages(store, request, &chosen)?,
        widest_m: corridor.widest_m(),
    })
}

/// Exports what a request needs from `store` to the file `out`, which appears complete or not at all. The same request of the
/// same store gives the same bytes. `progress` is called with the number of tiles done and the total.
///
/// # Errors
/// [`ExportError`] where the corridor or the layers hold no tile, a tile is damaged, the export cannot be made as small as
/// asked, or the disk is full. A file that existed at `out` is then unchanged.
pub fn export(
    store: &Reader,
    request: &ExportRequest,
    out: &Path,
    progress: &dyn Fn(u64, u64),
) -> Result<Exported, ExportError> {
    store.prove()?;
    let corridor = Corridor::along(&request.routes, &request.width())?;
    let mut chosen = select(store, request, &corridor)?;
    let file = AtomicFile::create(out, FileKind::Export, &[store.path()])?;
    let writing = Writing { store, request, corridor: &corridor, file: &file, progress };
    let (manifest, dropped) = writing.write_within_limit(&mut chosen)?;
    let (name, serial, valid_until) = (manifest.name.clone(), manifest.serial, manifest.valid_until.clone());
    let seal = write_seal(file.temporary_path(), &manifest.to_text(), request.key.as_ref())?;
    let bytes = file_len(file.temporary_path())?;
    let parts = exported_levels(&Reader::open(file.temporary_path())?, &chosen)?;
    file.persist()?;
    Ok(Exported {
        parts,
        bytes,
        digest: manifest.digest,
        file_digest: hex(&seal.file),
        dropped,
        signed_by: manifest.signed_by,
        name,
        serial,
        valid_until,
        coverage: coverages(store, request, &chosen)?,
        widest_m: corridor.widest_m(),
    })
}

/// An export in progress.
struct Writing<'a> {
    store: &'a Reader,
    request: &'a ExportRequest,
    corridor: &'a Corridor,
    file: &'a AtomicFile,
    progress: &'a dyn Fn(u64, u64),
}

impl Writing<'_> {
    /// Writes the parts, unsealed, and reduces them until the file has at most the allowed size.
    fn write_within_limit(&self, chosen: &mut Vec<LayerPart>) -> Result<(Manifest, Vec<Dropped>), ExportError> {
        let most = self.request.max_bytes.unwrap_or(u64::MAX);
        let mut dropped: Vec<Dropped> = self.request.jpeg_quality.map(stated_quality).into_iter().collect();
        loop {
            // The size of imagery that is encoded again is not known in advance.
            let known = |p: &ExportedLevel| {
                if chosen.iter().any(|c| c.jpeg_quality.is_some()) { p.rest() } else { p.content() }
            };
            let least: u64 = exported_levels(self.store, chosen)?.iter().map(known).sum();
            if least <= most {
                self.file.require_room(least)?;
                // A draft, and a file.
                let manifest = self.write(chosen, &dropped).map_err(|error| error.needing(least.saturating_mul(2)))?;
                if file_len(self.file.temporary_path())? <= most {
                    return Ok((manifest, dropped));
                }
            }
            let Some(one) = reduce_size(chosen, self.store.layers()) else {
                // The least size is known only after writing.
                self.write(chosen, &dropped)?;
                return Err(ExportError::TooLarge { least: file_len(self.file.temporary_path())?, most });
            };
            dropped.push(one);
        }
    }

    fn write(&self, chosen: &[LayerPart], dropped: &[Dropped]) -> Result<Manifest, ExportError> {
        self.file.truncate()?;
        let mut extract = Extract::begin(&self.file.draft_path(), self.store.descriptor_contract())?;
        let total = chosen.iter().map(|p| p.tiles.len() as u64).sum();
        let mut done = 0;
        for part in chosen {
            extract.copy(self.store, part, || {
                done += 1;
                (self.progress)(done, total);
            })?;
        }
        let manifest = make_manifest(&extract, self.store, self.request, dropped, self.corridor)?;
        extract.finish(self.file.temporary_path(), Some(&manifest.to_text()), SEAL_LEN as u8)?;
        Ok(manifest)
    }
}

fn make_manifest(
    extract: &Extract,
    store: &Reader,
    request: &ExportRequest,
    dropped: &[Dropped],
    corridor: &Corridor,
) -> Result<Manifest, ExportError> {
    let mut layers = Vec::new();
    for layer in extract.layers()? {
        let mut levels = Vec::new();
        let mut horizontal_error_m = Some(0.0);
        for zoom in layer.min_zoom..=layer.base_zoom {
            let (level, footprints) = extract.level(&layer.name, zoom)?;
            horizontal_error_m = footprints.iter().map(|f| f.horizontal_error_m).fold(horizontal_error_m, larger_error);
            levels.push(level);
        }
        layers.push(ManifestLayer::new(&layer, horizontal_error_m, levels));
    }
    let line =
        |r: &overfly_core::route::Route| r.points().iter().map(|p| [p.longitude_deg(), p.latitude_deg()]).collect();
    let route = ManifestRoute {
        lines_deg: request.routes.iter().map(line).collect(),
        corridor_m: request.corridor_m,
        widest_m: corridor.widest_m(),
        grown_by: request.drift.map(|d| json(&d.0)),
    };
    Ok(Manifest {
        format: Manifest::format(),
        name: request.name.clone(),
        serial: request.serial,
        store_format: overfly_store::FORMAT_VERSION,
        descriptor_contract: store.descriptor_contract().to_owned(),
        digest: extract.digest()?,
        cut_from: store.digest().to_owned(),
        layers,
        route,
        calibration: request.calibration.as_ref().map(json),
        dropped: dropped.to_vec(),
        valid_until: request.valid_until.map(|d| d.to_string()),
        signed_by: request.key.as_ref().map(|k| k.public().to_hex()),
    })
}

fn json(value: &impl Serialize) -> serde_json::Value {
    serde_json::to_value(value).expect("plain numbers serialise")
}

fn exported_levels(store: &Reader, chosen: &[LayerPart]) -> Result<Vec<ExportedLevel>, ExportError> {
    let mut parts = Vec::new();
    for part in chosen {
        let layer = store.layer(&part.name)?;
        for level in part.tiles.chunk_by(|a, b| a.zoom() == b.zoom()) {
            let mut bytes = store.sizes(layer, level.iter().copied())?;
            if !part.with_descriptors {
                bytes.descriptors = 0;
            }
            parts.push(ExportedLevel { layer: part.name.clone(), zoom: level[0].zoom(), tiles: level.len(), bytes });
        }
    }
    Ok(parts)
}

fn coverages(
    store: &Reader,
    request: &ExportRequest,
    chosen: &[LayerPart],
) -> Result<Vec<CorridorCoverage>, ExportError> {
    let layers = chosen.iter().map(|part| store.layer(&part.name)).collect::<Result<Vec<_>, _>>()?;
    let imagery = layers.into_iter().filter(|layer| layer.terrain.is_none());
    imagery.map(|layer| coverage(store, layer, request)).collect()
}
