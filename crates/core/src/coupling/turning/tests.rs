//! The areas of section IV.D against integration, polygons, random flights and a raster.

use super::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Area of a polygon given by its corners in order.
fn polygon_area(corners: &[(f64, f64)]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(a, b)| a.0 * b.1 - b.0 * a.1).sum::<f64>().abs() / 2.0
}

/// Where a turn by `phi` at the radius `r` and then straight flight end, `s` in all.
fn turn_then_straight(s: f64, r: f64, phi: f64) -> (f64, f64) {
    let (straight, (sin, cos)) = (s - r * phi, phi.sin_cos());
    (r * (1.0 - cos) + straight * sin, r * sin + straight * cos)
}

/// The right wing's rim: along the tightest circle, and back along `front` (0 at the circle's end, 1 straight ahead).
fn wing_rim(s: f64, r: f64, front: impl Fn(f64) -> (f64, f64)) -> Vec<(f64, f64)> {
    let steps = 20_000;
    let part = |k: i32| f64::from(k) / f64::from(steps);
    let circle = (0..=steps).map(|k| {
        let angle = s / r * part(k);
        (r * (1.0 - angle.cos()), r * angle.sin())
    });
    circle.chain((1..=steps).map(|k| front(part(k)))).collect()
}

#[test]
fn a_turn_ends_where_small_steps_along_it_lead() {
    for (s, r) in [(300.0, 500.0), (700.0, 500.0), (50.0, 1e6)] {
        let (mut x, mut y, steps) = (0.0, 0.0, 100_000);
        for k in 0..steps {
            let heading = (f64::from(k) + 0.5) / f64::from(steps) * s / r;
            (x, y) = (x + heading.sin() * s / f64::from(steps), y + heading.cos() * s / f64::from(steps));
        }
        let end = turn_point(s, r).unwrap();
        assert!((end.right_m - x).abs() < 1e-6 && (end.ahead_m - y).abs() < 1e-6);
    }
    assert_eq!(turn_point(70.0, f64::INFINITY), Ok(BodyOffset { right_m: 0.0, ahead_m: 70.0 }));
    // On a circle of 10^9 m the printed 1 - cos is 0 or one rounding; the truth is s^2 / 2 R.
    assert!((turn_point(10.0, 1e9).unwrap().right_m / 5e-8 - 1.0).abs() < 1e-12);
}

#[test]
fn the_area_under_the_ends_is_the_integral_25_and_26_its_leading_term() {
    for (s, r) in [(20.0, 500.0), (250.0, 500.0), (500.0, 500.0), (785.0, 500.0)] {
        // y dx as a sum over 200,000 radii, evenly in curvature.
        let steps = 200_000;
        let at = |k: i32| turn_point(s, r * f64::from(steps) / f64::from(k)).unwrap();
        let strips = (1..steps).map(|k| {
            let (low, high) = (at(k), at(k + 1));
            (high.right_m - low.right_m) * (high.ahead_m + low.ahead_m) / 2.0
        });
        let summed = strips.sum::<f64>() + at(1).right_m * s;
        let exact = end_curve_area_m2(s, r).unwrap();
        assert!((summed / exact - 1.0).abs() < 1e-8, "{summed} {exact}");
        let (printed, u) = (end_curve_area_paper_m2(s, r).unwrap(), s / r);
        let excess = printed / exact - 1.0;
        assert!(excess > 0.0 && (excess / (5.0 / 36.0 * u * u) - 1.0).abs() < 0.6 * u * u + 1e-6, "{excess}");
    }
}

