//! The ground of a town: main roads, streets, pavements, gardens, lawns, yards, parks.

use super::district::{Block, District, MAIN_HALF_M, MAIN_REACH_M, PAVEMENT_M, Place, TownLayout, Use};
use super::lot::lot_at;
use crate::scene::date::SceneDate;
use crate::scene::noise::{chance, cloudy, smooth};
use crate::scene::sample::{GREEN, GROUND};

/// Colour, height above the terrain in metres, and kind of a point.
pub type Surface = ([f32; 3], f64, u16);

const PAVEMENT: [f32; 3] = [158.0, 152.0, 143.0];
const LAWN: [f32; 3] = [98.0, 120.0, 64.0];
const SOIL: [f32; 3] = [128.0, 106.0, 82.0];

/// What is at a point of a town's ground on a day.
pub fn surface(layout: &TownLayout, date: &SceneDate, x_m: f64, y_m: f64) -> Surface {
    let place = layout.place(x_m, y_m);
    let district = &layout.districts[place.district];
    let (colour, lift_m, kind) = main_road(&place).unwrap_or_else(|| {
        let block = district.block(place.uv);
        street(district, &block, place.uv).unwrap_or_else(|| match district.used {
            Use::Houses | Use::Rows => garden(district, &block, place.uv, date, [x_m, y_m]),
            Use::Flats => lawn(district, &block, place.uv, date, [x_m, y_m]),
            Use::Works => yard(district, &block, place.uv, [x_m, y_m]),
            Use::Park => park(district, date, [x_m, y_m]),
        })
    });
    // Wear at 0.3 m, 1.3 m and 9 m.
    let wear = 0.035 * smooth(11, x_m / 0.3, y_m / 0.3)
        + 0.04 * smooth(12, x_m / 1.3, y_m / 1.3)
        + 0.05 * smooth(13, x_m / 9.0, y_m / 9.0);
    (colour.map(|c| c * (1.0 + wear)), lift_m, kind)
}

fn flat(colour: [f32; 3]) -> Surface {
    (colour, 0.0, GROUND)
}

fn asphalt(seed: u32, at: [f64; 2], age: f32) -> [f32; 3] {
    let base = 78.0 + 46.0 * age;
    // Mended patches along the road, and cracks.
    let patch =
        if chance(seed, (at[0] / 11.0).floor() as i32, (at[1] / 2.7).floor() as i32) < 0.09 { -18.0 } else { 0.0 };
    let crack = smooth(seed ^ 8, at[0] / 4.0, at[1] / 2.0).abs();
    let line = if crack < 0.03 { -14.0 } else { 0.0 };
    let tone = base + patch + line;
    [tone, tone, tone * 1.02]
}

fn main_road(place: &Place) -> Option<Surface> {
    let (d, s) = (place.border_m, place.along_m);
    if d > MAIN_REACH_M {
        return None;
    }
    if d > MAIN_HALF_M {
        let is_kerb = d < MAIN_HALF_M + 0.2;
        return Some(flat(if is_kerb { [186.0, 182.0, 174.0] } else { PAVEMENT.map(|c| c * slabs(s, d)) }));
    }
    let is_dash = d < 0.12 && s.rem_euclid(9.0) < 4.0;
    let is_edge = (d - (MAIN_HALF_M - 2.1)).abs() < 0.07;
    let is_worn = chance(3, (s / 0.8) as i32, 2) < 0.2;
    if (is_dash || is_edge) && !is_worn {
        return Some(flat([206.0, 206.0, 200.0]));
    }
    Some(flat(asphalt(23, [s, d], 0.45)))
}

/// Joints of slabs, as a factor.
fn slabs(s: f64, d: f64) -> f32 {
    if s.rem_euclid(1.5) < 0.1 || d.rem_euclid(0.9) < 0.08 { 0.9 } else { 1.0 }
}

/// Carriageway, kerb and pavement of the streets around a block; a few of a district's streets are missing.
fn street(district: &District, block: &Block, uv: [f64; 2]) -> Option<Surface> {
    if district.used == Use::Park {
        return None;
    }
    let [i, j] = block.number;
    let sides = [(0, 0, i, j), (1, 0, i + 1, j), (2, 1, j, i), (3, 1, j + 1, i)];
    let (mut nearest_m, mut along) = (f64::MAX, 0.0);
    for (edge, axis, line, piece) in sides {
        if is_street(district, axis, line, piece) {
            let d = (uv[axis] - block.edges_m[edge]).abs();
            if d < nearest_m {
                (nearest_m, along) = (d, uv[1 - axis]);
            }
        }
    }
    let age = chance(district.seed, 61, 0);
    let half_m = district.half_m;
    match nearest_m {
        d if d < half_m => {
            let is_dash = d < 0.09 && along.rem_euclid(6.0) < 2.5 && district.used != Use::Houses;
            Some(flat(if is_dash { [198.0, 198.0, 192.0] } else { asphalt(district.seed, [along, d], age) }))
        }
        d if d < half_m + 0.2 => Some(flat([176.0, 172.0, 164.0])),
        d if d < half_m + PAVEMENT_M => {
            let is_verge = district.used == Use::Houses && chance(district.seed, 62, 0) < 0.5 && d < half_m + 0.9;
            Some(flat(if is_verge { LAWN.map(|c| c * 1.05) } else { PAVEMENT.map(|c| c * slabs(along, d)) }))
        }
        _ => None,
    }
}

