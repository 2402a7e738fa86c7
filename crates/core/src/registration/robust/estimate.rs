//! The estimator: search for the largest consensus, refinement, report.

use super::least_squares::{Solution, solve};
use super::observations::{Observations, Score};
use super::options::{Ending, EstimatorOptions, HypothesisMethod};
use super::sampling::{Xorshift, nth_pair, pair_count};
use crate::registration::similarity::Similarity;
use nalgebra::{Matrix4, Vector2};

/// A similarity fitted to the inliers among the matches.
#[derive(Debug, Clone, PartialEq)]
pub struct RobustFit {
    /// Takes a point of b to what is observed of it in a.
    pub model: Similarity,
    /// Inliers, as ascending indices.
    pub inliers: Vec<usize>,
    /// Point of b about which `cofactor` is stated, px.
    pub pivot_px: Vector2<f64>,
    /// Inverse normal matrix of the inliers in the order (x, y, c, s), x and y being where the pivot is taken; times
    /// `unit_variance` it is the covariance.
    pub cofactor: Matrix4<f64>,
    /// Variance of unit weight: the weighted squared residuals over the degrees of freedom; infinite where there are none.
    pub unit_variance: f64,
    /// Root mean square residual of the inliers per axis, px.
    pub rms_px: f64,
}

/// How the hypothesis was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchReport {
    /// The method used: [`HypothesisMethod::AllPairs`] also where RANSAC was asked for and there were few pairs.
    pub method: HypothesisMethod,
    /// Pairs of matches that were tried.
    pub trials: usize,
    /// Inliers of the best hypothesis, by [`Observations::score`].
    pub inliers: usize,
    /// The seed of the draws.
    pub seed: u32,
}

/// Parameters of a similarity.
const PARAMETERS: f64 = 4.0;

/// The similarity with the largest consensus, refined, and how it was found. The same arguments give the same answer.
/// `None` where no pair of matches makes a plausible hypothesis, or where its inliers do not determine a similarity.
///
/// # References
/// Two matches determine a similarity by equations 34 to 36 of the paper ([`Similarity::through`]).
pub fn estimate(
    observations: &impl Observations,
    options: &EstimatorOptions,
    seed: u32,
) -> Option<(RobustFit, SearchReport)> {
    let (hypothesis, report) = search(observations, options, seed)?;
    Some((refine(observations, &hypothesis, options)?, report))
}

/// The similarity fitted to the inliers of `start`, inliers and fit in turn until they stay the same. `None` where the
/// inliers do not determine a similarity.
pub fn refine(observations: &impl Observations, start: &Similarity, options: &EstimatorOptions) -> Option<RobustFit> {
    let mut model = *start;
    let mut inliers = select(observations, &model, options.tolerance_px);
    for _ in 0..options.rounds {
        let next = solve(observations, &inliers, options)?.model;
        let still = select(observations, &next, options.tolerance_px);
        if still.len() < inliers.len().min(options.min_kept) {
            break;
        }
        model = next;
        if still == inliers {
            break;
        }
        inliers = still;
    }
    let solution = solve(observations, &inliers, options)?;
    let model = if options.ending == Ending::Fit { solution.model } else { model };
    Some(assess(observations, model, inliers, &solution))
}

fn search(
    observations: &impl Observations,
    options: &EstimatorOptions,
    seed: u32,
) -> Option<(Similarity, SearchReport)> {
    let count = observations.count();
    let all = pair_count(count);
    let ransac = match options.method {
        HypothesisMethod::Ransac { max_trials, miss_probability } if all > max_trials => {
            Some((max_trials, miss_probability))
        }
        _ => None,
    };
    let mut limit = ransac.map_or(all, |(max_trials, _)| max_trials);
    let mut draw = Xorshift::new(seed);
    let mut best: Option<(Score, Similarity)> = None;
    let mut trials = 0;
    while trials < limit {
        let (i, j) = if ransac.is_some() { draw.two_below(count) } else { nth_pair(trials, count) };
        trials += 1;
        let Some(model) = hypothesis(observations, [i, j], options) else { continue };
        let score = observations.score(&model, options.tolerance_px);
        if best.as_ref().is_none_or(|(highest, _)| score.is_better_than(highest)) {
            best = Some((score, model));
            if let Some((_, miss_probability)) = ransac {
                limit = limit.min(trials_needed(score.inliers as f64 / count as f64, miss_probability));
            }
        }
    }
    let method = if ransac.is_some() { options.method } else { HypothesisMethod::AllPairs };
    best.map(|(score, model)| (model, SearchReport { method, trials, inliers: score.inliers, seed }))
}

/// Draws after which a pair of inliers was missed with at most the given probability.
fn trials_needed(inlier_share: f64, miss_probability: f64) -> usize {
    if inlier_share >= 1.0 {
        return usize::MAX;
    }
    (miss_probability.ln() / (-inlier_share * inlier_share).ln_1p()).ceil() as usize
}

/// The similarity that two matches determine, where both and the bounds admit it.
fn hypothesis(observations: &impl Observations, pair: [usize; 2], options: &EstimatorOptions) -> Option<Similarity> {
    let [p, q] = pair.map(|i| observations.point(i));
    if (p - q).norm_squared() < options.min_base_px * options.min_base_px {
        return None;
    }
    let model = observations.hypothesis(pair)?;
    let is_admissible = |&i: &usize| observations.is_admissible(i, &model);
    (observations.is_plausible(&model) && pair.iter().all(is_admissible)).then_some(model)
}

