//! Orthophotos in: every kind of file gives the pixels that it holds, where they lie, or says why not.
//!
//! The files are made by `tests/fixtures/make.py`, which states their pixels.

use super::needs::real_data;
use overfly_core::geodesy::Geodetic;
use overfly_core::pixels::MaskedColour;
use overfly_core::tile::{TileId, WorldPixel, zoom_for_gsd};
use overfly_ingest::Remedy;
use overfly_ingest::crs::{Crs, DatumShift, Definition, Ellipsoid, Method};
use overfly_ingest::raster::{OpenOptions, Orthophoto, RasterError};
use std::path::{Path, PathBuf};

/// Where the aligned fixtures lie: pixel (100, 200) of this tile.
const TILE: (u8, u32, u32) = (18, 58_900, 92_400);
const OFFSET: (usize, usize) = (100, 200);
const SIZE: usize = 64;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
}

fn open(name: &str, options: &OpenOptions) -> Orthophoto {
    Orthophoto::open(&fixture(name), options).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn aligned_tile() -> TileId {
    TileId::new(TILE.0, TILE.1, TILE.2).unwrap()
}

fn rgb(x: usize, y: usize) -> [u8; 3] {
    [3 * x + 20, 3 * y + 30, 230 - x - 2 * y].map(|v| v as u8)
}

fn gray(x: usize, y: usize) -> [u8; 3] {
    [(x + 2 * y + 20) as u8; 3]
}

fn in_hole(x: usize, y: usize) -> bool {
    let (dx, dy) = (x as i64 - 32, y as i64 - 32);
    dx * dx + dy * dy < 100
}

/// Opens, warps, and compares every pixel of the tile: inside the image with `expected`, outside with missing.
#[track_caller]
fn shows(
    name: &str,
    options: &OpenOptions,
    tolerance: u8,
    valid: impl Fn(usize, usize) -> bool,
    expected: impl Fn(usize, usize) -> [u8; 3],
) {
    let tile = open(name, options).warp(aligned_tile()).unwrap().unwrap_or_else(|| panic!("{name}: an empty tile"));
    for row in 0..512 {
        for column in 0..512 {
            let inside = (OFFSET.0..OFFSET.0 + SIZE).contains(&column) && (OFFSET.1..OFFSET.1 + SIZE).contains(&row);
            let (x, y) = (column.wrapping_sub(OFFSET.0), row.wrapping_sub(OFFSET.1));
            let expect_valid = inside && valid(x, y);
            assert_eq!(tile.mask.at(column, row), expect_valid, "{name}: validity at {column}, {row}");
            let found = tile.colour.at(column, row);
            let wanted = if expect_valid { expected(x, y) } else { [0; 3] };
            let miss = (0..3).map(|c| found[c].abs_diff(wanted[c])).max().unwrap();
            assert!(miss <= tolerance, "{name}: {found:?} for {wanted:?} at image pixel {x}, {y}");
        }
    }
}

fn everywhere(_: usize, _: usize) -> bool {
    true
}

#[test]
fn every_lossless_colour_layout_gives_its_pixels_exactly() {
    for name in [
        "tiled_deflate.tif",
        "striped_lzw.tif",
        "lzw_predictor.tif",
        "zstd.tif",
        "packbits.tif",
        "uncompressed_bigtiff.tif",
        "big_endian.tif",
        "planar.tif",
        "webp.tif",
        "rgb_nir.tif",
        "nir_called_alpha.tif",
        "four_bands_min_is_black.tif",
        "pixel_is_point.tif",
        "photo_png.png",
    ] {
        shows(name, &OpenOptions::default(), 0, everywhere, rgb);
    }
}

#[test]
fn jpeg_inside_and_outside_of_tiff_is_close() {
    // Quality 95 with halved colour resolution on a smooth ramp; at the image's edge the encoder's padding shows.
    for name in
        ["jpeg_ycbcr.tif", "jpeg_rgb.tif", "jpeg_rgb_nir.tif", "jpeg_planar.tif", "jpeg_striped.tif", "photo_jpeg.jpg"]
    {
        shows(name, &OpenOptions::default(), 6, everywhere, rgb);
    }
    shows("jpeg_gray.tif", &OpenOptions::default(), 6, everywhere, gray);
}

#[test]
fn grays_and_palettes_become_colours() {
    shows("gray.tif", &OpenOptions::default(), 0, everywhere, gray);
    shows("gray_min_is_white.tif", &OpenOptions::default(), 0, everywhere, gray);
    shows("palette.tif", &OpenOptions::default(), 0, everywhere, |x, y| {
        let [i, ..] = gray(x, y);
        [i, 255 - i, i / 2]
    });
}

#[test]
fn missing_pixels_stay_missing_and_do_not_bleed() {
    let valid = |x: usize, y: usize| !in_hole(x, y);
    for name in ["rgba.tif", "nodata.tif", "side_mask.tif", "photo_alpha.png"] {
        shows(name, &OpenOptions::default(), 0, valid, rgb);
    }
    shows("gray_alpha.tif", &OpenOptions::default(), 0, valid, gray);
    shows("internal_mask.tif", &OpenOptions::default(), 6, valid, rgb);
    // Blocks that were never written are missing, not black.
    shows("sparse.tif", &OpenOptions::default(), 0, everywhere, rgb);
}

#[test]
fn deep_samples_are_shown_by_the_stretch_that_is_stated() {
    let with = |low: f64, high: f64| OpenOptions { stretch: Some((low, high)), ..OpenOptions::default() };
    shows("uint16.tif", &with(100.0, 100.0 + 255.0 * 16.0), 0, everywhere, rgb);
    shows("uint12.tif", &with(15.0, 15.0 + 255.0 * 16.0), 0, everywhere, rgb);
    shows("float32_nan.tif", &with(0.0, 1.0), 0, |x, y| !in_hole(x, y), rgb);
    for (name, samples) in
        [("uint16.tif", "16-bit unsigned"), ("uint12.tif", "12-bit"), ("float32_nan.tif", "32-bit floating")]
    {
        let error = Orthophoto::open(&fixture(name), &OpenOptions::default()).unwrap_err();
        assert_eq!(error.code(), "source_needs_stretch");
        let text = error.to_string();
        assert!(text.contains(name) && text.contains(samples), "{text}");
        assert_eq!(error.remedy(), Some(Remedy::StateStretch), "{text}");
    }
    let error = Orthophoto::open(&fixture("uint16.tif"), &with(5.0, 5.0)).unwrap_err();
    assert_eq!(error.code(), "source_bad_stretch");
}

#[test]
fn side_files_and_options_place_what_does_not_place_itself() {
    let stated = OpenOptions { crs: Some(3857), ..OpenOptions::default() };
    shows("photo_gray.png", &stated, 0, everywhere, gray);
    shows("placed_by_world_file.tif", &stated, 0, everywhere, rgb);
    for name in ["photo_gray.png", "placed_by_world_file.tif", "no_crs.tif"] {
        let error = Orthophoto::open(&fixture(name), &OpenOptions::default()).unwrap_err();
        assert_eq!(error.code(), "source_no_crs", "{name}: {error}");
        assert!(error.remedy() == Some(Remedy::StateCrs) && error.to_string().contains(name), "{error}");
    }
}

#[test]
fn states_the_date_that_the_file_states() {
    let acquired = |name: &str| open(name, &OpenOptions::default()).description().acquired.clone();
    assert_eq!(acquired("dated.tif").as_deref(), Some("2018-07-16"));
    assert_eq!(acquired("acquired.tif").as_deref(), Some("2018-07-16"));
    assert_eq!(acquired("gray.tif"), None);
}

fn user_defined(method: Method, false_easting: f64, false_northing: f64, unit_m: f64) -> Crs {
    Crs::from_definition(&Definition {
        method,
        origin_latitude_deg: 47.0,
        origin_longitude_deg: -99.3,
        false_easting,
        false_northing,
        unit_m,
        ellipsoid: Ellipsoid::GRS80,
        datum: DatumShift::Null { error_m: 0.0 },
    })
    .unwrap()
}

/// The colours are a ramp over the image's pixels, so each tile pixel's colour says where it was taken. `pixel` gives
/// the image position of a point by a route of its own: the CRS and the geotransform that make.py wrote.
fn lies_where_its_ramp_says(name: &str, crs: &Crs, pixel: impl Fn(f64, f64) -> (f64, f64)) {
    let source = open(name, &OpenOptions::default());
    let d = source.description();
    let centre = crs.geodetic_from_projected_pixel(&pixel);
    let zoom = zoom_for_gsd(centre, d.gsd_m_per_px);
    let middle = TileId::containing(centre, zoom).unwrap();
    let (mut compared, mut sums) = (0, [0.0; 2]);
    for (column, row) in (-1..=1i64).flat_map(|dy| (-1..=1i64).map(move |dx| (dx, dy))) {
        let id =
            TileId::new(zoom, (i64::from(middle.column()) + column) as u32, (i64::from(middle.row()) + row) as u32)
                .unwrap();
        let Some(tile) = source.warp(id).unwrap() else { continue };
        for (i, valid) in tile.mask.values().iter().enumerate() {
            let (tx, ty) = (i % 512, i / 512);
            let world = WorldPixel {
                x_px: f64::from(id.column()) * 512.0 + tx as f64 + 0.5,
                y_px: f64::from(id.row()) * 512.0 + ty as f64 + 0.5,
            };
            let point = world.to_geodetic(zoom).unwrap();
            let (e, n) = crs.projected_from_geodetic(point).unwrap();
            let (x, y) = pixel(e, n);
            let inside = |v: f64, margin: f64| v > margin && v < 64.0 - margin;
            if *valid == 0 {
                assert!(!(inside(x, 0.05) && inside(y, 0.05)), "{name}: {x}, {y} lies inside and is missing");
                continue;
            }
            assert!(inside(x, -0.05) && inside(y, -0.05), "{name}: {x}, {y} lies outside and is shown");
            if inside(x, 1.5) && inside(y, 1.5) {
                let [red, green, _] = tile.colour.at(tx, ty).map(f64::from);
                let miss = [red - (3.0 * (x - 0.5) + 20.0), green - (3.0 * (y - 0.5) + 30.0)];
                // Rounding to 8 bits: half a level, which is a sixth of a pixel.
                assert!(miss[0].abs() <= 0.57 && miss[1].abs() <= 0.57, "{name}: off by {miss:?} levels at {x}, {y}");
                compared += 1;
                sums = [sums[0] + miss[0], sums[1] + miss[1]];
            }
        }
    }
    assert!(compared > 2000, "{name}: {compared} pixels compared");
    // On average rounding cancels: 0.06 levels are 0.02 px.
    let mean = sums.map(|s| s / f64::from(compared));
    assert!(mean[0].abs() < 0.06 && mean[1].abs() < 0.06, "{name}: shifted by {mean:?} levels of 3 a pixel");
}

trait CentreOf {
    fn geodetic_from_projected_pixel(&self, pixel: &impl Fn(f64, f64) -> (f64, f64)) -> Geodetic;
}

impl CentreOf for Crs {
    /// Solves pixel(x, y) = (32, 32) for an affine `pixel`.
    fn geodetic_from_projected_pixel(&self, pixel: &impl Fn(f64, f64) -> (f64, f64)) -> Geodetic {
        let (o, i, j) = (pixel(0.0, 0.0), pixel(1.0, 0.0), pixel(0.0, 1.0));
        let (a, b, c, d) = (i.0 - o.0, j.0 - o.0, i.1 - o.1, j.1 - o.1);
        let (u, v) = (32.0 - o.0, 32.0 - o.1);
        let det = a * d - b * c;
        self.geodetic_from_projected((u * d - v * b) / det, (a * v - c * u) / det).unwrap()
    }
}

#[test]
fn every_system_and_geotransform_puts_the_ramp_in_its_place() {
    let north_up = |ulx: f64, uly: f64, w: f64, h: f64| move |x: f64, y: f64| ((x - ulx) / w, (uly - y) / h);
    let epsg = |code| Crs::from_epsg(code).unwrap();
    let (sin, cos) = 30f64.to_radians().sin_cos();
    lies_where_its_ramp_says("rotated_utm.tif", &epsg(26914), |x, y| {
        let (dx, dy) = ((x - 486_000.0) / 0.5, (y - 5_207_000.0) / 0.5);
        (dx * cos + dy * sin, dx * sin - dy * cos)
    });
    lies_where_its_ramp_says("south_utm.tif", &epsg(32756), north_up(334_000.0, 6_250_000.0, 0.5, 0.5));
    lies_where_its_ramp_says("degrees.tif", &epsg(4326), north_up(-99.15, 47.02, 6e-6, 4e-6));
    lies_where_its_ramp_says("us_feet.tif", &epsg(2263), north_up(987_000.0, 213_000.0, 1.5, 1.5));
    let tm = user_defined(Method::TransverseMercator { scale: 0.99995 }, 10_000.0, 20_000.0, 1.0);
    lies_where_its_ramp_says("user_tm.tif", &tm, north_up(10_100.0, 20_200.0, 0.5, 0.5));
    let (parallel_1_deg, parallel_2_deg) = (46.0, 48.5);
    let lcc = user_defined(Method::LambertConformal2 { parallel_1_deg, parallel_2_deg }, 600_000.0, 210_000.0, 1.0);
    lies_where_its_ramp_says("user_lcc.tif", &lcc, north_up(600_100.0, 210_200.0, 0.5, 0.5));
    let albers = user_defined(Method::Albers { parallel_1_deg, parallel_2_deg }, 0.0, 0.0, 1.0);
    lies_where_its_ramp_says("user_albers.tif", &albers, north_up(100.0, 200.0, 0.5, 0.5));
    let foot_m = 1200.0 / 3937.0;
    let feet = user_defined(Method::TransverseMercator { scale: 1.0 }, 10_000.0 / foot_m, 20_000.0 / foot_m, foot_m);
    lies_where_its_ramp_says("user_feet.tif", &feet, north_up(33_000.0, 66_000.0, 1.5, 1.5));
}

#[test]
fn refuses_by_name_with_file_and_remedy() {
    for (name, code, words) in [
        ("krovak.tif", "crs_refused", "krovak"),
        ("nad27.tif", "crs_refused", "NAD27"),
        ("no_place.tif", "source_no_georeference", "world file"),
        ("nan_place.tif", "source_bad_georeference", "NaN"),
        ("singular_place.tif", "source_bad_georeference", "singular"),
        ("make.py", "source_format", "GeoTIFF, PNG or JPEG"),
        ("absent.tif", "source_io", "absent.tif"),
    ] {
        let error =
            Orthophoto::open(&fixture(name), &OpenOptions::default()).map(|o| o.description().clone()).unwrap_err();
        assert_eq!(error.code(), code, "{name}: {error}");
        assert!(error.to_string().contains(words) && error.to_string().contains(name), "{name}: {error}");
    }
    if cfg!(feature = "gdal") {
        shows("lzma.tif", &OpenOptions::default(), 0, everywhere, rgb);
    } else {
        let error = Orthophoto::open(&fixture("lzma.tif"), &OpenOptions::default()).unwrap_err();
        assert!(error.code() == "source_unsupported" && error.remedy() == Some(Remedy::ConvertToCog), "{error}");
    }
    let unknown = OpenOptions { crs: Some(99_999), ..OpenOptions::default() };
    let error = Orthophoto::open(&fixture("gray.tif"), &unknown).unwrap_err();
    assert!(error.code() == "crs_unknown" && error.to_string().contains("99999"), "{error}");
}

#[test]
fn shrinking_averages_and_overviews_agree_with_the_full_resolution() {
    // The image's own zoom is 20; at 18 each tile pixel holds 4 x 4 of it, at 17 8 x 8, from the overview of half size.
    let source = open("overviews.tif", &OpenOptions::default());
    let four = source.warp(aligned_tile()).unwrap().unwrap();
    for y in 0..64 {
        for x in 0..64 {
            assert!(four.mask.at(100 + x, 200 + y));
            let found = four.colour.at(100 + x, 200 + y).map(f64::from);
            let wanted = [3 * x + 20, 3 * y + 30, 230 - x - 2 * y].map(|v| v as f64);
            // The ramp was rounded to 8 bits before it is averaged.
            let edge = x == 0 || y == 0 || x == 63 || y == 63;
            let miss = (0..3).map(|c| (found[c] - wanted[c]).abs()).fold(0.0, f64::max);
            assert!(miss <= if edge { 1.6 } else { 1.01 }, "{found:?} for {wanted:?} at {x}, {y}");
        }
    }
    let eight = source.warp(aligned_tile().parent().unwrap()).unwrap().unwrap();
    let (x, y) = (10usize, 12usize);
    // Pixel (x, y) of the parent holds four of the tile's: 2 x and 2 x + 1.
    let parent_offset = (TILE.1 as usize % 2 * 256 + 50, TILE.2 as usize % 2 * 256 + 100);
    let found = eight.colour.at(parent_offset.0 + x, parent_offset.1 + y).map(f64::from);
    let wanted = [3.0 * (2.0 * x as f64 + 0.5) + 20.0, 3.0 * (2.0 * y as f64 + 0.5) + 30.0];
    assert!((found[0] - wanted[0]).abs() <= 1.01 && (found[1] - wanted[1]).abs() <= 1.01, "{found:?} for {wanted:?}");
}

#[test]
fn tiles_far_away_are_empty() {
    let source = open("rotated_utm.tif", &OpenOptions::default());
    for (zoom, column, row) in [(18, 0, 0), (18, 262_143, 131_072), (5, 30, 16), (2, 3, 3), (23, 1, 1)] {
        assert!(source.warp(TileId::new(zoom, column, row).unwrap()).unwrap().is_none(), "{zoom}/{column}/{row}");
    }
}

/// The same tile by GDAL's warper, RGB and (alpha) validity.
fn gdal_tile(source: &Path, tile: TileId) -> (Vec<[f64; 3]>, Vec<bool>) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("tile.raw");
    let b = tile.mercator_bounds();
    let extent = [b.min_x_m, b.min_y_m, b.max_x_m, b.max_y_m].map(|v| format!("{v:.9}"));
    let run = std::process::Command::new("gdalwarp")
        .args([
            "-q",
            "-of",
            "ENVI",
            "-co",
            "INTERLEAVE=BSQ",
            "-t_srs",
            "EPSG:3857",
            "-r",
            "cubic",
            "-et",
            "0",
            "-dstalpha",
        ])
        .args(["-ts", "512", "512", "-te"])
        .args(&extent)
        .arg(source)
        .arg(&out)
        .output()
        .unwrap();
    assert!(run.status.success(), "{run:?}");
    let bytes = std::fs::read(out).unwrap();
    let plane = 512 * 512;
    let alpha = bytes.len() / plane - 1;
    let colours = (0..plane).map(|i| [0, 1, 2].map(|c| f64::from(bytes[c * plane + i]))).collect();
    (colours, (0..plane).map(|i| bytes[alpha * plane + i] > 127).collect())
}

