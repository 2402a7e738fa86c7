//! The fuzzers' targets over their corpora and over mutations of them: a short run of what `cargo fuzz` does for hours.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;

#[path = "../../fuzz/targets.rs"]
mod targets;

const MUTATIONS: usize = 2000;

fn corpus(target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(target);
    let mut files: Vec<_> = folder.read_dir().unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    files.iter().map(|f| std::fs::read(f).unwrap()).collect()
}

/// A few bytes changed, a piece cut out, repeated or taken from another input.
fn mutated(inputs: &[Vec<u8>], rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = inputs[rng.random_range(0..inputs.len())].clone();
    for _ in 0..rng.random_range(1..6) {
        let at = rng.random_range(0..=bytes.len());
        let end = rng.random_range(at..=bytes.len().min(at + 64));
        match rng.random_range(0..5) {
            0 => drop(bytes.drain(at..end)),
            1 => bytes.truncate(at.max(1)),
            2 => {
                let piece = bytes[at..end].to_vec();
                bytes.splice(at..at, piece);
            }
            3 => {
                let other = &inputs[rng.random_range(0..inputs.len())];
                let from = rng.random_range(0..=other.len());
                bytes.splice(at..end, other[from..other.len().min(from + 32)].iter().copied());
            }
            _ => bytes[at..end].iter_mut().for_each(|b| *b = rng.random()),
        }
    }
    bytes
}

#[test]
fn nothing_that_is_read_panics() {
    for (name, target) in targets::TARGETS {
        let inputs = corpus(name);
        assert!(inputs.len() >= 2, "the corpus of {name} is missing");
        inputs.iter().for_each(|input| target(input));
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        (0..MUTATIONS).for_each(|_| target(&mutated(&inputs, &mut rng)));
    }
}
