//! Faults of a memory card and its file while they are in use.

use super::client::{HttpClient, ServedStore};
use super::question::{AnswerVerdict, QuestionKind, Questions, judge_answer};
use overfly_core::tile::TileId;
use overfly_store::Reader;
use std::collections::BTreeSet;
use std::fs::{File, Permissions};
use std::os::unix::fs::{FileExt, PermissionsExt};
use std::path::Path;

/// Flips one bit of a tile's imagery in the file. The file keeps its date, as on a card that rots.
pub struct BitRot {
    sound: Vec<u8>,
}

impl BitRot {
    /// Reads the store at `path` while it is sound.
    pub fn read(path: &Path) -> Self {
        Self { sound: std::fs::read(path).expect("the rig reads and writes its own files") }
    }

    /// Damages some base tiles of the sound store `from` in its copy `path`, none of `spared`; `seed` chooses them.
    pub fn damage(
        &self,
        from: &Path,
        path: &Path,
        count: usize,
        seed: usize,
        spared: &dyn Fn(TileId) -> bool,
    ) -> BTreeSet<TileId> {
        let reader = Reader::open(from).expect("the sound store opens");
        let layer = &reader.layers()[0];
        let base = reader.footprints(layer, layer.base_zoom).expect("the sound store reads");
        let candidates: Vec<TileId> = base.iter().map(|f| f.tile).filter(|t| !spared(*t)).collect();
        let mut damaged = BTreeSet::new();
        for k in 0..count.min(candidates.len()) {
            let tile = candidates[(seed + k * 7) % candidates.len()];
            let image =
                reader.encoded_tile(layer, tile).expect("the sound store reads").expect("it has the tile").bytes;
            let needle = &image[image.len() / 2..image.len() / 2 + 40];
            // The same picture can stand under several names; all of them are damaged then.
            let places: Vec<usize> = find_all(&self.sound, needle);
            let file =
                File::options().write(true).read(true).open(path).expect("the rig reads and writes its own files");
            let date = file
                .metadata()
                .expect("the rig reads and writes its own files")
                .modified()
                .expect("the rig reads and writes its own files");
            for at in places {
                file.write_all_at(&[self.sound[at] ^ 8], at as u64).expect("the rig reads and writes its own files");
            }
            file.set_modified(date).expect("the rig reads and writes its own files");
            damaged.extend(base.iter().map(|f| f.tile).filter(|t| {
                *t == tile
                    || reader.encoded_tile(layer, *t).expect("the sound store reads").expect("it has the tile").bytes
                        == image
            }));
        }
        damaged
    }
}

fn find_all(bytes: &[u8], needle: &[u8]) -> Vec<usize> {
    let first = needle[0];
    (0..bytes.len() - needle.len())
        .filter(|&at| bytes[at] == first && &bytes[at..at + needle.len()] == needle)
        .collect()
}

/// A fault of the file under a running service.
#[derive(Debug, Clone, Copy)]
pub enum FileFault {
    Removed,
    Replaced,
    Truncated,
    Unreadable,
}

pub const FAULTS: [FileFault; 4] =
    [FileFault::Removed, FileFault::Replaced, FileFault::Truncated, FileFault::Unreadable];

/// Whether file permissions bind this process.
pub fn permissions_bind(path: &Path) -> bool {
    File::open(path).is_err()
}

/// Applies a fault to the store at `path`, asks, heals the store and starts the service again. Returns the number of
/// requests and what went wrong.
pub fn endure(
    fault: FileFault,
    sound: &Path,
    path: &Path,
    questions: &Questions,
    start: &dyn Fn() -> Result<ServedStore, String>,
) -> (u64, Vec<String>) {
    let mut wrong = Vec::new();
    let mut serving = match start() {
        Ok(serving) => serving,
        Err(why) => return (0, vec![format!("{fault:?}: it does not start: {why}")]),
    };
    let mut client = serving.client();
    let mut asked = inquire(&mut client, questions, &format!("before {fault:?}"), false, &mut wrong);
    let is_ready = injure(fault, sound, path);
    asked += inquire(&mut client, questions, &format!("{fault:?}"), true, &mut wrong);
    let readiness = client.get("/readyz");
    match &readiness {
        Ok(reply) if (reply.status == 200) == is_ready && (reply.status == 200 || !reply.code().is_empty()) => {}
        Ok(reply) => wrong.push(format!("{fault:?}: /readyz says {}", reply.status)),
        Err(error) => wrong.push(format!("{fault:?}: /readyz: {error}")),
    }
    match client.get("/healthz") {
        Ok(reply) if reply.status == 200 => {}
        _ => wrong.push(format!("{fault:?}: /healthz does not answer")),
    }
    if !serving.lives() {
        wrong.push(format!("{fault:?}: the service ended"));
    }
    drop(serving);
    heal(sound, path);
    match start() {
        Ok(serving) => {
            asked += inquire(&mut serving.client(), questions, &format!("after {fault:?}"), false, &mut wrong)
        }
        Err(why) => wrong.push(format!("after {fault:?}: it does not start: {why}")),
    }
    (asked + 2, wrong)
}

/// Applies a fault. Returns whether the service should still be ready.
fn injure(fault: FileFault, sound: &Path, path: &Path) -> bool {
    match fault {
        FileFault::Removed => std::fs::remove_file(path).expect("the rig reads and writes its own files"),
        FileFault::Replaced => {
            let other = path.with_extension("other");
            std::fs::copy(sound, &other).expect("the rig reads and writes its own files");
            std::fs::rename(other, path).expect("the rig reads and writes its own files");
            // What is there now is as sound as what was there: the service opens it.
            return true;
        }
        FileFault::Truncated => {
            let file = File::options().write(true).open(path).expect("the rig reads and writes its own files");
            file.set_len(file.metadata().expect("the rig reads and writes its own files").len() / 2)
                .expect("the rig reads and writes its own files");
        }
        FileFault::Unreadable => {
            std::fs::set_permissions(path, Permissions::from_mode(0o000))
                .expect("the rig reads and writes its own files");
            // Root can read any file.
            return !permissions_bind(path);
        }
    }
    false
}

fn heal(sound: &Path, path: &Path) {
    // The file may be absent.
    let _ = std::fs::remove_file(path);
    std::fs::copy(sound, path).expect("the rig reads and writes its own files");
}

/// Asks some questions of each kind. While `injured`, an error (5xx) is as right as a right answer.
fn inquire(client: &mut HttpClient, questions: &Questions, when: &str, injured: bool, wrong: &mut Vec<String>) -> u64 {
    let mut asked = 0;
    for (kind, count) in [
        (QuestionKind::Tile, 12),
        (QuestionKind::Candidates, 12),
        (QuestionKind::Descriptors, 4),
        (QuestionKind::Fix, 2),
        (QuestionKind::Malformed, 4),
    ] {
        for index in 0..count {
            let question = questions.get(kind, index * 5);
            asked += 1;
            match client.send(&question.request) {
                Err(error) => wrong.push(format!("{when}: {kind:?}: {error}")),
                Ok(reply) => match judge_answer(question, &reply) {
                    AnswerVerdict::Wrong(why) if !(injured && reply.status >= 500 && !reply.code().is_empty()) => {
                        wrong.push(format!("{when}: {why}"));
                    }
                    _ => {}
                },
            }
        }
    }
    asked
}
