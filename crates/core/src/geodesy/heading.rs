//! `Heading`: a direction clockwise from true north, and the turn between two directions.

use super::Enu;
use std::f64::consts::{PI, TAU};

/// A direction clockwise from true north, in [0, 2 pi) radians or [0, 360) degrees. Not a number stays not a number.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Heading {
    radians: f64,
}

impl Heading {
    /// True north.
    pub const NORTH: Self = Self { radians: 0.0 };

    /// Wraps an angle, radians clockwise from true north, to [0, 2 pi).
    ///
    /// # Example
    /// ```
    /// use overfly_core::geodesy::Heading;
    /// assert!((Heading::from_radians(-0.1).degrees() - 354.270_422).abs() < 1e-6);
    /// ```
    pub fn from_radians(radians: f64) -> Self {
        let wrapped = radians.rem_euclid(TAU);
        // The remainder of a tiny negative angle rounds up to a full turn.
        Self { radians: if wrapped < TAU || wrapped.is_nan() { wrapped } else { 0.0 } }
    }

    /// Wraps an angle, degrees clockwise from true north, to [0, 360).
    pub fn from_degrees(degrees: f64) -> Self {
        Self::from_radians(degrees.to_radians())
    }

    /// The direction in which an offset points; north for an offset of no length.
    pub fn from_enu(offset: Enu) -> Self {
        Self::from_radians(offset.east_m.atan2(offset.north_m))
    }

    /// Radians clockwise from true north, in [0, 2 pi).
    pub fn radians(self) -> f64 {
        self.radians
    }

    /// Degrees clockwise from true north, in [0, 360).
    pub fn degrees(self) -> f64 {
        // The conversion of a number just below 2 pi must not round up to 360.
        self.radians.to_degrees().rem_euclid(360.0)
    }

    /// The heading after a turn of `turn_rad` radians, positive clockwise.
    pub fn turned(self, turn_rad: f64) -> Self {
        Self::from_radians(self.radians + turn_rad)
    }

    /// The shorter turn from `other` to this heading, radians, positive clockwise, in (-pi, pi].
    ///
    /// # Example
    /// From 350 to 20 degrees it is 30 degrees to the right.
    /// ```
    /// use overfly_core::geodesy::Heading;
    /// let turn_rad = Heading::from_degrees(20.0).turn_rad_from(Heading::from_degrees(350.0));
    /// assert!((turn_rad.to_degrees() - 30.0).abs() < 1e-9);
    /// ```
    pub fn turn_rad_from(self, other: Self) -> f64 {
        wrap_turn_rad(self.radians - other.radians)
    }
}

/// Wraps a turn, radians, to (-pi, pi]: the shorter way round to the same direction.
pub fn wrap_turn_rad(turn_rad: f64) -> f64 {
    let wrapped = (turn_rad + PI).rem_euclid(TAU) - PI;
    if wrapped == -PI { PI } else { wrapped }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn lies_in_one_turn_and_points_the_same_way(angle in -50.0..50.0f64) {
            let heading = Heading::from_radians(angle);
            prop_assert!((0.0..TAU).contains(&heading.radians()) && (0.0..360.0).contains(&heading.degrees()));
            prop_assert!((heading.radians().sin() - angle.sin()).abs() < 1e-13);
            prop_assert!((heading.radians().cos() - angle.cos()).abs() < 1e-13);
        }

        #[test]
        fn a_turn_leads_from_one_heading_to_the_other(a in 0.0..TAU, b in 0.0..TAU) {
            let (from, to) = (Heading::from_radians(a), Heading::from_radians(b));
            let turn_rad = to.turn_rad_from(from);
            prop_assert!(turn_rad > -PI && turn_rad <= PI);
            prop_assert!(from.turned(turn_rad).turn_rad_from(to).abs() < 1e-12);
        }
    }

    #[test]
    fn a_full_turn_is_north() {
        for angle in [TAU, -TAU, -1e-300, 0.0, 3.0 * TAU] {
            assert_eq!(Heading::from_radians(angle).radians(), 0.0, "{angle}");
        }
        assert!(Heading::from_radians(TAU.next_down()).degrees() < 360.0);
        assert!(Heading::from_radians(f64::NAN).radians().is_nan());
    }

    #[test]
    fn the_opposite_direction_is_half_a_turn_to_the_right() {
        assert_eq!((wrap_turn_rad(PI), wrap_turn_rad(-PI), wrap_turn_rad(3.0 * PI)), (PI, PI, PI));
        assert!((wrap_turn_rad(PI + 0.1) - (0.1 - PI)).abs() < 1e-15);
    }

    #[test]
    fn an_offset_points_clockwise_from_north() {
        let degrees = |east_m, north_m| Heading::from_enu(Enu { east_m, north_m }).degrees();
        assert_eq!((degrees(0.0, 1.0), degrees(1.0, 0.0), degrees(0.0, -1.0)), (0.0, 90.0, 180.0));
        assert!((degrees(-1.0, 0.0) - 270.0).abs() < 1e-12);
        assert_eq!(degrees(0.0, 0.0), 0.0);
    }
}
