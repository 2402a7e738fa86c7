//! `ScenePlan`: the patterns of a world, and the frames that see them.

use super::pattern::RepeatingPattern;
use super::pattern_kind::PatternKind;
use super::scene::{BlockOutline, PatternBlock, RepeatingScene};
use crate::trial::negatives::kind::NegativeKind;
use rand::Rng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// The most frames of a world.
const MOST_SEATS: usize = 6;
/// Most blocks of a world.
const MOST_BLOCKS: usize = 5;
/// Margin around ground that a frame must see wholly inside a block.
const MARGIN: f64 = 1.1;

/// The ground that a frame sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seat {
    /// Index of the frame in its flight.
    pub frame: usize,
    /// The nadir, metres of the scene.
    pub nadir_m: [f64; 2],
    /// Greatest distance from the nadir of ground in view, metres.
    pub reach_m: f64,
    /// Edge of a square of the same area as the frame's ground, metres.
    pub edge_m: f64,
}

/// The patterns of a world, and the frames that see them.
#[derive(Debug, Clone, PartialEq)]
pub struct ScenePlan {
    /// The patterns.
    pub scene: RepeatingScene,
    /// The frames; at least one.
    pub seats: Vec<Seat>,
}

impl ScenePlan {
    /// Plans a world of a kind. `seats` are all frames over the map, at least one. Periods reach from the shortest that the
    /// map resolves to half a frame's edge; where the frame's place is missing from the map, to at most `half_region_m`, half
    /// of the smallest region's edge: a place of which the region shows one copy only cannot be told from that copy.
    pub fn random(
        kind: NegativeKind,
        seats: &[Seat],
        least_period_m: f64,
        half_region_m: f64,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let mut seats = seats.to_vec();
        seats.shuffle(rng);
        let first = seats[0];
        let mut longest_m = 0.5 * first.edge_m;
        if kind == NegativeKind::RepeatingAbsent {
            longest_m = longest_m.min(half_region_m);
        }
        let periods_m = [least_period_m, longest_m.max(least_period_m)];
        let mut pattern = pattern(kind, periods_m, rng);
        let everywhere = |pattern: RepeatingPattern| vec![PatternBlock { pattern, outline: None }];
        let mut scene = RepeatingScene { blocks: Vec::new(), hole: None, real_share: 0.0 };
        match kind {
            NegativeKind::RepeatingMixed => {
                scene.real_share = if rng.random_bool(0.5) { 0.25 } else { 0.5 };
                scene.blocks = everywhere(pattern);
            }
            NegativeKind::RepeatingBlock => {
                let is_one_pattern = rng.random_bool(0.5);
                for seat in seats.iter().take(MOST_BLOCKS) {
                    if !is_one_pattern {
                        pattern = self::pattern(kind, periods_m, rng);
                    }
                    let outline = partial_outline(seat, pattern.angle_rad, rng);
                    scene.blocks.push(PatternBlock { pattern: pattern.clone(), outline: Some(outline) });
                }
            }
            NegativeKind::RepeatingInside => {
                let outline = outline_around(&first, pattern.angle_rad, 1.0..2.2, rng);
                scene.blocks = vec![PatternBlock { pattern, outline: Some(outline) }];
            }
            NegativeKind::RepeatingGaps => {
                pattern.missing = rng.random_range(0.05..0.35);
                pattern.changed = rng.random_range(0.4..1.0);
                let outline = rng.random_bool(0.5).then(|| outline_around(&first, pattern.angle_rad, 1.0..2.2, rng));
                scene.blocks = vec![PatternBlock { pattern, outline }];
            }
            NegativeKind::RepeatingAbsent => {
                scene.hole = Some(outline_around(&first, pattern.angle_rad, 1.0..1.3, rng));
                scene.blocks = everywhere(pattern);
            }
            _ => scene.blocks = everywhere(pattern),
        }
        let sees = |seat: &Seat| match kind {
            NegativeKind::RepeatingBlock => scene.blocks.iter().any(|b| b.depth_m(seat.nadir_m) > -0.3 * seat.edge_m),
            NegativeKind::RepeatingAbsent => is_inside(scene.hole, seat),
            _ => is_inside(scene.blocks[0].outline, seat),
        };
        let mut chosen: Vec<Seat> = seats.iter().copied().filter(sees).take(MOST_SEATS).collect();
        if chosen.is_empty() {
            chosen.push(first);
        }
        Self { scene, seats: chosen }
    }
}

