//! One binary, a module per promise.

mod build;
mod calibrate;
mod candidates;
mod command_line;
mod demo;
mod drawn;
mod equations;
mod fixes;
mod fly;
mod gdal;
mod hostile_frames;
mod hostile_orthophotos;
mod http;
mod kill;
mod layers;
mod motions;
mod negatives;
mod onboard;
mod orthophotos;
mod pictures;
mod plan;
mod reference;
mod simulation;
mod store;
mod walk;
