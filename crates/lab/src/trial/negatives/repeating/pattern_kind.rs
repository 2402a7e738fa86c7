//! `PatternKind`: what repeats.

use serde::Serialize;

/// What a pattern repeats.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PatternKind {
    /// Stripes with sharp edges.
    Stripes,
    /// Stripes with a sinusoidal profile.
    Waves,
    /// Discs on a square, rectangular or hexagonal lattice.
    Dots,
    /// Checkers.
    Checkers,
    /// Crowns of trees that differ in size and place.
    Orchard,
    /// Long rectangles in rows, as solar panels.
    SolarRows,
    /// Houses in rows, with a street between each two rows.
    Houses,
    /// Streets that cross at right angles.
    Streets,
    /// Rectangular parcels of a few gray levels.
    Parcels,
    /// Fine rows, interrupted by headlands.
    Vineyard,
    /// Round irrigated fields of a few gray levels.
    Pivots,
    /// Lines in two directions.
    Hatch,
    /// Rectangles, every second row shifted by half of one.
    Bricks,
}

impl PatternKind {
    /// All kinds, in the order of reports.
    pub const ALL: [Self; 13] = [
        Self::Stripes,
        Self::Waves,
        Self::Dots,
        Self::Checkers,
        Self::Orchard,
        Self::SolarRows,
        Self::Houses,
        Self::Streets,
        Self::Parcels,
        Self::Vineyard,
        Self::Pivots,
        Self::Hatch,
        Self::Bricks,
    ];
    /// The kinds that are planted or built one by one, so that single elements can be missing.
    pub const PLANTED: [Self; 7] =
        [Self::Dots, Self::Orchard, Self::SolarRows, Self::Houses, Self::Vineyard, Self::Pivots, Self::Parcels];

    /// The name in JSON and in tables.
    pub fn word(self) -> &'static str {
        match self {
            Self::Stripes => "stripes",
            Self::Waves => "waves",
            Self::Dots => "dots",
            Self::Checkers => "checkers",
            Self::Orchard => "orchard",
            Self::SolarRows => "solar_rows",
            Self::Houses => "houses",
            Self::Streets => "streets",
            Self::Parcels => "parcels",
            Self::Vineyard => "vineyard",
            Self::Pivots => "pivots",
            Self::Hatch => "hatch",
            Self::Bricks => "bricks",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_what_json_says() {
        for kind in PatternKind::ALL {
            assert_eq!(serde_json::to_value(kind).unwrap(), kind.word());
        }
    }
}
