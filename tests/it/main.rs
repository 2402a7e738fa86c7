//! One binary, a module per promise.

mod candidates;
mod http;
mod onboard;
mod orthophotos;
mod reference;
mod store;
