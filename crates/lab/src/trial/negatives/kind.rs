//! `NegativeKind`: the ways in which a frame can have no place in the searched region.

use serde::Serialize;

/// The reason why any fix of a trial is false.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum NegativeKind {
    /// A real frame; the region, extended by the frame's reach, does not contain its place.
    Elsewhere,
    /// The frame mirrored, as over a mirrored map.
    Mirrored,
    /// The frame turned by 90, 180 or 270 degrees; the stated heading stays.
    Turned,
    /// White or smoothed noise.
    Noise,
    /// Faint waves.
    Water,
    /// One value, a gradient, or a vignette.
    Blank,
    /// Repeated stripes, chequers, crop rows or rectangular parcels.
    Fields,
    /// The frame magnified 1.3 to 1.6 times; the stated height stays.
    Scaled,
    /// A frame of another place, seen through this flight's camera.
    Foreign,
}

impl NegativeKind {
    /// All kinds, in the order of reports.
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

    /// Whether the frame still shows ground of the region, so that evidence for its true place is no chance agreement
    /// and only the gate of the sensors makes a fix false.
    pub fn shows_its_ground(self) -> bool {
        self == Self::Scaled
    }

    /// Whether the frame shows no ground at all, so that every place is equally false.
    pub fn is_without_place(self) -> bool {
        matches!(self, Self::Noise | Self::Water | Self::Blank | Self::Fields | Self::Foreign)
    }

    /// The name in JSON and on the command line.
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
