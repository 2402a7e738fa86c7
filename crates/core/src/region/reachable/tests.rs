//! The outline against flights simulated one by one, and against areas that another program drew.

use super::*;
use crate::region::polygon::{Rectangle, convex_hull, weighted_area};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// One flight as (curvature as a share of the largest, share of the length), by circles about their centres.
pub(in crate::region) fn fly(pieces: &[(f64, f64)], flight: TurningFlight) -> (Vertex, f64) {
    let (mut at, mut heading) = ([0.0, 0.0], 0.0f64);
    for &(turn, share) in pieces {
        let length = share * flight.length_m;
        if turn == 0.0 {
            at = [at[0] + length * heading.sin(), at[1] + length * heading.cos()];
        } else {
            // Right of the heading by the signed radius lies the centre; the aircraft goes round it.
            let radius = flight.radius_m / turn;
            let centre = [at[0] + radius * heading.cos(), at[1] - radius * heading.sin()];
            heading += length / radius;
            at = [centre[0] - radius * heading.cos(), centre[1] + radius * heading.sin()];
        }
    }
    (at, heading)
}

/// Right and ahead of the image's middle to right and ahead of the start.
pub(in crate::region) fn on_ground(pose: (Vertex, f64), right: f64, ahead: f64) -> Vertex {
    let (sin, cos) = pose.1.sin_cos();
    [pose.0[0] + right * cos + ahead * sin, pose.0[1] + ahead * cos - right * sin]
}

/// Shares that add up to one.
fn shares(count: usize, rng: &mut impl Rng) -> Vec<f64> {
    let parts: Vec<f64> = (0..count).map(|_| -rng.random_range(f64::MIN_POSITIVE..1.0f64).ln()).collect();
    let sum: f64 = parts.iter().sum();
    parts.iter().map(|p| p / sum).collect()
}

/// Full turns and straight parts in any order; any curvature; weaving; turns with nothing between.
pub(in crate::region) fn random_pieces(kind: usize, rng: &mut impl Rng) -> Vec<(f64, f64)> {
    let count = rng.random_range(1..=10);
    let shares = shares(count, rng);
    match kind % 4 {
        0 => shares.into_iter().map(|s| ([-1.0, 0.0, 1.0][rng.random_range(0..3)], s)).collect(),
        1 => shares.into_iter().map(|s| (rng.random_range(-1.0..=1.0), s)).collect(),
        2 => {
            let (waves, phase, size) =
                (rng.random_range(0.5..9.0) * TAU, rng.random_range(0.0..TAU), rng.random_range(0.3..=1.0));
            (0..200).map(|i| (size * (phase + waves * (f64::from(i) + 0.5) / 200.0).sin(), 1.0 / 200.0)).collect()
        }
        _ => {
            let first = [-1.0, 1.0][rng.random_range(0..2)];
            shares.into_iter().enumerate().map(|(i, s)| (if i % 2 == 0 { first } else { -first }, s)).collect()
        }
    }
}

/// How often a ring goes round a point, by the angles of its sides.
pub(in crate::region) fn goes_round(ring: &[Vertex], point: Vertex) -> bool {
    let angle: f64 = (0..ring.len())
        .map(|i| {
            let (a, b) = (ring[i], ring[(i + 1) % ring.len()]);
            let (a, b) = ([a[0] - point[0], a[1] - point[1]], [b[0] - point[0], b[1] - point[1]]);
            (a[0] * b[1] - a[1] * b[0]).atan2(a[0] * b[0] + a[1] * b[1])
        })
        .sum();
    angle > PI
}

/// Lengths in radii: from hardly a bend to many circles, with the places where the set closes behind (5.6 to 6.3).
const LENGTHS: [f64; 16] = [0.02, 0.3, 0.7, 1.0, 1.6, 2.5, 3.1, 4.5, 5.2, 5.8, 6.1, 6.5, 9.0, 13.0, 25.0, 400.0];
/// Images in radii, and the last fix's error.
const IMAGES: [(f64, f64, f64); 4] = [(0.05, 0.04, 0.0), (0.6, 0.4, 0.1), (1.0, 3.0, 0.0), (12.0, 8.0, 2.0)];

