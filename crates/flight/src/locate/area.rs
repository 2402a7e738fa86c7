//! `SearchArea`: the positions that a prior allows, in pixels of one level.

use super::pixel_window::PixelWindow;
use super::request::PositionPrior;
use overfly_core::geodesy::{Geodetic, LocalFrame, WORLD_M};
use overfly_core::tile::{Gsd, MercatorBounds, TILE_SIZE_PX, WorldPixel, gsd_at};
use overfly_store::Layer;

/// The nadirs to search: a rectangle of pixels of one level, and for a Gaussian prior the ellipse within.
#[derive(Debug, Clone)]
pub struct SearchArea {
    zoom: u8,
    left: i64,
    top: i64,
    width_px: i64,
    height_px: i64,
    ellipse: Option<Ellipse>,
}

#[derive(Debug, Clone, Copy)]
struct Ellipse {
    centre: WorldPixel,
    gsd: Gsd,
    sigma_east_m: f64,
    sigma_north_m: f64,
    correlation: f64,
}

/// Squared Mahalanobis radius that contains 99.7 % of a two-dimensional Gaussian: -2 ln 0.003.
const RADIUS_SQUARED: f64 = 11.618;
/// Pixels added on every side, so that a peak at the border has neighbours.
const RIM_PX: f64 = 2.0;

impl SearchArea {
    /// Returns the area of a prior at a zoom; `None` beyond the tile matrix.
    pub fn new(prior: &PositionPrior, layer: &Layer, zoom: u8) -> Option<Self> {
        match *prior {
            PositionPrior::Square { centre, half_width_m } => {
                Self::around(centre, half_width_m, half_width_m, zoom, None)
            }
            PositionPrior::Gaussian { centre, sigma_east_m, sigma_north_m, correlation } => {
                let radius = RADIUS_SQUARED.sqrt();
                let ellipse = Ellipse {
                    centre: WorldPixel::from_geodetic(centre, zoom).ok()?,
                    gsd: gsd_at(centre, zoom),
                    sigma_east_m,
                    sigma_north_m,
                    correlation,
                };
                Self::around(centre, radius * sigma_east_m, radius * sigma_north_m, zoom, Some(ellipse))
            }
            PositionPrior::WholeLayer => Self::whole_layer(layer, zoom),
        }
    }

    fn around(centre: Geodetic, east_m: f64, north_m: f64, zoom: u8, ellipse: Option<Ellipse>) -> Option<Self> {
        let pixel = WorldPixel::from_geodetic(centre, zoom).ok()?;
        let gsd = gsd_at(centre, zoom);
        let half_x = east_m / gsd.east_m_per_px + RIM_PX;
        let half_y = north_m / gsd.north_m_per_px + RIM_PX;
        Some(Self::between(
            zoom,
            [pixel.x_px - half_x, pixel.y_px - half_y],
            [pixel.x_px + half_x, pixel.y_px + half_y],
            ellipse,
        ))
    }

    fn whole_layer(layer: &Layer, zoom: u8) -> Option<Self> {
        let north_west = WorldPixel::from_geodetic(layer.bounds_deg.north_west().ok()?, zoom).ok()?;
        let mut south_east = WorldPixel::from_geodetic(layer.bounds_deg.south_east().ok()?, zoom).ok()?;
        if south_east.x_px <= north_west.x_px {
            south_east.x_px += f64::from(TILE_SIZE_PX) * f64::from(1u32 << zoom);
        }
        Some(Self::between(zoom, [north_west.x_px, north_west.y_px], [south_east.x_px, south_east.y_px], None))
    }

    fn between(zoom: u8, from: [f64; 2], to: [f64; 2], ellipse: Option<Ellipse>) -> Self {
        let (left, top) = (from[0].floor() as i64, from[1].floor() as i64);
        let (width_px, height_px) = (to[0].ceil() as i64 - left + 1, to[1].ceil() as i64 - top + 1);
        Self { zoom, left, top, width_px, height_px, ellipse }
    }

