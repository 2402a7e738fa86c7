//! A soak: the onboard service under many mixed requests with faults, with every answer checked and its memory
//! measured. The tests use a short soak, the example `soak` a long one.

pub mod client;
pub mod fault;
mod malformed;
pub mod question;
pub mod run;

use client::ServedStore;
use fault::BitRot;
use overfly_core::tile::TileId;
use question::Questions;
use run::SoakTally;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// The memory of the process at one moment.
#[derive(Debug, Clone, Copy)]
pub struct MemoryReading {
    pub asked: u64,
    /// Resident memory once all requests have their answers.
    pub resident_kb: u64,
    /// Mean resident memory since the last reading, over time.
    pub mean_resident_kb: u64,
    pub most_resident_kb: u64,
}

/// The result of a soak.
pub struct SoakResult {
    pub tally: SoakTally,
    pub readings: Vec<MemoryReading>,
    pub lives: bool,
}

/// The options of a soak.
pub struct SoakPlan<'a> {
    pub requests: u64,
    pub connections: u64,
    pub seed: u64,
    /// The served store and the sound one that it is a copy of, if tiles rot during the soak.
    pub rotting: Option<(&'a Path, &'a Path)>,
    /// Whether the ground of the requested fixes stays sound, so that all are found.
    pub spares_landscape: bool,
}

/// Sends all requests. Memory is measured after 1, 10, 50 and 100 % of them, and more tiles rot before the last two.
pub fn soak(serving: &mut ServedStore, questions: &Questions, plan: &SoakPlan<'_>) -> SoakResult {
    let rot = plan.rotting.map(|(_, sound)| BitRot::read(sound));
    let mut damaged: BTreeSet<TileId> = BTreeSet::new();
    let (mut tally, mut readings) = (SoakTally::default(), Vec::new());
    let mut from = 0;
    for percent in [1, 10, 50, 100] {
        let to = plan.requests * percent / 100;
        if let (Some(rot), Some((path, sound))) = (&rot, plan.rotting) {
            let count = if percent >= 50 { 3 } else { 1 };
            damaged.extend(rot.damage(sound, path, count, percent as usize * 31, &|tile| {
                plan.spares_landscape && is_landscape(tile)
            }));
        }
        let (asking, watched_by) = (AtomicBool::new(true), &*serving);
        let (asked, mean_resident_kb) = std::thread::scope(|scope| {
            let watched = scope.spawn(|| mean_resident_kb(watched_by, &asking));
            let asked = run::ask(watched_by, questions, &damaged, from..to, plan.connections, plan.seed);
            asking.store(false, Ordering::Relaxed);
            (asked, watched.join().expect("the thread does not panic"))
        });
        tally = tally.with(asked);
        // Lets requests that clients abandoned end.
        std::thread::sleep(Duration::from_secs(1));
        readings.push(MemoryReading {
            asked: to,
            resident_kb: serving.memory_kb("VmRSS"),
            mean_resident_kb,
            most_resident_kb: serving.memory_kb("VmHWM"),
        });
        from = to;
    }
    SoakResult { tally, readings, lives: serving.lives() }
}

/// Mean resident memory, measured ten times a second while requests are sent.
fn mean_resident_kb(serving: &ServedStore, asking: &AtomicBool) -> u64 {
    let (mut sum, mut count) = (0, 0);
    while count == 0 || asking.load(Ordering::Relaxed) {
        sum += serving.memory_kb("VmRSS");
        count += 1;
        std::thread::sleep(Duration::from_millis(100));
    }
    sum / count
}

/// Whether a tile belongs to the ground of the requested fixes.
fn is_landscape(tile: TileId) -> bool {
    let c = tile.centre();
    (48.47..48.51).contains(&c.latitude_deg()) && (15.58..15.65).contains(&c.longitude_deg())
}
