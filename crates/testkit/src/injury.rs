//! Injuries to an exported store, and what `verify` and the aircraft make of each. The tests use a few, the example
//! `injure_store` many.

use overfly_core::feature::{CELLS, CellMap, CellWindow};
use overfly_store::package::{Date, VerifyOptions, open_onboard, verify_package};
use overfly_store::{Footprint, Layer, Reader, StoredTile};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use std::collections::BTreeMap;
use std::os::unix::fs::FileExt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;

/// An injury to a store.
#[derive(Debug, Clone)]
pub enum Injury {
    /// One bit is flipped.
    Flip { at: usize, bit: u8 },
    /// The file ends here.
    Truncation { len: usize },
    /// Two pages are swapped.
    Swap { pages: [usize; 2] },
}

/// The results of injuries.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
pub struct InjuryTally {
    pub injuries: u64,
    /// `verify`: not good, exit code 3.
    pub not_good: u64,
    /// `verify`: not a store, exit code 2.
    pub no_store: u64,
    /// The onboard service refused to start.
    pub refused_onboard: u64,
    /// The onboard service started and gave up some tiles.
    pub degraded: u64,
    /// Injuries that `verify` missed, panics, and wrong answers. There must be none.
    pub failures: Vec<String>,
}

/// The answers of a sound store.
pub struct SoundStore {
    bytes: Vec<u8>,
    page: usize,
    layers: Vec<Layer>,
    footprints: BTreeMap<(String, u8), Vec<Footprint>>,
    tiles: Vec<(Layer, StoredTile)>,
    cells: BTreeMap<(String, u8), Arc<CellMap>>,
}

/// A day on which no store of a test has expired.
pub fn a_day() -> Date {
    Date::constant(2026, 11, 22)
}

impl SoundStore {
    /// Reads all answers of the store at `path`.
    pub fn read(path: &Path) -> Self {
        let reader = Reader::open(path).expect("the sound store opens");
        let (mut footprints, mut tiles, mut cells) = (BTreeMap::new(), Vec::new(), BTreeMap::new());
        for layer in reader.layers() {
            for zoom in layer.min_zoom..=layer.base_zoom {
                let key = (layer.name.clone(), zoom);
                let of_level = reader.footprints(layer, zoom).expect("the sound store reads");
                for footprint in &of_level {
                    tiles.push((
                        layer.clone(),
                        reader
                            .stored_tile(layer, footprint.tile)
                            .expect("the sound store reads")
                            .expect("it has the tile"),
                    ));
                }
                footprints.insert(key.clone(), of_level);
                cells.insert(key, reader.cells(layer, zoom, 1).expect("the sound store reads"));
            }
        }
        let bytes = std::fs::read(path).expect("the rig reads and writes its own files");
        let page = usize::from(u16::from_be_bytes([bytes[16], bytes[17]]));
        Self { bytes, page, layers: reader.layers().to_vec(), footprints, tiles, cells }
    }

    /// Draws injuries of each kind. Half of the flips hit pages that are nodes of a tree, not overflow pages: there
    /// are few of these, and they lead everywhere.
    pub fn injuries(&self, flips: usize, truncations: usize, swaps: usize, seed: u64) -> Vec<Injury> {
        let mut dice = StdRng::seed_from_u64(seed);
        let pages = self.bytes.len() / self.page;
        let is_node = |p: &usize| {
            let first = self.bytes[p * self.page + if *p == 0 { 100 } else { 0 }];
            [2, 5, 10, 13].contains(&first)
        };
        let nodes: Vec<usize> = (0..pages).filter(is_node).collect();
        let mut injuries = Vec::new();
        for flip in 0..flips {
            let anywhere = dice.random_range(0..self.bytes.len());
            let within = dice.random_range(0..self.page);
            let node = nodes[dice.random_range(0..nodes.len())];
            let at = if flip % 2 == 0 { anywhere } else { node * self.page + within };
            injuries.push(Injury::Flip { at, bit: dice.random_range(0..8) });
        }
        for truncation in 0..truncations {
            // Alternately at the end of a page, where nothing is cut in two, and anywhere.
            let len = dice.random_range(0..self.bytes.len());
            let len = if truncation % 2 == 0 { len / self.page * self.page } else { len };
            injuries.push(Injury::Truncation { len });
        }
        let page = |p: usize| &self.bytes[p * self.page..(p + 1) * self.page];
        while injuries.len() < flips + truncations + swaps {
            let pages = [dice.random_range(0..pages), dice.random_range(0..pages)];
            if page(pages[0]) != page(pages[1]) {
                injuries.push(Injury::Swap { pages });
            }
        }
        injuries
    }

    /// Applies each injury to a copy at `path`, asks all questions, and heals the copy.
    pub fn endure(
        &self,
        path: &Path,
        injuries: &[Injury],
        mut each: impl FnMut(&Path, &mut InjuryTally),
    ) -> InjuryTally {
        std::fs::write(path, &self.bytes).expect("the rig reads and writes its own files");
        let mut tally = InjuryTally::default();
        for injury in injuries {
            self.injure(path, injury);
            tally.injuries += 1;
            self.verify(path, injury, &mut tally);
            self.fly(path, injury, &mut tally);
            each(path, &mut tally);
            self.heal(path, injury);
        }
        assert_eq!(std::fs::read(path).expect("the rig reads and writes its own files"), self.bytes, "healed");
        tally
    }