    /// Returns a square around a pixel of a level, `half_px` to each side.
    pub fn around_pixel(zoom: u8, middle: WorldPixel, half_px: f64) -> Self {
        let WorldPixel { x_px, y_px } = middle;
        Self::between(zoom, [x_px - half_px, y_px - half_px], [x_px + half_px, y_px + half_px], None)
    }

    /// The area's rectangle, larger by `by_px` (at least 0) on every side; an ellipse within is then no bound any more.
    pub fn grown(self, by_px: f64) -> Self {
        if by_px <= 0.0 {
            return self;
        }
        let by = by_px.ceil() as i64;
        Self {
            left: self.left - by,
            top: self.top - by,
            width_px: self.width_px + 2 * by,
            height_px: self.height_px + 2 * by,
            ellipse: None,
            ..self
        }
    }

    /// Number of pixels of the area's rectangle.
    pub fn places(&self) -> f64 {
        self.width_px as f64 * self.height_px as f64
    }

    /// Zoom of the level.
    pub fn zoom(&self) -> u8 {
        self.zoom
    }

    /// Whether a square of the area's level, given by its upper-left corner and edge in pixels, intersects the area's rectangle, on
    /// this copy of the world or a neighbouring one.
    pub fn intersects(&self, corner_px: [f64; 2], edge_px: f64) -> bool {
        let world_px = f64::from(TILE_SIZE_PX) * 2f64.powi(i32::from(self.zoom));
        let overlap = |at: f64, from: i64, extent: i64| at < (from + extent) as f64 && at + edge_px > from as f64;
        overlap(corner_px[1], self.top, self.height_px)
            && [0.0, -world_px, world_px].iter().any(|w| overlap(corner_px[0] + w, self.left, self.width_px))
    }

    /// Whether a point, in pixels of the area's level, lies in the area, on this copy of the world or a neighbouring one.
    pub fn contains(&self, pixel: WorldPixel) -> bool {
        let world_px = i64::from(TILE_SIZE_PX) << self.zoom;
        let (x, y) = (pixel.x_px.floor() as i64, pixel.y_px.floor() as i64);
        let inside = |v: i64, from: i64, extent: i64| (from..from + extent).contains(&v);
        inside(y, self.top, self.height_px)
            && [0, -world_px, world_px]
                .iter()
                .any(|w| inside(x + w, self.left, self.width_px) && self.contains_pixel(x + w, y))
    }

    /// The area cut to the pixels within `reach_px` of a layer's bounds, for only there a frame can show ground of the layer; `None`
    /// where nothing is left.
    pub fn cut_to_layer(mut self, layer: &Layer, reach_px: f64) -> Option<Self> {
        let whole = Self::whole_layer(layer, self.zoom)?;
        let world_px = i64::from(TILE_SIZE_PX) << self.zoom;
        let middle = self.left + self.width_px / 2 - whole.left - whole.width_px / 2;
        let shift = (middle as f64 / world_px as f64).round() as i64 * world_px;
        let reach = reach_px.ceil() as i64;
        let left = self.left.max(whole.left + shift - reach);
        let right = (self.left + self.width_px).min(whole.left + shift + whole.width_px + reach);
        let top = self.top.max(whole.top - reach);
        let bottom = (self.top + self.height_px).min(whole.top + whole.height_px + reach);
        (self.left, self.top, self.width_px, self.height_px) = (left, top, right - left, bottom - top);
        (self.width_px > 0 && self.height_px > 0).then_some(self)
    }

    /// The part of the area's rectangle within `half_px` of a point, in pixels of the area's level; `None` where they do not intersect.
    pub fn window_around(&self, point: WorldPixel, half_px: i64) -> Option<PixelWindow> {
        let span = |at: f64, from: i64, extent: i64| {
            let first = from.max(at.floor() as i64 - half_px);
            let end = (from + extent).min(at.floor() as i64 + half_px + 1);
            (end > first).then(|| (first, (end - first) as usize))
        };
        let (left, width_px) = span(point.x_px, self.left, self.width_px)?;
        let (top, height_px) = span(point.y_px, self.top, self.height_px)?;
        Some(PixelWindow { zoom: self.zoom, left, top, width_px, height_px })
    }

