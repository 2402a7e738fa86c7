//! `--explain`: why a frame may not have been located, in words.

use overfly_flight::locate::Hint;
use serde::Serialize;

/// A hint with its words.
#[derive(Serialize)]
pub struct HintLine {
    #[serde(flatten)]
    hint: Hint,
    /// The hint as text.
    pub message: String,
}

impl From<Hint> for HintLine {
    fn from(hint: Hint) -> Self {
        Self { message: words(&hint), hint }
    }
}

fn words(hint: &Hint) -> String {
    match hint {
        Hint::HeadingInRadians { stated_deg, heading_deg } => {
            format!("matches at heading {heading_deg:.1}, not {stated_deg}: --heading-deg looks like radians")
        }
        Hint::Heading { stated_deg, heading_deg } => {
            format!("matches at heading {heading_deg:.1}, not {stated_deg:.1}: check --heading-deg")
        }
        Hint::HeightInFeet { stated_m, height_m } => {
            format!(
                "matches at a height of {height_m:.0} m, not {stated_m:.0} m: --height-m looks like feet (ratio 3.28)"
            )
        }
        Hint::Scale { ratio } => {
            format!("matches at {ratio:.2} times the stated scale: check --height-m and camera, or --gsd-m-per-px")
        }
        Hint::Layer { layer, map_epoch } => {
            let date = map_epoch.as_ref().map_or(String::new(), |date| format!(", of {date}"));
            format!("matches in the layer {layer}{date}: try --layer {layer}")
        }
    }
}
