//! The computations of overfly: values in, values out. No file, no clock, no environment, no globals.
//!
//! The modules hold positions and frames, images, tiles, the camera, features, registration, the coupling modes and their
//! models, search regions and routes. ARCHITECTURE.md lists them from the bottom up.

// Only the SIMD kernels are unsafe: each allows it in its own file, and the `dispatch!` macro at its call.
#![deny(unsafe_code)]

#[forbid(unsafe_code)]
pub mod camera;
#[forbid(unsafe_code)]
pub mod coupling;
pub mod feature;
#[forbid(unsafe_code)]
pub mod geodesy;
#[forbid(unsafe_code)]
pub mod integrity;
#[forbid(unsafe_code)]
pub mod jpeg;
pub mod pixels;
#[forbid(unsafe_code)]
pub mod region;
pub mod registration;
#[forbid(unsafe_code)]
pub mod route;
mod simd;
#[forbid(unsafe_code)]
pub mod tile;
