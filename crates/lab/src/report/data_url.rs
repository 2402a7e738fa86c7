//! Images inside a page.

use base64::Engine;
use overfly_core::pixels::Colour;

/// An image as a `data:` URL of a JPEG.
pub fn data_url(colour: &Colour, quality: u8) -> String {
    let mut bytes = Vec::new();
    let side = |n: usize| u16::try_from(n).expect("a report's images are at most a few thousand pixels wide");
    jpeg_encoder::Encoder::new(&mut bytes, quality)
        .encode(colour.values(), side(colour.width_px()), side(colour.height_px()), jpeg_encoder::ColorType::Rgb)
        .expect("writing to memory does not fail");
    format!("data:image/jpeg;base64,{}", base64::engine::general_purpose::STANDARD.encode(bytes))
}
