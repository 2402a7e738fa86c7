//! `Sample`: what is at a point of a scene.

/// Ground, road, field.
pub const GROUND: u16 = 0;
/// Trees, hedges, crops.
pub const GREEN: u16 = 1;
/// Open water.
pub const WATER: u16 = 2;
/// Cars and other small things.
pub const THING: u16 = 3;
/// The first building; the next has the next number.
pub const FIRST_BUILDING: u16 = 16;

/// What is at a point of the scene.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// Red, green, blue in [0, 255], in full sun on level ground.
    pub colour: [f32; 3],
    /// Height of the top, metres.
    pub top_m: f32,
    /// [`GROUND`], [`GREEN`], [`WATER`], [`THING`], or a building from [`FIRST_BUILDING`] on.
    pub kind: u16,
}