    fn injure(&self, path: &Path, injury: &Injury) {
        let file = std::fs::File::options().write(true).open(path).expect("the rig reads and writes its own files");
        match *injury {
            Injury::Flip { at, bit } => file
                .write_all_at(&[self.bytes[at] ^ (1 << bit)], at as u64)
                .expect("the rig reads and writes its own files"),
            Injury::Truncation { len } => file.set_len(len as u64).expect("the rig reads and writes its own files"),
            Injury::Swap { pages: [a, b] } => {
                let page = |p: usize| &self.bytes[p * self.page..(p + 1) * self.page];
                file.write_all_at(page(b), (a * self.page) as u64).expect("the rig reads and writes its own files");
                file.write_all_at(page(a), (b * self.page) as u64).expect("the rig reads and writes its own files");
            }
        }
    }

    fn heal(&self, path: &Path, injury: &Injury) {
        let file = std::fs::File::options().write(true).open(path).expect("the rig reads and writes its own files");
        let restore = |from: usize, len: usize| {
            file.write_all_at(&self.bytes[from..from + len], from as u64)
                .expect("the rig reads and writes its own files")
        };
        match *injury {
            Injury::Flip { at, .. } => restore(at, 1),
            Injury::Truncation { len } => restore(len, self.bytes.len() - len),
            Injury::Swap { pages } => pages.iter().for_each(|p| restore(p * self.page, self.page)),
        }
    }

    /// `verify` must reject the store with 3 or 2, and must not panic.
    fn verify(&self, path: &Path, injury: &Injury, tally: &mut InjuryTally) {
        let options = VerifyOptions { key: None, today: a_day(), every_tile: false };
        match catch_unwind(AssertUnwindSafe(|| verify_package(path, &options, &|_, _| ()))) {
            Err(_) => tally.failures.push(format!("verify panics on {injury:?}")),
            Ok(Ok(found)) if found.store.ok => tally.failures.push(format!("verify misses {injury:?}")),
            Ok(Ok(_)) => tally.not_good += 1,
            Ok(Err(error)) if error.is_unusable_input() => tally.no_store += 1,
            Ok(Err(_)) => tally.not_good += 1,
        }
    }

    /// The onboard service, without `verify`, must give no wrong answer.
    fn fly(&self, path: &Path, injury: &Injury, tally: &mut InjuryTally) {
        let flown = catch_unwind(AssertUnwindSafe(|| match open_onboard(path, None, &[], a_day()) {
            Err(_) => Ok(None),
            Ok(onboard) => self.ask(&onboard.store).map(|()| Some(onboard.store.damage().tiles)),
        }));
        match flown {
            Err(_) => tally.failures.push(format!("onboard panics on {injury:?}")),
            Ok(Err(wrong)) => tally.failures.push(format!("{wrong} after {injury:?}")),
            Ok(Ok(None)) => tally.refused_onboard += 1,
            Ok(Ok(Some(damaged))) => tally.degraded += u64::from(damaged > 0),
        }
    }

    /// Asks every question that a service asks a store; each answer must be right or an error.
    fn ask(&self, store: &Reader) -> Result<(), String> {
        if store.layers() != self.layers {
            return Err("other layers".into());
        }
        for ((name, zoom), expected) in &self.footprints {
            let layer = store.layer(name).map_err(|e| e.to_string())?;
            if store.footprints(layer, *zoom).is_ok_and(|found| found != *expected) {
                return Err(format!("other footprints of zoom {zoom}"));
            }
            let everywhere = layer_bounds(expected);
            if store.footprints_in(layer, *zoom, &everywhere).is_ok_and(|found| found != *expected) {
                return Err(format!("the R-tree gives other footprints of zoom {zoom}"));
            }
            if let Ok(found) = store.cells(layer, *zoom, 1) {
                same_cells(&found, &self.cells[&(name.clone(), *zoom)])?;
            }
        }
        for (layer, expected) in &self.tiles {
            match store.stored_tile(layer, expected.footprint.tile) {
                Ok(Some(found)) if found == *expected => {}
                Err(_) => {}
                Ok(_) => return Err(format!("another tile {}", expected.footprint.tile)),
            }
        }
        Ok(())
    }
}

fn layer_bounds(footprints: &[Footprint]) -> overfly_core::tile::MercatorBounds {
    let all = footprints.iter().map(|f| f.tile.mercator_bounds());
    all.reduce(|a, b| overfly_core::tile::MercatorBounds {
        min_x_m: a.min_x_m.min(b.min_x_m),
        min_y_m: a.min_y_m.min(b.min_y_m),
        max_x_m: a.max_x_m.max(b.max_x_m),
        max_y_m: a.max_y_m.max(b.max_y_m),
    })
    .expect("the rig reads and writes its own files")
}

/// Checks that each found block has the expected cells. Blocks may be missing.
fn same_cells(found: &CellMap, expected: &CellMap) -> Result<(), String> {
    let cut = |map: &CellMap, [column, row]: [i64; 2]| {
        let mut window = CellWindow::new(CELLS, CELLS);
        map.cut(column * CELLS as i64, row * CELLS as i64, &mut window);
        (window.cells, window.energies)
    };
    for &block in found.blocks() {
        if !expected.blocks().contains(&block) || cut(found, block) != cut(expected, block) {
            return Err(format!("other cells of {block:?}"));
        }
    }
    Ok(())
}