    /// The area's rectangle in blocks of at most `edge_px` a side.
    pub fn blocks(&self, edge_px: i64) -> Vec<PixelWindow> {
        let starts = |extent: i64| (0..extent).step_by(edge_px as usize);
        let block = |x: i64, y: i64| PixelWindow {
            zoom: self.zoom,
            left: self.left + x,
            top: self.top + y,
            width_px: edge_px.min(self.width_px - x) as usize,
            height_px: edge_px.min(self.height_px - y) as usize,
        };
        starts(self.height_px).flat_map(|y| starts(self.width_px).map(move |x| block(x, y))).collect()
    }

    /// The rectangle grown by `margin_px`, in Web Mercator metres; x may run past the antimeridian.
    pub fn mercator_bounds(&self, margin_px: f64) -> MercatorBounds {
        let span_m = WORLD_M / (f64::from(TILE_SIZE_PX) * f64::from(1u32 << self.zoom));
        let x_m = |px: f64| px * span_m - WORLD_M / 2.0;
        let y_m = |px: f64| WORLD_M / 2.0 - px * span_m;
        MercatorBounds {
            min_x_m: x_m(self.left as f64 - margin_px),
            min_y_m: y_m((self.top + self.height_px) as f64 + margin_px),
            max_x_m: x_m((self.left + self.width_px) as f64 + margin_px),
            max_y_m: y_m(self.top as f64 - margin_px),
        }
    }

    /// Whether a pixel of the rectangle belongs to the area.
    pub fn contains_pixel(&self, x: i64, y: i64) -> bool {
        self.ellipse.as_ref().is_none_or(|e| {
            let east = (x as f64 - e.centre.x_px) * e.gsd.east_m_per_px / e.sigma_east_m;
            let north = (e.centre.y_px - y as f64) * e.gsd.north_m_per_px / e.sigma_north_m;
            let r = e.correlation;
            // One pixel of slack, so that an ellipse smaller than a pixel still contains its centre.
            let slack = 1.0 + 2.0 * e.gsd.mean_m_per_px() / e.sigma_east_m.min(e.sigma_north_m);
            (east * east - 2.0 * r * east * north + north * north) / (1.0 - r * r) <= RADIUS_SQUARED * slack * slack
        })
    }

    /// Ground sample distance at the centre of a block.
    pub fn gsd_of(&self, block: &PixelWindow) -> Gsd {
        let middle = WorldPixel {
            x_px: block.left as f64 + block.width_px as f64 / 2.0,
            y_px: block.top as f64 + block.height_px as f64 / 2.0,
        };
        let world_px = f64::from(TILE_SIZE_PX) * f64::from(1u32 << block.zoom);
        let inside = WorldPixel { y_px: middle.y_px.clamp(0.0, world_px), ..middle };
        let point = inside.to_geodetic(block.zoom).expect("a pixel inside the matrix has a position");
        gsd_at(point, block.zoom)
    }
}

/// Width and height of the smallest upright rectangle around the area that a prior allows, metres east and north; the layer's
/// extent for the whole layer.
pub fn extent_m(prior: &PositionPrior, layer: &Layer) -> [f64; 2] {
    match *prior {
        PositionPrior::Square { half_width_m, .. } => [2.0 * half_width_m; 2],
        PositionPrior::Gaussian { sigma_east_m, sigma_north_m, .. } => {
            let width = 2.0 * RADIUS_SQUARED.sqrt();
            [width * sigma_east_m, width * sigma_north_m]
        }
        PositionPrior::WholeLayer => {
            let corners = layer.bounds_deg.south_west().ok().zip(layer.bounds_deg.north_east().ok());
            corners.map_or([0.0; 2], |(south_west, north_east)| {
                let offset = LocalFrame::at(south_west).enu_from_geodetic(north_east);
                [offset.east_m.abs(), offset.north_m.abs()]
            })
        }
    }
}