fn flight(length: f64, (across, along, _): (f64, f64, f64)) -> TurningFlight {
    const RADIUS_M: f64 = 700.0;
    TurningFlight {
        length_m: length * RADIUS_M,
        radius_m: RADIUS_M,
        across_m: across * RADIUS_M,
        along_m: along * RADIUS_M,
    }
}

#[test]
fn no_flight_leaves_the_outline() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for length in LENGTHS {
        for image in IMAGES {
            let flight = flight(length, image);
            let inaccuracy_m = image.2 * flight.radius_m;
            let outline = reachable_outline(flight, inaccuracy_m);
            for n in 0..200 {
                let pose = fly(&random_pieces(n, &mut rng), flight);
                for corner in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                    let mut point = on_ground(pose, corner.0 * flight.across_m / 2.0, corner.1 * flight.along_m / 2.0);
                    for axis in &mut point {
                        *axis += [-0.5, 0.5][rng.random_range(0..2)] * inaccuracy_m;
                    }
                    assert!(goes_round(&outline, point), "{length} radii, image {image:?}: {point:?}");
                }
            }
        }
    }
}

/// Ends of the paths that bound the set, densely, both sides.
fn extremes(flight: TurningFlight, steps: u32) -> Vec<(Vertex, f64)> {
    let turns = [[1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [1.0, -1.0, 1.0]];
    let arc = (TAU * flight.radius_m / flight.length_m).min(1.0);
    let mut ends = Vec::new();
    for turns in turns.into_iter().flat_map(|t| [t, t.map(|turn: f64| -turn)]) {
        for i in 0..=steps {
            for j in 0..=steps {
                let (first, last) = (arc * f64::from(i) / f64::from(steps), arc * f64::from(j) / f64::from(steps));
                if first + last <= 1.0 {
                    ends.push(fly(&[(turns[0], first), (turns[1], 1.0 - first - last), (turns[2], last)], flight));
                }
            }
        }
    }
    ends
}

/// Distance of a point from an image at the end of a flight, moved by up to `half_m` east and north: by turns the
/// nearest point of one and of the other.
fn distance_m(point: Vertex, pose: (Vertex, f64), flight: TurningFlight, half_m: f64) -> f64 {
    let (sin, cos) = pose.1.sin_cos();
    let (mut moved, mut distance) = ([0.0, 0.0], f64::INFINITY);
    for _ in 0..if half_m > 0.0 { 12 } else { 1 } {
        let offset = [0, 1].map(|k| point[k] - moved[k] - pose.0[k]);
        let (right, ahead) = (offset[0] * cos - offset[1] * sin, offset[0] * sin + offset[1] * cos);
        let (across, along) = (flight.across_m / 2.0, flight.along_m / 2.0);
        let near = on_ground(pose, right.clamp(-across, across), ahead.clamp(-along, along));
        let rest = [0, 1].map(|k| point[k] - near[k]);
        moved = rest.map(|r: f64| r.clamp(-half_m, half_m));
        distance = (rest[0] - moved[0]).hypot(rest[1] - moved[1]);
    }
    distance
}

#[test]
fn flights_come_close_to_all_of_the_outline() {
    let (mut within_a_hundredth, mut all) = (0u32, 0u32);
    for length in [0.3, 1.0, 2.5, 4.5, 5.2, 7.0, 13.0, 25.0] {
        for image in &IMAGES[..3] {
            let flight = flight(length, *image);
            let half_m = image.2 * flight.radius_m / 2.0;
            let outline = reachable_outline(flight, 2.0 * half_m);
            let size_m = outline.iter().map(|v| v[0].hypot(v[1])).fold(0.0, f64::max);
            let ends = extremes(flight, 100);
            let corner_m = flight.corner_m() + 1.5 * half_m + 0.05 * size_m;
            for (i, a) in outline.iter().enumerate() {
                let b = outline[(i + 1) % outline.len()];
                for s in [0.0, 0.25, 0.5, 0.75] {
                    let point = [a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])];
                    let within = |part: f64| {
                        ends.iter()
                            .filter(|(at, _)| (point[0] - at[0]).hypot(point[1] - at[1]) <= corner_m)
                            .any(|&end| distance_m(point, end, flight, half_m) <= part * size_m)
                    };
                    // Where the ground seen from the start has a bay on one bearing, the bay counts.
                    assert!(within(0.05), "{length} radii, image {image:?}: {point:?}");
                    within_a_hundredth += u32::from(within(0.01));
                    all += 1;
                }
            }
        }
    }
    println!("{within_a_hundredth} of {all} points of outlines lie within 1 % of what a flight reaches");
    assert!(f64::from(within_a_hundredth) >= 0.97 * f64::from(all));
}

