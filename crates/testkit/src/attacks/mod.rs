//! Attacks on the service: many clients that ask for much, send little or take nothing, while somebody asks for its health.

pub mod attack;
pub mod material;
pub mod prober;
pub mod run;
