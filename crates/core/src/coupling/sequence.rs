//! `ExecutionSequence`: the recurrence of search times, and its fixed points.

use super::CouplingError;

/// The recurrence t(k + 1) = constant + root sqrt(t(k)) + linear t(k) + square t(k)^2 + cube t(k)^3, seconds, with no negative
/// coefficient. It is either a polynomial (`root` is zero; convex) or without square and cube (concave).
///
/// # References
/// Gamma (19) and Phi (29) are polynomials. The square root models independent drifts, which the paper does not have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExecutionSequence {
    constant_s: f64,
    root_sqrt_s: f64,
    linear: f64,
    square_per_s: f64,
    cube_per_s2: f64,
}

/// The fixed points of a recurrence of search times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixedPoints {
    /// The limit of every start below `unstable_s`, seconds: t1 (21), or s2 = 0 of (30).
    pub stable_s: f64,
    /// The bound of the starts from which the searches settle, seconds: t2 (22), s1 (31). A start at the bound stays there; a
    /// start beyond it grows without bound. Infinite where every start settles; equal to `stable_s` where the discriminant
    /// is zero.
    pub unstable_s: f64,
}

impl ExecutionSequence {
    /// Makes the recurrence constant + linear t + square t^2 + cube t^3.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`] where a coefficient is negative or not a number.
    pub fn polynomial(
        constant_s: f64,
        linear: f64,
        square_per_s: f64,
        cube_per_s2: f64,
    ) -> Result<Self, CouplingError> {
        Ok(Self {
            constant_s: finite_and_not_negative("constant_s", constant_s)?,
            root_sqrt_s: 0.0,
            linear: finite_and_not_negative("linear", linear)?,
            square_per_s: finite_and_not_negative("square_per_s", square_per_s)?,
            cube_per_s2: finite_and_not_negative("cube_per_s2", cube_per_s2)?,
        })
    }

    /// Makes the recurrence constant + root sqrt(t) + linear t.
    ///
    /// # Errors
    /// [`CouplingError::OutOfDomain`] where a coefficient is negative or not a number.
    pub fn with_root(constant_s: f64, root_sqrt_s: f64, linear: f64) -> Result<Self, CouplingError> {
        let root_sqrt_s = finite_and_not_negative("root_sqrt_s", root_sqrt_s)?;
        Ok(Self { root_sqrt_s, ..Self::polynomial(constant_s, linear, 0.0, 0.0)? })
    }

    /// The time of the search that follows one of `execution_s` (at least 0), seconds.
    pub fn next_s(&self, execution_s: f64) -> f64 {
        let t = execution_s;
        if t.is_infinite() {
            // Times that grow without bound become infinite; a coefficient of zero must not make them NaN.
            let grows = self.root_sqrt_s + self.linear + self.square_per_s + self.cube_per_s2 > 0.0;
            return if grows { f64::INFINITY } else { self.constant_s };
        }
        self.constant_s
            + self.root_sqrt_s * t.sqrt()
            + t * (self.linear + t * (self.square_per_s + t * self.cube_per_s2))
    }

    /// The infinite sequence of search times, seconds, beginning with the first.
    ///
    /// # Example
    /// t(k + 1) = 1 + t(k) / 2 tends to 2.
    /// ```
    /// let halved = overfly_core::coupling::ExecutionSequence::polynomial(1.0, 0.5, 0.0, 0.0).unwrap();
    /// assert_eq!(halved.times_s(0.0).take(4).collect::<Vec<_>>(), [0.0, 1.0, 1.5, 1.75]);
    /// assert_eq!(halved.limit_s(0.0), Ok(2.0));
    /// ```
    pub fn times_s(&self, first_s: f64) -> impl Iterator<Item = f64> + use<> {
        let law = *self;
        std::iter::successors(Some(first_s), move |&t| Some(law.next_s(t)))
    }

    /// The fixed points; `None` where no start settles (except a start at 0 without a constant, which stays there).
    ///
    /// A convex recurrence has two fixed points, a double one, or none. A concave or linear recurrence has one or none.
    pub fn fixed_points(&self) -> Option<FixedPoints> {
        let slack = 1.0 - self.linear;
        if slack <= 0.0 {
            return None;
        }
        if self.square_per_s == 0.0 && self.cube_per_s2 == 0.0 {
            return Some(FixedPoints { stable_s: self.only_fixed_point_s(slack), unstable_s: f64::INFINITY });
        }
        if self.cube_per_s2 == 0.0 { self.quadratic_fixed_points(slack) } else { self.cubic_fixed_points(slack) }
    }