/// The centre of the area that a prior allows; `None` beyond the tile matrix.
pub fn centre(prior: &PositionPrior, layer: &Layer) -> Option<Geodetic> {
    let point = match *prior {
        PositionPrior::Gaussian { centre, .. } | PositionPrior::Square { centre, .. } => centre,
        PositionPrior::WholeLayer => layer.bounds_deg.middle().ok()?,
    };
    WorldPixel::from_geodetic(point, 0).ok().map(|_| point)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn layer(bounds_deg: [f64; 4]) -> Layer {
        Layer {
            name: "ortho".into(),
            base_zoom: 16,
            min_zoom: 12,
            base_tiles: 1,
            tiles: 1,
            bounds_deg: bounds_deg.into(),
            acquired: None,
            complete: true,
            digest: None,
            terms: Default::default(),
            terrain: None,
        }
    }

    fn square(latitude_deg: f64, longitude_deg: f64, half_width_m: f64) -> PositionPrior {
        PositionPrior::Square { centre: Geodetic::from_degrees(latitude_deg, longitude_deg).unwrap(), half_width_m }
    }

    #[test]
    fn a_layer_across_the_antimeridian_is_reached_from_both_sides() {
        let layer = layer([179.9, 10.0, -179.9, 10.1]);
        for longitude_deg in [179.95, -179.95, 179.999, -179.999] {
            let area = SearchArea::new(&square(10.05, longitude_deg, 500.0), &layer, 14).unwrap();
            let kept = area.clone().cut_to_layer(&layer, 20.0).unwrap();
            assert_eq!((kept.left, kept.width_px), (area.left, area.width_px), "{longitude_deg}");
        }
        let far = SearchArea::new(&square(10.05, 0.0, 500.0), &layer, 14).unwrap();
        assert!(far.cut_to_layer(&layer, 20.0).is_none());
    }

    proptest! {
        #[test]
        fn blocks_tile_the_area(width in 1i64..300, height in 1i64..300, edge in 1i64..90) {
            let area = SearchArea { zoom: 12, left: 7, top: 11, width_px: width, height_px: height, ellipse: None };
            let blocks = area.blocks(edge);
            let pixels: i64 = blocks.iter().map(|b| (b.width_px * b.height_px) as i64).sum();
            prop_assert_eq!(pixels, width * height);
            prop_assert!(blocks.iter().all(|b| b.left >= 7 && b.left + b.width_px as i64 <= 7 + width));
        }

        #[test]
        fn a_gaussian_area_contains_everything_within_three_sigma(angle in 0.0..std::f64::consts::TAU, radius in 0.0..3.0f64, r in -0.9..0.9f64) {
            let centre = Geodetic::from_degrees(47.0, -99.0).unwrap();
            let prior = PositionPrior::Gaussian { centre, sigma_east_m: 200.0, sigma_north_m: 90.0, correlation: r };
            let area = SearchArea::new(&prior, &layer([-99.5, 46.5, -98.5, 47.5]), 13).unwrap();
            // A point at Mahalanobis distance `radius`: the Cholesky factor of the covariance times a unit vector.
            let (u, v) = (radius * angle.cos(), radius * angle.sin());
            let (east_m, north_m) = (200.0 * u, 90.0 * (r * u + (1.0 - r * r).sqrt() * v));
            let point = LocalFrame::at(centre).geodetic_from_enu(overfly_core::geodesy::Enu { east_m, north_m }).unwrap();
            let pixel = WorldPixel::from_geodetic(point, 13).unwrap();
            let (x, y) = (pixel.x_px.round() as i64, pixel.y_px.round() as i64);
            prop_assert!(area.contains_pixel(x, y));
            prop_assert!(x >= area.left && x < area.left + area.width_px && y >= area.top && y < area.top + area.height_px);
        }
    }
}
