//! Orthophotos in: every kind of file gives the pixels that it holds, where they lie.

use overfly::raster::{OpenOptions, Orthophoto};
use overfly::tile::{TileId, zoom_for_gsd};
use std::path::{Path, PathBuf};

fn real_data(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(name);
    if path.exists() {
        return Some(path);
    }
    eprintln!("SKIPPED: {} is not here", path.display());
    None
}

#[test]
fn naip_imagery_fills_the_tile_at_its_centre() {
    let Some(path) = real_data("naip/m_4709963_se_14_1_20180716.tif") else { return };
    let source = Orthophoto::open(&path, &OpenOptions::default()).unwrap();
    let d = source.description();
    assert_eq!((d.width_px, d.height_px), (934, 724));
    assert!((d.gsd_m_per_px - 5.0).abs() < 0.01, "{}", d.gsd_m_per_px);
    let centre = d.outline[0];
    let zoom = zoom_for_gsd(centre, d.gsd_m_per_px);
    let corner = TileId::containing(centre, zoom).unwrap();
    let tile = source.warp(corner).unwrap().expect("the corner's tile shows the corner");
    assert!(tile.mask.valid_fraction() > 0.0 && !tile.mask.is_full());
}
