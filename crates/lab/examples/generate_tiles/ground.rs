//! The colour of the ground at a point: crops, grass, tracks, roads, rails, water.

use crate::curve::Curve;
use crate::noise::{chance, cloudy, smooth};
use crate::parcels::ParcelPlace;
use crate::scene::{FarmlandScene, LandUse};

type Rgb = [f32; 3];

/// How a field looks.
struct Crop {
    colour: Rgb,
    soil: Rgb,
    /// Share of soil that shows between rows, [0, 1].
    open: f32,
    /// Strength of streaks along the rows.
    streak: f32,
    /// Whether tractor lines show.
    lines: f32,
}

const fn crop(colour: Rgb, soil: Rgb, open: f32, streak: f32, lines: f32) -> Crop {
    Crop { colour, soil, open, streak, lines }
}

const SOIL: Rgb = [146.0, 122.0, 94.0];
/// Early summer: wheat, barley, rape past its flower, young maize, beet, oats, fallow.
const EARLY_SUMMER: [Crop; 7] = [
    crop([92.0, 116.0, 62.0], SOIL, 0.05, 0.05, 0.22),
    crop([156.0, 152.0, 94.0], SOIL, 0.06, 0.06, 0.20),
    crop([132.0, 138.0, 66.0], SOIL, 0.04, 0.05, 0.16),
    crop([104.0, 116.0, 66.0], [152.0, 130.0, 100.0], 0.55, 0.13, 0.10),
    crop([78.0, 110.0, 54.0], SOIL, 0.18, 0.09, 0.18),
    crop([112.0, 132.0, 76.0], SOIL, 0.06, 0.05, 0.22),
    crop([138.0, 128.0, 92.0], SOIL, 0.40, 0.05, 0.05),
];
/// Early autumn, three years later: stubble, ploughed, ripe maize, harrowed, catch crop, beet, pale stubble.
const EARLY_AUTUMN: [Crop; 7] = [
    crop([184.0, 166.0, 120.0], SOIL, 0.10, 0.12, 0.14),
    crop([120.0, 98.0, 78.0], [104.0, 84.0, 66.0], 0.5, 0.11, 0.04),
    crop([100.0, 108.0, 56.0], SOIL, 0.05, 0.10, 0.10),
    crop([162.0, 138.0, 108.0], [140.0, 116.0, 90.0], 0.4, 0.08, 0.10),
    crop([94.0, 122.0, 62.0], SOIL, 0.25, 0.07, 0.06),
    crop([76.0, 106.0, 52.0], SOIL, 0.10, 0.09, 0.14),
    crop([198.0, 184.0, 142.0], SOIL, 0.06, 0.10, 0.16),
];

fn mix(a: Rgb, b: Rgb, t: f32) -> Rgb {
    let t = t.clamp(0.0, 1.0);
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t)
}

fn scale(a: Rgb, k: f32) -> Rgb {
    a.map(|v| v * k)
}

/// 1 within `half_m` of a line, 0 beyond, over a soft edge of half a metre.
fn within(distance_m: f64, half_m: f64) -> f32 {
    ((half_m - distance_m) / 0.5 + 0.5).clamp(0.0, 1.0) as f32
}

/// Colour (before the sun) and height of what grows, at a point of the scene, in an epoch.
pub fn ground(scene: &FarmlandScene, epoch: usize, x: f64, y: f64) -> (Rgb, f32) {
    let place = scene.parcels.place(x, y, epoch);
    let mut colour = match scene.uses[place.parcel] {
        LandUse::Arable => field(scene, epoch, &place, x, y),
        LandUse::Meadow | LandUse::Orchard => meadow(scene, epoch, &place, x, y),
        LandUse::Garden => garden(scene, epoch, x, y),
        LandUse::Wood => forest_floor(scene, x, y),
        LandUse::FelledWood => {
            if epoch == 0 {
                forest_floor(scene, x, y)
            } else {
                clearing(scene, x, y)
            }
        }
        LandUse::YoungWood => {
            if epoch == 1 {
                forest_floor(scene, x, y)
            } else {
                clearing(scene, x, y)
            }
        }
    };
    let mut height = 0.0;
    let grass = grass(scene, epoch, x, y);
    if scene.has_track(&place) {
        colour = mix(colour, grass, within(place.boundary_m, 3.2));
        let rut = within((place.boundary_m - 0.85).abs(), 0.45);
        colour = mix(colour, [176.0, 162.0, 134.0], rut * (0.75 + 0.25 * smooth(scene.seed + 8, x / 6.0, y / 6.0)));
    } else if scene.has_hedge(&place) {
        colour = mix(colour, grass, within(place.boundary_m, 4.0));
        let half_m =
            2.0 + 1.1 * f64::from(smooth(scene.seed + 9, x / 11.0, y / 11.0)) - if epoch == 0 { 0.2 } else { 0.0 };
        let gap = cloudy(scene.seed + 10, x / 50.0, y / 50.0) < -0.42;
        if !gap && place.boundary_m < half_m {
            let bush = smooth(scene.seed + 11, x / 2.2, y / 2.2);
            height = ((1.0 - (place.boundary_m / half_m).powi(2)).sqrt() * 2.6) as f32 + 0.8 * bush;
            let leaf = if epoch == 0 { [74.0, 98.0, 50.0] } else { [84.0, 92.0, 50.0] };
            colour = scale(leaf, 1.0 + 0.2 * bush);
        }
    } else {
        colour = mix(colour, grass, within(place.boundary_m, 0.9) * 0.8);
    }
    for (centre, radius_m) in &scene.yards {
        let d = (x - centre[0]).hypot(y - centre[1]) + 4.0 * f64::from(smooth(scene.seed + 12, x / 10.0, y / 10.0));
        let gravel = scale([172.0, 164.0, 150.0], 1.0 + 0.08 * cloudy(scene.seed + 13, x / 5.0, y / 5.0));
        colour = mix(colour, gravel, within(d, *radius_m));
    }
    let (colour, is_water) = water(scene, epoch, x, y, colour, grass);
    let (colour, is_road) = roads(scene, epoch, x, y, colour, grass);
    let speckle = 1.0 + 0.05 * (chance(scene.seed + 14 + epoch as u32, (x * 2.0) as i32, (y * 2.0) as i32) - 0.5);
    (scale(colour, speckle), if is_water || is_road { 0.0 } else { height.max(0.0) })
}

