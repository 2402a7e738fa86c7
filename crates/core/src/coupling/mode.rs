//! `Mode`: which registrations run when.

/// How relative and absolute registration are coupled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// So many relative registrations, then an absolute one, for which they wait.
    Sequential,
    /// Both at once: an absolute registration's result is carried forward by the relative ones made meanwhile.
    Parallel,
    /// Absolute registrations alone, each searching all that the aircraft can have reached since the last.
    Combined,
    /// Whichever of these the execution times and the last answers speak for, image by image.
    Auto,
    /// Relative registrations alone, from the start on: dead reckoning, to compare with.
    RelativeOnly,
}

impl Mode {
    /// The modes that `all` means.
    pub const ALL: [Self; 4] = [Self::Sequential, Self::Parallel, Self::Combined, Self::Auto];

    /// As JSON and the command line spell it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Sequential => "sequential",
            Self::Parallel => "parallel",
            Self::Combined => "combined",
            Self::Auto => "auto",
            Self::RelativeOnly => "relative_only",
        }
    }
}
