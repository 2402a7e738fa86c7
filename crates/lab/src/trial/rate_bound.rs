//! Exact bounds on a rate from a count.

/// The one-sided 95 % upper bound on a rate (Clopper and Pearson): the largest rate under which `count` or fewer of
/// `trials` have a probability of 5 %. For a count of zero about 3 / `trials` (the rule of three); 1 without trials.
pub fn upper95(count: usize, trials: usize) -> f64 {
    if count >= trials {
        return 1.0;
    }
    bisected(|rate| at_most(count, trials, rate) > 0.05)
}

/// The one-sided 95 % lower bound on a rate: the smallest rate under which `count` or more of `trials` have a
/// probability of 5 %; 0 for a count of zero.
pub fn lower95(count: usize, trials: usize) -> f64 {
    if count == 0 || trials == 0 {
        return 0.0;
    }
    bisected(|rate| 1.0 - at_most(count - 1, trials, rate) < 0.05)
}

/// The rate in [0, 1] up to which a property holds.
fn bisected(holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        if holds(middle) { low = middle } else { high = middle }
    }
    (low + high) / 2.0
}

/// Probability of at most `count` of `trials` events at a rate in (0, 1): the binomial sum, term by term in
/// logarithms.
fn at_most(count: usize, trials: usize, rate: f64) -> f64 {
    let odds_ln = rate.ln() - (-rate).ln_1p();
    let mut term_ln = trials as f64 * (-rate).ln_1p();
    let mut sum = term_ln.exp();
    for k in 1..=count.min(trials) {
        term_ln += ((trials + 1 - k) as f64 / k as f64).ln() + odds_ln;
        sum += term_ln.exp();
    }
    sum.min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_scipy() {
        // scipy.stats.beta.ppf(0.95, k + 1, n - k) and beta.ppf(0.05, k, n - k + 1)
        let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-6;
        assert!(near(upper95(0, 20_000), 0.000_149_775_4), "{}", upper95(0, 20_000));
        assert!(near(upper95(3, 1000), 0.007_735_244_7), "{}", upper95(3, 1000));
        assert!(near(lower95(3, 1000), 0.000_818_175_4), "{}", lower95(3, 1000));
        assert!(near(upper95(40, 100), 0.487_024_18), "{}", upper95(40, 100));
    }

    #[test]
    fn nothing_tried_proves_nothing() {
        assert_eq!((upper95(0, 0), lower95(0, 0), upper95(5, 5)), (1.0, 0.0, 1.0));
        assert_eq!(lower95(0, 10), 0.0);
    }
}
