//! The coarse surface as an SVG, with the peaks of the coarse search.

use super::palette;
use super::picture::svg_over;
use overfly_core::pixels::Colour;
use overfly_flight::locate::{TracedPeak, TracedSurface};
use std::fmt::Write;

/// Edge of the drawn surface, screen pixels.
const EDGE: f64 = 560.0;
/// Number of peaks marked.
pub const MARKED_PEAKS: usize = 5;
/// z-score that is drawn darkest.
const DARKEST: f32 = -2.0;

/// The surface, its best peak circled in white and the next ones in blue, each with its z-score.
pub fn svg(surface: &TracedSurface, peaks: &[TracedPeak]) -> String {
    let picture = heat_map(surface);
    let (width, height) = (picture.width_px() as f64, picture.height_px() as f64);
    let scale = EDGE / width.max(height);
    // Lengths are in the picture's own pixels.
    let unit = 1.0 / scale;
    let mut marks = String::new();
    for (rank, peak) in peaks.iter().enumerate().take(MARKED_PEAKS).rev() {
        let cx = peak.pose.nadir.x_px - surface.window.left as f64 + 0.5;
        let cy = peak.pose.nadir.y_px - surface.window.top as f64 + 0.5;
        if !((0.0..width).contains(&cx) && (0.0..height).contains(&cy)) {
            continue;
        }
        let colour = if rank == 0 { "#fff" } else { "#7fd3ff" };
        let beside = if cx > 0.8 * width { (-14.0, "end") } else { (14.0, "start") };
        let _ = write!(
            marks,
            r##"<circle cx="{cx}" cy="{cy}" r="{:.3}" fill="none" stroke="{colour}" stroke-width="{:.3}"/><text x="{:.2}" y="{:.2}" font-size="{:.2}" text-anchor="{}" fill="{colour}" stroke="#000" stroke-width="{:.3}" paint-order="stroke">{:.1}</text>"##,
            9.0 * unit,
            2.0 * unit,
            cx + beside.0 * unit,
            cy + 5.0 * unit,
            15.0 * unit,
            beside.1,
            3.0 * unit,
            peak.z_score,
        );
    }
    svg_over(&picture, scale, true, &marks)
}

/// The z-scores as colours, from two standard deviations below the mean to the highest.
fn heat_map(surface: &TracedSurface) -> Colour {
    let highest = surface.z_scores.iter().flatten().fold(1.0f32, |a, b| a.max(*b));
    let paint = |z: &Option<f32>| palette::heat((z.unwrap_or(0.0) - DARKEST) / (highest - DARKEST));
    let values = surface.z_scores.iter().flat_map(paint).collect();
    Colour::from_values(surface.window.width_px, surface.window.height_px, values).expect("three values a pixel")
}
