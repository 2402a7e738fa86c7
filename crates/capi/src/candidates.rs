//! The tiles to search for a position and its uncertainty, best first.

use crate::border::{Place, object, optional, stated};
use crate::error::{call, overfly_status, release};
use crate::store::overfly_store;
use overfly_flight::locate::candidates::{Candidate, CandidateParameters, candidates};
use std::ffi::c_char;

/// A position and its uncertainty. Start from `overfly_candidate_request_new()`, which states nothing. The position, the
/// heading, `across_m`, `along_m` and the parameters of one mode must be stated:
/// sequential (the default): `inaccuracy_m` and `drift_m`, or `sigma_east_m` and `sigma_north_m`;
/// parallel: `inaccuracy_m`, `unit_drift_m`, `execution_s`, `relative_s`;
/// combined: `inaccuracy_m`, `speed_mps`, `execution_s`, `min_turn_radius_m`.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct overfly_candidate_request {
    /// `sequential`, `parallel` or `combined`; null: sequential.
    pub mode: *const c_char,
    /// The layer; null: the only one, or `ortho`.
    pub layer: *const c_char,
    /// Most likely latitude of the centre of the image, degrees; combined mode: that of the last fix.
    pub latitude_deg: f64,
    /// Most likely longitude, degrees.
    pub longitude_deg: f64,
    /// Direction of the upper edge of the image, degrees clockwise from true north, [0, 360).
    pub heading_deg: f64,
    /// Extent of the image on the ground across the heading, metres.
    pub across_m: f64,
    /// Extent of the image on the ground along the heading, metres.
    pub along_m: f64,
    /// Full width of the error of the last fix, metres.
    pub inaccuracy_m: f64,
    /// Drift since the last fix, one-sided, metres.
    pub drift_m: f64,
    /// One standard deviation towards east, metres.
    pub sigma_east_m: f64,
    /// One standard deviation towards north, metres.
    pub sigma_north_m: f64,
    /// Correlation of both, in (-1, 1); NaN: 0.
    pub correlation: f64,
    /// Drift of one relative registration, one-sided, metres.
    pub unit_drift_m: f64,
    /// How long the absolute registration before this search ran, seconds.
    pub execution_s: f64,
    /// Time of one relative registration, seconds.
    pub relative_s: f64,
    /// Ground speed, metres per second.
    pub speed_mps: f64,
    /// Least turn radius, metres.
    pub min_turn_radius_m: f64,
    /// Chooses the coarsest level whose pixels are no larger than this, metres per pixel; NaN: the base level.
    pub gsd_m_per_px: f64,
    /// How many of the best tiles to return; 0: all.
    pub max_tiles: u64,
}

/// A tile to search: `zoom`, `column` and `row` of the tile matrix (512 px a tile, rows counted from the north).
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct overfly_candidate {
    /// Zoom level.
    pub zoom: u32,
    /// Column, from the antimeridian eastwards.
    pub column: u32,
    /// Row, 0 in the north.
    pub row: u32,
    /// Keypoints described in the tile.
    pub keypoints: u32,
    /// Probability that the centre of the image lies in the tile.
    pub probability: f64,
    /// How unlike each other the keypoints are, in [0, 1].
    pub distinctiveness: f64,
    /// Ground sample distance at the centre of the tile, metres per pixel.
    pub gsd_m_per_px: f64,
}

/// The tiles to search.
#[repr(C)]
#[derive(Debug)]
pub struct overfly_candidates {
    /// The tiles, best first; never null.
    pub tiles: *const overfly_candidate,
    /// How many there are.
    pub length: usize,
    /// Probability that the centre of the image lies in these tiles.
    pub containment: f64,
    /// The paper's count of tiles for this search.
    pub nominal_count: f64,
    /// Estimated time of the search, seconds.
    pub estimated_s: f64,
}

