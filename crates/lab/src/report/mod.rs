//! The HTML report of a flight: one self-contained page from plain results. Reads and writes no file.

mod calibration;
mod cost;
mod experiment_page;
mod flown;
mod flown_plots;
mod gallery;
mod map;
mod mosaic;
mod page;
mod plan_page;
mod plan_plot;
mod plot;
mod relative_cost;
mod simulated;
mod simulated_failures;
mod simulated_plots;

pub use calibration::calibration_svg;
pub use cost::cost_svg;
pub use experiment_page::experiment_html;
pub use flown::{Flown, flown_page};
pub use mosaic::Mosaic;
pub use plan_page::plan_html;
pub use plan_plot::plan_svgs;
pub use relative_cost::relative_cost_svgs;
pub use simulated::simulated_page;
pub use simulated_plots::simulated_svgs;

use crate::trial::{FixOutcome, FixScore, Flight};
use overfly_core::pixels::Colour;

/// What a report is made of.
pub struct Report<'a> {
    /// Heading of the page.
    pub title: &'a str,
    /// A sentence or two below it.
    pub introduction: &'a str,
    /// The flight, as read.
    pub flight: &'a Flight,
    /// What came of each of its frames, in the same order.
    pub outcomes: &'a [FixOutcome],
    /// Their score.
    pub score: &'a FixScore,
    /// Half the width of the square that was searched around each prior, metres.
    pub prior_error_m: f64,
    /// The map.
    pub mosaic: &'a Mosaic,
    /// Some frames to show beside the map: index into `outcomes`, and the frame in colour.
    pub shown: &'a [(usize, Colour)],
    /// Figures of the store and machine: a name and its value each.
    pub facts: &'a [(String, String)],
}

impl Report<'_> {
    /// The page. Every image and plot is embedded; nothing is loaded from anywhere.
    pub fn to_html(&self) -> String {
        page::page(self)
    }
}

/// Text safe inside HTML and SVG.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// An image as a `data:` address.
fn data_url(colour: &Colour, quality: u8) -> String {
    use base64::Engine;
    let mut bytes = Vec::new();
    let side = |n: usize| u16::try_from(n).expect("a report's images are at most a few thousand pixels wide");
    jpeg_encoder::Encoder::new(&mut bytes, quality)
        .encode(colour.values(), side(colour.width_px()), side(colour.height_px()), jpeg_encoder::ColorType::Rgb)
        .expect("writing to memory does not fail");
    format!("data:image/jpeg;base64,{}", base64::engine::general_purpose::STANDARD.encode(bytes))
}
