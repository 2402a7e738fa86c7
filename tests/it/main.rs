//! One binary, a module per promise.

mod build;
mod candidates;
mod drawn;
mod gdal;
mod http;
mod kill;
mod onboard;
mod orthophotos;
mod reference;
mod store;