    /// The limit of the times from a first one, seconds. A start exactly at the unstable fixed point stays there.
    ///
    /// # Errors
    /// [`CouplingError::NoFixedPoint`] or [`CouplingError::StartsTooLate`] where the times grow without bound;
    /// [`CouplingError::OutOfDomain`] for a start that is negative or not a number.
    pub fn limit_s(&self, first_s: f64) -> Result<f64, CouplingError> {
        let start_s = finite_and_not_negative("first_s", first_s)?;
        let Some(FixedPoints { stable_s, unstable_s }) = self.fixed_points() else {
            return if self.next_s(start_s) == start_s && self.stays(start_s) {
                Ok(start_s)
            } else {
                Err(CouplingError::NoFixedPoint)
            };
        };
        if start_s > unstable_s {
            return Err(CouplingError::StartsTooLate { start_s, limit_s: unstable_s });
        }
        Ok(if start_s == unstable_s { unstable_s } else { stable_s })
    }

    /// Whether a start reproduces itself although there is no attracting fixed point: 0 without a constant, or any start of
    /// t(k + 1) = t(k). Equality of `next_s` alone could be rounding.
    fn stays(&self, start_s: f64) -> bool {
        let bare = self.constant_s == 0.0 && self.root_sqrt_s == 0.0;
        bare && (start_s == 0.0 || (self.linear == 1.0 && self.square_per_s == 0.0 && self.cube_per_s2 == 0.0))
    }

    /// The one positive root of constant + root x - slack x^2 = 0 with x = sqrt(t).
    fn only_fixed_point_s(&self, slack: f64) -> f64 {
        if self.root_sqrt_s == 0.0 {
            return self.constant_s / slack;
        }
        let x = (self.root_sqrt_s + (self.root_sqrt_s.powi(2) + 4.0 * slack * self.constant_s).sqrt()) / (2.0 * slack);
        x * x
    }

    /// The fixed points without a cubic term: equations 20 to 22, with t1 in the form without cancellation for a small square.
    fn quadratic_fixed_points(&self, slack: f64) -> Option<FixedPoints> {
        let discriminant = slack * slack - 4.0 * self.square_per_s * self.constant_s;
        if discriminant < 0.0 {
            return None;
        }
        let sum = slack + discriminant.sqrt();
        Some(FixedPoints { stable_s: 2.0 * self.constant_s / sum, unstable_s: sum / (2.0 * self.square_per_s) })
    }

    /// The fixed points with a cubic term. The excess e(t) = next - t is convex: it falls to its minimum and rises from there.
    /// Without square and constant this is equation 31.
    fn cubic_fixed_points(&self, slack: f64) -> Option<FixedPoints> {
        if self.constant_s == 0.0 && self.square_per_s == 0.0 {
            return Some(FixedPoints { stable_s: 0.0, unstable_s: (slack / self.cube_per_s2).sqrt() });
        }
        let (square, cube) = (self.square_per_s, self.cube_per_s2);
        // e'(t) = 3 cube t^2 + 2 square t - slack = 0.
        let least_at_s = slack / (square + (square * square + 3.0 * cube * slack).sqrt());
        // cube t^2 + square t - slack = 0: from here on e(t) is at least the constant.
        let beyond_s = 2.0 * slack / (square + (square * square + 4.0 * cube * slack).sqrt());
        let excess = |t: f64| self.constant_s + t * (t * (square + t * cube) - slack);
        let least = excess(least_at_s);
        if least > 0.0 {
            return None;
        }
        let stable_s = if self.constant_s == 0.0 { 0.0 } else { crossing(0.0, least_at_s, |t| excess(t) > 0.0) };
        let unstable_s =
            if self.constant_s == 0.0 { beyond_s } else { crossing(least_at_s, beyond_s, |t| excess(t) <= 0.0) };
        Some(FixedPoints { stable_s, unstable_s })
    }
}

/// Returns `value` if it is finite and not negative. Coefficients have no common scale, and t2 has no upper limit.
fn finite_and_not_negative(name: &'static str, value: f64) -> Result<f64, CouplingError> {
    let holds = value >= 0.0 && value.is_finite();
    if holds { Ok(value) } else { Err(CouplingError::OutOfDomain { name, value, expected: "finite and not negative" }) }
}

/// The point between `low` and `high` at which `holds` turns from true to false, by bisection down to neighbouring numbers.
pub(super) fn crossing(mut low: f64, mut high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    // 1100 halvings bring any interval of f64 down to neighbours; the loop ends long before.
    for _ in 0..1100 {
        let middle = low + (high - low) / 2.0;
        if middle <= low || middle >= high {
            break;
        }
        if holds(middle) { low = middle } else { high = middle }
    }
    low
}

