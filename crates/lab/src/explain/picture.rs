//! Images as JPEG, and as SVG with marks.

use base64::Engine;
use overfly_core::pixels::Colour;

/// Larger images are shrunk.
const MAX_EDGE_PX: usize = 900;
/// Quality of the JPEGs.
const QUALITY: u8 = 82;

/// A colour image as JPEG.
pub fn jpeg(colour: &Colour) -> Vec<u8> {
    let mut bytes = Vec::new();
    let side = |n: usize| u16::try_from(n).expect("pictures are at most a few thousand pixels wide");
    jpeg_encoder::Encoder::new(&mut bytes, QUALITY)
        .encode(colour.values(), side(colour.width_px()), side(colour.height_px()), jpeg_encoder::ColorType::Rgb)
        .expect("writing to memory does not fail");
    bytes
}

/// Every n-th pixel of an image that is wider or higher than a page needs.
pub fn shrunk(colour: &Colour) -> Colour {
    let step = colour.width_px().max(colour.height_px()).div_ceil(MAX_EDGE_PX).max(1);
    let (width, height) = (colour.width_px().div_ceil(step), colour.height_px().div_ceil(step));
    let values = (0..width * height).flat_map(|i| colour.at(i % width * step, i / width * step)).collect();
    Colour::from_values(width, height, values).expect("three values a pixel")
}

/// An SVG of an image, `scale` times as large, with marks drawn over it in the image's own pixels.
pub fn svg_over(colour: &Colour, scale: f64, is_sharp: bool, marks: &str) -> String {
    let (width, height) = (colour.width_px(), colour.height_px());
    let rendering = if is_sharp { r#" style="image-rendering:pixelated""# } else { "" };
    format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{:.0}" height="{:.0}" font-family="sans-serif"><image width="{width}" height="{height}"{rendering} href="data:image/jpeg;base64,{}"/>{marks}</svg>"#,
        width as f64 * scale,
        height as f64 * scale,
        base64::engine::general_purpose::STANDARD.encode(jpeg(colour)),
    )
}
