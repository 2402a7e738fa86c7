//! The laboratory: trials against truth, simulation, the paper's experiment, reports and pictures.

pub mod explain;
pub mod report;
pub mod scene;
pub mod trial;