/// Whether a piece of a street was built: street `line` of an axis, between the streets `piece` and `piece + 1` that cross it.
pub fn is_street(district: &District, axis: usize, line: i32, piece: i32) -> bool {
    axis == 1 || chance(district.seed ^ 0x77, line, piece) > 0.15
}

fn grass(seed: u32, date: &SceneDate, [x, y]: [f64; 2]) -> [f32; 3] {
    let own = chance(seed, 5, 6);
    let patches = cloudy(seed ^ 31, x / 7.0, y / 7.0);
    let lush = date.tinted(LAWN.map(|c| c * (0.82 + 0.36 * own)), 0.75 * chance(date.seed_of(seed), 7, 7) + 0.25);
    let blades = 1.0 + 0.09 * smooth(71, x / 0.35, y / 0.35) + 0.16 * patches;
    [lush[0] * blades + 10.0 * patches, lush[1] * blades, lush[2] * blades]
}

/// A garden with hedge or fence, drive, terrace, beds and lawn.
fn garden(district: &District, block: &Block, uv: [f64; 2], date: &SceneDate, at: [f64; 2]) -> Surface {
    let Some(lot) = lot_at(district, block, uv) else { return flat(grass(block.seed(district), date, at)) };
    let [s, t] = lot.local(uv);
    let (width_m, depth_m) = (lot.width_m(), lot.depth_m());
    let looks = date.seed_of(lot.seed);
    let look = |n: i32| chance(looks, n, 8);
    let setback_m = lot.setback_m(district.used);
    let edge_m = s.min(width_m - s).min(depth_m - t);
    let is_front = t < setback_m;
    if edge_m < 0.45 && !is_front {
        let border = lot.draw(30);
        if border < 0.45 {
            let leaves = 1.0 + 0.2 * smooth(41, at[0] / 0.5, at[1] / 0.5);
            let lift_m = 1.3 + 0.9 * lot.draw(31) + 0.2 * f64::from(leaves);
            return (date.tinted([62.0, 86.0, 44.0], 0.2).map(|c| c * leaves), lift_m, GREEN);
        }
        if border < 0.8 && edge_m < 0.16 {
            return ([132.0, 112.0, 90.0], 1.2, GROUND);
        }
    }
    let drive_m = if lot.draw(32) < 0.5 { s } else { width_m - s };
    let is_drive = lot.draw(33) < 0.75 && drive_m < 3.3 && drive_m > 0.5 && t < setback_m + 9.0;
    if is_drive || (is_front && lot.draw(34) < 0.35) {
        let tone = 0.8 + 0.4 * lot.draw(35) as f32;
        return flat(PAVEMENT.map(|c| c * tone * slabs(s, t)));
    }
    if district.used == Use::Rows && lot.draw(36) < 0.5 {
        let tone = 0.72 + 0.4 * lot.draw(37) as f32;
        return flat([140.0 * tone, 134.0 * tone, 126.0 * tone]);
    }
    let terrace_m = t - setback_m - 8.0 - 3.0 * lot.draw(38);
    if (0.0..4.5).contains(&terrace_m) && (s - 0.5 * width_m).abs() < 0.3 * width_m {
        let tone = 0.85 + 0.35 * look(1);
        return flat([168.0 * tone, 152.0 * tone, 134.0 * tone]);
    }
    if look(2) < 0.13 && (t - 0.72 * depth_m).abs() < 1.9 && (s - 0.5 * width_m).abs() < 3.4 {
        let is_rim = (t - 0.72 * depth_m).abs() > 1.55 || (s - 0.5 * width_m).abs() > 3.0;
        return flat(if is_rim { [196.0, 192.0, 182.0] } else { [72.0, 156.0, 178.0] });
    }
    bed(looks, date, at).unwrap_or_else(|| flat(grass(lot.seed, date, at)))
}

