//! `WriteOperation`: a command that writes a store.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::PathBuf;

/// The file that every operation writes.
pub const TARGET: &str = "target.gpkg";

/// A command that writes a store.
pub struct WriteOperation {
    pub name: &'static str,
    /// The files in the work folder before, by name; [`TARGET`] is among them if the operation changes a store.
    pub before: BTreeMap<&'static str, PathBuf>,
    /// The command line; `{}` stands for the work folder.
    pub arguments: Vec<OsString>,
    /// Whether an interrupted run may leave an unfinished layer, which the next run continues.
    pub resumes: bool,
    /// Whether it makes a new map, which no command overwrites: once it is there, the same command is refused.
    pub makes_map: bool,
    /// Whether the same command gives the same bytes, not only the same digest.
    pub same_bytes: bool,
    /// Whether the result is a patch, not a store.
    pub makes_patch: bool,
}
