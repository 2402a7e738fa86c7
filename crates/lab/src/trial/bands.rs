//! Exact bands of counts and of the mean NEES, for tests of predictions: quantiles, not estimates.

/// Above this many expected events a band uses the normal distribution; it then differs from the exact band by less
/// than a thousandth of its width.
const MOST_SUMMED: f64 = 2e6;

/// The least and the greatest count of `trials` independent events of probability `rate` with `confidence` (in (0,
/// 1)). On either side at most half of the rest lies outside. If the probabilities differ about a mean of `rate`, the
/// band is wider than necessary.
///
/// # References
/// Quantiles of the binomial distribution, summed term by term in logarithms. For unequal probabilities: Hoeffding
/// 1956, theorem 4.
pub fn count_band(trials: u64, rate: f64, confidence: f64) -> [u64; 2] {
    if rate <= 0.0 || trials == 0 {
        return [0, 0];
    }
    if rate >= 1.0 {
        return [trials, trials];
    }
    let outside = (1.0 - confidence) / 2.0;
    let mean = trials as f64 * rate;
    if mean.min(trials as f64 - mean) > MOST_SUMMED {
        let reach = normal_quantile(1.0 - outside) * (mean * (1.0 - rate)).sqrt();
        return [(mean - reach).floor() as u64, (mean + reach).ceil() as u64];
    }
    if rate > 0.5 {
        // Counts the events that do not happen; they are fewer.
        let [low, high] = count_band(trials, 1.0 - rate, confidence);
        return [trials - high, trials - low];
    }
    let odds_ln = rate.ln() - (-rate).ln_1p();
    let mut term_ln = trials as f64 * (-rate).ln_1p();
    let mut sum = term_ln.exp();
    let mut low = (sum > outside).then_some(0);
    for k in 1..=trials {
        if sum >= 1.0 - outside {
            return [low.unwrap_or(k - 1), k - 1];
        }
        term_ln += ((trials + 1 - k) as f64 / k as f64).ln() + odds_ln;
        sum += term_ln.exp();
        if low.is_none() && sum > outside {
            low = Some(k);
        }
    }
    [low.unwrap_or(trials), trials]
}

/// The band of the mean of `count` independent chi-square variables of two degrees of freedom, with `confidence`. The
/// mean NEES of `count` independent positions lies in it if their covariances are true.
///
/// # References
/// Their sum is at most x with the probability that a Poisson variable of mean x / 2 is at least `count`.
pub fn nees_band(count: u64, confidence: f64) -> [f64; 2] {
    let outside = (1.0 - confidence) / 2.0;
    let quantile = |chance: f64| {
        let (mut low, mut high) = (0.0, 2.0 * count as f64 + 40.0 * (count as f64).sqrt() + 60.0);
        for _ in 0..60 {
            let middle = (low + high) / 2.0;
            if poisson_below(count, middle / 2.0) > 1.0 - chance { low = middle } else { high = middle }
        }
        (low + high) / 2.0 / count as f64
    };
    [quantile(outside), quantile(1.0 - outside)]
}

/// Probability that a Poisson variable of a mean above 0 is below `count`.
fn poisson_below(count: u64, mean: f64) -> f64 {
    let mut term_ln = -mean;
    let mut sum = 0.0;
    for k in 0..count {
        if k > 0 {
            term_ln += (mean / k as f64).ln();
        }
        sum += term_ln.exp();
    }
    f64::min(sum, 1.0)
}

/// Quantile of the normal distribution for a probability in [0.5, 1), by bisection.
fn normal_quantile(chance: f64) -> f64 {
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        if 1.0 - upper_tail(middle) < chance { low = middle } else { high = middle }
    }
    (low + high) / 2.0
}

/// Probability that a standard normal variable is below x, to 7.5e-8.
pub fn chance_below(x: f64) -> f64 {
    if x < 0.0 { upper_tail(-x) } else { 1.0 - upper_tail(x) }
}

/// Probability that a standard normal variable exceeds x >= 0.
///
/// # References
/// Abramowitz and Stegun 26.2.17: to 7.5e-8.
fn upper_tail(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.231_641_9 * x);
    let polynomial =
        t * (0.319_381_530 + t * (-0.356_563_782 + t * (1.781_477_937 + t * (-1.821_255_978 + t * 1.330_274_429))));
    (-x * x / 2.0).exp() / std::f64::consts::TAU.sqrt() * polynomial
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_agree_with_scipy() {
        // scipy.stats.binom.ppf([0.025, 0.975], n, p); its lower quantile is the least k with P(<= k) >= 0.025.
        assert_eq!(count_band(1000, 0.003, 0.95), [0, 7]);
        assert_eq!(count_band(400, 0.95, 0.95), [371, 388]);
        assert_eq!(count_band(20_000, 0.05, 0.95), [940, 1061]);
        assert_eq!(count_band(9_960_000, 4.016_064_257e-4, 0.95), [3877, 4124]);
        assert_eq!(count_band(0, 0.3, 0.95), [0, 0]);
        assert_eq!((count_band(7, 0.0, 0.9), count_band(7, 1.0, 0.9)), ([0, 0], [7, 7]));
    }

    #[test]
    fn very_many_events_follow_the_normal_distribution() {
        // scipy.stats.binom.ppf([0.025, 0.975], 100_000_000, 0.05) = [4995729, 5004272]
        let [low, high] = count_band(100_000_000, 0.05, 0.95);
        assert!(low.abs_diff(4_995_729) <= 2 && high.abs_diff(5_004_272) <= 2, "{low} {high}");
    }

    #[test]
    fn nees_agrees_with_scipy() {
        // scipy.stats.chi2.ppf([0.025, 0.975], 800) / 400 and chi2.ppf([0.0005, 0.9995], 40) / 20
        let near = |found: [f64; 2], low: f64, high: f64| {
            assert!((found[0] - low).abs() < 1e-5 && (found[1] - high).abs() < 1e-5, "{found:?}");
        };
        near(nees_band(400, 0.95), 1.808_781, 2.200_688);
        near(nees_band(20, 0.999), 0.845_311, 3.804_730);
    }
}
