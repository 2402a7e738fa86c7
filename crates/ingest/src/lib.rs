//! All that happens before the flight: coordinate reference systems, orthophotos, building and merging stores, planning
//! routes, and cutting out what an aircraft takes along.

pub mod build;
pub mod crs;
pub mod export;
pub mod plan;
pub mod raster;
