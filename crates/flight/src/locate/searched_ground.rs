//! `SearchedGround`: the ground that a registration searches. It follows from the request and the camera; no frame is needed.

use super::answer::Reason;
use super::area::{SearchArea, centre};
use super::levels::Levels;
use super::refusal::Refusal;
use super::request::{FixRequest, PositionPrior};
use super::search_region::searched_position;
use overfly_core::camera::Camera;
use overfly_core::geodesy::{BodyOffset, Geodetic};
use overfly_core::tile::{Gsd, MercatorBounds, gsd_at};
use overfly_store::{Footprint, Layer, Reader, StoreError};

/// A frame whose shorter side has fewer pixels than this at the coarse level shows nothing to match.
const MIN_SIDE_PX: f64 = 12.0;
/// How far a frame may reach from the nadir at the coarse level, where its edge has about 50 to 100 pixels: a view tilted
/// by 45 degrees reaches 500. The size of the ground view grows with the square.
const MAX_REACH_PX: f64 = 1000.0;

/// Between two headings or scales that are tried the edge of a frame moves by less than this, coarse pixels; the nadir of a frame that
/// looks aside by more, as its distance is to the frame's own size.
const LEVER_PX: f64 = 1.2;

/// A frame shows at most so many times the ground of the whole layer: of a larger one no window lies on the map.
const MAX_LAYERS_IN_FRAME: f64 = 16.0;

/// The ground that a registration searches.
pub struct SearchedGround {
    /// The prior of the position, grown by what the attitude leaves open.
    pub position: PositionPrior,
    /// The centre of the area.
    pub centre: Geodetic,
    /// The levels of coarse search and refinement.
    pub levels: Levels,
    /// The positions to search, at the coarse level.
    pub area: SearchArea,
    /// How far the frame reaches from its nadir, coarse pixels.
    pub reach_px: f64,
    /// How far it reaches from its own middle, coarse pixels.
    pub half_px: f64,
}

impl SearchedGround {
    /// Returns the ground of a request on a layer, for a camera of its view.
    ///
    /// # Errors
    /// A [`Refusal`] where the area lies outside the layer or the frame cannot be compared with the map.
    pub fn new(request: &FixRequest, layer: &Layer, camera: &Camera) -> Result<Self, Refusal> {
        let position = searched_position(request, camera);
        let outside = |detail: &str| Refusal::new(Reason::OutsideMap, detail);
        let centre = centre(&position, layer).ok_or_else(|| outside("the position is beyond the tile matrix"))?;
        let levels = Levels::choose(camera, layer, centre);
        let [reach_px, half_px] = checked_reach_px(camera, gsd_at(centre, levels.coarse))?;
        check_share_of_layer(camera, layer, centre)?;
        let area = SearchArea::new(&position, layer, levels.coarse)
            .and_then(|area| area.grown(LEVER_PX * (reach_px / half_px - 1.0).floor()).cut_to_layer(layer, reach_px))
            .ok_or_else(|| outside("the search region lies outside the layer"))?;
        Ok(Self { position, centre, levels, area, reach_px, half_px })
    }

    /// The extent of the area and of every frame within.
    pub fn bounds(&self) -> MercatorBounds {
        self.area.mercator_bounds(self.reach_px)
    }

    /// The base tiles that meet the area or a frame within, in no order.
    ///
    /// # Errors
    /// Where the store cannot be read.
    pub fn footprints(&self, store: &Reader, layer: &Layer) -> Result<Vec<Footprint>, StoreError> {
        match self.position {
            PositionPrior::WholeLayer => store.footprints(layer, layer.base_zoom),
            _ => store.footprints_in(layer, layer.base_zoom, &self.bounds()),
        }
    }

    /// The number of [`footprints`](Self::footprints).
    ///
    /// # Errors
    /// Where the store cannot be read.
    pub fn count_tiles(&self, store: &Reader, layer: &Layer) -> Result<usize, StoreError> {
        match self.position {
            PositionPrior::WholeLayer => Ok(layer.base_tiles as usize),
            _ => Ok(self.footprints(store, layer)?.len()),
        }
    }
}

/// Refuses a frame of which the whole layer could fill only a small part.
fn check_share_of_layer(camera: &Camera, layer: &Layer, near: Geodetic) -> Result<(), Refusal> {
    let (w, h) = camera.frame_size_px();
    let frame_m2 = f64::from(w) * f64::from(h) * camera.gsd_m_per_px().powi(2);
    let Some(whole) = SearchArea::new(&PositionPrior::WholeLayer, layer, layer.base_zoom) else { return Ok(()) };
    let gsd = gsd_at(near, layer.base_zoom);
    let layer_m2 = whole.places() * gsd.east_m_per_px * gsd.north_m_per_px;
    if frame_m2 > MAX_LAYERS_IN_FRAME * layer_m2 {
        let [frame_km2, layer_km2] = [frame_m2, layer_m2].map(|m2| m2 / 1e6);
        let detail = format!(
            "the frame would show {frame_km2:.2} km2, and the whole layer covers {layer_km2:.2}; is its scale right?"
        );
        return Err(Refusal::new(Reason::InconsistentScale, detail));
    }
    Ok(())
}

/// The farthest that a frame's corner lies from the nadir and from the frame's middle, coarse pixels; refused where the frame is too small or reaches too far.
fn checked_reach_px(camera: &Camera, gsd: Gsd) -> Result<[f64; 2], Refusal> {
    let (w, h) = camera.frame_size_px();
    let side_px = f64::from(w.min(h)) * camera.gsd_m_per_px() / gsd.mean_m_per_px();
    if side_px < MIN_SIDE_PX {
        let detail = format!("the frame is {side_px:.1} px of the map wide, {MIN_SIDE_PX} needed");
        return Err(Refusal::new(Reason::TooLittleStructure, detail));
    }
    let Some(corners) = camera.footprint_in_body() else {
        return Err(Refusal::new(Reason::HorizonInView, "the camera sees the horizon"));
    };
    let farthest_m = corners.iter().map(|corner| corner.length_m()).fold(0.0, f64::max);
    let reach_px = farthest_m / gsd.mean_m_per_px();
    if reach_px > MAX_REACH_PX {
        let detail = format!(
            "the frame would reach {reach_px:.0} px of the map's coarsest level from the point below the camera, at most {MAX_REACH_PX}; is its scale right?"
        );
        return Err(Refusal::new(Reason::InconsistentScale, detail));
    }
    let mean = |axis: fn(&BodyOffset) -> f64| corners.iter().map(axis).sum::<f64>() / 4.0;
    let middle = BodyOffset { right_m: mean(|corner| corner.right_m), ahead_m: mean(|corner| corner.ahead_m) };
    let half_m = corners.iter().map(|corner| (*corner - middle).length_m()).fold(0.0, f64::max);
    Ok([reach_px, half_m / gsd.mean_m_per_px()])
}
