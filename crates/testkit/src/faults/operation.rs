//! `WriteOperation`: a command that writes a store.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::PathBuf;

/// Where every operation writes.
pub const TARGET: &str = "target.gpkg";

/// An operation.
pub struct WriteOperation {
    pub name: &'static str,
    /// What stands in the work folder before, by name; [`TARGET`] among it where the operation changes a store.
    pub before: BTreeMap<&'static str, PathBuf>,
    /// The command line; `{}` is the work folder.
    pub arguments: Vec<OsString>,
    /// Whether an interrupted run may leave an unfinished layer, which the next run goes on with.
    pub resumes: bool,
    /// Whether the same command gives the same bytes, and not only the same digest.
    pub same_bytes: bool,
    /// Whether what it makes is a patch and no store.
    pub makes_patch: bool,
}
