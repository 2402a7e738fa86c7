//! Material for integration tests and rigs: drawn stores, faults, injuries, soaks. Only dev-dependencies use this
//! crate; the rigs are its examples.

pub mod attacks;
pub mod drawn;
pub mod faults;
pub mod hostile;
pub mod inflating;
pub mod injury;
pub mod older_store;
pub mod soak;
