//! `Corridor`: the ground on both sides of routes, as regions to compare tiles with.

use super::error::ExportError;
use overfly_core::coupling::CouplingParameters;
use overfly_core::geodesy::{Geodesic, Geodetic, destination, geodesic_between};
use overfly_core::region::{ImageOnGround, Region, Uncertainty};
use overfly_core::route::Route;
use overfly_core::tile::gsd_at;

/// The widest corridor, metres on each side. A search region extends to at most three times this distance.
pub const MAX_HALF_WIDTH_M: f64 = 100_000.0;
/// The longest part of a route that makes one rectangle. Seen from its middle a geodesic bends by micrometres, and lengths of
/// 1 km and the corridor's width appear shorter by millimetres, so that the rectangle is slightly too large.
const MAX_PIECE_M: f64 = 2_000.0;
/// A margin in pixels uses the pixel in the middle of a rectangle; at its far end a pixel is larger by less than this factor.
const PIXEL_SLACK: f64 = 1.1;

/// The most rectangles of a corridor: five times round the earth. Each is compared with the map's tiles.
const MOST_PIECES: f64 = 100_000.0;

/// The width of a corridor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CorridorWidth {
    /// W: the constant width on each side, metres.
    pub half_width_m: f64,
    /// The width that is added along the route.
    pub drift: Option<CorridorDrift>,
}

/// The growth of a corridor with the position's drift, for relative registrations alone from the route's start on and no fix
/// at all. It adds half the diagonal of the search region at that drift (the rectangle of equation 3), and a third of an
/// image, by which a search may read past its region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CorridorDrift(pub CouplingParameters);

/// The share of an image's edge (the square root of its area) that a search may read past its region: eight pixels of an
/// edge of 46 pixels, on each of two levels, the second with pixels of twice the size.
const PAST_REGION: f64 = 1.0 / 3.0;

impl CorridorDrift {
    /// Returns the width added on each side after `way_m` of the route, metres.
    ///
    /// # Errors
    /// [`ExportError::Coupling`] where the parameters are outside the models' domain.
    pub fn added_m(&self, way_m: f64) -> Result<f64, ExportError> {
        let p = &self.0;
        let relative_count = way_m / p.speed_mps / p.relative_s;
        let drift_m = p.drift_growth.drift_m(relative_count, p.unit_drift_m)?;
        let half = |edge_m: f64| (edge_m + p.inaccuracy_m) / 2.0 + drift_m;
        Ok(half(p.across_m).hypot(half(p.along_m)) + PAST_REGION * (p.across_m * p.along_m).sqrt())
    }
}

/// A rectangle along a part of a route, longer by its half width at both ends.
#[derive(Debug, Clone, Copy, PartialEq)]
struct CorridorPiece {
    middle: Geodetic,
    heading_rad: f64,
    length_m: f64,
    half_width_m: f64,
}

/// The ground on both sides of routes.
#[derive(Debug, Clone, PartialEq)]
pub struct Corridor {
    pieces: Vec<CorridorPiece>,
}

impl Corridor {
    /// Makes the corridor along routes. The drift of the first route continues along each of the others, its alternates.
    ///
    /// # Errors
    /// [`ExportError::CorridorWidth`] where the corridor is or grows too wide; [`ExportError::RouteTooLong`];
    /// [`ExportError::Coupling`] where the drift's parameters are outside the models' domain.
    pub fn along(routes: &[Route], width: &CorridorWidth) -> Result<Self, ExportError> {
        let count: f64 = routes.iter().flat_map(Route::legs).map(|(_, leg)| piece_count(leg)).sum();
        if count > MOST_PIECES {
            let length_m = routes.iter().map(Route::length_m).sum();
            return Err(ExportError::RouteTooLong { length_m, pieces: count as u64, most: MOST_PIECES as u64 });
        }
        let mut pieces = Vec::new();
        for (index, route) in routes.iter().enumerate() {
            let mut way_m = if index == 0 { 0.0 } else { routes[0].length_m() };
            for (start, leg) in route.legs() {
                let count = piece_count(leg);
                let length_m = leg.distance_m / count;
                for piece in 0..count as u64 {
                    let middle_m = (piece as f64 + 0.5) * length_m;
                    way_m += length_m;
                    let half_width_m = half_width_m(width, way_m)?;
                    pieces.extend(corridor_piece(start, leg, middle_m, length_m, half_width_m));
                }
            }
        }
        Ok(Self { pieces })
    }

