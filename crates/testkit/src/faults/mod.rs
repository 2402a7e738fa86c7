//! Faults at every call that writes a store or reads one: kills, losses of power, full disks, failing disks, short reads. Used by
//! the tests in short form and by the example `faults` in long form.

pub mod bench;
pub mod operation;
pub mod operations;
pub mod reading;
pub mod serving;
pub mod shim;
pub mod tally;
