//! A flight without pauses: from one drawn point of the inner area to the next, in turns that an aircraft can fly, in a wind that
//! changes slowly.

use super::normal::normal;
use super::pose::ScenePose;
use super::track::{Shot, TrackPlan, range};
use super::world::World;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{PI, TAU};

/// Smallest turn radius, in steps from one frame to the next.
const TURN_RADIUS_STEPS: f64 = 3.0;
/// What drifts slowly (wind, height, mean tilt) keeps this share of itself from one frame to the next.
const KEPT: f64 = 0.97;
/// Standard deviation of the angle between course and heading that the wind makes, radians.
const CRAB_SIGMA_RAD: f64 = 0.08;

/// What drifts slowly: a standard normal number that follows the one before.
struct Drift(f64);

impl Drift {
    fn draw(rng: &mut ChaCha8Rng) -> Self {
        Self(normal(rng))
    }

    fn next(&mut self, rng: &mut ChaCha8Rng) -> f64 {
        self.0 = KEPT * self.0 + (1.0 - KEPT * KEPT).sqrt() * normal(rng);
        self.0
    }
}

/// Draws the shots of a flight without pauses.
pub fn continuous_shots(plan: &TrackPlan, world: &World) -> Vec<Shot> {
    let rng = &mut ChaCha8Rng::seed_from_u64(plan.seed);
    let most_turn_rad = 1.0 / TURN_RADIUS_STEPS;
    let (mut place, mut target) = (inner_point(plan, world, rng), inner_point(plan, world, rng));
    let mut bearing_rad = towards(place, target);
    let mut drifts: [Drift; 4] = std::array::from_fn(|_| Drift::draw(rng));
    let tilt_towards_rad: f64 = rng.random_range(0.0..TAU);
    let mut shots = Vec::with_capacity(plan.frames);
    for k in 0..plan.frames {
        let [crab, height, tilt, turn] = drifts.each_mut().map(|drift| drift.next(rng));
        let crab_rad = CRAB_SIGMA_RAD * crab;
        let [low, high] = plan.height_m;
        let height_m = low + (high - low) * (0.5 + 0.25 * height).clamp(0.0, 1.0);
        let [least, most] = plan.tilt_deg;
        let tilt_rad = (least + (most - least) * (0.5 + 0.25 * tilt).clamp(0.0, 1.0)).to_radians();
        let towards_rad = tilt_towards_rad + 0.4 * turn;
        shots.push(shot(plan, world, rng, (place, bearing_rad, crab_rad, height_m), tilted(tilt_rad, towards_rad), k));
        if distance(place, target) < 2.0 * TURN_RADIUS_STEPS * plan.step_m {
            target = inner_point(plan, world, rng);
        }
        let turn_rad = (towards(place, target) - bearing_rad + PI).rem_euclid(TAU) - PI;
        bearing_rad += turn_rad.clamp(-most_turn_rad, most_turn_rad);
        let (sin, cos) = bearing_rad.sin_cos();
        place = [place[0] + plan.step_m * sin, place[1] - plan.step_m * cos];
    }
    shots
}

/// Pitch and roll of a direction off nadir: pitch ahead, then roll to the left of the pitched axis.
fn tilted(tilt_rad: f64, towards_rad: f64) -> [f64; 2] {
    [(tilt_rad.tan() * towards_rad.cos()).atan(), (tilt_rad.sin() * towards_rad.sin()).asin()]
}

fn shot(
    plan: &TrackPlan,
    world: &World,
    rng: &mut ChaCha8Rng,
    (place, bearing_rad, crab_rad, height_m): ([f64; 2], f64, f64, f64),
    tilt_rad: [f64; 2],
    index: usize,
) -> Shot {
    let [lowest_m, highest_m] = world.terrain.extremes_m(place, 0.3 * height_m);
    let ground_m = (0.5 * (lowest_m + highest_m)).max(world.water_m.unwrap_or(f64::MIN));
    let wobble_rad = plan.wobble_deg.to_radians();
    let rate = |rng: &mut ChaCha8Rng| plan.rate_deg_per_s.to_radians() * normal(rng);
    let (sin, cos) = bearing_rad.sin_cos();
    Shot {
        pose: ScenePose {
            place,
            z_m: ground_m + height_m,
            heading_rad: (bearing_rad + crab_rad).rem_euclid(TAU),
            pitch_rad: tilt_rad[0] + wobble_rad * normal(rng),
            roll_rad: tilt_rad[1] + wobble_rad * normal(rng),
        },
        time_s: index as f64 * plan.step_m / plan.speed_mps,
        velocity_mps: [sin * plan.speed_mps, -cos * plan.speed_mps],
        rates_rad_per_s: [rate(rng), rate(rng), rate(rng)],
    }
}

fn inner_point(plan: &TrackPlan, world: &World, rng: &mut ChaCha8Rng) -> [f64; 2] {
    let size_m = world.size_m();
    [0, 1].map(|axis| {
        let margin_m = plan.margin_m.min(0.45 * size_m[axis]);
        range(rng, [margin_m, size_m[axis] - margin_m])
    })
}

fn towards(from: [f64; 2], to: [f64; 2]) -> f64 {
    (to[0] - from[0]).atan2(from[1] - to[1])
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}
