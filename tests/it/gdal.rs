//! GIS tools open a store as it is, and read the imagery that they would have made themselves.

use super::needs::real_data;
use overfly_ingest::build::{self, Request};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Mean difference allowed, gray levels of 255: JPEG's loss and the resamplers' difference.
const LEVELS: f64 = 4.0;
/// Displacement allowed, tile pixels.
const DISPLACEMENT_PX: f64 = 0.1;

fn naip() -> PathBuf {
    real_data("naip/m_4709963_se_14_1_20180716.tif")
}

/// What a command prints; the command must succeed.
pub fn output(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {text}");
    text
}

fn store(folder: &Path, source: &Path) -> PathBuf {
    let db = folder.join("n18.gpkg");
    let request = Request {
        db: db.clone(),
        layer: "ortho".into(),
        sources: vec![source.into()],
        threads: 2,
        ..Request::default()
    };
    build::run(&request, &mut |_| ControlFlow::Continue(())).unwrap();
    db
}

/// GDAL opens the raster of a GeoPackage without a warning, and its validator finds nothing.
pub fn opens_and_validates(db: &Path) {
    let raster = output(Command::new("gdalinfo").arg("-checksum").arg(db));
    assert!(raster.contains("GPKG") && raster.contains("Overviews") && !raster.contains("Warning"), "{raster}");
    let found = output(Command::new("/usr/bin/python3").args(["-m", "osgeo_utils.samples.validate_gpkg"]).arg(db));
    assert!(!found.to_lowercase().contains("error"), "{found}");
}

#[test]
#[ignore = "needs gdal and naip"]
fn needs_gdal_and_naip_gdal_opens_a_store_and_its_validator_finds_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let db = store(folder.path(), &naip());
    opens_and_validates(&db);
    let features = output(Command::new("ogrinfo").args(["-ro", "-so", "-al"]).arg(&db));
    assert!(
        features.contains("footprints") && features.contains("Polygon") && !features.contains("Warning"),
        "{features}"
    );
}

/// Raw RGBA of a GeoPackage's or image's pixels by GDAL, band after band.
fn bands(image: &Path, raw: &Path) -> Vec<u8> {
    output(Command::new("gdal_translate").args(["-q", "-of", "ENVI", "-co", "INTERLEAVE=BSQ"]).arg(image).arg(raw));
    std::fs::read(raw).unwrap()
}

#[test]
#[ignore = "needs gdal and naip"]
fn needs_gdal_and_naip_gdal_reads_back_what_it_would_have_warped_itself() {
    let source = naip();
    let folder = tempfile::tempdir().unwrap();
    let db = store(folder.path(), &source);
    let ours = bands(&db, &folder.path().join("ours.img"));
    let info: serde_json::Value =
        serde_json::from_str(&output(Command::new("gdalinfo").args(["-json"]).arg(&db))).unwrap();
    let number = |v: &serde_json::Value| v.as_f64().unwrap();
    let (width, height) = (number(&info["size"][0]) as usize, number(&info["size"][1]) as usize);
    let corners = &info["cornerCoordinates"];
    let (low, high) = (&corners["lowerLeft"], &corners["upperRight"]);
    let extent: Vec<String> =
        [&low[0], &low[1], &high[0], &high[1]].iter().map(|v| format!("{:.9}", number(v))).collect();
    let warped = folder.path().join("warped.tif");
    let size = [width.to_string(), height.to_string()];
    let rgb = folder.path().join("rgb.tif");
    output(Command::new("gdal_translate").args(["-q", "-b", "1", "-b", "2", "-b", "3"]).arg(&source).arg(&rgb));
    output(
        Command::new("gdalwarp")
            .args(["-q", "-t_srs", "EPSG:3857", "-r", "bilinear", "-et", "0", "-dstalpha", "-te"])
            .args(&extent)
            .arg("-ts")
            .args(&size)
            .arg(&rgb)
            .arg(&warped),
    );
    let theirs = bands(&warped, &folder.path().join("theirs.img"));
    let pixels = width * height;
    assert_eq!((ours.len(), theirs.len()), (4 * pixels, 4 * pixels));
    let valid = |image: &[u8], i: usize| image[3 * pixels + i] == 255;
    let both: Vec<bool> = (0..pixels).map(|i| valid(&ours, i) && valid(&theirs, i)).collect();
    let count = both.iter().filter(|&&b| b).count();
    let one_only = (0..pixels).filter(|&i| valid(&ours, i) != valid(&theirs, i)).count();
    // The edge may differ by a pixel: 2 (4.7 + 3.6 km) at 4.8 m of the projection is about 5,000 pixels.
    assert!(count > pixels / 2 && one_only < 6000, "{count} valid in both, {one_only} in one only");
    let gray = |image: &[u8]| -> Vec<f64> {
        (0..pixels).map(|i| (0..3).map(|b| f64::from(image[b * pixels + i])).sum::<f64>() / 3.0).collect()
    };
    let difference =
        (0..3 * pixels).filter(|i| both[i % pixels]).map(|i| f64::from(ours[i].abs_diff(theirs[i]))).sum::<f64>()
            / (3 * count) as f64;
    let [x_px, y_px] = displacement(&gray(&ours), &gray(&theirs), &both, width);
    eprintln!("mean difference {difference:.2} levels, displacement ({x_px:.4}, {y_px:.4}) px");
    assert!(difference <= LEVELS);
    assert!(x_px.hypot(y_px) < DISPLACEMENT_PX);
}

/// The displacement of `b` against `a` in pixels: least squares on the gradient (Lucas and Kanade 1981), over pixels
/// whose neighbours are all valid.
fn displacement(a: &[f64], b: &[f64], valid: &[bool], width: usize) -> [f64; 2] {
    let height = a.len() / width;
    let (mut xx, mut xy, mut yy, mut xt, mut yt) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let i = y * width + x;
            if ![i, i - 1, i + 1, i - width, i + width].iter().all(|&j| valid[j]) {
                continue;
            }
            let gx = (a[i + 1] - a[i - 1] + b[i + 1] - b[i - 1]) / 4.0;
            let gy = (a[i + width] - a[i - width] + b[i + width] - b[i - width]) / 4.0;
            let t = a[i] - b[i];
            (xx, xy, yy, xt, yt) = (xx + gx * gx, xy + gx * gy, yy + gy * gy, xt + gx * t, yt + gy * t);
        }
    }
    let determinant = xx * yy - xy * xy;
    [(yy * xt - xy * yt) / determinant, (xx * yt - xy * xt) / determinant]
}

#[test]
fn the_displacement_is_measured_rightly() {
    let (width, height) = (200, 150);
    let wave = |dx: f64, dy: f64| -> Vec<f64> {
        (0..width * height)
            .map(|i| {
                let (x, y) = ((i % width) as f64 - dx, (i / width) as f64 - dy);
                100.0 + 40.0 * (x / 5.0 + y / 9.0).sin() + 30.0 * (y / 6.0 - x / 11.0).cos()
            })
            .collect()
    };
    let [x, y] = displacement(&wave(0.0, 0.0), &wave(0.25, -0.15), &vec![true; width * height], width);
    assert!((x - 0.25).abs() < 0.02 && (y + 0.15).abs() < 0.02, "{x} {y}");
}
