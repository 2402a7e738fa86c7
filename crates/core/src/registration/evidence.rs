//! How surely an agreement of windows is no accident.
//!
//! A contrario (Desolneux, Moisan, Morel, 2000): suppose the frame does not show this ground. Then each window's peak
//! falls anywhere in its search square, and agrees with a given similarity with the chance that the tolerance's disc
//! has of the square. The number of false alarms is the number of similarities that were looked at times the chance
//! that so many windows agree with one of them.

/// What was counted.
#[derive(Debug, Clone, Copy)]
pub struct Agreement {
    /// Windows that held structure and were searched.
    pub windows: usize,
    /// Of these, those that agree with the similarity.
    pub agreeing: usize,
    /// Chance that one window agrees by accident.
    pub chance: f64,
    /// Places that were looked at this closely.
    pub places: f64,
}

/// Peaks of chance are not spread quite evenly: neighbouring windows see the same edges.
const UNEVENNESS: f64 = 1.5;

/// The chance that a peak anywhere in a square of half edge `radius_px` lies within `tolerance_px` of a given point.
pub fn chance_of_one(tolerance_px: f64, radius_px: usize) -> f64 {
    let square = ((2 * radius_px + 1) as f64).powi(2);
    (UNEVENNESS * std::f64::consts::PI * tolerance_px.powi(2) / square).min(1.0)
}

/// Samples of a surface that count as independent, for each window that the view holds: what little a view shows, its
/// boldest edges decide alone, and its surface has a heavier tail than the normal one. Measured on frames turned and mirrored
/// over a map's corner, where 10 windows were left and a wrong place stood 7.7 standard deviations high.
const SAMPLES_PER_WINDOW: f64 = 5.0;

/// log10 of the expected number of places, of those compared, where the surface of a view of so many windows stands `score`
/// standard deviations high by chance: the leading term of Student's tail, never above 0. At least one window.
pub fn log10_peak_by_chance(score: f64, windows: usize, places: f64) -> f64 {
    if score < 1.0 {
        return 0.0;
    }
    let freedom = SAMPLES_PER_WINDOW * windows.max(1) as f64;
    let log10_tail = -(freedom - 1.0) / 2.0 * (score * score / freedom).ln_1p() / std::f64::consts::LN_10
        - (score * std::f64::consts::TAU.sqrt() * (1.0 - 1.0 / freedom)).log10();
    (places.max(1.0).log10() + log10_tail).min(0.0)
}

/// log10 of the expected number of accidental agreements at least this good in the whole search. Two windows of the
/// consensus determine the similarity and prove nothing.
pub fn log10_false_alarms(agreement: &Agreement) -> f64 {
    let Agreement { windows: n, agreeing: k, chance, places } = *agreement;
    if k < 3 || n < k {
        return f64::INFINITY;
    }
    let pairs = (k * (k - 1)) as f64 / 2.0;
    let tests = places.max(1.0).log10() + (n as f64).log10() + log10_choose(n, k) + pairs.log10();
    tests + (k - 2) as f64 * chance.log10()
}

fn log10_choose(n: usize, k: usize) -> f64 {
    (1..=k.min(n - k)).map(|i| ((n + 1 - i) as f64 / i as f64).log10()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_agreement_is_less_of_an_accident_and_a_wider_search_more() {
        let base = Agreement { windows: 20, agreeing: 10, chance: 0.05, places: 1e5 };
        let nfa = log10_false_alarms(&base);
        assert!(log10_false_alarms(&Agreement { agreeing: 12, ..base }) < nfa);
        let wide = log10_false_alarms(&Agreement { places: 1e7, ..base });
        assert!((wide - nfa - 2.0).abs() < 1e-9);
    }

    #[test]
    fn a_peak_is_weighed_by_students_tail() {
        // Q(6) = 9.866e-10 of the normal distribution; the leading term is 2.6 % above.
        assert!((log10_peak_by_chance(6.0, 1_000_000, 1e4) - (9.866e-6f64).log10()).abs() < 0.02);
        // P(T > 6) with 60 degrees of freedom is 6.14e-8.
        assert!((log10_peak_by_chance(6.0, 12, 1.0) - (6.14e-8f64).log10()).abs() < 0.05);
        assert_eq!(log10_peak_by_chance(3.0, 1_000_000, 1e6), 0.0);
    }

    #[test]
    fn two_windows_prove_nothing() {
        let two = Agreement { windows: 20, agreeing: 2, chance: 0.05, places: 1.0 };
        assert_eq!(log10_false_alarms(&two), f64::INFINITY);
    }

    #[test]
    fn choose_is_pascals() {
        assert!((log10_choose(20, 10) - 184_756f64.log10()).abs() < 1e-9);
    }
}
