//! The kernels of absolute registration on a drawn ground: `cargo bench --bench registration`.

use criterion::{Criterion, Throughput};
use overfly_core::camera::{Camera, GroundGrid, View, render};
use overfly_core::feature::Structure;
use overfly_core::pixels::{Gray, Mask};
use overfly_core::registration::coarse::{CoarseMap, PlacedView, Reach};
use overfly_core::registration::peak_z_score::{REACH_PX, peak_z_score};
use overfly_core::registration::window_fit::{WindowFitOptions, fit_windows};
use overfly_core::registration::windows::{WindowOptions, match_windows};
use std::hint::black_box;

/// Edge of the map, pixels. Views are 216 x 162 px: a 256 x 192 frame of 5.5 m per px on a level of 6.5 m per px.
const MAP_PX: usize = 512;
const VIEW_PX: [usize; 2] = [216, 162];

/// Overlapping rectangles of random gray (a fixed linear congruential generator).
fn ground() -> Gray {
    let mut gray = Gray::filled(MAP_PX, MAP_PX, 100.0);
    let mut state = 12345u32;
    let mut next = |n: usize| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as usize % n
    };
    for _ in 0..4000 {
        let (x, y, w, h, v) = (next(MAP_PX), next(MAP_PX), 3 + next(20), 3 + next(20), next(256));
        for j in y..(y + h).min(MAP_PX) {
            gray.values_mut()[j * MAP_PX + x..j * MAP_PX + (x + w).min(MAP_PX)].fill(v as f32);
        }
    }
    gray
}

fn structure(gray: &Gray) -> Structure {
    Structure::new(gray, &Mask::filled(gray.width_px(), gray.height_px(), true))
}

fn cut(gray: &Gray, at: [usize; 2], [width, height]: [usize; 2]) -> Gray {
    let values = (0..width * height).map(|i| gray.at(at[0] + i % width, at[1] + i / width)).collect();
    Gray::from_values(width, height, values).expect("as many values as pixels")
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let ground = ground();
    let map = structure(&ground);
    describing(&mut criterion, &ground);
    searching(&mut criterion, &ground);
    refining(&mut criterion, &ground, &map);
    criterion.final_summary();
}

fn describing(criterion: &mut Criterion, ground: &Gray) {
    let mut group = criterion.benchmark_group("describe");
    let mask = Mask::filled(MAP_PX, MAP_PX, true);
    group.throughput(Throughput::Elements((MAP_PX * MAP_PX) as u64));
    group.bench_function("structure", |b| b.iter(|| Structure::new(black_box(ground), &mask)));
    let frame = cut(ground, [0, 0], [256, 192]);
    let camera = Camera::new(&View::Nadir { gsd_m_per_px: 5.5 }, 256, 192).expect("a camera");
    let grid = GroundGrid::around(&camera, 0.6, [6.5, 6.5], 1.0).expect("the camera looks down");
    group.throughput(Throughput::Elements((grid.width_px * grid.height_px) as u64));
    group.bench_function("ground view", |b| b.iter(|| render(black_box(&frame), &camera, 0.6, &grid)));
    group.finish();
}

fn searching(criterion: &mut Criterion, ground: &Gray) {
    let region = structure(&cut(ground, [0, 0], [128, 128]));
    let view = PlacedView { structure: structure(&cut(ground, [30, 40], [54, 40])), nadir_px: [27, 20] };
    let reach = Reach::from_views(std::slice::from_ref(&view));
    let map = CoarseMap::new(&region, reach);
    let mut fourier = map.fourier();
    let normalisation = map.normalisation(&mut fourier, &view).expect("the view is not blank");
    let mut group = criterion.benchmark_group("coarse, 128 x 128 px");
    group.bench_function("transform the map", |b| b.iter(|| CoarseMap::new(black_box(&region), reach)));
    group.bench_function("denominator", |b| b.iter(|| map.normalisation(&mut fourier, black_box(&view))));
    group.bench_function("two views", |b| {
        b.iter(|| map.correlate(&mut fourier, [black_box(&view), &view], &normalisation))
    });
    group.finish();
}

fn refining(criterion: &mut Criterion, ground: &Gray, map: &Structure) {
    let view = structure(&cut(ground, [100, 120], VIEW_PX));
    let mut group = criterion.benchmark_group("refine, 216 x 162 px");
    let mut matches = Vec::new();
    for (name, radius_px, step_px) in
        [("windows, radius 4", 4, 1), ("windows, radius 8", 8, 1), ("windows, radius 8 in steps of 2", 8, 2)]
    {
        let options = WindowOptions { size_px: 32, stride_px: 32, radius_px, step_px };
        matches = match_windows(&view, map, [100, 120], &options);
        group.bench_function(name, |b| b.iter(|| match_windows(black_box(&view), map, [100, 120], &options)));
    }
    let options = WindowFitOptions { tolerance_px: 1.25, max_growth: 0.12, max_turn_rad: 0.14 };
    group.bench_function("similarity", |b| b.iter(|| fit_windows(black_box(&matches), [108.0, 81.0], &options)));
    let around = structure(&cut(ground, [100 - REACH_PX, 120 - REACH_PX], VIEW_PX.map(|n| n + 2 * REACH_PX)));
    group.bench_function("peak z-score", |b| b.iter(|| peak_z_score(black_box(&view), &around, [REACH_PX; 2])));
    group.finish();
}
