//! The models of the coupling modes and of execution time. Numbers in, numbers out: no geometry, no clock.

mod nominal;

pub use nominal::{SECONDS_PER_TILE, nominal_count_sequential, region_edges_m};