/// Laws held against what happens when one search after another is run, nothing else known.
#[cfg(test)]
pub(super) mod trials {
    use super::*;
    use rand::Rng;
    use rand_chacha::ChaCha8Rng;

    /// How the trials ended.
    #[derive(Default)]
    pub struct Tally {
        total: usize,
        settled: usize,
        grew: usize,
        late: usize,
        undecided: usize,
    }

    impl Tally {
        /// Runs `next` from a start drawn at rest, around both fixed points or far out, and compares its end with
        /// [`ExecutionSequence::limit_s`].
        pub fn compare(&mut self, law: &ExecutionSequence, rng: &mut ChaCha8Rng, next: impl Fn(f64) -> f64) {
            let k = self.total;
            self.total += 1;
            let first_s = match law.fixed_points() {
                Some(f) if f.unstable_s.is_finite() && k.is_multiple_of(2) => f.unstable_s * rng.random_range(0.5..1.5),
                Some(f) if k.is_multiple_of(3) => f.stable_s * rng.random_range(0.0..2.0),
                _ => rng.random_range(0.001..100.0),
            };
            let Some(end_s) = end_s(next, first_s) else {
                self.undecided += 1;
                return;
            };
            match law.limit_s(first_s) {
                Ok(limit_s) => {
                    assert!(
                        (end_s - limit_s).abs() <= 1e-6 * limit_s,
                        "{law:?} from {first_s}: {end_s}, not {limit_s}"
                    );
                    self.settled += 1;
                }
                Err(error) => {
                    assert!(end_s.is_infinite(), "{law:?} from {first_s}: {end_s}, not {error}");
                    self.grew += 1;
                    self.late += usize::from(error.code() == "starts_too_late");
                }
            }
        }

        /// Asserts that every kind of end was seen often, and that few trials stayed undecided.
        pub fn check(&self) {
            let Self { total, settled, grew, late, undecided } = *self;
            assert!(settled > total / 5 && grew > total / 5 && late > total / 50, "{settled} {grew} {late}");
            assert!(undecided < total / 200, "{undecided} undecided");
        }
    }

