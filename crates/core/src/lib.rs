//! What overfly computes: values in, values out. No file, no clock, no environment, no globals.
//!
//! Positions and frames, images, tiles, the camera, features, registration, the coupling modes and their models, regions to
//! search, routes. See ARCHITECTURE.md for the map of the modules, bottom first.

pub mod camera;
pub mod coupling;
pub mod feature;
pub mod geodesy;
pub mod pixels;
pub mod region;
pub mod registration;
pub mod route;
mod simd;
pub mod tile;
