//! `PreparedFrame`: the first stage of a registration. The frame at the levels to search, and the area to search.

use super::answer::Reason;
use super::area::{SearchArea, centre};
use super::frame_pyramid::FramePyramid;
use super::hypotheses::{Hypothesis, hypotheses};
use super::levels::{CellLevel, Levels};
use super::refusal::{EarlyEnd, Refusal};
use super::request::PositionPrior;
use super::search_context::SearchContext;
use super::search_extent::SearchExtent;
use super::search_region::searched_position;
use overfly_core::camera::Camera;
use overfly_core::geodesy::Geodetic;
use overfly_core::pixels::Gray;
use overfly_core::tile::{Gsd, gsd_at};
use overfly_store::StoreError;

/// A frame whose shorter side has fewer pixels than this at the coarse level shows nothing to match.
const MIN_SIDE_PX: f64 = 12.0;
/// How far a frame may reach from the nadir at the coarse level, where its edge has about 50 to 100 pixels: a view tilted
/// by 45 degrees reaches 500. The size of the ground view grows with the square.
const MAX_REACH_PX: f64 = 1000.0;

/// A frame ready to be searched for.
pub struct PreparedFrame<'a> {
    /// The frame at every level of the search.
    pub frame: FramePyramid<'a>,
    /// The centre of the area.
    pub centre: Geodetic,
    /// The levels of coarse search and refinement.
    pub levels: Levels,
    /// The level of the wide search, where the area is so large that one is made.
    pub cell_level: Option<CellLevel>,
    /// The prior of the position, grown by what the attitude leaves open.
    pub position: PositionPrior,
    /// The positions to search, at the coarse level.
    pub area: SearchArea,
    /// How far the frame reaches from its nadir, coarse pixels.
    pub reach_px: f64,
    /// The likely headings and scales, and the rest.
    pub hypotheses: [Vec<Hypothesis>; 2],
    /// The size of a search of the whole area under all hypotheses.
    pub extent: SearchExtent,
    /// Base tiles that meet the area or a frame within.
    pub tiles_searched: usize,
}

impl<'a> PreparedFrame<'a> {
    /// Prepares a frame for a request.
    ///
    /// # Errors
    /// [`EarlyEnd::NoFix`] where the area holds no map or the frame cannot be compared with one; [`EarlyEnd::Error`] where the
    /// store fails.
    pub fn new(context: &SearchContext<'a>, frame: &'a Gray, camera: Camera) -> Result<Self, EarlyEnd> {
        let layer = context.layer;
        let position = searched_position(context.request, &camera);
        let outside = |detail: &str| Refusal::new(Reason::OutsideMap, detail);
        let centre = centre(&position, layer).ok_or_else(|| outside("the position is beyond the tile matrix"))?;
        let levels = Levels::choose(&camera, layer, centre);
        let reach_px = checked_reach_px(&camera, gsd_at(centre, levels.coarse))?;
        let area = SearchArea::new(&position, layer, levels.coarse)
            .and_then(|area| area.cut_to_layer(layer, reach_px))
            .ok_or_else(|| outside("the search region lies outside the layer"))?;
        let tiles_searched = count_tiles(context, &area, reach_px)?;
        if tiles_searched == 0 {
            return Err(outside("no tile of the layer meets the search region").into());
        }
        let hypotheses = hypotheses(context.request, reach_px);
        let extent = SearchExtent::new(&area, reach_px, hypotheses.iter().map(Vec::len).sum());
        let cell_level = extent.is_wide().then(|| CellLevel::choose(layer, centre, edge_m(&camera))).flatten();
        let mut zooms: Vec<u8> = levels.all().chain(cell_level.map(|level| level.zoom)).collect();
        zooms.sort_unstable_by(|a, b| b.cmp(a));
        zooms.dedup();
        let mut frame = FramePyramid::new(frame, camera);
        frame.add_levels(zooms.into_iter().map(|zoom| (zoom, gsd_at(centre, zoom))));
        Ok(Self { frame, centre, levels, cell_level, position, area, reach_px, hypotheses, extent, tiles_searched })
    }
}

/// The farthest that a frame's corner lies from the nadir, coarse pixels; refused where the frame is too small or reaches too far.
fn checked_reach_px(camera: &Camera, gsd: Gsd) -> Result<f64, Refusal> {
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
    Ok(reach_px)
}

/// Number of base tiles that meet the area or a frame within.
fn count_tiles(context: &SearchContext<'_>, area: &SearchArea, reach_px: f64) -> Result<usize, StoreError> {
    let layer = context.layer;
    if context.request.position == PositionPrior::WholeLayer {
        return Ok(layer.base_tiles as usize);
    }
    let bounds = area.mercator_bounds(reach_px);
    Ok(context.store.footprints_in(layer, layer.base_zoom, &bounds)?.len())
}

/// Square root of the ground area that a frame shows, metres.
fn edge_m(camera: &Camera) -> f64 {
    let (w, h) = camera.frame_size_px();
    (f64::from(w) * f64::from(h)).sqrt() * camera.gsd_m_per_px()
}