/// Flower beds, bushes and dug soil.
fn bed(seed: u32, date: &SceneDate, [x, y]: [f64; 2]) -> Option<Surface> {
    let where_ = smooth(seed ^ 51, x / 3.2, y / 3.2);
    if where_ > 0.52 {
        let leaves = smooth(seed ^ 52, x / 0.55, y / 0.55);
        let lift_m = f64::from(((where_ - 0.52) * 4.0).min(1.0) * (1.1 + 0.5 * leaves));
        return Some((
            date.tinted([70.0, 92.0, 48.0], 0.25).map(|c| c * (1.0 + 0.25 * leaves)),
            lift_m.max(0.1),
            GREEN,
        ));
    }
    (where_ < -0.66).then(|| flat(SOIL.map(|c| c * (0.9 + 0.15 * smooth(seed ^ 53, x / 0.5, y / 0.9)))))
}

/// Lawns between flats, with car parks and paths.
fn lawn(district: &District, block: &Block, uv: [f64; 2], date: &SceneDate, at: [f64; 2]) -> Surface {
    if is_car_park(district, block, uv) {
        let [u0, _, v0, _] = block.inner_m(district);
        let is_line = (uv[0] - u0).rem_euclid(2.6) < 0.14 && (uv[1] - v0).rem_euclid(16.0) < 4.8;
        return flat(if is_line { [196.0; 3] } else { asphalt(district.seed ^ 5, uv, 0.7) });
    }
    let path = smooth(block.seed(district), at[0] / 26.0, at[1] / 26.0);
    if path.abs() < 0.035 {
        return flat(PAVEMENT.map(|c| c * 1.02));
    }
    bed(date.seed_of(block.seed(district)), date, at).unwrap_or_else(|| flat(grass(block.seed(district), date, at)))
}

/// Whether a point of a block lies on its car park: a strip along v at one end.
pub fn is_car_park(district: &District, block: &Block, uv: [f64; 2]) -> bool {
    let [u0, u1, v0, v1] = block.inner_m(district);
    let wide_m = if district.used == Use::Works { 0.3 } else { 0.22 } * (u1 - u0);
    uv[0] > u0 + 1.0 && uv[0] < u0 + wide_m && uv[1] > v0 + 1.5 && uv[1] < v1 - 1.5
}

/// The yard of a works: asphalt, concrete, gravel, a strip of grass at its edge.
fn yard(district: &District, block: &Block, uv: [f64; 2], at: [f64; 2]) -> Surface {
    let [u0, u1, v0, v1] = block.inner_m(district);
    let edge_m = (uv[0] - u0).min(u1 - uv[0]).min(uv[1] - v0).min(v1 - uv[1]);
    let seed = block.seed(district);
    if edge_m < 2.2 {
        return flat(LAWN.map(|c| c * (1.0 + 0.1 * smooth(seed, at[0], at[1]))));
    }
    if is_car_park(district, block, uv) {
        let is_line = (uv[1] - v0).rem_euclid(2.7) < 0.14 && (uv[0] - u0).rem_euclid(15.0) < 5.0;
        return flat(if is_line { [200.0; 3] } else { asphalt(seed, uv, 0.4) });
    }
    // Slabs of concrete of 6 m, some darker; stains.
    let slab = chance(seed, (uv[0] / 6.0).floor() as i32, (uv[1] / 6.0).floor() as i32);
    let joint = if uv[0].rem_euclid(6.0) < 0.12 || uv[1].rem_euclid(6.0) < 0.12 { 0.85 } else { 1.0 };
    let stain = 1.0 + 0.12 * cloudy(seed ^ 6, at[0] / 9.0, at[1] / 9.0);
    let tone = (136.0 + 22.0 * slab) * joint * stain;
    flat([tone, tone * 0.99, tone * 0.95])
}

/// Grass, paths and a pond.
fn park(district: &District, date: &SceneDate, at: [f64; 2]) -> Surface {
    let [x, y] = at;
    let path = smooth(district.seed ^ 2, x / 48.0, y / 48.0) - 0.15 * smooth(district.seed ^ 3, x / 17.0, y / 17.0);
    if path.abs() < 0.045 {
        return flat([186.0, 172.0, 142.0]);
    }
    let pond = smooth(district.seed ^ 4, x / 60.0, y / 60.0);
    if pond > 0.62 {
        return flat([54.0, 68.0, 66.0]);
    }
    if pond > 0.585 {
        return (date.tinted([88.0, 104.0, 58.0], 0.5), 0.5, GREEN);
    }
    bed(district.seed, date, [x / 2.0, y / 2.0]).unwrap_or_else(|| flat(grass(district.seed, date, at)))
}