#[test]
fn a_wing_is_one_sixth_so_both_are_one_third_and_not_the_printed_two() {
    for (s, r) in [(40.0, 800.0), (250.0, 500.0), (500.0, 500.0), (785.0, 500.0)] {
        let circles = polygon_area(&wing_rim(s, r, |k| {
            let end = turn_point(s, if k < 1.0 { r / (1.0 - k) } else { f64::INFINITY }).unwrap();
            (end.right_m, end.ahead_m)
        }));
        let everything = polygon_area(&wing_rim(s, r, |k| turn_then_straight(s, r, s / r * (1.0 - k))));
        let sixth = s * s * s / (6.0 * r);
        assert!((everything / sixth - 1.0).abs() < 1e-6, "{everything} {sixth}");
        assert!((wing_area_m2(s, r).unwrap() / sixth - 1.0).abs() < 1e-12);
        assert!((circles / circle_wing_area_m2(s, r).unwrap() - 1.0).abs() < 1e-6);
        let u = s / r;
        assert!((1.0 - circles / sixth) / (u * u / 60.0) > 0.9 && circles < sixth);
        // Both wings: the printed (27) less its rectangle is twice what is there.
        let printed = swept_area_paper_m2(600.0, s, r).unwrap() - 600.0 * s;
        let right = swept_area_m2(600.0, s, r).unwrap() - 600.0 * s;
        assert!((printed / right - 2.0).abs() < 1e-9 && (right / (2.0 * everything) - 1.0).abs() < 1e-6);
    }
}

#[test]
fn turning_and_then_flying_straight_reaches_six_metres_further_ahead_than_the_circles() {
    let (s, r) = (500.0f64, 500.0f64);
    let front: Vec<_> = (0..=20_000)
        .map(|k| turn_point(s, r * 20_000.0 / f64::from(k)).unwrap())
        .map(|end| (end.right_m, end.ahead_m))
        .collect();
    let mut most = [0.0f64; 2];
    for k in 0..=200 {
        let (x, y) = turn_then_straight(s, r, f64::from(k) / 200.0);
        let beside = front.partition_point(|q| q.0 < x).min(front.len() - 1);
        let nearest = front.iter().map(|q| (x - q.0).hypot(y - q.1)).fold(f64::INFINITY, f64::min);
        most = [most[0].max(y - front[beside].1), most[1].max(nearest)];
    }
    // Straight ahead of the circles' end at the same distance aside, and to the nearest of the ends.
    assert!((most[0] - 5.91).abs() < 0.02 && (most[1] - 5.16).abs() < 0.02, "{most:?}");
}

/// The shortest way to a point by a turn at `r` and then straight; none to the inside of the two tightest circles.
fn shortest_way_m(x: f64, y: f64, r: f64) -> Option<f64> {
    let (dx, dy) = (x.abs() - r, y);
    let tangent = (dx * dx + dy * dy - r * r).max(-1e-6 * r * r);
    if tangent < 0.0 && tangent < -1e-9 * r * r {
        return None;
    }
    let straight = tangent.max(0.0).sqrt();
    let phi = (straight.atan2(-r) - dy.atan2(dx)).rem_euclid(std::f64::consts::TAU);
    let phi = if phi > std::f64::consts::TAU - 1e-6 { 0.0 } else { phi };
    Some(r * phi + straight)
}

#[test]
fn random_flights_never_leave_the_set_whose_area_is_computed() {
    let mut rng = ChaCha8Rng::seed_from_u64(27);
    let r = 500.0;
    let (mut near_front, flights) = (0, 20_000);
    for _ in 0..flights {
        let s = r * rng.random_range(0.1..FRAC_PI_2);
        // Up to five stretches, each straight, at the tightest circle, or anything between.
        let (mut x, mut y, mut heading, mut left) = (0.0f64, 0.0f64, 0.0f64, s);
        for stretch in 0..5 {
            let length = if stretch == 4 { left } else { left * rng.random::<f64>() };
            let curvature = match rng.random_range(0..4) {
                0 => 0.0,
                1 => 1.0 / r,
                2 => -1.0 / r,
                _ => rng.random_range(-1.0..1.0) / r,
            };
            // The chord of an arc points along the mean heading.
            let turned = curvature * length;
            let chord = if turned == 0.0 { length } else { 2.0 / curvature * (turned / 2.0).sin() };
            (x, y) = (x + chord * (heading + turned / 2.0).sin(), y + chord * (heading + turned / 2.0).cos());
            (heading, left) = (heading + turned, left - length);
        }
        let way = shortest_way_m(x, y, r).unwrap_or_else(|| panic!("({x}, {y}) lies inside of a circle"));
        assert!(way <= s + 1e-4, "({x}, {y}) after {s} needs {way}");
        near_front += usize::from(way > 0.99 * s);
    }
    assert!(near_front > flights / 20, "only {near_front} flights come near the front");
}

