//! The rank score: how high a value of a correlation surface stands among all values of that surface, whatever the texture.

/// The mean score by chance, and the score of a displacement that was not searched or where the map shows nothing.
pub const MEAN_RANK_SCORE: f32 = 1.0;

/// Correlation where the map shows nothing.
const NOTHING_SHOWN: f32 = 0.0;

/// Minus the natural logarithm of each value's rank share among all values: exponential with mean 1 by chance, whatever the values'
/// distribution. Displacements where the map shows nothing, whose correlation is 0, have no rank: they score the mean.
pub fn rank_scores(values: &[f32]) -> Vec<f32> {
    let mut order: Vec<usize> = (0..values.len()).filter(|&i| values[i] != NOTHING_SHOWN).collect();
    order.sort_unstable_by(|&a, &b| values[b].total_cmp(&values[a]).then(a.cmp(&b)));
    let mut scores = vec![MEAN_RANK_SCORE; values.len()];
    for (rank, &i) in order.iter().enumerate() {
        scores[i] = -((rank as f32 + 0.5) / order.len() as f32).ln();
    }
    scores
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scores_have_the_mean_of_chance_and_the_order_of_the_values() {
        let values: Vec<f32> = (0..289).map(|i| ((i * 37) % 289 + 1) as f32).collect();
        let scores = rank_scores(&values);
        let mean = scores.iter().sum::<f32>() / 289.0;
        assert!((mean - MEAN_RANK_SCORE).abs() < 0.01, "{mean}");
        assert_eq!(
            scores.iter().copied().fold(0.0, f32::max),
            scores[values.iter().position(|&v| v == 289.0).unwrap()]
        );
    }

    #[test]
    fn ground_without_a_map_votes_for_nothing() {
        assert_eq!(rank_scores(&[0.0; 25]), [MEAN_RANK_SCORE; 25]);
        let scores = rank_scores(&[0.0, -0.2, 0.0, -0.1]);
        assert_eq!((scores[0], scores[2]), (MEAN_RANK_SCORE, MEAN_RANK_SCORE));
        assert!(scores[3] > MEAN_RANK_SCORE && scores[1] < MEAN_RANK_SCORE);
    }
}
