//! Synthetic frames with exact truth.

use super::*;
use crate::pixels::Gray;
use crate::registration::similarity::Similarity;
use nalgebra::Vector2;

/// A smooth random landscape: a sum of waves, so that any resampling is exact.
fn landscape(x: f64, y: f64) -> f32 {
    let mut state = 7u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1u32 << 24)
    };
    let value: f64 = (0..60)
        .map(|_| {
            let (fx, fy, phase) = ((next() - 0.5) * 0.9, (next() - 0.5) * 0.9, next() * 6.3);
            (fx * x + fy * y + phase).sin()
        })
        .sum();
    (128.0 + 9.0 * value).clamp(0.0, 255.0) as f32
}

fn frame(similarity: &Similarity, gain: f32) -> Gray {
    let (w, h) = (240, 200);
    let value = |i: usize| {
        let p = similarity.apply(Vector2::new((i % w) as f64 + 0.5, (i / w) as f64 + 0.5));
        gain * landscape(p.x, p.y)
    };
    Gray::from_values(w, h, (0..w * h).map(value).collect()).unwrap()
}

fn turned(degrees: f64, scale: f64, x: f64, y: f64) -> Similarity {
    let (sin, cos) = degrees.to_radians().sin_cos();
    Similarity { c: scale * cos, s: scale * sin, t: Vector2::new(x, y) }
}

#[test]
fn finds_the_motion_to_a_few_hundredths_of_a_pixel_at_any_turn() {
    let a = frame(&turned(0.0, 1.0, 0.0, 0.0), 1.0);
    for truth in [turned(3.0, 1.0, 60.3, -20.7), turned(87.0, 1.02, 210.0, 15.0), turned(181.0, 0.97, 230.0, 190.0)] {
        let MotionAnswer::Motion(motion) = register(&a, &frame(&truth, 0.9), &MotionPrior::default()) else {
            panic!("not registered: {truth:?}")
        };
        let expected = truth.apply(Vector2::new(120.0, 100.0)) - Vector2::new(120.0, 100.0);
        let off = Vector2::from(motion.displacement_px) - expected;
        assert!(off.norm() < 0.05, "{truth:?} off by {off}");
        assert!((motion.scale - truth.scale()).abs() < 1e-3);
    }
}

/// Every pixel of a frame as a square of 12.
fn enlarged(frame: &Gray) -> Gray {
    let (w, h) = (frame.width_px() * 12, frame.height_px() * 12);
    Gray::from_values(w, h, (0..w * h).map(|i| frame.at(i % w / 12, i / w / 12)).collect()).unwrap()
}

#[test]
fn large_frames_are_answered_in_their_own_pixels() {
    let truth = turned(3.0, 1.0, 60.3, -20.7);
    let (a, b) = (frame(&turned(0.0, 1.0, 0.0, 0.0), 1.0), frame(&truth, 1.0));
    let MotionAnswer::Motion(motion) = register(&enlarged(&a), &enlarged(&b), &MotionPrior::default()) else {
        panic!("not registered")
    };
    let expected = (truth.apply(Vector2::new(120.0, 100.0)) - Vector2::new(120.0, 100.0)) * 12.0;
    let off = Vector2::from(motion.displacement_px) - expected;
    assert!(off.norm() < 1.5, "{off}");
    assert!((motion.a_from_b[0][2] - truth.t.x * 12.0).abs() < 3.0);
}

#[test]
fn gives_no_motion_where_nothing_is_shared_or_shown() {
    let a = frame(&turned(0.0, 1.0, 0.0, 0.0), 1.0);
    let elsewhere = frame(&turned(0.0, 1.0, 5000.0, 9000.0), 1.0);
    let blank = Gray::filled(240, 200, 90.0);
    let tiny = Gray::filled(1, 1, 90.0);
    for b in [elsewhere, blank, tiny] {
        assert!(matches!(register(&a, &b, &MotionPrior::default()), MotionAnswer::NoMotion { .. }));
    }
}

#[test]
fn refuses_a_scale_that_contradicts_the_stated_one() {
    let a = frame(&turned(0.0, 1.0, 0.0, 0.0), 1.0);
    let b = frame(&turned(2.0, 1.0, 30.0, 0.0), 1.0);
    let answer = register(&a, &b, &MotionPrior { scale: Some(1.6) });
    assert!(matches!(answer, MotionAnswer::NoMotion { .. }));
}

#[test]
fn finds_frames_of_twice_and_half_the_scale() {
    let a = frame(&turned(0.0, 1.0, 0.0, 0.0), 1.0);
    for (truth, bound) in [(turned(20.0, 1.4, 60.0, -30.0), 1.0), (turned(-35.0, 0.55, 70.0, 110.0), 1.0)] {
        let MotionAnswer::Motion(motion) = register(&a, &frame(&truth, 1.1), &MotionPrior::default()) else {
            panic!("not registered: {truth:?}")
        };
        let expected = truth.apply(Vector2::new(120.0, 100.0)) - Vector2::new(120.0, 100.0);
        assert!((Vector2::from(motion.displacement_px) - expected).norm() < bound);
    }
}

#[test]
fn a_mirrored_frame_gives_no_motion() {
    let a = frame(&turned(0.0, 1.0, 0.0, 0.0), 1.0);
    let (w, h) = (a.width_px(), a.height_px());
    let mirrored = Gray::from_values(w, h, (0..w * h).map(|i| a.at(w - 1 - i % w, i / w)).collect()).unwrap();
    assert!(matches!(register(&a, &mirrored, &MotionPrior::default()), MotionAnswer::NoMotion { .. }));
}

#[test]
fn the_same_frames_give_the_same_bits() {
    let (a, b) = (frame(&turned(0.0, 1.0, 0.0, 0.0), 1.0), frame(&turned(4.0, 1.05, 30.0, 10.0), 0.9));
    assert_eq!(register(&a, &b, &MotionPrior::default()), register(&a, &b, &MotionPrior::default()));
}