#[test]
fn the_shown_area_is_that_of_a_raster() {
    let (r, cell) = (500.0f64, 2.0f64);
    for (s, a, b) in [(100.0f64, 300.0f64, 200.0f64), (500.0, 240.0, 400.0), (780.0, 300.0, 160.0)] {
        let (half_x, half_y) = ((a / 2.0 / cell) as i64, (b / 2.0 / cell) as i64);
        let reach = ((s + a.max(b)) / cell) as i64 + 4;
        let size = (2 * reach + 2) as usize;
        // Sums over the upper left of every cell, so that a window's sum says whether any reached cell is in it.
        let mut sums = vec![0u32; size * size];
        for j in 1..size {
            for i in 1..size {
                let x = (i as f64 - 1.0 - reach as f64) * cell;
                let y = (j as f64 - 1.0 - reach as f64) * cell;
                let reached = y >= 0.0 && shortest_way_m(x, y, r).is_some_and(|way| way <= s);
                sums[j * size + i] = u32::from(reached) + sums[(j - 1) * size + i] + sums[j * size + i - 1]
                    - sums[(j - 1) * size + i - 1];
            }
        }
        let clamp = |k: i64| k.clamp(0, size as i64 - 1) as usize;
        let mut covered = 0u32;
        for j in 1..size as i64 {
            for i in 1..size as i64 {
                let (left, right) = (clamp(i - half_x - 1), clamp(i + half_x));
                let (low, high) = (clamp(j - half_y - 1), clamp(j + half_y));
                let any = sums[high * size + right] + sums[low * size + left]
                    - sums[low * size + right]
                    - sums[high * size + left];
                covered += u32::from(any > 0);
            }
        }
        let counted = f64::from(covered) * cell * cell;
        let stated = shown_area_m2(a, b, s, r).unwrap();
        // Half a cell all round the rim.
        assert!((counted / stated - 1.0).abs() < 0.01, "{counted} counted, {stated} stated");
        // The printed one leaves out the image, about b s^2 / (2 R) along each wing, and has twice the wings.
        let left_out = stated - swept_area_paper_m2(a, s, r).unwrap() + s.powi(3) / (3.0 * r);
        let (along_wings, u) = (b * s * s / r, s / r);
        assert!((left_out - a * b - along_wings).abs() <= along_wings * u * u / 12.0 + 1e-6, "{left_out}");
    }
}

#[test]
fn refuses_more_than_a_quarter_turn_and_what_is_no_number() {
    for area in [end_curve_area_m2, wing_area_m2, circle_wing_area_m2] {
        assert_eq!(area(800.0, 500.0).unwrap_err().code(), "beyond_quarter_turn");
        assert!(area(500.0 * FRAC_PI_2, 500.0).is_ok() && area(f64::NAN, 500.0).is_err());
        assert_eq!((area(800.0, f64::INFINITY), area(0.0, 500.0)), (Ok(0.0), Ok(0.0)));
    }
    assert!(shown_area_m2(600.0, 400.0, 800.0, 500.0).is_err() && turn_point(-1.0, 5.0).is_err());
    assert!(swept_area_paper_m2(600.0, f64::NAN, 500.0).is_err() && turned_rad(1.0, 0.0).is_err());
}