    /// Returns the half width at the widest place, metres.
    pub fn widest_m(&self) -> f64 {
        self.pieces.iter().map(|p| p.half_width_m).fold(0.0, f64::max)
    }

    /// Returns the corridor's rectangles, each wider by `margin_px` pixels of the level `zoom` on every side. Their union
    /// contains every point whose distance from a route is at most the corridor's half width there.
    ///
    /// # Errors
    /// [`ExportError::Region`] where the route leaves the tile matrix.
    pub fn regions(&self, zoom: u8, margin_px: f64) -> impl Iterator<Item = Result<Region, ExportError>> + '_ {
        let region = move |piece: &CorridorPiece| {
            let gsd = gsd_at(piece.middle, zoom);
            let margin_m = margin_px * PIXEL_SLACK * gsd.east_m_per_px.max(gsd.north_m_per_px);
            let half_m = piece.half_width_m + margin_m;
            let (across_m, along_m) = (2.0 * half_m, piece.length_m + 2.0 * half_m);
            let image = ImageOnGround { across_m, along_m, heading_rad: piece.heading_rad };
            Ok(Region::new(piece.middle, image, Uncertainty::Sequential { inaccuracy_m: 0.0, drift_m: 0.0 })?)
        };
        self.pieces.iter().map(region)
    }
}

/// Returns the corridor's half width after `way_m` of the route, metres.
///
/// # Errors
/// As [`Corridor::along`].
pub(super) fn half_width_m(width: &CorridorWidth, way_m: f64) -> Result<f64, ExportError> {
    let added_m = width.drift.map_or(Ok(0.0), |d| d.added_m(way_m))?;
    let half_width_m = width.half_width_m + added_m;
    let is_valid = width.half_width_m > 0.0 && half_width_m <= MAX_HALF_WIDTH_M;
    if is_valid { Ok(half_width_m) } else { Err(ExportError::CorridorWidth { half_width_m, most_m: MAX_HALF_WIDTH_M }) }
}

/// The number of rectangles along a leg.
fn piece_count(leg: Geodesic) -> f64 {
    (leg.distance_m / MAX_PIECE_M).ceil().max(1.0)
}

