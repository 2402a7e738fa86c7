//! All that flies: camera frames are decoded, located on a store, and coupled into a flight's positions.

pub mod cross_check;
pub mod frame;
pub mod locate;
pub mod navigate;
