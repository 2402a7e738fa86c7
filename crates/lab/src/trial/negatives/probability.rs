//! Whether the stated false-fix probability is true: stated beside observed, over searches whose true place was there to find.

use super::outcome::NegativeOutcome;
use crate::trial::rate_bound::{lower95, upper95};
use serde::Serialize;

/// Upper ends of the bins. Up to the third a place is a fix.
const UPPER_ENDS: [f64; 6] = [1.5e-4, 1e-3, 6e-3, 5e-2, 0.5, 1.0];

/// Searches whose best place states a false-fix probability within a range, and how many of these places are wrong.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ProbabilityBin {
    /// The range begins above this.
    pub above: f64,
    /// The range ends here.
    pub up_to: f64,
    /// Searches.
    pub searches: usize,
    /// Of these: the best place is beyond the bound of a right fix.
    pub wrong: usize,
    /// Mean of what they state.
    pub stated_mean: f64,
    /// One-sided 95 % lower bound on the share that is wrong.
    pub rate_lower95: f64,
    /// One-sided 95 % upper bound on the same share.
    pub rate_upper95: f64,
    /// Whether the statement can be true or errs towards caution: `stated_mean` is at least `rate_lower95`.
    pub is_kept: bool,
}

/// The stated probabilities in bins, over the repeating kinds. A wrong place is one that lies farther from the truth than a right fix
/// may. Only places that were compared with their rivals count: about others nothing was stated but what spoke against them.
pub fn probability_bins(outcomes: &[&NegativeOutcome]) -> Vec<ProbabilityBin> {
    let mut above = 0.0;
    let stated: Vec<(f64, bool)> = outcomes.iter().filter_map(|o| stated(o)).collect();
    UPPER_ENDS
        .into_iter()
        .map(|up_to| {
            let within: Vec<_> = stated.iter().filter(|(p, _)| *p > above && *p <= up_to).collect();
            let (searches, wrong) = (within.len(), within.iter().filter(|(_, is_wrong)| *is_wrong).count());
            let stated_mean = within.iter().map(|(p, _)| p).sum::<f64>() / searches.max(1) as f64;
            let rate_lower95 = lower95(wrong, searches);
            let bin = ProbabilityBin {
                above,
                up_to,
                searches,
                wrong,
                stated_mean,
                rate_lower95,
                rate_upper95: upper95(wrong, searches),
                is_kept: searches == 0 || stated_mean >= rate_lower95,
            };
            above = up_to;
            bin
        })
        .collect()
}

/// What the best place of a search states, and whether it is wrong.
fn stated(outcome: &NegativeOutcome) -> Option<(f64, bool)> {
    let best = outcome.search.as_ref()?.best.as_ref().filter(|best| best.rivals.is_some())?;
    let place = outcome.place.filter(|_| outcome.kind.is_repeating())?;
    Some((best.false_fix_probability, outcome.best_error_m()? > place.right_m))
}

#[cfg(test)]
mod tests {
    use super::super::kind::NegativeKind;
    use super::super::outcome::TruePlace;
    use super::super::score::tests::outcome;
    use super::*;
    use overfly_core::geodesy::{Enu, LocalFrame};
    use overfly_flight::locate::WeighedPlace;

    /// A search whose best place states `probability` and lies `error_m` off.
    fn weighed(probability: f64, error_m: f64, rivals: Option<usize>) -> NegativeOutcome {
        let mut made = outcome(0, NegativeKind::Repeating, 1.0, None, false);
        let search = made.search.as_mut().unwrap();
        let truth = search.prior;
        let nadir = LocalFrame::at(truth).geodetic_from_enu(Enu { east_m: error_m, north_m: 0.0 }).unwrap();
        search.best = Some(WeighedPlace {
            layer: "ortho".into(),
            nadir,
            log10_false_alarms: -9.0,
            log10_rival_false_alarms: -9.0,
            false_fix_probability: probability,
            rivals,
            least_t_score: None,
            blocks: None,
        });
        made.place = Some(TruePlace { truth, right_m: 15.0 });
        made
    }

    #[test]
    fn a_statement_that_is_too_low_is_found() {
        let mut outcomes: Vec<_> = (0..100).map(|_| weighed(1.5e-4, 2.0, Some(1))).collect();
        outcomes.extend((0..20).map(|i| weighed(0.02, if i < 10 { 400.0 } else { 1.0 }, Some(3))));
        outcomes.push(weighed(0.7, 400.0, Some(3)));
        outcomes.push(weighed(0.7, 400.0, None));
        let bins = probability_bins(&outcomes.iter().collect::<Vec<_>>());
        let counts: Vec<_> = bins.iter().map(|b| (b.searches, b.wrong, b.is_kept)).collect();
        let expected = [(100, 0, true), (0, 0, true), (0, 0, true), (20, 10, false), (0, 0, true), (1, 1, true)];
        assert_eq!(counts, expected);
    }
}