/// The inliers of a model.
fn select(observations: &impl Observations, model: &Similarity, tolerance_px: f64) -> Vec<usize> {
    let is_inlier = |&i: &usize| {
        observations.residual(i, model).norm_squared() <= tolerance_px * tolerance_px
            && observations.is_admissible(i, model)
    };
    (0..observations.count()).filter(is_inlier).collect()
}

fn assess(observations: &impl Observations, model: Similarity, inliers: Vec<usize>, solution: &Solution) -> RobustFit {
    let (mut weighted, mut plain) = (0.0, 0.0);
    for &i in &inliers {
        let r = observations.residual(i, &model);
        weighted += (r.transpose() * observations.information(i) * r)[0];
        plain += r.norm_squared();
    }
    let values = (2 * inliers.len()) as f64;
    let freedom = values - PARAMETERS;
    let unit_variance = if freedom > 0.0 { weighted / freedom } else { f64::INFINITY };
    let &Solution { pivot_px, cofactor, .. } = solution;
    RobustFit { model, inliers, pivot_px, cofactor, unit_variance, rms_px: (plain / values).sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix2;

    /// Plain matches of points, all equally well known.
    struct Points {
        b: Vec<Vector2<f64>>,
        a: Vec<Vector2<f64>>,
    }

    impl Observations for Points {
        fn count(&self) -> usize {
            self.b.len()
        }

        fn point(&self, index: usize) -> Vector2<f64> {
            self.b[index]
        }

        fn observed(&self, index: usize) -> Vector2<f64> {
            self.a[index]
        }

        fn information(&self, _index: usize) -> Matrix2<f64> {
            Matrix2::identity()
        }

        fn residual(&self, index: usize, model: &Similarity) -> Vector2<f64> {
            self.a[index] - model.apply(self.b[index])
        }

        fn is_admissible(&self, _index: usize, _model: &Similarity) -> bool {
            true
        }

        fn is_plausible(&self, _model: &Similarity) -> bool {
            true
        }

        fn score(&self, model: &Similarity, tolerance_px: f64) -> Score {
            Score { inliers: select(self, model, tolerance_px).len(), cost: 0.0 }
        }
    }

    fn truth() -> Similarity {
        Similarity::about(0.8, -0.4, Vector2::new(100.0, 100.0), Vector2::new(130.0, 90.0))
    }

    /// The first `right` of `count` matches obey the truth.
    fn points(right: usize, count: usize) -> Points {
        let mut draw = Xorshift::new(5);
        let mut point = || Vector2::new(draw.below(2000) as f64 / 10.0, draw.below(2000) as f64 / 10.0);
        let b: Vec<_> = (0..count).map(|_| point()).collect();
        let a = (0..count).map(|i| if i < right { truth().apply(b[i]) } else { point() }).collect();
        Points { b, a }
    }

    fn options(method: HypothesisMethod) -> EstimatorOptions {
        EstimatorOptions {
            method,
            tolerance_px: 0.5,
            min_base_px: 5.0,
            rounds: 4,
            min_kept: 0,
            ending: Ending::Fit,
            pivot_px: None,
            prior: None,
        }
    }

    const RANSAC: HypothesisMethod = HypothesisMethod::Ransac { max_trials: 1000, miss_probability: 1e-6 };

    #[test]
    fn both_methods_find_the_same_similarity() {
        let points = points(40, 100);
        let (all, by_all) = estimate(&points, &options(HypothesisMethod::AllPairs), 1).unwrap();
        let (drawn, by_draws) = estimate(&points, &options(RANSAC), 1).unwrap();
        assert!((all.model.t - truth().t).norm() < 1e-9 && (all.model.c - 0.8).abs() < 1e-12);
        assert_eq!((all.model, &all.inliers), (drawn.model, &drawn.inliers));
        assert!((0..40).all(|i| all.inliers.contains(&i)) && all.rms_px < 0.5);
        assert_eq!((by_all.method, by_all.trials), (HypothesisMethod::AllPairs, 4950));
        // 0.4^2 of the pairs are right: ln(1e-6) / ln(1 - 0.16) = 79.2.
        assert_eq!((by_draws.method, by_draws.trials, by_draws.seed), (RANSAC, 80, 1));
    }

    #[test]
    fn few_matches_are_tried_in_all_pairs_and_one_match_gives_nothing() {
        let (_, report) = estimate(&points(5, 7), &options(RANSAC), 9).unwrap();
        assert_eq!((report.method, report.trials), (HypothesisMethod::AllPairs, 21));
        assert!(estimate(&points(1, 1), &options(RANSAC), 9).is_none());
        assert!(estimate(&points(0, 0), &options(RANSAC), 9).is_none());
    }

    #[test]
    fn exact_matches_have_no_variance_and_two_have_no_freedom() {
        let (fit, _) = estimate(&points(9, 9), &options(HypothesisMethod::AllPairs), 1).unwrap();
        assert!(fit.unit_variance < 1e-20);
        let (fit, _) = estimate(&points(2, 2), &options(HypothesisMethod::AllPairs), 1).unwrap();
        assert_eq!(fit.unit_variance, f64::INFINITY);
    }
}