    /// The end of one search after another: infinite where it grows without bound, 0 where it dies away, `None` where
    /// 20,000 searches do not tell.
    fn end_s(next: impl Fn(f64) -> f64, first_s: f64) -> Option<f64> {
        let mut t = first_s;
        for _ in 0..20_000 {
            let after = next(t);
            if after > 1e15 {
                return Some(f64::INFINITY);
            }
            if after < 1e-30 {
                return Some(0.0);
            }
            if (after - t).abs() <= 1e-13 * t {
                return Some(after);
            }
            t = after;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn fixed_points_reproduce_themselves(
            c0 in 0.0..3.0f64, c1 in 0.0..0.95f64, c2 in 0.0..0.5f64, c3 in 0.0..0.5f64, keep in 0..4u8,
        ) {
            let (c2, c3) = (if keep & 1 > 0 { c2 } else { 0.0 }, if keep & 2 > 0 { c3 } else { 0.0 });
            let law = ExecutionSequence::polynomial(c0, c1, c2, c3).unwrap();
            // Where none is found, none is there: the law lies above the diagonal on a fine grid.
            match law.fixed_points() {
                None => for k in 0..20_000 {
                    let t = f64::from(k) * 1e-3;
                    prop_assert!(law.next_s(t) > t);
                },
                Some(found) => {
                    prop_assert!((law.next_s(found.stable_s) - found.stable_s).abs() < 1e-9 * (1.0 + found.stable_s));
                    if found.unstable_s.is_finite() && found.unstable_s < 1e6 {
                        let off = law.next_s(found.unstable_s) - found.unstable_s;
                        prop_assert!(off.abs() < 1e-9 * (1.0 + found.unstable_s), "{off}");
                    }
                    prop_assert!(found.stable_s <= found.unstable_s);
                }
            }
        }

        #[test]
        fn a_root_has_one_fixed_point_that_everything_tends_to(
            c0 in 1e-3..3.0f64, root in 0.0..2.0f64, c1 in 0.0..0.9f64, start in 0.0..1e6f64,
        ) {
            let law = ExecutionSequence::with_root(c0, root, c1).unwrap();
            let limit = law.limit_s(start).unwrap();
            let end = law.times_s(start).nth(2000).unwrap();
            prop_assert!((end - limit).abs() < 1e-6 * limit, "{end} {limit}");
        }
    }

    #[test]
    fn at_discriminant_zero_the_two_points_are_one_that_attracts_from_below_only() {
        // t' = t^2 / 4 + 1: touches the diagonal at 2. The paper's (20) excludes it, yet from below it settles.
        let law = ExecutionSequence::polynomial(1.0, 0.0, 0.25, 0.0).unwrap();
        assert_eq!(law.fixed_points(), Some(FixedPoints { stable_s: 2.0, unstable_s: 2.0 }));
        assert_eq!((law.limit_s(0.0), law.limit_s(2.0)), (Ok(2.0), Ok(2.0)));
        assert_eq!(law.limit_s(2.001).unwrap_err().code(), "starts_too_late");
        let slowly = law.times_s(0.0).nth(100_000).unwrap();
        assert!(slowly < 2.0 && 2.0 - slowly < 1e-4, "{slowly}");
        assert!(law.times_s(2.001).nth(20_000).unwrap().is_infinite());
        // A hair above: none.
        assert_eq!(ExecutionSequence::polynomial(1.0 + 1e-12, 0.0, 0.25, 0.0).unwrap().fixed_points(), None);
    }

    #[test]
    fn a_cube_that_touches_the_diagonal_is_told_from_one_that_misses() {
        // t' = t^3 / 3 + 2/3 touches at 1.
        let law = |constant: f64| ExecutionSequence::polynomial(constant, 0.0, 0.0, 1.0 / 3.0).unwrap();
        let found = law(2.0 / 3.0 - 1e-12).fixed_points().unwrap();
        assert!((found.stable_s - 1.0).abs() < 1e-5 && (found.unstable_s - 1.0).abs() < 1e-5);
        assert!(found.stable_s < 1.0 && found.unstable_s > 1.0);
        assert_eq!(law(2.0 / 3.0 + 1e-12).limit_s(0.0), Err(CouplingError::NoFixedPoint));
    }

    #[test]
    fn cubes_with_and_without_constant_agree_where_the_constant_vanishes() {
        let paper = ExecutionSequence::polynomial(0.0, 0.4, 0.0, 0.2).unwrap().fixed_points().unwrap();
        assert_eq!(paper, FixedPoints { stable_s: 0.0, unstable_s: 3f64.sqrt() });
        let near = ExecutionSequence::polynomial(1e-12, 0.4, 0.0, 0.2).unwrap().fixed_points().unwrap();
        assert!(near.stable_s < 2e-12 && (near.unstable_s - 3f64.sqrt()).abs() < 1e-9);
        let with_square = ExecutionSequence::polynomial(0.0, 0.4, 1e-12, 0.2).unwrap().fixed_points().unwrap();
        assert!(with_square.stable_s == 0.0 && (with_square.unstable_s - 3f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn zero_without_a_constant_stays_and_the_identity_stays_anywhere() {
        let steep = ExecutionSequence::polynomial(0.0, 1.5, 0.0, 0.1).unwrap();
        assert_eq!(steep.limit_s(0.0), Ok(0.0));
        assert_eq!(steep.limit_s(1e-9), Err(CouplingError::NoFixedPoint));
        let identity = ExecutionSequence::polynomial(0.0, 1.0, 0.0, 0.0).unwrap();
        assert_eq!(identity.limit_s(3.0), Ok(3.0));
        let creeping = ExecutionSequence::polynomial(1e-18, 1.0, 0.0, 0.0).unwrap();
        assert_eq!(creeping.limit_s(3.0), Err(CouplingError::NoFixedPoint));
    }

    #[test]
    fn refuses_negative_and_missing_numbers() {
        assert!(ExecutionSequence::polynomial(-1.0, 0.0, 0.0, 0.0).is_err());
        assert!(ExecutionSequence::with_root(1.0, f64::NAN, 0.0).is_err());
        let law = ExecutionSequence::polynomial(1.0, 0.5, 0.0, 0.0).unwrap();
        assert!(law.limit_s(f64::NAN).is_err() && law.limit_s(-1.0).is_err());
    }

    #[test]
    fn an_infinite_time_stays_infinite() {
        let law = ExecutionSequence::polynomial(1.0, 0.0, 2.0, 0.0).unwrap();
        assert_eq!(law.times_s(5.0).nth(5000), Some(f64::INFINITY));
        let flat = ExecutionSequence::polynomial(1.0, 0.0, 0.0, 0.0).unwrap();
        assert_eq!(flat.next_s(f64::INFINITY), 1.0);
    }
}