/// Mean difference in levels, and the shift in tile pixels that best explains what differs (least squares on the
/// gradient).
fn differences(tile: &MaskedColour, other: &[[f64; 3]], other_valid: &[bool]) -> (f64, f64, f64) {
    let at = |x: usize, y: usize| f64::from(tile.colour.at(x, y)[1]);
    let all_valid = |x: usize, y: usize| {
        (y - 1..=y + 1).all(|v| (x - 1..=x + 1).all(|u| tile.mask.at(u, v) && other_valid[v * 512 + u]))
    };
    let (mut n, mut sum, mut a, mut b) = (0.0, 0.0, nalgebra::Matrix2::zeros(), nalgebra::Vector2::zeros());
    for y in 1..511 {
        for x in 1..511 {
            if !all_valid(x, y) {
                continue;
            }
            let colours = tile.colour.at(x, y).map(f64::from);
            sum += (0..3).map(|c| (colours[c] - other[y * 512 + x][c]).abs()).sum::<f64>() / 3.0;
            n += 1.0;
            let g = nalgebra::Vector2::new((at(x + 1, y) - at(x - 1, y)) / 2.0, (at(x, y + 1) - at(x, y - 1)) / 2.0);
            a += g * g.transpose();
            b += g * (colours[1] - other[y * 512 + x][1]);
        }
    }
    assert!(n > 1000.0, "{n} pixels in common");
    let shift = a.try_inverse().expect("an image with texture") * b;
    (sum / n, shift.norm(), n)
}

