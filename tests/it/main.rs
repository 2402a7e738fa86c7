//! One binary, a module per promise.

mod orthophotos;
mod store;
