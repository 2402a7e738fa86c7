//! overfly: the tile database that lets an aircraft fly without GPS.
//!
//! Orthophotos become a tiled, descriptor-indexed GeoPackage; a camera frame is located on it. See ARCHITECTURE.md
//! for the map of the modules, bottom first.

pub mod build;
pub mod camera;
pub mod coupling;
pub mod explain;
pub mod feature;
pub mod geodesy;
pub mod locate;
pub mod navigate;
pub mod package;
pub mod pixels;
pub mod plan;
pub mod raster;
pub mod region;
pub mod registration;
pub mod report;
pub mod server;
mod simd;
pub mod store;
pub mod tile;
pub mod trial;