/// Two tiles of a real orthophoto, as this project and as GDAL warp them.
fn warps_as_gdal(name: &str) {
    // Pixels valid for one alone, as a share of the tile.
    const VALID_APART: f64 = 0.002;
    let path = real_data(name);
    let source = Orthophoto::open(&path, &OpenOptions::default()).unwrap();
    let d = source.description();
    let centre = d.outline[16];
    let zoom = zoom_for_gsd(centre, d.gsd_m_per_px);
    let mut compared = 0;
    for id in [TileId::containing(centre, zoom).unwrap(), TileId::containing(d.outline[80], zoom).unwrap()] {
        let Some(tile) = source.warp(id).unwrap() else { continue };
        let (other, other_valid) = gdal_tile(&path, id);
        let apart = tile.mask.values().iter().zip(&other_valid).filter(|(v, o)| (**v != 0) != **o).count() as f64;
        assert!(apart / 512.0 / 512.0 <= VALID_APART, "{name} {id}: {apart} pixels are valid for one alone");
        let (mean, shift_px, n) = differences(&tile, &other, &other_valid);
        eprintln!("{name} {id}: {n} pixels, mean difference {mean:.3} levels, shift {shift_px:.4} px");
        // Both convolve with Keys' kernel; only rounding differs.
        assert!(mean < 0.6 && shift_px < 0.02, "{name} {id}: {mean} levels, {shift_px} px");
        compared += 1;
    }
    assert!(compared > 0, "{name}: no tile was compared");
}

