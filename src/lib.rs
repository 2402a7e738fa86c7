//! The `overfly` program: the command line and the HTTP service.

// A program without the laboratory uses less of what its commands share.
#![cfg_attr(not(feature = "lab"), allow(dead_code, unused_imports))]

pub mod cli;
mod ground_motion;
pub mod server;
mod today;