fn field(scene: &FarmlandScene, epoch: usize, place: &ParcelPlace, x: f64, y: f64) -> Rgb {
    let id = (place.parcel as i32, place.half as i32 + 4 * epoch as i32);
    let pick = (chance(scene.seed + 15, id.0, id.1) * 7.0) as usize;
    let crop = if epoch == 0 { &EARLY_SUMMER[pick] } else { &EARLY_AUTUMN[pick] };
    let tone = 0.93 + 0.14 * chance(scene.seed + 16, id.0, id.1);
    // Along the edge the tractor turns: rows follow the boundary there.
    let (along, across) = if place.edge_m < 12.0 {
        (place.along_m + place.across_m, place.edge_m)
    } else {
        (place.along_m, place.across_m)
    };
    let wet = cloudy(scene.seed + 17, x / 120.0, y / 120.0);
    let patch = cloudy(scene.seed + 18 + epoch as u32, x / 22.0, y / 22.0);
    let streak = smooth(scene.seed + 19 + id.0 as u32 * 3, along / 45.0, across / 1.6)
        + 0.6 * smooth(scene.seed + 20 + id.0 as u32 * 3, along / 200.0, across / 5.0);
    let open = crop.open * (0.6 + 0.4 * patch) + (0.5 * wet - 0.22).max(0.0) * 0.7;
    let mut colour = mix(crop.colour, crop.soil, open);
    colour = scale(colour, tone * (1.0 - 0.09 * wet + 0.06 * patch + crop.streak * streak));
    let shifted = across + f64::from(chance(scene.seed + 21, id.0, 3)) * 20.0;
    let wheel = ((shifted.rem_euclid(21.0) - 10.5).abs() - 0.95).abs();
    let line = within(wheel, 0.4) * (0.8 + 0.2 * smooth(scene.seed + 22, along / 12.0, across));
    mix(colour, scale(crop.soil, 0.95), line * crop.lines * 3.6)
}

fn grass(scene: &FarmlandScene, epoch: usize, x: f64, y: f64) -> Rgb {
    let base = if epoch == 0 { [106.0, 126.0, 72.0] } else { [132.0, 132.0, 82.0] };
    let tuft = cloudy(scene.seed + 23 + epoch as u32, x / 7.0, y / 7.0);
    scale(base, 1.0 + 0.10 * tuft)
}

fn meadow(scene: &FarmlandScene, epoch: usize, place: &ParcelPlace, x: f64, y: f64) -> Rgb {
    let dry = cloudy(scene.seed + 24, x / 70.0, y / 70.0);
    let mut colour = mix(grass(scene, epoch, x, y), [150.0, 142.0, 92.0], 0.25 + 0.4 * dry);
    let is_mown = chance(scene.seed + 25, place.parcel as i32, epoch as i32) < 0.45;
    if is_mown {
        let swath = (place.across_m / 3.4).floor() as i64 % 2 == 0;
        colour = scale(mix(colour, [148.0, 150.0, 96.0], 0.5), if swath { 1.05 } else { 0.95 });
    }
    colour
}

fn garden(scene: &FarmlandScene, epoch: usize, x: f64, y: f64) -> Rgb {
    let plot = chance(scene.seed + 26, (x / 17.0).floor() as i32, (y / 21.0).floor() as i32);
    let base = grass(scene, epoch, x, y);
    match plot {
        v if v < 0.14 => mix(base, [158.0, 148.0, 132.0], 0.75),
        v if v < 0.3 => mix(base, [120.0, 98.0, 74.0], 0.5),
        v => scale(base, 0.85 + 0.3 * v),
    }
}

