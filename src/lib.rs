//! The `overfly` program: the command line and the service over HTTP.

pub mod cli;
pub mod server;
