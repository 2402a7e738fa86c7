//! `SimulatedDrift`: the error of a simulated position, and the probability that it lies within the searched region.

use super::scenario::{DrawnDrift, ErrorModel};
use crate::trial::bands::chance_below;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// The error of a position across and along the heading, metres: the error of the last fix, and the drift since.
#[derive(Debug, Clone)]
pub struct SimulatedDrift {
    fix_m: [f64; 2],
    /// Error of each registration, if all drift alike.
    each_m: [f64; 2],
    since_m: [f64; 2],
    count: f64,
}

impl SimulatedDrift {
    /// The error right after a fix.
    pub fn after_fix(errors: &ErrorModel, rng: &mut ChaCha8Rng) -> Self {
        let mut even = |half_m: f64| [(); 2].map(|()| half_m * (2.0 * rng.random::<f64>() - 1.0));
        let fix_m = even(errors.inaccuracy_m / 2.0);
        Self { fix_m, each_m: even(errors.unit_drift_m), since_m: [0.0; 2], count: 0.0 }
    }

    /// The error right after a false fix with a given error.
    pub fn after_false_fix(errors: &ErrorModel, wrong_m: [f64; 2], rng: &mut ChaCha8Rng) -> Self {
        Self { fix_m: wrong_m, ..Self::after_fix(errors, rng) }
    }

    /// Adds `count` further relative registrations; the count can be fractional.
    pub fn grow(&mut self, errors: &ErrorModel, count: f64, rng: &mut ChaCha8Rng) {
        let per_axis = match errors.drift {
            DrawnDrift::Bias => self.each_m.map(|each| each * count),
            // The sum of n normal errors is normal with n times the variance.
            DrawnDrift::Independent => {
                let sigma_m = errors.unit_drift_m / errors.drift_sigmas * count.sqrt();
                [(); 2].map(|()| {
                    let z: f64 = StandardNormal.sample(rng);
                    sigma_m * z
                })
            }
        };
        for (since, added) in self.since_m.iter_mut().zip(per_axis) {
            *since += added;
        }
        self.count += count;
    }

    /// Error across and along the heading, metres.
    pub fn error_m(&self) -> [f64; 2] {
        [self.fix_m[0] + self.since_m[0], self.fix_m[1] + self.since_m[1]]
    }

    /// D_T as the search assumes it, metres.
    pub fn stated_m(&self, errors: &ErrorModel) -> f64 {
        errors.drift_growth.factor(self.count) * errors.unit_drift_m
    }

    /// Whether the image lies in the rectangle of (3) around its assumed place.
    pub fn is_within_region(&self, errors: &ErrorModel) -> bool {
        let reach_m = errors.inaccuracy_m / 2.0 + self.stated_m(errors);
        // The slack allows for rounding at the edge.
        self.error_m().iter().all(|e| e.abs() <= reach_m * (1.0 + 1e-12) + 1e-9)
    }
}

/// Probability that the image lies in the rectangle of (3), `count` relative registrations after a fix.
pub fn chance_within_region(errors: &ErrorModel, count: f64) -> f64 {
    const STEPS: usize = 400;
    let reach_m = errors.inaccuracy_m / 2.0 + errors.drift_growth.factor(count) * errors.unit_drift_m;
    let below = |limit_m: f64| match errors.drift {
        DrawnDrift::Bias => {
            let width_m = errors.unit_drift_m * count;
            if width_m > 0.0 {
                (0.5 + limit_m / (2.0 * width_m)).clamp(0.0, 1.0)
            } else {
                f64::from(u8::from(limit_m >= 0.0))
            }
        }
        DrawnDrift::Independent => {
            let sigma_m = errors.unit_drift_m / errors.drift_sigmas * count.sqrt();
            if sigma_m > 0.0 { chance_below(limit_m / sigma_m) } else { f64::from(u8::from(limit_m >= 0.0)) }
        }
    };
    // The mean over the error of the fix, which is uniform.
    let per_axis: f64 = (0..STEPS)
        .map(|k| ((k as f64 + 0.5) / STEPS as f64 - 0.5) * errors.inaccuracy_m)
        .map(|fix_m| below(reach_m - fix_m) - below(-reach_m - fix_m))
        .sum::<f64>()
        / STEPS as f64;
    // Without drift both limits equal the error itself.
    if errors.unit_drift_m * count == 0.0 { 1.0 } else { per_axis * per_axis }
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::coupling::DriftGrowth;
    use rand::SeedableRng;

    fn model(drift: DrawnDrift, drift_growth: DriftGrowth, inaccuracy_m: f64) -> ErrorModel {
        ErrorModel { inaccuracy_m, unit_drift_m: 1.5, drift_growth, drift, drift_sigmas: 2.0 }
    }

    fn counted(errors: &ErrorModel, count: f64) -> f64 {
        let (mut inside, trials) = (0, 20_000);
        for seed in 0..trials {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut drift = SimulatedDrift::after_fix(errors, &mut rng);
            for part in [0.25, 0.75] {
                drift.grow(errors, part * count, &mut rng);
            }
            inside += usize::from(drift.is_within_region(errors));
        }
        inside as f64 / trials as f64
    }

    #[test]
    fn what_2_assumes_is_never_outside_and_what_it_does_not_as_often_as_computed() {
        for inaccuracy_m in [0.0, 30.0] {
            let kept = model(DrawnDrift::Bias, DriftGrowth::Linear, inaccuracy_m);
            assert_eq!(counted(&kept, 40.0), 1.0);
            assert!((chance_within_region(&kept, 40.0) - 1.0).abs() < 1e-12);
            for (drift, growth) in
                [(DrawnDrift::Independent, DriftGrowth::SquareRoot), (DrawnDrift::Bias, DriftGrowth::SquareRoot)]
            {
                let errors = model(drift, growth, inaccuracy_m);
                let (seen, stated) = (counted(&errors, 40.0), chance_within_region(&errors, 40.0));
                // Four standard deviations of 20,000 trials, at most.
                assert!((seen - stated).abs() < 0.0142, "{drift:?} {inaccuracy_m}: {seen}, stated {stated}");
            }
        }
        // A repeated bias inside a square root: 1 / sqrt(n) on each axis. Independent errors within two sigma: 95.45
        // % on each axis.
        let chance = |drift| chance_within_region(&model(drift, DriftGrowth::SquareRoot, 0.0), 25.0);
        assert!((chance(DrawnDrift::Bias) - 1.0 / 25.0).abs() < 1e-9);
        assert!((chance(DrawnDrift::Independent) - 0.954_499_7 * 0.954_499_7).abs() < 1e-5);
    }

    #[test]
    fn without_drift_and_inaccuracy_a_position_is_right() {
        let errors = ErrorModel { unit_drift_m: 0.0, ..model(DrawnDrift::Bias, DriftGrowth::Linear, 0.0) };
        assert_eq!((counted(&errors, 9.0), chance_within_region(&errors, 9.0)), (1.0, 1.0));
    }
}
