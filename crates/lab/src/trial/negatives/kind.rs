//! `NegativeKind`: the ways in which a frame can have no place in the region that is searched for it.

use serde::Serialize;

/// Why a fix of such a trial is false, whatever it says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum NegativeKind {
    /// A real frame; the region, grown by the frame's reach, does not hold its place.
    Elsewhere,
    /// The frame's left and right exchanged, as over a mirrored map.
    Mirrored,
    /// The frame turned by 90, 180 or 270 degrees, the heading left as it was stated.
    Turned,
    /// White or smoothed noise.
    Noise,
    /// Faint ripples.
    Water,
    /// One value, a gradient, or a vignette.
    Blank,
    /// Stripes, chequers, crop rows or rectangular parcels that repeat themselves.
    Fields,
    /// The frame magnified 1.3 to 1.6 times, the height left as it was stated.
    Scaled,
    /// A frame of another place, seen through this flight's camera.
    Foreign,
}

impl NegativeKind {
    /// All of them, in the order in which they are reported.
    pub const ALL: [Self; 9] = [
        Self::Elsewhere,
        Self::Mirrored,
        Self::Turned,
        Self::Noise,
        Self::Water,
        Self::Blank,
        Self::Fields,
        Self::Scaled,
        Self::Foreign,
    ];

    /// Whether the frame still shows ground of the region, so that evidence for its true place is no accident: only the
    /// sensors' veto makes a fix false.
    pub fn shows_its_ground(self) -> bool {
        self == Self::Scaled
    }

    /// Whether the frame shows no ground at all, so that no place is more false than another.
    pub fn is_without_place(self) -> bool {
        matches!(self, Self::Noise | Self::Water | Self::Blank | Self::Fields | Self::Foreign)
    }

    /// As JSON and the command line spell it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Elsewhere => "elsewhere",
            Self::Mirrored => "mirrored",
            Self::Turned => "turned",
            Self::Noise => "noise",
            Self::Water => "water",
            Self::Blank => "blank",
            Self::Fields => "fields",
            Self::Scaled => "scaled",
            Self::Foreign => "foreign",
        }
    }
}

impl std::str::FromStr for NegativeKind {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, Self::Err> {
        let words = || Self::ALL.map(Self::word).join(", ");
        Self::ALL.into_iter().find(|k| k.word() == word).ok_or_else(|| format!("one of {}", words()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_what_json_says() {
        for kind in NegativeKind::ALL {
            assert_eq!(serde_json::to_value(kind).unwrap(), kind.word());
            assert_eq!(kind.word().parse(), Ok(kind));
        }
        assert!("nothing".parse::<NegativeKind>().is_err());
    }
}