#[test]
#[ignore = "needs gdal and naip"]
fn needs_gdal_and_naip_an_orthophoto_warps_as_gdal_warps_it() {
    warps_as_gdal("naip/m_4709963_se_14_1_20180716.tif");
}

#[test]
#[ignore = "needs gdal and brighton"]
fn needs_gdal_and_brighton_a_rotated_orthophoto_warps_as_gdal_warps_it() {
    warps_as_gdal("brighton/ortho_0.09m.tif");
}

#[test]
fn a_bad_file_is_an_error_and_not_a_panic_wherever_it_is_cut() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["tiled_deflate.tif", "jpeg_ycbcr.tif", "striped_lzw.tif", "photo_png.png", "photo_jpeg.jpg"] {
        let whole = std::fs::read(fixture(name)).unwrap();
        let stem = folder.path().join(name);
        for side in ["pgw", "jgw", "prj"] {
            let beside = fixture(name).with_extension(side);
            if beside.exists() {
                std::fs::copy(beside, stem.with_extension(side)).unwrap();
            }
        }
        for share in 0..40 {
            std::fs::write(&stem, &whole[..whole.len() * share / 40]).unwrap();
            let outcome = Orthophoto::open(&stem, &OpenOptions::default()).and_then(|o| o.warp(aligned_tile()));
            if let Err(error) = outcome {
                assert!(error.to_string().contains(name), "{error}");
            } else {
                // A JPEG decoder fills up what is missing; a PNG's last bytes hold no pixels.
                let harmless = name.ends_with("jpg") && share > 0 || name.ends_with("png") && share >= 36;
                assert!(harmless, "{name} cut at {share}/40 was read");
            }
        }
    }
    let error: RasterError = Orthophoto::open(folder.path(), &OpenOptions::default()).unwrap_err();
    assert_eq!(error.code(), "source_io");
}
