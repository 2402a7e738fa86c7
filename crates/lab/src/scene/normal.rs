//! `normal`: a standard normal number.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Twelve uniform numbers less six: near enough to normal, and the same on every machine.
pub fn normal(rng: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0
}
