//! Ranking of the tiles that meet a region.

use super::candidate_tiles::{Candidate, Candidates};
use super::geometry::Geometry;
use super::search_cost::SearchCost;
use overfly_core::region::Region;
use overfly_store::Footprint;

/// Ranks the footprints that an index found: those that meet the region, best first, with the figures of the search.
pub fn rank<'a>(
    layer: &str,
    footprints: impl Iterator<Item = &'a Footprint>,
    region: &Region,
    max_tiles: Option<usize>,
    cost: &SearchCost,
) -> Candidates {
    let mut met: Vec<(f64, f64, &Footprint)> = footprints
        .filter_map(|f| {
            let bounds = f.tile.mercator_bounds();
            let met = region.meets(&bounds);
            met.then(|| (imaged_probability(region, f), region.distance_m(&bounds), f))
        })
        .collect();
    met.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.total_cmp(&b.1)).then(a.2.tile.cmp(&b.2.tile)));
    met.truncate(max_tiles.unwrap_or(usize::MAX));
    let tiles: Vec<Candidate> = met.iter().map(|&(probability, _, f)| candidate(layer, f, probability)).collect();
    Candidates {
        nominal_count: region.nominal_count(),
        region: Geometry::from_rings(region.rings_deg()),
        // Not `sum`: the sum of nothing is -0, which JSON would show.
        containment: tiles.iter().fold(0.0, |sum: f64, t| sum + t.probability).min(1.0),
        estimated_s: cost.estimated_s(tiles.len()),
        tiles,
    }
}

/// The probability that the image's centre lies where a tile has pixels.
pub(super) fn imaged_probability(region: &Region, footprint: &Footprint) -> f64 {
    let (parts, share) = footprint.imaged_ground();
    parts.iter().map(|part| region.probability(part)).sum::<f64>() * share
}

/// The entry of a tile.
pub(super) fn candidate(layer: &str, footprint: &Footprint, probability: f64) -> Candidate {
    let tile = footprint.tile;
    Candidate {
        id: format!("{layer}/{tile}"),
        layer: layer.to_owned(),
        z: tile.zoom(),
        x: tile.column(),
        y: tile.row(),
        bounds_deg: tile.bounds(),
        probability,
        valid_fraction: footprint.valid_fraction,
        keypoints: footprint.keypoints,
        distinctiveness: footprint.distinctiveness,
        gsd_m_per_px: tile.gsd().mean_m_per_px(),
        acquired: footprint.acquired.clone(),
    }
}
