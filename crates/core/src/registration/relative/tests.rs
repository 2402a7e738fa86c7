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

#[test]
fn identical_images_are_a_copy_and_no_measurement() {
    let a = frame(&turned(0.0, 1.0, 0.0, 0.0), 1.0);
    let MotionAnswer::NoMotion { reason, .. } = register(&a, &a.clone(), &MotionPrior::default()) else {
        panic!("a motion of 0 was measured")
    };
    assert_eq!(reason, NoMotionReason::IdenticalImages);
}

/// Rows of trees with gaps, at a period in px, and a faint landscape beneath; no two frames have the same noise.
fn orchard(shift: [f64; 2], period_px: f64, landscape_share: f32, noise: u32) -> Gray {
    let mut state = noise;
    let mut random = move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1u32 << 24) as f32 - 0.5
    };
    let (w, h) = (320, 240);
    let value = |i: usize| {
        let (x, y) = ((i % w) as f64 + shift[0], (i / w) as f64 + shift[1]);
        let near = |v: f64| (v / period_px - (v / period_px).round()) * period_px;
        let tree = (-(near(x).powi(2) + near(y).powi(2)) / (0.05 * period_px * period_px)).exp() as f32;
        150.0 - 90.0 * tree + landscape_share * (landscape(x, y) - 128.0) + 6.0 * random()
    };
    Gray::from_values(w, h, (0..w * h).map(value).collect()).unwrap()
}

#[test]
fn ground_that_repeats_itself_gives_no_false_motion() {
    for period_px in [16.0, 23.0, 40.0, 61.0] {
        for (landscape_share, shift) in [(0.0, [70.0, 12.0]), (0.0, [31.0, 0.0]), (0.05, [95.0, 20.0])] {
            let a = orchard([0.0, 0.0], period_px, landscape_share, 1);
            let b = orchard(shift, period_px, landscape_share, 2);
            if let MotionAnswer::Motion(m) = register(&a, &b, &MotionPrior::default()) {
                let off = Vector2::from(m.displacement_px) - Vector2::from(shift);
                assert!(off.norm() < 1.0, "period {period_px}, {landscape_share}: off by {off}");
            }
        }
    }
}

#[test]
fn an_overlay_that_stands_still_is_not_taken_for_the_ground() {
    let overlay = |mut g: Gray| {
        for (i, v) in g.values_mut().iter_mut().enumerate() {
            let (x, y) = (i % 240, i / 240);
            if y % 50 < 12 && (x / 5 * 7 + y / 4 * 3) % 5 < 2 {
                *v = 250.0;
            }
        }
        g
    };
    let truth = turned(0.0, 1.0, 45.0, 10.0);
    let a = overlay(frame(&turned(0.0, 1.0, 0.0, 0.0), 1.0));
    let b = overlay(frame(&truth, 1.0));
    if let MotionAnswer::Motion(m) = register(&a, &b, &MotionPrior::default()) {
        assert!((Vector2::from(m.displacement_px) - truth.t).norm() < 1.0, "{:?}", m.displacement_px);
    }
}

#[test]
fn a_wing_that_stands_still_is_not_taken_for_the_ground() {
    let wing = |mut g: Gray| {
        for (i, v) in g.values_mut().iter_mut().enumerate() {
            let (x, y) = (i % 240, i / 240);
            if x > 150 {
                *v = 160.0 + 60.0 * ((x * x / 7 + y * y / 11 + x * y / 5) as f32 * 0.35).sin();
            }
        }
        g
    };
    let truth = turned(0.0, 1.0, 90.0, 40.0);
    let a = wing(frame(&turned(0.0, 1.0, 0.0, 0.0), 1.0));
    let b = wing(frame(&truth, 0.97));
    if let MotionAnswer::Motion(m) = register(&a, &b, &MotionPrior::default()) {
        assert!((Vector2::from(m.displacement_px) - truth.t).norm() < 1.0, "{:?}", m.displacement_px);
    }
}
