//! `Exit`: the program's exit codes.

use std::process::ExitCode;

/// How a command ended. Exit code 2 is also what clap uses for bad usage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    /// 0: done.
    Done,
    /// 1: failed, or only partly done.
    Failed,
    /// 2: bad usage, or nothing usable in the input.
    Unusable,
    /// 3: no fix, or verification failed.
    NoFix,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(match exit {
            Exit::Done => 0,
            Exit::Failed => 1,
            Exit::Unusable => 2,
            Exit::NoFix => 3,
        })
    }
}