/// Returns a request that states nothing.
#[unsafe(no_mangle)]
pub extern "C" fn overfly_candidate_request_new() -> overfly_candidate_request {
    overfly_candidate_request {
        mode: std::ptr::null(),
        layer: std::ptr::null(),
        latitude_deg: f64::NAN,
        longitude_deg: f64::NAN,
        heading_deg: f64::NAN,
        across_m: f64::NAN,
        along_m: f64::NAN,
        inaccuracy_m: f64::NAN,
        drift_m: f64::NAN,
        sigma_east_m: f64::NAN,
        sigma_north_m: f64::NAN,
        correlation: f64::NAN,
        unit_drift_m: f64::NAN,
        execution_s: f64::NAN,
        relative_s: f64::NAN,
        speed_mps: f64::NAN,
        min_turn_radius_m: f64::NAN,
        gsd_m_per_px: f64::NAN,
        max_tiles: 0,
    }
}

/// Lists the tiles to search and sets `*found`, which the caller frees with `overfly_candidates_free`. No tile is an answer
/// too: the region then lies outside the layer. On failure `*found` is null.
///
/// # Safety
/// `store` comes from `overfly_store_open` and is not freed; `request` and the strings in it may be read; `found` may be
/// written. Null is an error.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn overfly_candidates_find(
    store: *const overfly_store,
    request: *const overfly_candidate_request,
    found: *mut *mut overfly_candidates,
) -> overfly_status {
    call(|| {
        let out = unsafe { Place::new(found, "found") }?;
        out.set(std::ptr::null_mut());
        let store = &unsafe { object(store, "store") }?.reader;
        let request = unsafe { object(request, "request") }?;
        let mode = unsafe { optional(request.mode, "mode") }?;
        let layer = unsafe { optional(request.layer, "layer") }?;
        let answer = candidates(store, &request.parameters(mode, layer).query()?)?;
        let tiles: Box<[overfly_candidate]> = answer.tiles.iter().map(overfly_candidate::from).collect();
        let length = tiles.len();
        out.set(Box::into_raw(Box::new(overfly_candidates {
            tiles: Box::into_raw(tiles).cast(),
            length,
            containment: answer.containment,
            nominal_count: answer.nominal_count,
            estimated_s: answer.estimated_s,
        })));
        Ok(overfly_status::OVERFLY_OK)
    })
}

/// Frees a list of candidates. Null does nothing.
///
/// # Safety
/// `found` is null or comes from `overfly_candidates_find`, was not changed, and is not used afterwards.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn overfly_candidates_free(found: *mut overfly_candidates) {
    if !found.is_null() {
        release(|| {
            let found = unsafe { Box::from_raw(found) };
            let tiles = std::ptr::slice_from_raw_parts_mut(found.tiles.cast_mut(), found.length);
            drop(unsafe { Box::from_raw(tiles) });
        });
    }
}

impl overfly_candidate_request {
    fn parameters(&self, mode: Option<&str>, layer: Option<&str>) -> CandidateParameters {
        CandidateParameters {
            latitude_deg: stated(self.latitude_deg),
            longitude_deg: stated(self.longitude_deg),
            heading_deg: stated(self.heading_deg),
            across_m: stated(self.across_m),
            along_m: stated(self.along_m),
            inaccuracy_m: stated(self.inaccuracy_m),
            drift_m: stated(self.drift_m),
            sigma_east_m: stated(self.sigma_east_m),
            sigma_north_m: stated(self.sigma_north_m),
            correlation: stated(self.correlation),
            mode: mode.map(str::to_owned),
            unit_drift_m: stated(self.unit_drift_m),
            execution_s: stated(self.execution_s),
            relative_s: stated(self.relative_s),
            speed_mps: stated(self.speed_mps),
            min_turn_radius_m: stated(self.min_turn_radius_m),
            layer: layer.map(str::to_owned),
            max_tiles: (self.max_tiles > 0).then_some(self.max_tiles),
            gsd_m_per_px: stated(self.gsd_m_per_px),
        }
    }
}

impl From<&Candidate> for overfly_candidate {
    fn from(tile: &Candidate) -> Self {
        Self {
            zoom: tile.z.into(),
            column: tile.x,
            row: tile.y,
            keypoints: tile.keypoints,
            probability: tile.probability,
            distinctiveness: tile.distinctiveness,
            gsd_m_per_px: tile.gsd_m_per_px,
        }
    }
}
