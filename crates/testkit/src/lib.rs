//! What integration tests and rigs are made of: drawn stores, faults, injuries, soaks.

pub mod drawn;
pub mod faults;
pub mod injury;
pub mod soak;