/// Returns the piece of a leg whose middle lies `middle_m` from the leg's start.
fn corridor_piece(
    start: Geodetic,
    leg: Geodesic,
    middle_m: f64,
    length_m: f64,
    half_width_m: f64,
) -> Option<CorridorPiece> {
    let middle = destination(start, Geodesic { distance_m: middle_m, ..leg }).ok()?;
    // A geodesic's azimuth changes along it, so it is taken at the middle: back to the start, reversed.
    let heading_rad = geodesic_between(middle, start).azimuth_rad + std::f64::consts::PI;
    Some(CorridorPiece { middle, heading_rad, length_m, half_width_m })
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::geodesy::{Enu, LocalFrame, MercatorPoint};
    use overfly_core::tile::MercatorBounds;
    use proptest::prelude::*;

    /// A line of legs from a position.
    fn route(latitude_deg: f64, longitude_deg: f64, legs: &[(f64, f64)]) -> Option<Route> {
        let mut at = Geodetic::from_degrees(latitude_deg, longitude_deg).unwrap();
        let mut points = vec![[at.longitude_deg(), at.latitude_deg()]];
        for &(distance_m, azimuth_rad) in legs {
            at = destination(at, Geodesic { distance_m, azimuth_rad }).unwrap();
            points.push([at.longitude_deg(), at.latitude_deg()]);
        }
        crate::plan::parse_route(&serde_json::json!({"type": "LineString", "coordinates": points}).to_string()).ok()
    }

    proptest! {
        #[test]
        fn contains_every_point_within_its_width(
            lat in -80.0..80.0f64, lon in -180.0..180.0f64, w in 50.0..20_000.0f64,
            legs in prop::collection::vec((10.0..30_000.0f64, -3.1..3.1f64), 1..5),
            share in 0.0..1.0f64, off in 0.0..0.9999f64, bearing in -3.1..3.1f64,
        ) {
            let Some(route) = route(lat, lon, &legs) else { return Ok(()) };
            let corridor = Corridor::along(std::slice::from_ref(&route), &CorridorWidth { half_width_m: w, drift: None }).unwrap();
            let along = route.every(route.length_m() / 50.0).unwrap();
            let on = along[((along.len() - 1) as f64 * share) as usize].position;
            let Ok(point) = destination(on, Geodesic { distance_m: w * off, azimuth_rad: bearing }) else { return Ok(()) };
            let Ok(MercatorPoint { x_m, y_m }) = MercatorPoint::from_geodetic(point) else { return Ok(()) };
            let dot = MercatorBounds { min_x_m: x_m - 1e-3, min_y_m: y_m - 1e-3, max_x_m: x_m + 1e-3, max_y_m: y_m + 1e-3 };
            prop_assert!(corridor.regions(14, 0.0).any(|r| r.unwrap().meets(&dot)));
        }
    }

    #[test]
    fn is_no_wider_than_its_rectangles_corners() {
        let route = route(47.0, -99.0, &[(3000.0, 1.5)]).unwrap();
        let corridor =
            Corridor::along(std::slice::from_ref(&route), &CorridorWidth { half_width_m: 1500.0, drift: None })
                .unwrap();
        let regions: Vec<Region> = corridor.regions(14, 0.0).collect::<Result<_, _>>().unwrap();
        let start = route.points()[0];
        for step in 0..400 {
            // Past the start, and a little more than a corner's distance off.
            let angle = f64::from(step) / 400.0 * std::f64::consts::PI + 1.5 + std::f64::consts::FRAC_PI_2;
            let (east_m, north_m) = (2135.0 * angle.sin(), 2135.0 * angle.cos());
            let point = LocalFrame::at(start).geodetic_from_enu(Enu { east_m, north_m }).unwrap();
            let MercatorPoint { x_m, y_m } = MercatorPoint::from_geodetic(point).unwrap();
            let dot = MercatorBounds { min_x_m: x_m, min_y_m: y_m, max_x_m: x_m + 1e-3, max_y_m: y_m + 1e-3 };
            assert!(!regions.iter().any(|r| r.meets(&dot)), "{step}");
        }
    }

    #[test]
    fn grows_by_the_drift_and_the_search_region() {
        use overfly_core::coupling::Calibration;
        let aircraft: crate::plan::Aircraft = toml::from_str(
            "speed_mps = 30\nmin_turn_radius_m = 400\nwidth_px = 400\nheight_px = 300\ngsd_m_per_px = 1\nunit_drift_m = 0.1\ninaccuracy_m = 20\n",
        )
        .unwrap();
        let p = aircraft.parameters(&Calibration::PROJECT, None).unwrap();
        let drift = CorridorDrift(p);
        let past_m = (400.0f64 * 300.0).sqrt() / 3.0;
        assert!((drift.added_m(0.0).unwrap() - 210f64.hypot(160.0) - past_m).abs() < 1e-9);
        // 3 km at 30 m/s: 100 s of registrations one after the other, 0.1 m each.
        let drift_m = 0.1 * 100.0 / p.relative_s;
        let expected_m = (210.0 + drift_m).hypot(160.0 + drift_m) + past_m;
        assert!((drift.added_m(3000.0).unwrap() - expected_m).abs() < 1e-6);
    }

    #[test]
    fn refuses_a_route_that_would_take_hours() {
        // 600 positions, from side to side of the earth: 6 million pieces.
        let positions: Vec<[f64; 2]> = (0..600).map(|i| [f64::from(i % 2) * 179.0, f64::from(i) * 0.01]).collect();
        let zigzag = serde_json::json!({"type": "LineString", "coordinates": positions});
        let routes = crate::plan::parse_routes(&zigzag.to_string()).unwrap();
        let refused = Corridor::along(&routes, &CorridorWidth { half_width_m: 1000.0, drift: None }).unwrap_err();
        assert_eq!(refused.code(), "route_too_long");
        assert!(refused.to_string().contains("km"), "{refused}");
    }

    #[test]
    fn refuses_invalid_widths() {
        let route = route(0.0, 0.0, &[(100.0, 0.0)]).unwrap();
        for half_width_m in [0.0, -1.0, f64::NAN, f64::INFINITY, 2e5] {
            let refused = Corridor::along(std::slice::from_ref(&route), &CorridorWidth { half_width_m, drift: None });
            assert_eq!(refused.unwrap_err().code(), "corridor_width");
        }
    }
}
