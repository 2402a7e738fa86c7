//! Which pairs of matches become hypotheses.

/// A small seeded generator (xorshift, Marsaglia 2003): the same numbers on every machine.
#[derive(Debug, Clone)]
pub struct Xorshift {
    state: u32,
}

impl Xorshift {
    /// A generator with a seed other than 0.
    pub fn new(seed: u32) -> Self {
        Self { state: seed }
    }

    /// The next number below `count`.
    pub fn below(&mut self, count: usize) -> usize {
        self.state ^= self.state << 13;
        self.state ^= self.state >> 17;
        self.state ^= self.state << 5;
        self.state as usize % count
    }

    /// Two different numbers below `count`, which must be at least 2.
    pub fn two_below(&mut self, count: usize) -> (usize, usize) {
        let i = self.below(count);
        loop {
            let j = self.below(count);
            if j != i {
                return (i, j);
            }
        }
    }
}

/// Number of pairs of `count` matches.
pub fn pair_count(count: usize) -> usize {
    count * count.saturating_sub(1) / 2
}

/// Pair `k` of `count` matches in the order (0, 1), (0, 2), ..., (1, 2), ...
pub fn nth_pair(mut k: usize, count: usize) -> (usize, usize) {
    for i in 0..count {
        let row = count - 1 - i;
        if k < row {
            return (i, i + 1 + k);
        }
        k -= row;
    }
    (0, 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_pairs_come_once_and_in_order() {
        let pairs: Vec<_> = (0..pair_count(5)).map(|k| nth_pair(k, 5)).collect();
        let expected: Vec<_> = (0..5).flat_map(|i| (i + 1..5).map(move |j| (i, j))).collect();
        assert_eq!(pairs, expected);
        assert_eq!((pair_count(0), pair_count(1), pair_count(2)), (0, 0, 1));
    }

    #[test]
    fn draws_differ_and_repeat_with_the_seed() {
        let draws = |seed| {
            let mut draw = Xorshift::new(seed);
            (0..50).map(|_| draw.two_below(3)).collect::<Vec<_>>()
        };
        assert!(draws(7).iter().all(|(i, j)| i != j && *i < 3 && *j < 3));
        assert!(draws(7) == draws(7) && draws(7) != draws(8));
    }
}
