//! `BodyOffset`: a horizontal offset in the aircraft's own axes, and its rotation to east and north.

use super::{Enu, Heading};

/// A horizontal offset in the aircraft's own axes, metres. The axes are level: they turn with the heading, and pitch and
/// roll do not tilt them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BodyOffset {
    /// To the right of the heading, metres.
    pub right_m: f64,
    /// Along the heading, metres.
    pub ahead_m: f64,
}

impl BodyOffset {
    /// Makes the ground offset of a displacement on an image, pixels right and down. The image looks straight down with
    /// its upper edge ahead.
    pub fn from_image_px([right_px, down_px]: [f64; 2], gsd_m_per_px: f64) -> Self {
        Self { right_m: right_px * gsd_m_per_px, ahead_m: -down_px * gsd_m_per_px }
    }

    /// Length of the offset, metres.
    pub fn length_m(self) -> f64 {
        self.right_m.hypot(self.ahead_m)
    }
}

impl std::ops::Sub for BodyOffset {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self { right_m: self.right_m - other.right_m, ahead_m: self.ahead_m - other.ahead_m }
    }
}

/// The aircraft's level axes under one heading. Rotates offsets between these axes and east-north.
///
/// # Example
/// Under a heading of 90 degrees, ahead is east and right is south.
/// ```
/// use overfly_core::geodesy::{BodyFrame, BodyOffset};
/// let frame = BodyFrame::from_heading_rad(90f64.to_radians());
/// let enu = frame.enu_from_body(BodyOffset { right_m: 3.0, ahead_m: 4.0 });
/// assert!((enu.east_m - 4.0).abs() < 1e-12 && (enu.north_m + 3.0).abs() < 1e-12);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyFrame {
    sin: f64,
    cos: f64,
}

impl BodyFrame {
    /// Makes the frame of a heading, radians clockwise from true north; any number of turns.
    pub fn from_heading_rad(heading_rad: f64) -> Self {
        let (sin, cos) = heading_rad.sin_cos();
        Self { sin, cos }
    }

    /// The offset in east and north.
    pub fn enu_from_body(self, offset: BodyOffset) -> Enu {
        let BodyOffset { right_m, ahead_m } = offset;
        Enu { east_m: right_m * self.cos + ahead_m * self.sin, north_m: ahead_m * self.cos - right_m * self.sin }
    }

    /// The offset in the aircraft's axes.
    pub fn body_from_enu(self, offset: Enu) -> BodyOffset {
        let Enu { east_m, north_m } = offset;
        BodyOffset { right_m: east_m * self.cos - north_m * self.sin, ahead_m: east_m * self.sin + north_m * self.cos }
    }
}

impl From<Heading> for BodyFrame {
    fn from(heading: Heading) -> Self {
        Self::from_heading_rad(heading.radians())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_rotation_and_its_inverse_give_the_offset_back(
            heading_rad in -10.0..10.0f64, right_m in -1e4..1e4f64, ahead_m in -1e4..1e4f64,
        ) {
            let (frame, offset) = (BodyFrame::from_heading_rad(heading_rad), BodyOffset { right_m, ahead_m });
            let enu = frame.enu_from_body(offset);
            let back = frame.body_from_enu(enu);
            prop_assert!((back.right_m - right_m).abs() < 1e-8 && (back.ahead_m - ahead_m).abs() < 1e-8);
            prop_assert!((enu.length_m() - offset.length_m()).abs() < 1e-8);
        }

        #[test]
        fn ahead_points_along_the_heading(heading_rad in 0.0..std::f64::consts::TAU) {
            let enu = BodyFrame::from_heading_rad(heading_rad).enu_from_body(BodyOffset { right_m: 0.0, ahead_m: 5.0 });
            let course = Heading::from_enu(enu);
            prop_assert!(course.turn_rad_from(Heading::from_radians(heading_rad)).abs() < 1e-12);
        }
    }

    #[test]
    fn right_of_north_is_east() {
        let enu = BodyFrame::from(Heading::NORTH).enu_from_body(BodyOffset { right_m: 2.0, ahead_m: 7.0 });
        assert_eq!(enu, Enu { east_m: 2.0, north_m: 7.0 });
    }
}
