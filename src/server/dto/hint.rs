//! `HintJson`: at which other statement a frame matches that was not located.

use overfly_flight::locate::Hint;
use serde::Serialize;
use utoipa::ToSchema;

/// A statement of the request to check: with another one the frame matches. A hint is no fix, and has no position. `kind` says which of
/// the other fields there are.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = Hint)]
pub(crate) struct HintJson {
    /// What to state otherwise.
    kind: HintKindJson,
    /// The stated heading, degrees; of `heading_in_radians` as if it were in degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    stated_deg: Option<f64>,
    /// The heading that matches, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    heading_deg: Option<f64>,
    /// The stated height, as metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    stated_m: Option<f64>,
    /// The height that matches, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    height_m: Option<f64>,
    /// The stated ground sample distance, as metres per pixel.
    #[serde(skip_serializing_if = "Option::is_none")]
    stated_m_per_px: Option<f64>,
    /// The ground sample distance that matches, metres per pixel.
    #[serde(skip_serializing_if = "Option::is_none")]
    gsd_m_per_px: Option<f64>,
    /// The scale that matches over the stated one: of the height, or of the ground sample distance.
    #[serde(skip_serializing_if = "Option::is_none")]
    ratio: Option<f64>,
    /// The layer in which the frame matches.
    #[serde(skip_serializing_if = "Option::is_none")]
    layer: Option<String>,
    /// Date of the imagery there, if known.
    #[serde(skip_serializing_if = "Option::is_none")]
    map_epoch: Option<String>,
    /// The hint in words.
    message: String,
}

/// What to state otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[schema(as = HintKind)]
#[serde(rename_all = "snake_case")]
enum HintKindJson {
    /// The stated heading is right in radians.
    HeadingInRadians,
    /// Another heading matches.
    Heading,
    /// The stated height is right in feet.
    HeightInFeet,
    /// The stated height is right in kilometres.
    HeightInKilometres,
    /// The stated ground sample distance is right in feet.
    GsdInFeet,
    /// Another scale matches.
    Scale,
    /// The frame matches in another layer.
    Layer,
}

impl HintJson {
    /// Makes the reply of a hint. `spell` gives the name of a parameter as the user knows it.
    pub(super) fn new(hint: Hint, spell: impl Fn(&str) -> String) -> Self {
        let message = hint.message(spell);
        let bare = |kind| Self {
            kind,
            stated_deg: None,
            heading_deg: None,
            stated_m: None,
            height_m: None,
            stated_m_per_px: None,
            gsd_m_per_px: None,
            ratio: None,
            layer: None,
            map_epoch: None,
            message: message.clone(),
        };
        let heading = |kind, [stated_deg, heading_deg]: [f64; 2]| Self {
            stated_deg: Some(stated_deg),
            heading_deg: Some(heading_deg),
            ..bare(kind)
        };
        let height = |kind, [stated_m, height_m]: [f64; 2]| Self {
            stated_m: Some(stated_m),
            height_m: Some(height_m),
            ..bare(kind)
        };
        match hint {
            Hint::HeadingInRadians { stated_deg, heading_deg } => {
                heading(HintKindJson::HeadingInRadians, [stated_deg, heading_deg])
            }
            Hint::Heading { stated_deg, heading_deg } => heading(HintKindJson::Heading, [stated_deg, heading_deg]),
            Hint::HeightInFeet { stated_m, height_m } => height(HintKindJson::HeightInFeet, [stated_m, height_m]),
            Hint::HeightInKilometres { stated_m, height_m } => {
                height(HintKindJson::HeightInKilometres, [stated_m, height_m])
            }
            Hint::GsdInFeet { stated_m_per_px, gsd_m_per_px } => Self {
                stated_m_per_px: Some(stated_m_per_px),
                gsd_m_per_px: Some(gsd_m_per_px),
                ..bare(HintKindJson::GsdInFeet)
            },
            Hint::Scale { ratio } => Self { ratio: Some(ratio), ..bare(HintKindJson::Scale) },
            Hint::Layer { layer, map_epoch } => Self { layer: Some(layer), map_epoch, ..bare(HintKindJson::Layer) },
        }
    }
}
