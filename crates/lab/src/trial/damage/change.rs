//! `FileChange`: the ways in which a file's bytes are changed.

use rand::Rng;
use serde::Serialize;

/// A change of a file's bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FileChange {
    /// A run of bytes is 0, as after a lost packet or page.
    Zeroed,
    /// The file ends early.
    Cut,
    /// Two pieces of equal length have changed places.
    Swapped,
    /// One to eight bits are flipped.
    Flipped,
    /// A run of bytes is random.
    Overwritten,
    /// A run of bytes is missing.
    Removed,
    /// A piece of the file stands in it twice.
    Repeated,
    /// Harmless: bytes follow the end of the file.
    Trailing,
    /// Harmless: a few bytes stand before every restart marker of a JPEG, as webcams write them.
    RestartJunk,
    /// Harmless: a JPEG has segments that no decoder knows.
    Segments,
}

impl FileChange {
    /// All, those that damage first.
    pub const ALL: [Self; 10] = [
        Self::Zeroed,
        Self::Cut,
        Self::Swapped,
        Self::Flipped,
        Self::Overwritten,
        Self::Removed,
        Self::Repeated,
        Self::Trailing,
        Self::RestartJunk,
        Self::Segments,
    ];

    /// Its word in files and JSON.
    pub fn word(self) -> &'static str {
        match self {
            Self::Zeroed => "zeroed",
            Self::Cut => "cut",
            Self::Swapped => "swapped",
            Self::Flipped => "flipped",
            Self::Overwritten => "overwritten",
            Self::Removed => "removed",
            Self::Repeated => "repeated",
            Self::Trailing => "trailing",
            Self::RestartJunk => "restart_junk",
            Self::Segments => "segments",
        }
    }

    /// Whether the frame must be read as before.
    pub fn is_harmless(self) -> bool {
        matches!(self, Self::Trailing | Self::RestartJunk | Self::Segments)
    }

    /// Changes a file; the first eight bytes, by which formats are known, stay.
    pub fn applied(self, file: &[u8], rng: &mut impl Rng) -> Vec<u8> {
        const KEPT: usize = 8;
        let mut bytes = file.to_vec();
        let room = bytes.len().saturating_sub(KEPT + 1).max(1);
        let length = run_length(room / 2, rng);
        let start = (KEPT + rng.random_range(0..=room - length.min(room))).min(bytes.len());
        let end = (start + length).min(bytes.len());
        match self {
            Self::Zeroed => bytes[start..end].fill(0),
            Self::Cut => bytes.truncate(KEPT + rng.random_range(0..room)),
            Self::Swapped => {
                let other = KEPT + rng.random_range(0..=room - length.min(room));
                (0..length)
                    .filter(|i| start.max(other) + i < file.len())
                    .for_each(|i| bytes.swap(start + i, other + i));
            }
            Self::Flipped => {
                for _ in 0..rng.random_range(1..=8) {
                    let at = KEPT + rng.random_range(0..room);
                    bytes[at] ^= 1 << rng.random_range(0..8);
                }
            }
            Self::Overwritten => rng.fill(&mut bytes[start..end]),
            Self::Removed => drop(bytes.drain(start..end)),
            Self::Repeated => {
                let piece = bytes[start..end].to_vec();
                bytes.splice(end..end, piece);
            }
            Self::Trailing => bytes.extend((0..length).map(|_| rng.random::<u8>())),
            Self::RestartJunk => bytes = with_restart_junk(file, rng),
            Self::Segments => {
                let content = vec![rng.random::<u8>() | 1; rng.random_range(0..2000)];
                let head = [0xff, 0xe0 | rng.random_range(2..12u8)];
                let size = (content.len() as u16 + 2).to_be_bytes();
                bytes.splice(2..2, [&head[..], &size, &content].concat());
            }
        }
        bytes
    }
}

/// A length from 1 to 4096 bytes, all orders of magnitude alike.
fn run_length(most: usize, rng: &mut impl Rng) -> usize {
    let bits = f64::from((most.clamp(1, 4096) as u32).ilog2());
    (rng.random_range(0.0..=bits).exp2() as usize).clamp(1, most.max(1))
}

/// Puts one to eight bytes before every restart marker.
fn with_restart_junk(file: &[u8], rng: &mut impl Rng) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(file.len() * 2);
    for (i, &byte) in file.iter().enumerate() {
        if byte == 0xff && matches!(file.get(i + 1), Some(0xd0..=0xd7)) {
            bytes.extend((0..rng.random_range(1..=8)).map(|_| rng.random_range(0..0xffu8)));
        }
        bytes.push(byte);
    }
    bytes
}

impl std::str::FromStr for FileChange {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, Self::Err> {
        let words = || Self::ALL.map(Self::word).join(", ");
        Self::ALL.into_iter().find(|c| c.word() == word).ok_or_else(|| format!("one of {}", words()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn every_change_changes_bytes_and_keeps_the_first() {
        let file: Vec<u8> = (0..9000u32).map(|i| (i * i % 253) as u8).chain([0xff, 0xd3, 7]).collect();
        for change in FileChange::ALL {
            for seed in 0..50 {
                let changed = change.applied(&file, &mut ChaCha8Rng::seed_from_u64(seed));
                assert!(changed[..2] == file[..2] && changed != file || change == FileChange::Swapped, "{change:?}");
                assert_eq!(changed, change.applied(&file, &mut ChaCha8Rng::seed_from_u64(seed)));
            }
            assert_eq!(change.word().parse(), Ok(change));
            assert_eq!(serde_json::to_value(change).unwrap(), change.word());
        }
    }

    #[test]
    fn tiny_files_do_not_stop_it() {
        for change in FileChange::ALL {
            for length in 2..20 {
                change.applied(&vec![9; length + 8], &mut ChaCha8Rng::seed_from_u64(1));
            }
        }
    }
}
