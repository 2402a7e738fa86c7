//! The last stage of a registration: from the verdict to the answer.

use super::answer::{Answer, Fix, NoFix, Reason};
use super::area::extent_m;
use super::refusal::Refusal;
use super::search_context::SearchContext;
use super::verify::{Verdict, VerifiedPlace};
use overfly_core::camera::Camera;
use overfly_core::coupling::nominal_count_sequential;
use overfly_core::geodesy::{BodyFrame, EnuCovariance, Geodetic, Heading, LocalFrame};
use overfly_core::tile::{TileId, gsd_at};
use overfly_store::{Footprint, StoreError};

/// Neighbouring windows see the same edges, so fewer of them are independent than there are: variances from their residuals are
/// too small by this factor. Measured where frame and map are of one date and nothing else disturbs.
const VARIANCE_FACTOR: f64 = 1.4;
/// Changes between two dates (shadows, leaves, walls seen from another side) scatter the windows, but also shift all of them
/// together, which no residual shows: one standard deviation per axis, as a multiple of the scatter. Measured on synthetic ground
/// under another sun, whose truth is exact.
const COMMON_SHIFT_SHARE: f64 = 2.0;
/// Such a shift is caused by the heights of objects, so its bound does not grow with the pixel, metres.
const MAX_COMMON_SHIFT_M: f64 = 1.0;
/// The smallest false-fix probability that is stated. None of 20,000 negative trials was accepted, which proves no rate below 3 in
/// 20,000.
const MIN_FALSE_FIX_PROBABILITY: f64 = 1.5e-4;

/// The size of a search, as every answer states it.
#[derive(Debug, Clone, Copy)]
pub struct SearchSize {
    /// Base tiles whose imagery was searched.
    pub tiles_searched: usize,
    /// Nominal count of the search.
    pub nominal_count: f64,
}

impl SearchSize {
    /// Returns the nominal count (equation 3) for the area that the prior allows, whose two edges stand for twice the drift, and no
    /// tiles yet.
    pub fn new(context: &SearchContext<'_>, camera: &Camera) -> Self {
        let (w, h) = camera.frame_size_px();
        let (across_m, along_m) = (f64::from(w) * camera.gsd_m_per_px(), f64::from(h) * camera.gsd_m_per_px());
        let [east_m, north_m] = extent_m(&context.request.position, context.layer);
        let nominal_count = nominal_count_sequential(across_m, along_m, 0.0, (east_m * north_m).sqrt() / 2.0);
        Self { tiles_searched: 0, nominal_count }
    }
}

/// The answer to a verdict; without a verdict there was nothing to search.
///
/// # Errors
/// Where the store cannot be read.
pub fn answer(
    context: &SearchContext<'_>,
    camera: &Camera,
    size: SearchSize,
    verdict: Option<&Verdict>,
) -> Result<Answer, StoreError> {
    let Some(verdict) = verdict else {
        let refusal = Refusal::new(Reason::TooLittleStructure, "there is no heading or scale to search");
        return Ok(no_fix(context, size, &refusal, None));
    };
    if let Some(refusal) = &verdict.refusal {
        return Ok(no_fix(context, size, refusal, Some(verdict)));
    }
    let place = verdict.fix().expect("a verdict without a refusal has a place");
    let Ok(nadir) = place.refined.pose.nadir.to_geodetic(place.refined.pose.zoom) else {
        let refusal = Refusal::new(Reason::OutsideMap, "the best place is beyond the tile matrix");
        return Ok(no_fix(context, size, &refusal, Some(verdict)));
    };
    Ok(Answer::Fix(fix(context, camera, size, place, nadir)?))
}

/// The answer "no fix".
pub fn no_fix(context: &SearchContext<'_>, size: SearchSize, refusal: &Refusal, verdict: Option<&Verdict>) -> Answer {
    Answer::NoFix(NoFix {
        reason: refusal.reason,
        detail: refusal.detail.clone(),
        score: verdict.and_then(|v| v.score),
        log10_false_alarms: verdict.and_then(|v| v.log10_false_alarms),
        tiles_searched: size.tiles_searched,
        nominal_count: size.nominal_count,
        time_s: context.request.time_s,
    })
}

fn fix(
    context: &SearchContext<'_>,
    camera: &Camera,
    size: SearchSize,
    place: &VerifiedPlace,
    nadir: Geodetic,
) -> Result<Fix, StoreError> {
    let pose = place.refined.pose;
    let fit = &place.refined.fit;
    let gsd = gsd_at(nadir, pose.zoom);
    let camera = camera.at_height_ratio(pose.height_ratio);
    let footprint = footprint_at(context, nadir)?;
    let map_error_m = footprint.as_ref().map_or(0.0, |f| f.horizontal_error_m);
    let c = fit.covariance * VARIANCE_FACTOR;
    let (ge, gn) = (gsd.east_m_per_px, gsd.north_m_per_px);
    let common_m = (COMMON_SHIFT_SHARE * fit.rms_px * gsd.mean_m_per_px()).min(MAX_COMMON_SHIFT_M);
    let common_m2 = map_error_m.powi(2) + common_m.powi(2);
    // East runs with the map's columns, north against its rows.
    let covariance = EnuCovariance {
        ee_m2: c[(0, 0)] * ge * ge + common_m2,
        en_m2: -c[(0, 1)] * ge * gn,
        nn_m2: c[(1, 1)] * gn * gn + common_m2,
    };
    Ok(Fix {
        position: nadir,
        heading: Heading::from_radians(pose.heading_rad),
        heading_sigma_rad: c[(3, 3)].sqrt(),
        gsd_m_per_px: camera.gsd_m_per_px(),
        scale_sigma_ratio: c[(2, 2)].sqrt(),
        covariance,
        score: place.peak_z_score,
        false_fix_probability: 10f64.powf(place.log10_false_alarms).clamp(MIN_FALSE_FIX_PROBABILITY, 1.0),
        log10_false_alarms: Some(place.log10_false_alarms),
        image_centre: image_centre(&camera, nadir, pose.heading_rad),
        inliers: fit.inliers.len(),
        tiles_searched: size.tiles_searched,
        nominal_count: size.nominal_count,
        map_epoch: footprint.and_then(|f| f.acquired),
        time_s: context.request.time_s,
    })
}

fn footprint_at(context: &SearchContext<'_>, point: Geodetic) -> Result<Option<Footprint>, StoreError> {
    let Ok(tile) = TileId::containing(point, context.layer.base_zoom) else { return Ok(None) };
    context.store.footprint(context.layer, tile)
}

fn image_centre(camera: &Camera, nadir: Geodetic, heading_rad: f64) -> Geodetic {
    let centre = camera.image_centre_in_body().unwrap_or_default();
    let enu = BodyFrame::from_heading_rad(heading_rad).enu_from_body(centre);
    LocalFrame::at(nadir).geodetic_from_enu(enu).unwrap_or(nadir)
}
