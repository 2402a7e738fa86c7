//! The rank score: how high a value of a correlation surface stands among all values of that surface, whatever the texture.

/// The mean score by chance, and the score of a displacement that was not searched or where the map shows nothing.
pub const MEAN_RANK_SCORE: f32 = 1.0;

/// Correlation where the map shows nothing.
const NOTHING_SHOWN: f32 = 0.0;

/// Scores the values of surfaces by their ranks.
///
/// A score is minus the natural logarithm of the value's rank share among all values: exponential with mean 1 by chance, whatever the values'
/// distribution. Displacements where the map shows nothing, whose correlation is 0, have no rank: they score the mean.
#[derive(Debug, Default)]
pub struct RankScorer {
    /// Values in an order of integers, the highest first, with their places.
    order: Vec<u64>,
    /// The score of each rank among `of_rank.len()` values.
    of_rank: Vec<f32>,
}

impl RankScorer {
    /// The score of each value.
    pub fn scores(&mut self, values: &[f32]) -> Vec<f32> {
        let shown = values.iter().zip(0u64..).filter(|&(value, _)| *value != NOTHING_SHOWN);
        self.order.clear();
        self.order.extend(shown.map(|(&value, place)| u64::from(!ordered(value)) << 32 | place));
        self.order.sort_unstable();
        let ranked = self.order.len();
        if self.of_rank.len() != ranked {
            self.of_rank = (0..ranked).map(|rank| -((rank as f32 + 0.5) / ranked as f32).ln()).collect();
        }
        let mut scores = vec![MEAN_RANK_SCORE; values.len()];
        for (place, &score) in self.order.iter().zip(&self.of_rank) {
            scores[(place & u64::from(u32::MAX)) as usize] = score;
        }
        scores
    }
}

/// An integer that is greater for a greater value, as [`f32::total_cmp`] orders them.
fn ordered(value: f32) -> u32 {
    let bits = value.to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scores_have_the_mean_of_chance_and_the_order_of_the_values() {
        let values: Vec<f32> = (0..289).map(|i| ((i * 37) % 289 + 1) as f32).collect();
        let scores = RankScorer::default().scores(&values);
        let mean = scores.iter().sum::<f32>() / 289.0;
        assert!((mean - MEAN_RANK_SCORE).abs() < 0.01, "{mean}");
        assert_eq!(
            scores.iter().copied().fold(0.0, f32::max),
            scores[values.iter().position(|&v| v == 289.0).unwrap()]
        );
    }

    #[test]
    fn ground_without_a_map_votes_for_nothing() {
        assert_eq!(RankScorer::default().scores(&[0.0; 25]), [MEAN_RANK_SCORE; 25]);
        let scores = RankScorer::default().scores(&[0.0, -0.2, 0.0, -0.1]);
        assert_eq!((scores[0], scores[2]), (MEAN_RANK_SCORE, MEAN_RANK_SCORE));
        assert!(scores[3] > MEAN_RANK_SCORE && scores[1] < MEAN_RANK_SCORE);
    }

    #[test]
    fn integers_order_values_as_they_are_ordered() {
        let mut values = [0.3, -0.0, 0.0, -7.5, 1e-30, f32::INFINITY, -1e-30, f32::NEG_INFINITY];
        values.sort_by_key(|&value| ordered(value));
        assert!(values.is_sorted_by(|a, b| a.total_cmp(b).is_lt()));
    }
}
