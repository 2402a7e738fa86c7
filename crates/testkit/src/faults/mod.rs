//! Faults at every call that writes or reads a store: kills, losses of power, full disks, failing disks, short reads.
//! The tests inject a few, the example `faults` many.

pub mod bench;
pub mod operation;
pub mod operations;
pub mod reading;
pub mod serving;
pub mod shim;
pub mod tally;
