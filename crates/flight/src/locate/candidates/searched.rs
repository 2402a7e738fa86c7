//! `searched_candidates`: the tiles that a fix with the same request searches.

use super::super::answering::SearchSize;
use super::super::error::LocateError;
use super::super::ground_heights::GroundHeights;
use super::super::hypotheses::hypotheses;
use super::super::request::{FixRequest, PositionPrior};
use super::super::search_extent::{SearchExtent, estimated_s};
use super::super::searched_ground::SearchedGround;
use super::super::stated_height::StatedHeight;
use super::candidate_tiles::{Candidate, Candidates};
use super::geometry::Geometry;
use super::ranking::{candidate, imaged_probability};
use super::search::bounded;
use overfly_core::camera::{Camera, View};
use overfly_core::geodesy::{WORLD_M, degrees_from_mercator};
use overfly_core::region::{ImageOnGround, Region, Uncertainty};
use overfly_core::tile::MercatorBounds;
use overfly_store::{Footprint, Reader};

/// Returns the base tiles that a fix with this request searches, best first, for a frame of the stated camera's size. All
/// probabilities are of the point that the fix answers: the nadir. They are uniform over the map where the position is unknown, and
/// where its ellipse reaches beyond 300 km. A request whose fix ends without a search (outside the map, the horizon in view) has no
/// tiles.
///
/// # Errors
/// [`LocateError::TooManyTiles`] for more than `most_tiles` tiles, [`LocateError::Missing`] where the view states no camera, and as [`locate`](super::super::locate), without a frame.
pub fn searched_candidates(store: &Reader, request: &FixRequest, most_tiles: u64) -> Result<Candidates, LocateError> {
    request.check()?;
    let View::Posed { intrinsics, .. } = &request.view else {
        let expected = "state height_m and camera: without an image, only they tell how much ground it shows";
        return Err(LocateError::Missing { name: "camera", expected });
    };
    let layer = store.imagery_layer(&request.layer)?;
    let (_, resolved) = StatedHeight::resolved(request, layer, GroundHeights::from_store(store).as_ref())?;
    let request = &resolved;
    let camera = Camera::new(&request.view, intrinsics.width_px, intrinsics.height_px)?;
    let ground = SearchedGround::new(request, layer, &camera).ok();
    let footprints = match &ground {
        Some(ground) => {
            let too_many = |_| LocateError::TooManyTiles { most: most_tiles };
            bounded(&ground.bounds(), layer.base_zoom, layer, most_tiles).map_err(too_many)?;
            ground.footprints(store, layer)?
        }
        None => Vec::new(),
    };
    let region = ground.as_ref().and_then(|ground| region(ground, request, &camera));
    let tiles = ranked(&layer.name, &footprints, region.as_ref());
    let estimated_s = match &ground {
        Some(ground) if !tiles.is_empty() => {
            let count = hypotheses(request, ground.half_px).iter().map(Vec::len).sum();
            estimated_s(SearchExtent::new(&ground.area, ground.half_px, count).comparisons())
        }
        _ => 0.0,
    };
    Ok(Candidates {
        nominal_count: SearchSize::new(request, layer, &camera).nominal_count,
        region: Geometry::from_rings(ground.map(|ground| rings_deg(&ground.bounds())).unwrap_or_default()),
        containment: tiles.iter().fold(0.0, |sum: f64, t| sum + t.probability).min(1.0),
        estimated_s,
        tiles,
    })
}

/// The distribution of the nadir; `None` where it is uniform over the map.
fn region(ground: &SearchedGround, request: &FixRequest, camera: &Camera) -> Option<Region> {
    let (w, h) = camera.frame_size_px();
    let image = ImageOnGround {
        across_m: f64::from(w) * camera.gsd_m_per_px(),
        along_m: f64::from(h) * camera.gsd_m_per_px(),
        heading_rad: request.heading.map_or(0.0, |heading| heading.heading_rad),
    };
    let (centre, uncertainty) = match ground.position {
        PositionPrior::Gaussian { centre, sigma_east_m, sigma_north_m, correlation } => {
            (centre, Uncertainty::Covariance { sigma_east_m, sigma_north_m, correlation })
        }
        PositionPrior::Square { .. } | PositionPrior::WholeLayer => return None,
    };
    Region::new(centre, image, uncertainty).ok()
}

/// The tiles by falling probability, then by distance from the middle, then by name.
fn ranked(layer: &str, footprints: &[Footprint], region: Option<&Region>) -> Vec<Candidate> {
    let imaged: f64 = footprints.iter().map(|f| f.valid_fraction).sum();
    let mut met: Vec<(f64, f64, &Footprint)> = footprints
        .iter()
        .map(|f| match region {
            Some(region) => (imaged_probability(region, f), region.distance_m(&f.tile.mercator_bounds()), f),
            None => (f.valid_fraction / imaged, 0.0, f),
        })
        .collect();
    met.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.total_cmp(&b.1)).then(a.2.tile.cmp(&b.2.tile)));
    met.into_iter().map(|(probability, _, f)| candidate(layer, f, probability)).collect()
}

/// An extent as closed, counterclockwise rings in degrees, cut at the antimeridian and where the tile matrix ends.
fn rings_deg(bounds: &MercatorBounds) -> Vec<Vec<[f64; 2]>> {
    let half_m = WORLD_M / 2.0;
    let (south_m, north_m) = (bounds.min_y_m.max(-half_m), bounds.max_y_m.min(half_m));
    let part = |world: f64| {
        let west_m = (bounds.min_x_m - world * WORLD_M).max(-half_m);
        let east_m = (bounds.max_x_m - world * WORLD_M).min(half_m);
        let corners = [(west_m, south_m), (east_m, south_m), (east_m, north_m), (west_m, north_m), (west_m, south_m)];
        (east_m > west_m && north_m > south_m)
            .then(|| corners.map(|(x_m, y_m)| degrees_from_mercator(x_m, y_m)).to_vec())
    };
    [-1.0, 0.0, 1.0].into_iter().filter_map(part).collect()
}
