//! Coordinate reference systems: positions in them to WGS84 and back.
//!
//! Projections are `proj4rs`'s; parameters come from an EPSG code or a [`Definition`]. A system that cannot be projected
//! correctly is refused by name. This module does no I/O: `raster` reads the CRS of a file.

mod datum;
mod definition;
mod epsg;
mod error;
mod reference_system;

pub use datum::{DatumShift, Ellipsoid};
pub use definition::{Definition, Method};
pub use error::CrsError;
pub use reference_system::Crs;
