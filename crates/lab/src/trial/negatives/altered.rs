//! Real frames changed so that they fit nowhere: mirrored, turned, magnified, or given another camera.

use overfly_core::camera::{Attitude, CameraError, Intrinsics, View};
use overfly_core::pixels::Gray;

/// A frame and the stated view of its camera.
pub struct ShownFrame {
    /// The frame.
    pub gray: Gray,
    /// The stated view.
    pub view: View,
}

/// Mirrors the frame, its camera and its roll: the frame that the same flight over a mirrored world would have taken.
pub fn mirrored(frame: &Gray, view: &View) -> ShownFrame {
    let (width, height) = (frame.width_px(), frame.height_px());
    let mut gray = frame.clone();
    (0..height).for_each(|y| gray.values_mut()[y * width..(y + 1) * width].reverse());
    let view = match view {
        View::Nadir { .. } => view.clone(),
        View::Posed { intrinsics: i, height, attitude } => {
            let [k1, k2, p1, p2, k3] = i.distortion;
            let [cx, cy] = i.principal_point_px;
            View::Posed {
                intrinsics: Intrinsics {
                    principal_point_px: [f64::from(i.width_px) - cx, cy],
                    distortion: [k1, k2, p1, -p2, k3],
                    ..i.clone()
                },
                height: *height,
                attitude: Attitude { roll_rad: attitude.roll_rad.map(|roll_rad| -roll_rad), ..*attitude },
            }
        }
    };
    ShownFrame { gray, view }
}

/// Cuts the middle square of the frame and turns it clockwise by a number of quarter turns.
///
/// # Errors
/// If the camera cannot have taken this frame.
pub fn turned(frame: &Gray, view: &View, quarters: usize) -> Result<ShownFrame, CameraError> {
    let (width, height) = (frame.width_px(), frame.height_px());
    let side = width.min(height);
    let (left, top) = ((width - side) / 2, (height - side) / 2);
    let last = side - 1;
    let from = |x: usize, y: usize| match quarters % 4 {
        0 => (x, y),
        1 => (y, last - x),
        2 => (last - x, last - y),
        _ => (last - y, x),
    };
    let values = (0..side * side)
        .map(|i| {
            let (x, y) = from(i % side, i / side);
            frame.at(left + x, top + y)
        })
        .collect();
    let gray = Gray::from_values(side, side, values).expect("one value for each pixel");
    let view = match view {
        View::Nadir { .. } => view.clone(),
        View::Posed { intrinsics, height: flown, attitude } => {
            let whole = intrinsics.scaled_to(width as u32, height as u32)?;
            let [cx, cy] = whole.principal_point_px;
            View::Posed {
                intrinsics: Intrinsics {
                    width_px: side as u32,
                    height_px: side as u32,
                    principal_point_px: [cx - left as f64, cy - top as f64],
                    ..whole
                },
                height: *flown,
                attitude: *attitude,
            }
        }
    };
    Ok(ShownFrame { gray, view })
}

/// Magnifies the middle of the frame by `factor`; the size of the frame stays.
pub fn magnified(frame: &Gray, factor: f64) -> Gray {
    let (width, height) = (frame.width_px(), frame.height_px());
    let (cx, cy) = (width as f64 / 2.0, height as f64 / 2.0);
    let value = |i: usize| {
        let (x, y) = ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
        frame.sample(cx + (x - cx) / factor, cy + (y - cy) / factor)
    };
    Gray::from_values(width, height, (0..width * height).map(value).collect()).expect("one value for each pixel")
}

/// Fits an image to another size: cuts its middle to that aspect, then shrinks or stretches it.
pub fn fitted(image: &Gray, width: usize, height: usize) -> Gray {
    let (own_width, own_height) = (image.width_px() as f64, image.height_px() as f64);
    let per_px = (own_width / width as f64).min(own_height / height as f64);
    // Shrunk by area first, so that the sampling below does not skip pixels.
    let shrink = per_px.max(1.0);
    let small = image.shrunk((own_width / shrink).round() as usize, (own_height / shrink).round() as usize);
    let step = per_px / shrink;
    let (cx, cy) = (small.width_px() as f64 / 2.0, small.height_px() as f64 / 2.0);
    let value = |i: usize| {
        let (x, y) = ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
        small.sample(cx + (x - width as f64 / 2.0) * step, cy + (y - height as f64 / 2.0) * step)
    };
    Gray::from_values(width, height, (0..width * height).map(value).collect()).expect("one value for each pixel")
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::camera::Height;

    fn numbered(width: usize, height: usize) -> Gray {
        Gray::from_values(width, height, (0..width * height).map(|i| i as f32).collect()).unwrap()
    }

    fn posed(width_px: u32, height_px: u32) -> View {
        let intrinsics =
            Intrinsics { principal_point_px: [3.0, 1.5], ..Intrinsics::centred(width_px, height_px, 10.0) };
        View::Posed { intrinsics, height: Height::AboveGround(100.0), attitude: Attitude::exact(0.01, 0.02) }
    }

    #[test]
    fn a_mirror_is_its_own_inverse() {
        let (frame, view) = (numbered(5, 3), posed(5, 3));
        let once = mirrored(&frame, &view);
        assert_eq!(once.gray.row(0), [4.0, 3.0, 2.0, 1.0, 0.0]);
        let twice = mirrored(&once.gray, &once.view);
        assert_eq!((twice.gray, twice.view), (frame, view));
    }

    #[test]
    fn four_quarters_are_a_whole_turn() {
        let frame = numbered(3, 3);
        let mut turning = frame.clone();
        for _ in 0..4 {
            turning = turned(&turning, &posed(3, 3), 1).unwrap().gray;
        }
        assert_eq!(turning, frame);
        // Clockwise: what was at the upper left goes to the upper right.
        assert_eq!(turned(&frame, &posed(3, 3), 1).unwrap().gray.at(2, 0), frame.at(0, 0));
        let View::Posed { intrinsics, .. } = turned(&numbered(6, 4), &posed(6, 4), 2).unwrap().view else { panic!() };
        assert_eq!((intrinsics.width_px, intrinsics.principal_point_px), (4, [2.0, 1.5]));
    }

    #[test]
    fn magnifying_keeps_the_middle_and_fitting_keeps_the_aspect() {
        let frame = numbered(9, 9);
        assert_eq!(magnified(&frame, 1.5).at(4, 4), frame.at(4, 4));
        let columns = Gray::from_values(40, 10, (0..400).map(|i| (i % 40) as f32).collect()).unwrap();
        let wide = fitted(&columns, 5, 5);
        assert_eq!((wide.width_px(), wide.height_px()), (5, 5));
        // The middle ten columns of forty.
        assert!(wide.values().iter().all(|v| (14.0..26.0).contains(v)), "{wide:?}");
    }
}
