//! Repeatable noise: a value for every point of the plane, the same on every run and every thread.

/// A well-mixed 32-bit number of three integers.
#[inline]
pub fn hash(seed: u32, x: i32, y: i32) -> u32 {
    let mut h =
        seed.wrapping_mul(0x9e37_79b9) ^ (x as u32).wrapping_mul(0x85eb_ca6b) ^ (y as u32).wrapping_mul(0xc2b2_ae35);
    h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
    h ^ (h >> 15)
}

/// Like [`hash`], in [0, 1).
#[inline]
pub fn chance(seed: u32, x: i32, y: i32) -> f32 {
    (hash(seed, x, y) >> 8) as f32 / (1u32 << 24) as f32
}

/// Smooth value noise in [-1, 1] with features of size one.
#[inline]
pub fn smooth(seed: u32, x: f64, y: f64) -> f32 {
    let (ix, iy) = (x.floor(), y.floor());
    let ease = |t: f64| (t * t * (3.0 - 2.0 * t)) as f32;
    let (fx, fy) = (ease(x - ix), ease(y - iy));
    let (ix, iy) = (ix as i32, iy as i32);
    let corner = |dx, dy| chance(seed, ix + dx, iy + dy) * 2.0 - 1.0;
    let top = corner(0, 0) + (corner(1, 0) - corner(0, 0)) * fx;
    let bottom = corner(0, 1) + (corner(1, 1) - corner(0, 1)) * fx;
    top + (bottom - top) * fy
}

/// Four octaves of [`smooth`], about in [-1, 1].
pub fn cloudy(seed: u32, x: f64, y: f64) -> f32 {
    let octave = |k: u32, w: f32| smooth(seed.wrapping_add(k * 7919), x * f64::from(1 << k), y * f64::from(1 << k)) * w;
    (octave(0, 1.0) + octave(1, 0.5) + octave(2, 0.25) + octave(3, 0.125)) / 1.4
}
