//! `Terrain`: what a layer of heights states of them.

use overfly_core::geodesy::VerticalDatum;
use rusqlite::Row;
use rusqlite::types::Type;
use serde::{Deserialize, Serialize};

/// One standard deviation of heights whose error is unknown, metres: that of the global models, with what grows and stands on the
/// ground.
const DEFAULT_VERTICAL_ERROR_M: f64 = 5.0;

/// What a layer of heights states of them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Terrain {
    /// The surface that the heights are above.
    #[serde(with = "datum_word")]
    pub vertical_datum: VerticalDatum,
    /// One standard deviation of the heights, metres: `None` where it is unknown.
    pub vertical_error_m: Option<f64>,
}

impl Terrain {
    /// The standard deviation of the heights that covariances carry, metres.
    pub fn error_m(&self) -> f64 {
        self.vertical_error_m.unwrap_or(DEFAULT_VERTICAL_ERROR_M)
    }
}

/// A datum as its word.
mod datum_word {
    use overfly_core::geodesy::VerticalDatum;
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    pub fn serialize<S: Serializer>(datum: &VerticalDatum, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(datum.word())
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<VerticalDatum, D::Error> {
        let word = String::deserialize(deserializer)?;
        VerticalDatum::parse(&word).ok_or_else(|| D::Error::custom(format!("no vertical datum is called {word:?}")))
    }
}

/// Reads what a layer states of its heights, from a row of its columns `vertical_datum` and `vertical_error_m`: `None` for imagery.
pub(super) fn read(row: &Row<'_>, at: usize) -> rusqlite::Result<Option<Terrain>> {
    let Some(word) = row.get::<_, Option<String>>(at)? else { return Ok(None) };
    let vertical_datum = VerticalDatum::parse(&word).ok_or_else(|| {
        let reason = format!("a vertical datum called {word:?}");
        rusqlite::Error::FromSqlConversionFailure(at, Type::Text, reason.into())
    })?;
    Ok(Some(Terrain { vertical_datum, vertical_error_m: row.get(at + 1)? }))
}
