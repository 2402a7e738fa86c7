//! Drawn worlds with exact truth: maps of them as others make maps, and frames as real cameras take frames.
//!
//! A world is a grid of cells with heights, so roofs lean, walls show and shadows fall as they must. The map is rectified on the bare
//! ground only, seen from one side on another day, and warped. A frame is cast ray by ray. Truth follows from the renderer's own
//! rays, not from the program's camera model.

mod building;
mod cast;
mod cells;
mod continuous_track;
mod date;
mod exposure;
mod files;
mod flight;
mod lakes;
mod mountains;
pub mod noise;
mod normal;
mod objects;
mod orthophoto;
mod pose;
mod sample;
mod sun;
mod terrain;
#[cfg(test)]
mod tests;
mod town;
mod track;
pub mod utm;
mod world;

pub use date::SceneDate;
pub use exposure::Exposure;
pub use files::{write_heights, write_map};
pub use flight::{FlightPlan, TrueColumns};
pub use lakes::{CELL_M as LAKES_CELL_M, LEVEL_M as LAKES_LEVEL_M, lakes};
pub use mountains::{CELL_M as MOUNTAINS_CELL_M, mountains};
pub use orthophoto::{MapWarp, OrthophotoPlan};
pub use sun::Sun;
pub use terrain::Terrain;
pub use town::{CELL_M as TOWN_CELL_M, town};
pub use track::TrackPlan;
pub use world::World;