fn forest_floor(scene: &FarmlandScene, x: f64, y: f64) -> Rgb {
    scale([66.0, 70.0, 46.0], 1.0 + 0.2 * cloudy(scene.seed + 27, x / 4.0, y / 4.0))
}

fn clearing(scene: &FarmlandScene, x: f64, y: f64) -> Rgb {
    let scrub = cloudy(scene.seed + 28, x / 9.0, y / 9.0);
    mix([142.0, 126.0, 98.0], [96.0, 108.0, 62.0], 0.45 + 0.7 * scrub)
}

fn water(scene: &FarmlandScene, epoch: usize, x: f64, y: f64, land: Rgb, grass: Rgb) -> (Rgb, bool) {
    // The second epoch is a dry autumn: the lake is 7 m smaller all round, the river 1 m on each side.
    let (lake_down_m, river_down_m) = if epoch == 0 { (0.0, 0.0) } else { (7.0, 1.0) };
    let mut colour = land;
    let mut wet_m = f64::INFINITY;
    let mut shore_m = f64::INFINITY;
    if let Some(b) = scene.river.beside(x, y) {
        let bank_m = b.offset_m.abs() - scene.river_half_m(b.along_m);
        (wet_m, shore_m) = (bank_m + river_down_m, bank_m);
    }
    let lake_m = scene.beyond_lake_m(x, y);
    (wet_m, shore_m) = (wet_m.min(lake_m + lake_down_m), shore_m.min(lake_m));
    colour = mix(
        colour,
        scale(grass, 0.9),
        within(shore_m, 6.0 + 3.0 * f64::from(smooth(scene.seed + 29, x / 13.0, y / 13.0))),
    );
    let mud = scale([150.0, 138.0, 112.0], 1.0 + 0.08 * cloudy(scene.seed + 30, x / 6.0, y / 6.0));
    colour = mix(colour, mud, within(shore_m, 0.8));
    let deep = if epoch == 0 { [54.0, 70.0, 68.0] } else { [66.0, 80.0, 66.0] };
    let shallow = if epoch == 0 { [84.0, 92.0, 74.0] } else { [98.0, 98.0, 74.0] };
    let surface = mix(shallow, deep, (-wet_m / 6.0) as f32);
    let ripple = 1.0 + 0.03 * smooth(scene.seed + 31 + epoch as u32, x / 3.0, y / 9.0);
    (mix(colour, scale(surface, ripple), within(wet_m, 0.0)), wet_m < 0.0)
}

fn roads(scene: &FarmlandScene, epoch: usize, x: f64, y: f64, land: Rgb, grass: Rgb) -> (Rgb, bool) {
    let distance = |curve: &Curve| curve.beside(x, y);
    let mut colour = land;
    let mut nearest_m = f64::INFINITY;
    for b in scene.drives.iter().filter_map(distance) {
        let d = b.offset_m.abs();
        colour = mix(colour, grass, within(d, 3.0));
        let gravel = scale([182.0, 170.0, 146.0], 1.0 + 0.06 * cloudy(scene.seed + 32, x / 5.0, y / 5.0));
        colour = mix(colour, gravel, within(d, 1.7) * if d < 0.4 { 0.6 } else { 1.0 });
        nearest_m = nearest_m.min(d);
    }
    let worn = cloudy(scene.seed + 33, x / 16.0, y / 16.0);
    let asphalt = |tone: f32| scale([132.0, 132.0, 134.0], tone * (1.0 + 0.05 * worn));
    if let Some(b) = distance(&scene.railway) {
        let d = b.offset_m.abs();
        colour = mix(colour, scale(grass, 0.92), within(d, 6.5));
        let sleeper = if (b.along_m / 1.2).fract() < 0.5 { 0.94 } else { 1.0 };
        colour = mix(colour, scale([142.0, 132.0, 124.0], sleeper), within(d, 2.6));
        colour = mix(colour, [96.0, 86.0, 82.0], within((d - 0.75).abs(), 0.15));
        nearest_m = nearest_m.min(d);
    }
    for b in scene.side_roads.iter().filter_map(distance) {
        let d = b.offset_m.abs();
        colour = mix(colour, grass, within(d, 4.4));
        colour = mix(colour, asphalt(1.06), within(d, 2.4));
        nearest_m = nearest_m.min(d);
    }
    if let Some(b) = distance(&scene.main_road) {
        let d = b.offset_m.abs();
        colour = mix(colour, grass, within(d, 7.0));
        // The western half has a new, darker surface in the second epoch.
        let is_new = epoch == 1 && x < 1300.0;
        colour = mix(colour, asphalt(if is_new { 0.78 } else { 1.0 }), within(d, 3.7));
        let dash = (b.along_m / 12.0).fract() < 0.5;
        colour =
            mix(colour, [214.0, 214.0, 208.0], within((d - 3.2).abs(), 0.12) + if dash { within(d, 0.1) } else { 0.0 });
        nearest_m = nearest_m.min(d);
    }
    (colour, nearest_m < 4.5)
}
