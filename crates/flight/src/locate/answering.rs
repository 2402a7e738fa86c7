//! The last stage of a registration: from the verdict to the answer.

use super::answer::{Answer, Fix, NoFix, PositionOf, Reason, SearchedMap};
use super::area::extent_m;
use super::measured_place::{Doubts, MeasuredPlace};
use super::refusal::Refusal;
use super::request::FixRequest;
use super::search_context::SearchContext;
use super::search_region::searched_position;
use super::verify::{Verdict, VerifiedPlace};
use nalgebra::Matrix2;
use overfly_core::camera::{Camera, View};
use overfly_core::coupling::nominal_count_sequential;
use overfly_core::geodesy::{BodyFrame, Enu, Geodetic, Heading, LocalFrame};
use overfly_store::{Layer, StoreError};

/// The size of a search, as every answer states it.
#[derive(Debug, Clone, Copy)]
pub struct SearchSize {
    /// Base tiles whose imagery was searched.
    pub tiles_searched: usize,
    /// Nominal count of the search.
    pub nominal_count: f64,
}

impl SearchSize {
    /// Returns the nominal count (equation 3) for the area that is searched, whose two edges stand for twice the drift, and no
    /// tiles yet.
    pub fn new(request: &FixRequest, layer: &Layer, camera: &Camera) -> Self {
        let (w, h) = camera.frame_size_px();
        let (across_m, along_m) = (f64::from(w) * camera.gsd_m_per_px(), f64::from(h) * camera.gsd_m_per_px());
        let [east_m, north_m] = extent_m(&searched_position(request, camera), layer);
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
    match fix(context, camera, size, place)? {
        Some(fix) => Ok(Answer::Fix(fix)),
        None => {
            let refusal = Refusal::new(Reason::OutsideMap, "the best place is beyond the tile matrix");
            Ok(no_fix(context, size, &refusal, Some(verdict)))
        }
    }
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
        map: searched_map(context),
        time_s: context.request.time_s,
    })
}

/// The map of a search of one layer.
fn searched_map(context: &SearchContext<'_>) -> SearchedMap {
    let layer = context.layer;
    SearchedMap {
        store_digest: context.store.digest().to_owned(),
        layer: layer.name.clone(),
        layer_date: layer.date().map(str::to_owned),
        layers_searched: vec![layer.name.clone()],
        layers_charged: context.layers,
    }
}

/// The fix at a place; `None` beyond the tile matrix.
///
/// # Errors
/// Where the store cannot be read.
pub fn fix(
    context: &SearchContext<'_>,
    camera: &Camera,
    size: SearchSize,
    place: &VerifiedPlace,
) -> Result<Option<Fix>, StoreError> {
    let near_rivals_px2 = place.rivals.map_or_else(Matrix2::zeros, |report| report.near_px2) + place.near_second_px2;
    let doubts = Doubts { seam: place.seam.as_ref(), is_smeared: place.is_smeared, near_rivals_px2 };
    let Some(measured) = MeasuredPlace::new(context, camera, &place.refined, &doubts)? else { return Ok(None) };
    let MeasuredPlace { estimate, image_centre, camera, covariances, map_error_m, footprint } = measured;
    let Some(nadir) = nadir(&camera, image_centre, estimate.heading_rad) else { return Ok(None) };
    let stated_error_m = footprint.as_ref().and_then(|f| f.horizontal_error_m);
    // A view without a height looks straight down: its nadir is the image's centre.
    let (position_of, covariance, attitude_sigma_rad) = match &context.request.view {
        View::Nadir { .. } => (PositionOf::ImageCentre, covariances.image_centre, None),
        View::Posed { attitude, .. } => (PositionOf::Nadir, covariances.nadir, Some(attitude.sigma_rad)),
    };
    Ok(Some(Fix {
        position: nadir,
        position_of,
        heading: Heading::from_radians(estimate.heading_rad),
        heading_sigma_rad: estimate.heading_variance_rad2.sqrt(),
        gsd_m_per_px: camera.gsd_m_per_px(),
        scale_sigma_ratio: estimate.log_height_variance.sqrt(),
        covariance,
        score: place.peak_z_score,
        false_fix_probability: place.false_fix_probability(),
        log10_false_alarms: Some(place.log10_false_alarms),
        image_centre,
        image_centre_covariance: covariances.image_centre,
        attitude_sigma_rad,
        inliers: place.refined.fit.inliers.len(),
        tiles_searched: size.tiles_searched,
        nominal_count: size.nominal_count,
        map_error_m,
        map_error_known: stated_error_m.is_some(),
        map_epoch: footprint.and_then(|f| f.acquired),
        map: searched_map(context),
        time_s: context.request.time_s,
    }))
}

/// The nadir of a camera that shows a ground point at its image's centre; `None` beyond the horizon of that point.
fn nadir(camera: &Camera, image_centre: Geodetic, heading_rad: f64) -> Option<Geodetic> {
    let centre = camera.image_centre_in_body().unwrap_or_default();
    let Enu { east_m, north_m } = BodyFrame::from_heading_rad(heading_rad).enu_from_body(centre);
    LocalFrame::at(image_centre).geodetic_from_enu(Enu { east_m: -east_m, north_m: -north_m }).ok()
}
