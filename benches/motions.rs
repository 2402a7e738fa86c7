//! The steps of relative registration on drawn ground, frames of 512 px: `cargo bench --bench motions`.

use criterion::Criterion;
use nalgebra::Vector2;
use overfly_core::feature::keypoint::{KeypointOptions, describe_frame, match_mutual};
use overfly_core::pixels::Gray;
use overfly_core::registration::Similarity;
use overfly_core::registration::relative::alignment::align;
use overfly_core::registration::relative::consensus::{FrameSizes, find_consensus};
use overfly_core::registration::relative::{KeypointMatch, MotionPrior, register};
use std::hint::black_box;

const GROUND_PX: usize = 1200;
const FRAME_PX: usize = 512;

/// Overlapping rectangles of random gray (a fixed linear congruential generator), twice smoothed.
fn ground() -> Gray {
    let mut gray = Gray::filled(GROUND_PX, GROUND_PX, 100.0);
    let mut state = 12345u32;
    let mut next = |n: usize| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as usize % n
    };
    for _ in 0..24_000 {
        let (x, y, w, h, v) = (next(GROUND_PX), next(GROUND_PX), 3 + next(20), 3 + next(20), next(256));
        for j in y..(y + h).min(GROUND_PX) {
            gray.values_mut()[j * GROUND_PX + x..j * GROUND_PX + (x + w).min(GROUND_PX)].fill(v as f32);
        }
    }
    gray.filtered_5(|[a, b, c, d, e]| (a + b + c + d + e) * 0.2)
}

/// The frame whose pixels `ground_from_frame` takes to the ground.
fn frame(ground: &Gray, ground_from_frame: &Similarity) -> Gray {
    let value = |i: usize| {
        let p = Vector2::new((i % FRAME_PX) as f64 + 0.5, (i / FRAME_PX) as f64 + 0.5);
        let q = ground_from_frame.apply(p);
        ground.sample(q.x, q.y)
    };
    let values = (0..FRAME_PX * FRAME_PX).map(value).collect();
    Gray::from_values(FRAME_PX, FRAME_PX, values).expect("as many values as pixels")
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let ground = ground();
    let centre = Vector2::new(256.0, 256.0);
    let truth = Similarity::about(0.995, 0.06, centre, Vector2::new(300.0, 480.0));
    let at = |s: &Similarity| Similarity { t: s.t + Vector2::new(200.0, 100.0), ..*s };
    let still = Similarity { c: 1.0, s: 0.0, t: Vector2::zeros() };
    let (a, b) = (frame(&ground, &at(&still)), frame(&ground, &at(&truth)));
    let options = KeypointOptions { limit: 600, steps_per_octave: 1 };
    let (of_a, of_b) = (describe_frame(&a, &options), describe_frame(&b, &options));
    let matches = match_mutual(&of_a, &of_b, 0.95);
    let matches: Vec<_> = matches.iter().map(|m| KeypointMatch::new(&of_a, m.a, &of_b, m.b)).collect();
    let frames = FrameSizes { size_of_a: 2.0 * centre, centre_of_b: centre };
    let start = Similarity { t: truth.t + Vector2::new(0.6, -0.4), ..truth };

    let mut group = criterion.benchmark_group("motion");
    group.bench_function("describe_frame", |bench| bench.iter(|| describe_frame(black_box(&a), &options)));
    group.bench_function("match_mutual", |bench| bench.iter(|| match_mutual(black_box(&of_a), &of_b, 0.95)));
    group.bench_function("consensus", |bench| bench.iter(|| find_consensus(black_box(&matches), &frames, (0.4, 2.5))));
    group.bench_function("align", |bench| bench.iter(|| align(black_box(&a), &b, &start, centre, false)));
    group.bench_function("register", |bench| bench.iter(|| register(black_box(&a), &b, &MotionPrior::default())));
    group.finish();
    criterion.final_summary();
}
