//! `NegativeKind`: the ways in which a fix can be false.

use serde::Serialize;

/// The reason why any fix of a trial is false, or any but the one at the frame's place.
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
    /// A pattern over the whole map and in the frame. In this kind and those below, a fix at the true place is right.
    Repeating,
    /// The same, mixed with a quarter or a half of the real imagery.
    RepeatingMixed,
    /// Blocks of pattern, smaller than a frame or a little larger, in real surroundings.
    RepeatingBlock,
    /// A frame wholly within a block of pattern.
    RepeatingInside,
    /// A pattern with many missing elements, most of which differ between the map and the frame.
    RepeatingGaps,
    /// A frame of a pattern whose place shows other ground on the map, or lies outside the region. Every fix is false.
    RepeatingAbsent,
}

impl NegativeKind {
    /// All kinds, in the order of reports.
    pub const ALL: [Self; 15] = [
        Self::Elsewhere,
        Self::Mirrored,
        Self::Turned,
        Self::Noise,
        Self::Water,
        Self::Blank,
        Self::Fields,
        Self::Scaled,
        Self::Foreign,
        Self::Repeating,
        Self::RepeatingMixed,
        Self::RepeatingBlock,
        Self::RepeatingInside,
        Self::RepeatingGaps,
        Self::RepeatingAbsent,
    ];

    /// Whether frame and map show a pattern that repeats itself.
    pub fn is_repeating(self) -> bool {
        matches!(
            self,
            Self::Repeating
                | Self::RepeatingMixed
                | Self::RepeatingBlock
                | Self::RepeatingInside
                | Self::RepeatingGaps
                | Self::RepeatingAbsent
        )
    }

    /// Whether the frame still shows ground of the region, or ground that looks alike, so that what agrees agrees not by
    /// chance.
    pub fn shows_its_ground(self) -> bool {
        self == Self::Scaled || self.is_repeating()
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
            Self::Repeating => "repeating",
            Self::RepeatingMixed => "repeating_mixed",
            Self::RepeatingBlock => "repeating_block",
            Self::RepeatingInside => "repeating_inside",
            Self::RepeatingGaps => "repeating_gaps",
            Self::RepeatingAbsent => "repeating_absent",
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
