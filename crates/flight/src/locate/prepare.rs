//! `PreparedFrame`: the first stage of a registration. The frame at the levels to search, and the area to search.

use super::answer::Reason;
use super::area::SearchArea;
use super::frame_pyramid::FramePyramid;
use super::hypotheses::{Hypothesis, hypotheses};
use super::levels::{CellLevel, Levels};
use super::refusal::{EarlyEnd, Refusal};
use super::request::PositionPrior;
use super::search_context::SearchContext;
use super::search_extent::SearchExtent;
use super::searched_ground::SearchedGround;
use overfly_core::camera::Camera;
use overfly_core::geodesy::Geodetic;
use overfly_core::pixels::Gray;
use overfly_core::tile::gsd_at;

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
        let ground = SearchedGround::new(context.request, layer, &camera)?;
        let tiles_searched = ground.count_tiles(context.store, layer)?;
        if tiles_searched == 0 {
            return Err(Refusal::new(Reason::OutsideMap, "no tile of the layer meets the search region").into());
        }
        let SearchedGround { position, centre, levels, area, reach_px, half_px } = ground;
        let hypotheses = hypotheses(context.request, half_px);
        let extent = SearchExtent::new(&area, half_px, hypotheses.iter().map(Vec::len).sum());
        let cell_level = extent.is_wide().then(|| CellLevel::choose(layer, centre, edge_m(&camera))).flatten();
        let mut zooms: Vec<u8> = levels.all().chain(cell_level.map(|level| level.zoom)).collect();
        zooms.sort_unstable_by(|a, b| b.cmp(a));
        zooms.dedup();
        let mut frame = FramePyramid::new(frame, camera);
        frame.add_levels(zooms.into_iter().map(|zoom| (zoom, gsd_at(centre, zoom))));
        Ok(Self { frame, centre, levels, cell_level, position, area, reach_px, hypotheses, extent, tiles_searched })
    }
}

/// Square root of the ground area that a frame shows, metres.
fn edge_m(camera: &Camera) -> f64 {
    let (w, h) = camera.frame_size_px();
    (f64::from(w) * f64::from(h)).sqrt() * camera.gsd_m_per_px()
}
