//! `HintJson`: at which other statement a frame matches that was not located.

use overfly_flight::locate::Hint;
use serde::Serialize;
use utoipa::ToSchema;

/// A statement of the request to check: with another one the frame matches. A hint is no fix, and has no position.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = Hint)]
pub(crate) struct HintJson {
    #[serde(flatten)]
    change: HintChangeJson,
    /// The hint in words.
    message: String,
}

/// What to state otherwise.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = HintChange)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum HintChangeJson {
    /// The stated heading is right in radians.
    HeadingInRadians {
        /// The stated heading, as degrees.
        stated_deg: f64,
        /// The heading that matches, degrees.
        heading_deg: f64,
    },
    /// Another heading matches.
    Heading {
        /// The stated heading, degrees.
        stated_deg: f64,
        /// The heading that matches, degrees.
        heading_deg: f64,
    },
    /// The stated height is right in feet.
    HeightInFeet {
        /// The stated height, as metres.
        stated_m: f64,
        /// The height that matches, metres.
        height_m: f64,
    },
    /// Another scale matches.
    Scale {
        /// The scale that matches over the stated one: of the height, or of the ground sample distance.
        ratio: f64,
    },
    /// The frame matches in another layer.
    Layer {
        /// The layer.
        layer: String,
        /// Date of its imagery there, if known.
        map_epoch: Option<String>,
    },
}

impl HintJson {
    /// Makes the reply of a hint. `spell` gives the name of a parameter as the user knows it.
    pub(super) fn new(hint: Hint, spell: impl Fn(&str) -> String) -> Self {
        let message = hint.message(spell);
        let change = match hint {
            Hint::HeadingInRadians { stated_deg, heading_deg } => {
                HintChangeJson::HeadingInRadians { stated_deg, heading_deg }
            }
            Hint::Heading { stated_deg, heading_deg } => HintChangeJson::Heading { stated_deg, heading_deg },
            Hint::HeightInFeet { stated_m, height_m } => HintChangeJson::HeightInFeet { stated_m, height_m },
            Hint::Scale { ratio } => HintChangeJson::Scale { ratio },
            Hint::Layer { layer, map_epoch } => HintChangeJson::Layer { layer, map_epoch },
        };
        Self { change, message }
    }
}
