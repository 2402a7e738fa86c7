//! All that happens before the flight: coordinate reference systems, orthophotos, building and merging stores, planning
//! routes, and exporting what one flight needs.
//!
//! Errors state facts. What a user can do about one is its [`Remedy`], which the program that shows the error puts into words.

pub mod build;
pub mod crs;
pub mod export;
pub mod plan;
pub mod raster;
mod remedy;

pub use remedy::Remedy;
