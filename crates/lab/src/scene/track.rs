//! `Shot`: when, where and how each frame of a flight is taken; `TrackPlan` draws them.

use super::normal::normal;
use super::pose::ScenePose;
use super::world::World;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// One frame to be taken.
#[derive(Debug, Clone, Copy)]
pub struct Shot {
    /// The camera when the middle row is read.
    pub pose: ScenePose,
    /// Seconds on the flight's clock.
    pub time_s: f64,
    /// Motion towards east and south, metres per second.
    pub velocity_mps: [f64; 2],
    /// Turn of heading, pitch and roll, radians per second.
    pub rates_rad_per_s: [f64; 3],
}

/// A flight in straight lines, each from one edge of the inner area to another.
#[derive(Debug, Clone, Copy)]
pub struct TrackPlan {
    /// Frames.
    pub frames: usize,
    /// Most frames of a line: pitch and roll keep their means along it.
    pub line_frames: usize,
    /// From one frame to the next, metres.
    pub step_m: f64,
    /// Speed, metres per second.
    pub speed_mps: f64,
    /// Lowest and highest height above the ground, metres.
    pub height_m: [f64; 2],
    /// Least and greatest angle off nadir, degrees, in a direction that is drawn for each line.
    pub tilt_deg: [f64; 2],
    /// Standard deviation of pitch and roll from frame to frame, degrees.
    pub wobble_deg: f64,
    /// Standard deviation of the turn rates, degrees per second.
    pub rate_deg_per_s: f64,
    /// From the edge of the world to the nearest nadir, metres.
    pub margin_m: f64,
    /// Whether the flight goes from line to line in turns, without pauses and jumps.
    pub is_continuous: bool,
    /// Seed.
    pub seed: u64,
}

impl TrackPlan {
    /// Draws the shots.
    pub fn shots(&self, world: &World) -> Vec<Shot> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let mut shots = Vec::with_capacity(self.frames);
        let mut time_s = 0.0;
        while shots.len() < self.frames {
            let line = Line::draw(self, world, &mut rng);
            let count =
                ((line.length_m / self.step_m) as usize).clamp(1, self.line_frames).min(self.frames - shots.len());
            for k in 0..count {
                shots.push(self.shot(&line, k as f64 * self.step_m, time_s, world, &mut rng));
                time_s += self.step_m / self.speed_mps;
            }
            // The turn to the next line.
            time_s += 12.0 * self.step_m / self.speed_mps;
        }
        shots
    }

    fn shot(&self, line: &Line, along_m: f64, time_s: f64, world: &World, rng: &mut ChaCha8Rng) -> Shot {
        let (sin, cos) = line.bearing_rad.sin_cos();
        let aside_m = 0.004 * line.height_m * normal(rng);
        let place = [line.start[0] + sin * along_m + cos * aside_m, line.start[1] - cos * along_m + sin * aside_m];
        let height_m = line.height_m * (1.0 + 0.01 * normal(rng));
        let [lowest_m, highest_m] = world.terrain.extremes_m(place, 0.3 * height_m);
        let ground_m = (0.5 * (lowest_m + highest_m)).max(world.water_m.unwrap_or(f64::MIN));
        let wobble_rad = self.wobble_deg.to_radians();
        let rate = |rng: &mut ChaCha8Rng| self.rate_deg_per_s.to_radians() * normal(rng);
        Shot {
            pose: ScenePose {
                place,
                z_m: ground_m + height_m,
                heading_rad: (line.bearing_rad + line.crab_rad + 0.02 * normal(rng)).rem_euclid(std::f64::consts::TAU),
                pitch_rad: line.tilt_rad[0] + wobble_rad * normal(rng),
                roll_rad: line.tilt_rad[1] + wobble_rad * normal(rng),
            },
            time_s,
            velocity_mps: [sin * self.speed_mps, -cos * self.speed_mps],
            rates_rad_per_s: [rate(rng), rate(rng), rate(rng)],
        }
    }
}

/// A straight line of a flight.
struct Line {
    start: [f64; 2],
    length_m: f64,
    bearing_rad: f64,
    crab_rad: f64,
    height_m: f64,
    /// Mean pitch and roll.
    tilt_rad: [f64; 2],
}

impl Line {
    /// From a point of one edge of the inner area to a point of another.
    fn draw(plan: &TrackPlan, world: &World, rng: &mut ChaCha8Rng) -> Self {
        let size_m = world.size_m();
        let far = |axis: usize| (size_m[axis] - plan.margin_m).max(plan.margin_m + 1.0);
        let edge = rng.random_range(0..4);
        let on_edge = |edge: usize, rng: &mut ChaCha8Rng| {
            let free = |axis: usize, rng: &mut ChaCha8Rng| rng.random_range(plan.margin_m..far(axis));
            match edge {
                0 => [free(0, rng), plan.margin_m],
                1 => [far(0), free(1, rng)],
                2 => [free(0, rng), far(1)],
                _ => [plan.margin_m, free(1, rng)],
            }
        };
        let start = on_edge(edge, rng);
        let end = on_edge((edge + rng.random_range(1..4)) % 4, rng);
        let (dx, dy) = (end[0] - start[0], end[1] - start[1]);
        let tilt_rad = range(rng, plan.tilt_deg).to_radians();
        let towards_rad: f64 = rng.random_range(0.0..std::f64::consts::TAU);
        Self {
            start,
            length_m: dx.hypot(dy),
            bearing_rad: dx.atan2(-dy),
            crab_rad: 0.06 * normal(rng),
            height_m: range(rng, plan.height_m),
            // A direction off nadir by `tilt`: pitch ahead, then roll to the left of the pitched axis.
            tilt_rad: [(tilt_rad.tan() * towards_rad.cos()).atan(), (tilt_rad.sin() * towards_rad.sin()).asin()],
        }
    }
}

/// An even number between two bounds.
pub fn range(rng: &mut ChaCha8Rng, [low, high]: [f64; 2]) -> f64 {
    low + (high - low) * rng.random::<f64>()
}
