//! Small images that inflate to much, and a store whose tile is one.

use flate2::write::ZlibEncoder;
use flate2::{Compression, Crc};
use overfly_core::feature::keypoint::CONTRACT;
use overfly_core::pixels::{Colour, Mask, MaskedColour};
use overfly_core::tile::TileId;
use overfly_store::{BuiltTile, Declaration, EncodedTile, Terms, TileContent, Writer, content_hash};
use std::io::Write;
use std::path::Path;

/// A PNG chunk.
pub fn chunk(name: &[u8; 4], content: &[u8]) -> Vec<u8> {
    let mut crc = Crc::new();
    crc.update(name);
    crc.update(content);
    let size = (content.len() as u32).to_be_bytes();
    [&size[..], name, content, &crc.sum().to_be_bytes()].concat()
}

/// The text of `megabytes` zeros, compressed.
pub fn zeros(megabytes: usize) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    let block = vec![0; 1_000_000];
    (0..megabytes).for_each(|_| encoder.write_all(&block).expect("memory takes it"));
    encoder.finish().expect("memory takes it")
}

/// A gray PNG with further chunks before its pixels, which are `pixels` compressed.
pub fn png(size_px: u32, more: &[u8], pixels: &[u8]) -> Vec<u8> {
    let size = size_px.to_be_bytes();
    let header = chunk(b"IHDR", &[&size[..], &size, &[8, 0, 0, 0, 0]].concat());
    [b"\x89PNG\r\n\x1a\n".to_vec(), header, more.to_vec(), chunk(b"IDAT", pixels), chunk(b"IEND", b"")].concat()
}

/// A PNG of black pixels with further chunks.
pub fn black_png(size_px: u32, more: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    // A filter byte before each row.
    encoder.write_all(&vec![0; (size_px as usize + 1) * size_px as usize]).expect("memory takes it");
    png(size_px, more, &encoder.finish().expect("memory takes it"))
}

/// A black PNG with a colour profile that inflates: `zeros` is from [`zeros`].
pub fn png_with_profile(size_px: u32, zeros: &[u8]) -> Vec<u8> {
    black_png(size_px, &chunk(b"iCCP", &[b"x\0\0", zeros].concat()))
}

/// Writes a layer of one tile, whose imagery is a PNG with a colour profile that inflates, into a store at `path`. All its hashes
/// are right.
pub fn hostile_layer(path: &Path, layer: &str, tile: TileId, zeros: &[u8]) {
    let pixels = MaskedColour { colour: Colour::black(512, 512), mask: Mask::filled(512, 512, true) };
    let mut content = TileContent::encode(tile, &pixels, &[], None).expect("a black tile");
    let bytes = png_with_profile(512, zeros);
    let described = content.descriptors.clone().unwrap_or_default();
    let content_hash = content_hash("image/png", &bytes, &described, content.cells.as_deref());
    content.image = EncodedTile { media_type: "image/png", bytes, content_hash };
    let declaration = Declaration {
        layer: layer.into(),
        sources: Vec::new(),
        zoom_override: None,
        base_zoom: tile.zoom(),
        min_zoom: tile.zoom(),
        terms: Terms::default(),
        terrain: None,
    };
    let mut writer = Writer::begin(path, CONTRACT, declaration).expect("a store of the rig");
    writer.put(&BuiltTile { tile, inputs_hash: [0; 32], content: Some(content) }).expect("a store of the rig");
    writer.finish(&|_| true).expect("a store of the rig");
}
