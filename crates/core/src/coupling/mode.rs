//! `Mode`: the coupling of relative and absolute registration.

/// The coupling of relative and absolute registration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// A number of relative registrations, then an absolute one, for which they wait.
    Sequential,
    /// Both run at the same time: the relative registrations propagate the result of an absolute one to the present.
    Parallel,
    /// Absolute registrations only. Each searches all ground that the aircraft can have reached since the last fix.
    Combined,
    /// One of these modes for each image, by the execution times and the last answers.
    Auto,
    /// Relative registrations only: dead reckoning from the start, for comparison.
    RelativeOnly,
}

impl Mode {
    /// The modes that `all` stands for.
    pub const ALL: [Self; 4] = [Self::Sequential, Self::Parallel, Self::Combined, Self::Auto];

    /// The word for the mode in JSON and on the command line.
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