/// Areas drawn flight by flight by `tests/reference/reachable.py`: in radii the length and the image, then the area
/// shown and that with what it encloses.
#[test]
fn the_outline_holds_hardly_more_than_is_reached() {
    let rows =
        include_str!("../../../../../tests/reference/reachable.csv").lines().filter(|line| !line.starts_with('#'));
    let mut count = 0;
    for row in rows {
        let [length, across, along, shown, filled] =
            <[f64; 5]>::try_from(row.split(',').map(|v| v.parse().unwrap()).collect::<Vec<_>>()).unwrap();
        let flight = flight(length, (across, along, 0.0));
        let area = weighted_area(&reachable_outline(flight, 0.0), |_| 1.0) / flight.radius_m.powi(2);
        println!("{row}: {:+.2} %, {:+.2} % of filled", 100.0 * (area / shown - 1.0), 100.0 * (area / filled - 1.0));
        // The drawing is right to about 0.3 %.
        assert!(area >= 0.997 * filled && area <= 1.025 * filled, "{row}: {area}");
        assert!(area <= 1.065 * shown, "{row}: {area}");
        count += 1;
    }
    assert_eq!(count, 32);
}

#[test]
fn a_convex_hull_would_hold_much_more() {
    for (length, image, least, most) in [(2.2, (0.1, 0.1, 0.0), 2.3, 2.5), (1.0, (0.6, 0.4, 0.0), 1.12, 1.17)] {
        let outline = reachable_outline(flight(length, image), 0.0);
        let mut hull = Vec::new();
        convex_hull(&mut outline.clone(), &mut hull);
        let ratio = weighted_area(&hull, |_| 1.0) / weighted_area(&outline, |_| 1.0);
        assert!((least..most).contains(&ratio), "{ratio}");
    }
}

#[test]
fn hardly_any_flight_leaves_the_rectangle_of_the_image() {
    let flight = TurningFlight { length_m: 1e-3, radius_m: 50.0, across_m: 600.0, along_m: 400.0 };
    let area = weighted_area(&reachable_outline(flight, 30.0), |_| 1.0);
    assert!((area / (630.0 * 430.0) - 1.0).abs() < 0.02, "{area}");
}

#[test]
fn without_a_turn_the_image_lies_ahead() {
    // As stiff as numbers go, and no stiffer than that.
    for radius_m in [1e12, 1e300, f64::MAX] {
        let flight = TurningFlight { length_m: 5e3, radius_m, across_m: 600.0, along_m: 400.0 };
        let outline = reachable_outline(flight, 0.0);
        let around = Rectangle::around(&outline).unwrap();
        let expected = [-300.0, 4800.0, 300.0, 5200.0];
        for (found, expected) in [around.min, around.max].concat().into_iter().zip(expected) {
            assert!((found - expected).abs() < 10.0, "{around:?}");
        }
    }
}

#[test]
fn an_aircraft_that_turns_on_the_spot_reaches_a_disc() {
    for radius_m in [1e-3, 1e-200, f64::MIN_POSITIVE] {
        let flight = TurningFlight { length_m: 5e3, radius_m, across_m: 60.0, along_m: 40.0 };
        let area = weighted_area(&reachable_outline(flight, 0.0), |_| 1.0);
        let disc = PI * (5e3 + flight.corner_m()).powi(2);
        // The image turns at the end as it likes, so its corner points away everywhere.
        assert!(area >= disc && area < 1.02 * disc, "{area} {disc}");
    }
}

#[test]
fn an_image_lost_in_rounding_is_still_covered() {
    let flight = TurningFlight { length_m: 5e3, radius_m: 900.0, across_m: 1e-200, along_m: f64::MIN_POSITIVE };
    let outline = reachable_outline(flight, 0.0);
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for n in 0..400 {
        let (at, _) = fly(&random_pieces(n, &mut rng), flight);
        assert!(goes_round(&outline, at), "{at:?}");
    }
}
