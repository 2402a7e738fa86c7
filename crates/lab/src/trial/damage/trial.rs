//! `DamageTrial`: the options of a trial of damaged frames.

use super::change::FileChange;
use super::format::FrameFormat;
use crate::trial::fixes::FixTrial;

/// The options of a trial.
#[derive(Debug, Clone)]
pub struct DamageTrial {
    /// What the searches are told, with how many threads each, and the seed of everything random.
    pub fixes: FixTrial,
    /// Formats to write frames in.
    pub formats: Vec<FrameFormat>,
    /// Changes to make.
    pub changes: Vec<FileChange>,
    /// Trials of each format, spread evenly over the changes that it takes.
    pub trials: usize,
    /// Frames that are tried at the same time.
    pub threads: usize,
}
