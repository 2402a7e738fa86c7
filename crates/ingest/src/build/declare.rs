//! Declaring a source: a file is opened, hashed and described.

use super::error::{MAX_TILES, Rejected};
use super::outline::Outline;
use super::request::{Request, future_day};
use crate::raster::{OpenOptions, Orthophoto, RasterError, content_hash, stated_datum};
use crate::remedy::Remedy;
use overfly_core::geodesy::Geodetic;
use overfly_core::tile::zoom_for_gsd;
use overfly_store::{Source, default_error_m};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// A given source and its size.
#[derive(Debug, Clone)]
pub struct DeclaredSource {
    /// The source as the store declares it.
    pub source: Source,
    /// The number of its pixels.
    pub pixels: u64,
    /// The CRS that the file states and the request overrides.
    pub overridden_crs: Option<OverriddenCrs>,
}

/// A source whose own CRS the request overrides.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct OverriddenCrs {
    /// The source.
    pub path: PathBuf,
    /// What its file states.
    pub own: String,
    /// What the request states, and counts.
    pub given: String,
}

/// Opens, hashes and describes a file, and checks that it has a valid pixel.
///
/// # Errors
/// [`Rejected`] with what is wrong with the file.
pub fn declare(path: &Path, request: &Request) -> Result<DeclaredSource, Rejected> {
    let reject = |error: RasterError| Rejected::from((path, &error));
    let photo = Orthophoto::open(path, &open_options(request.crs, request.stretch, request.terrain.is_some()))
        .map_err(reject)?;
    if request.terrain.is_some() {
        // Heights in feet would be built as metres.
        stated_datum(path).map_err(reject)?;
    }
    let description = photo.description();
    let source = Source {
        content_hash: content_hash(path).map_err(reject)?,
        path: path.canonicalize().unwrap_or_else(|_| path.into()),
        acquired: request.date.clone().or_else(|| description.acquired.clone()),
        crs_epsg: request.crs,
        stretch: request.stretch,
        horizontal_error_m: horizontal_error_m(
            request.horizontal_error_m,
            description.crs_error_m,
            description.gsd_m_per_px,
        ),
        gsd_m_per_px: description.gsd_m_per_px,
        outline_deg: description.outline.iter().map(|p| [p.longitude_deg(), p.latitude_deg()]).collect(),
    };
    if let Some(rejected) = source.acquired.as_deref().and_then(|date| future(path, date, request)) {
        return Err(rejected);
    }
    if !has_valid_pixel(&photo, &source)? {
        return Err(Rejected {
            path: path.into(),
            code: "nothing_valid",
            message: format!(
                "{}: no pixel is valid: all is masked, transparent or nodata, or the whole image is smaller than a pixel of zoom {}",
                path.display(),
                natural_zoom(&source)
            ),
            remedy: Some(Remedy::CheckValidPixels),
        });
    }
    let overridden =
        |own: &String| OverriddenCrs { path: path.into(), own: own.clone(), given: description.crs.clone() };
    Ok(DeclaredSource {
        source,
        pixels: description.width_px.saturating_mul(description.height_px),
        overridden_crs: description.overridden_crs.as_ref().map(overridden),
    })
}

/// Why a source is left out whose metadata state a date of the future.
fn future(path: &Path, date: &str, request: &Request) -> Option<Rejected> {
    let (day, today) = future_day(date, request.today)?;
    Some(Rejected {
        path: path.into(),
        code: "future_date",
        message: format!("{}: its metadata date it {day}, in the future: today is {today} (UTC)", path.display()),
        remedy: Some(Remedy::StateDate),
    })
}

/// The error of a source, metres: the stated one, at least that of its CRS. `None` where none is stated, unless that of the CRS alone is
/// more than the default of an unknown one.
fn horizontal_error_m(stated_m: Option<f64>, crs_m: f64, gsd_m_per_px: f64) -> Option<f64> {
    match stated_m {
        Some(stated_m) => Some(stated_m.max(crs_m)),
        None => (crs_m > default_error_m(gsd_m_per_px)).then_some(crs_m),
    }
}

/// Whether the source has a valid pixel. Tiles are warped from the middle outwards until one has; usually the first does.
fn has_valid_pixel(photo: &Orthophoto, source: &Source) -> Result<bool, Rejected> {
    let path = &photo.description().path;
    let zoom = natural_zoom(source);
    let outline = Outline::new(&source.outline_deg, zoom).map_err(|e| Rejected {
        path: path.clone(),
        code: "beyond_the_matrix",
        message: format!("{}: {e}", path.display()),
        remedy: None,
    })?;
    if outline.extent_tiles() > f64::from(MAX_TILES) {
        return Err(Rejected {
            path: path.clone(),
            code: "too_many_tiles",
            message: format!("{}: it spans more than {MAX_TILES} tiles", path.display()),
            remedy: Some(Remedy::CheckGeoreference),
        });
    }
    let mut tiles = outline.tiles();
    let middle = tiles.get(tiles.len() / 2).copied();
    tiles.sort_by_key(|t| middle.map_or(0, |m| t.column().abs_diff(m.column()) + t.row().abs_diff(m.row())));
    for tile in tiles {
        if photo.warp(tile).map_err(|e| Rejected::from((path.as_path(), &e)))?.is_some() {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Returns the zoom that keeps a source's resolution.
pub fn natural_zoom(source: &Source) -> u8 {
    let count = source.outline_deg.len().max(1) as f64;
    let latitude_deg = source.outline_deg.iter().map(|p| p[1]).sum::<f64>() / count;
    let centre = Geodetic::from_degrees(latitude_deg, 0.0).expect("a mean of latitudes is a latitude");
    zoom_for_gsd(centre, source.gsd_m_per_px)
}

/// Returns the options with which a declared source is opened.
pub fn open_options(crs: Option<u32>, stretch: Option<(f64, f64)>, heights: bool) -> OpenOptions {
    OpenOptions { crs, stretch, heights, ..OpenOptions::default() }
}
