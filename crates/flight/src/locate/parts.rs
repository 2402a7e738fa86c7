//! `Parts`: a registration with one of its parts left out, so that a trial shows what each part brings.

/// A part of a registration without which frames can still be located.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Part {
    /// The soft vote: only windows with one peak each vote.
    SoftVote,
    /// The small windows of the soft vote: those that measure also vote.
    SmallWindows,
    /// The weights of the soft vote's windows: all count alike, and only the variance of their sum is measured.
    WindowWeights,
    /// The tilt that a soft vote elects, and the votes held anew under a tilt.
    Tilt,
    /// What the whole view must show beside a soft vote.
    WholeView,
    /// The votes on whether a rival is chance.
    RivalVotes,
    /// Rivals within a place's own ellipse widen its covariance: they make it ambiguous.
    NearRivals,
    /// The terrain of the store: frames are laid on a plane.
    Terrain,
}

impl Part {
    /// All parts, in the order of a search.
    pub const ALL: [Self; 8] = [
        Self::SoftVote,
        Self::SmallWindows,
        Self::WindowWeights,
        Self::Tilt,
        Self::WholeView,
        Self::RivalVotes,
        Self::NearRivals,
        Self::Terrain,
    ];
}

/// All parts but one at most.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Parts {
    left_out: Option<Part>,
}

impl Parts {
    /// All parts: what everybody flies with.
    pub const ALL: Self = Self { left_out: None };

    /// All parts but this one.
    pub fn without(part: Part) -> Self {
        Self { left_out: Some(part) }
    }

    /// Whether a part is there.
    pub fn has(self, part: Part) -> bool {
        self.left_out != Some(part)
    }
}