/// A pattern with a period between two lengths, uniform in its logarithm.
fn pattern(kind: NegativeKind, [shortest_m, longest_m]: [f64; 2], rng: &mut ChaCha8Rng) -> RepeatingPattern {
    let kinds: &[PatternKind] =
        if kind == NegativeKind::RepeatingGaps { &PatternKind::PLANTED } else { &PatternKind::ALL };
    let kind = kinds[rng.random_range(0..kinds.len())];
    let period_m = shortest_m * (longest_m / shortest_m).powf(rng.random::<f64>());
    RepeatingPattern::random(kind, period_m, rng)
}

/// A block of 0.3 to 1.5 frame edges whose middle a frame sees.
fn partial_outline(seat: &Seat, angle_rad: f64, rng: &mut ChaCha8Rng) -> BlockOutline {
    let mut offset = |centre: f64| centre + rng.random_range(-0.4..0.4) * seat.edge_m;
    let centre_m = [offset(seat.nadir_m[0]), offset(seat.nadir_m[1])];
    let mut half = || rng.random_range(0.15..0.75) * seat.edge_m;
    BlockOutline { centre_m, half_m: [half(), half()], angle_rad }
}

/// A block that holds all ground of a frame. Its sides are `size` times as long as needed.
fn outline_around(seat: &Seat, angle_rad: f64, size: std::ops::Range<f64>, rng: &mut ChaCha8Rng) -> BlockOutline {
    let need_m = MARGIN * seat.reach_m;
    let half_m = [0; 2].map(|_| need_m * rng.random_range(size.clone()));
    let free = half_m.map(|half| half - need_m);
    let (sin, cos) = angle_rad.sin_cos();
    let [u, v] = free.map(|f| f * rng.random_range(-1.0..1.0));
    let centre_m = [seat.nadir_m[0] + u * cos - v * sin, seat.nadir_m[1] + u * sin + v * cos];
    BlockOutline { centre_m, half_m, angle_rad }
}

/// Whether a frame sees nothing outside an outline.
fn is_inside(outline: Option<BlockOutline>, seat: &Seat) -> bool {
    outline.is_none_or(|o| o.depth_m(seat.nadir_m) > seat.reach_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    fn seats() -> Vec<Seat> {
        let seat =
            |i: usize| Seat { frame: i, nadir_m: [150.0 * i as f64, 40.0 * i as f64], reach_m: 350.0, edge_m: 500.0 };
        (0..12).map(seat).collect()
    }

    #[test]
    fn equal_seeds_plan_equal_worlds() {
        for kind in NegativeKind::ALL.into_iter().filter(|k| k.is_repeating()) {
            let plan = |seed| ScenePlan::random(kind, &seats(), 20.0, 150.0, &mut ChaCha8Rng::seed_from_u64(seed));
            assert_eq!(plan(4), plan(4));
            assert_ne!(plan(4), plan(5));
        }
    }

    #[test]
    fn frames_see_the_ground_that_their_kind_promises() {
        for seed in 0..100 {
            let plan = |kind| ScenePlan::random(kind, &seats(), 20.0, 150.0, &mut ChaCha8Rng::seed_from_u64(seed));
            let inside = plan(NegativeKind::RepeatingInside);
            let outline = inside.scene.blocks[0].outline.unwrap();
            assert!(inside.seats.iter().all(|s| outline.depth_m(s.nadir_m) > s.reach_m));
            let absent = plan(NegativeKind::RepeatingAbsent);
            assert!(
                absent.scene.blocks[0].pattern.period_m[0].min(absent.scene.blocks[0].pattern.period_m[1]) <= 150.0
            );
            assert!(absent.seats.iter().all(|s| absent.scene.hole.unwrap().depth_m(s.nadir_m) > s.reach_m));
            let mixed = plan(NegativeKind::RepeatingMixed).scene.real_share;
            assert!(mixed == 0.25 || mixed == 0.5);
            let [p, q] = plan(NegativeKind::Repeating).scene.blocks[0].pattern.period_m;
            assert!((17.0..=250.0).contains(&p.min(q)), "{p} {q}");
            let blocks = plan(NegativeKind::RepeatingBlock);
            assert!(blocks.scene.blocks.iter().all(|b| b.outline.unwrap().half_m.iter().all(|h| *h < 376.0)));
        }
    }
}
