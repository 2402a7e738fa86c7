//! `MeasuredPlace`: what the windows of a place measure, with the covariance of a fix there.

use super::fix_covariance::FixCovariances;
use super::place_estimate::{PlaceEstimate, TiltFound};
use super::refined_place::RefinedPlace;
use super::search_context::SearchContext;
use nalgebra::Matrix2;
use overfly_core::camera::Camera;
use overfly_core::geodesy::Geodetic;
use overfly_core::registration::seam::Seam;
use overfly_core::tile::{TileId, gsd_at};
use overfly_store::{Footprint, StoreError, default_error_m};

/// What leaves a doubt about a place beside its windows.
#[derive(Debug, Clone, Copy, Default)]
pub struct Doubts<'a> {
    /// A seam across the view.
    pub seam: Option<&'a Seam>,
    /// Whether the view is smeared.
    pub is_smeared: bool,
    /// Covariance of the places within the ellipse at which the frame might lie instead, pixels of the place's level squared.
    pub near_rivals_px2: Matrix2<f64>,
}

/// A place as its windows measure it, and the map there.
pub struct MeasuredPlace {
    /// The ground under the image's centre, the heading and the height.
    pub estimate: PlaceEstimate,
    /// The ground under the image's centre.
    pub image_centre: Geodetic,
    /// The stated camera at the estimated height.
    pub camera: Camera,
    /// The covariances of a fix.
    pub covariances: FixCovariances,
    /// The map's own error, one standard deviation per axis, metres.
    pub map_error_m: f64,
    /// The tile under the image's centre.
    pub footprint: Option<Footprint>,
}

impl MeasuredPlace {
    /// Measures a place; `None` beyond the tile matrix. `camera` is the stated one.
    ///
    /// # Errors
    /// Where the store cannot be read.
    pub fn new(
        context: &SearchContext<'_>,
        camera: &Camera,
        place: &RefinedPlace,
        doubts: &Doubts<'_>,
    ) -> Result<Option<Self>, StoreError> {
        let view = &context.request.view;
        let mut estimate = PlaceEstimate::new(place, view, camera);
        if let Some(seam) = doubts.seam {
            estimate = estimate.doubted(seam);
        }
        if doubts.is_smeared {
            estimate = estimate.smeared(place);
        }
        estimate.covariance_px2 += doubts.near_rivals_px2;
        let tilt = TiltFound::new(place, view, camera);
        let camera = camera.at_height_ratio(estimate.height_ratio);
        let Ok(image_centre) = estimate.image_centre.to_geodetic(estimate.zoom) else { return Ok(None) };
        let footprint = footprint_at(context, image_centre)?;
        let finest_m_per_px = gsd_at(image_centre, context.layer.base_zoom).mean_m_per_px();
        let stated_error_m = footprint.as_ref().and_then(|f| f.horizontal_error_m);
        let map_error_m = stated_error_m.unwrap_or_else(|| default_error_m(finest_m_per_px));
        let gsd = gsd_at(image_centre, estimate.zoom);
        let relief_error_m = context.ground.filter(|_| place.relief.is_some()).map_or(0.0, |ground| ground.error_m());
        let covariances =
            FixCovariances::new(&estimate, tilt.as_ref(), view, &camera, gsd, [map_error_m, relief_error_m]);
        Ok(Some(Self { estimate, image_centre, camera, covariances, map_error_m, footprint }))
    }
}

fn footprint_at(context: &SearchContext<'_>, point: Geodetic) -> Result<Option<Footprint>, StoreError> {
    let Ok(tile) = TileId::containing(point, context.layer.base_zoom) else { return Ok(None) };
    context.store.footprint(context.layer, tile)
}
