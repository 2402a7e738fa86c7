//! Descriptions of images, and how they are matched: keypoints with binary descriptors, structure, and cells of structure.

mod cell_map;
mod cells;
pub mod keypoint;
mod structure;

pub use cell_map::{CELL_ZERO, CellMap, CellWindow, cell_energy};
pub use cells::{CELL_PX, CELLS, CELLS_BLOB_LEN, LEAST_VALID, MISSING, describe_cells};
pub use structure::{BORDER_PX, CHANNEL_ONE, ENERGY_ONE, Structure};
