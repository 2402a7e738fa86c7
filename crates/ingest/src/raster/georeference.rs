//! `Georeference`: the position of a source's pixels on the earth.

use super::affine::Affine;
use super::error::RasterError;
use crate::crs::{Crs, CrsError};
use crate::remedy::Remedy;
use overfly_core::geodesy::{Geodetic, LocalFrame, MAX_LATITUDE_DEG, MercatorPoint, WORLD_M};
use std::path::Path;

/// Points along each side of an outline. Between them a side of 1,000 km bends by at most a few hundred metres.
const POINTS_PER_SIDE: u32 = 32;

/// A source's size, geotransform and CRS, and the part of the tile matrix that they cover.
#[derive(Debug, Clone)]
pub(super) struct Georeference {
    pub affine: Affine,
    pub crs: Crs,
    pub size_px: (f64, f64),
    /// The first plane coordinate of the image's centre, for systems with a period.
    centre_x: f64,
    pub outline: Vec<Geodetic>,
    pub gsd_m_per_px: f64,
    /// Extent in the world of the tile matrix, as shares of its width from the north-west corner: min x, min y, max x,
    /// max y. x may lie outside [0, 1] where the image crosses the antimeridian.
    pub world: [f64; 4],
}

impl Georeference {
    /// Makes a georeference and checks that the pixels lie on the earth.
    ///
    /// # Errors
    /// [`RasterError::BadGeoreference`] for a transform without inverse, an impossible size on the ground, and an outline
    /// outside the projection's domain.
    pub fn new(path: &Path, affine: Affine, crs: Crs, width_px: u64, height_px: u64) -> Result<Self, RasterError> {
        if let Some(fault) = affine.fault() {
            return Err(RasterError::bad_georeference(path, fault, Some(Remedy::ReplaceGeotransform)));
        }
        let off_earth = |reason: String| RasterError::bad_georeference(path, reason, Some(Remedy::CheckCrs));
        let size_px = (width_px as f64, height_px as f64);
        let corners =
            [(0.0, 0.0), (size_px.0, 0.0), (0.0, size_px.1), size_px].map(|(x, y)| affine.plane_from_pixel(x, y));
        let spread = |i: fn(&(f64, f64)) -> f64| {
            let values = corners.iter().map(i);
            values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
        };
        // Five times around the earth in feet; once around in degrees.
        let most = if crs.is_geographic() { 361.0 } else { 7e8 };
        let wide = spread(|c| c.0).max(spread(|c| c.1));
        if wide.is_nan() || wide > most {
            return Err(off_earth(format!("the image would be {wide:e} of the CRS's units wide")));
        }
        let (centre_x, _) = affine.plane_from_pixel(size_px.0 / 2.0, size_px.1 / 2.0);
        let mut this = Self { affine, crs, size_px, centre_x, outline: Vec::new(), gsd_m_per_px: 0.0, world: [0.0; 4] };
        let unprojected = |e: CrsError| off_earth(e.to_string());
        this.gsd_m_per_px = this.centre_gsd().map_err(unprojected)?;
        if !(1e-4..1e6).contains(&this.gsd_m_per_px) {
            return Err(off_earth(format!("its pixels would measure {:e} m on the ground", this.gsd_m_per_px)));
        }
        this.outline = this.walk_outline().map_err(unprojected)?;
        this.world = this.world_extent().map_err(unprojected)?;
        Ok(this)
    }

    /// Returns the ground position of a pixel position.
    pub fn geodetic_from_pixel(&self, x_px: f64, y_px: f64) -> Result<Geodetic, CrsError> {
        let (x, y) = self.affine.plane_from_pixel(x_px, y_px);
        self.crs.geodetic_from_projected(x, y)
    }

    /// Returns the pixel position of a ground position; `None` where the CRS has no such position.
    pub fn pixel_from_geodetic(&self, point: Geodetic) -> Option<(f64, f64)> {
        let (mut x, y) = self.crs.projected_from_geodetic(point).ok()?;
        if let Some(period) = self.crs.period() {
            x += ((self.centre_x - x) / period).round() * period;
        }
        Some(self.affine.pixel_from_plane(x, y))
    }

    fn centre_gsd(&self) -> Result<f64, CrsError> {
        let (x, y) = (self.size_px.0 / 2.0, self.size_px.1 / 2.0);
        let frame = LocalFrame::at(self.geodetic_from_pixel(x, y)?);
        let at = |dx: f64, dy: f64| Ok(frame.enu_from_geodetic(self.geodetic_from_pixel(x + dx, y + dy)?));
        let (e, w, s, n) = (at(0.5, 0.0)?, at(-0.5, 0.0)?, at(0.0, 0.5)?, at(0.0, -0.5)?);
        let across = (e.east_m - w.east_m, e.north_m - w.north_m);
        let down = (s.east_m - n.east_m, s.north_m - n.north_m);
        Ok((across.0 * down.1 - across.1 * down.0).abs().sqrt())
    }

    fn walk_outline(&self) -> Result<Vec<Geodetic>, CrsError> {
        let (w, h) = self.size_px;
        let corners = [(0.0, 0.0), (w, 0.0), (w, h), (0.0, h), (0.0, 0.0)];
        let mut outline = Vec::with_capacity(4 * POINTS_PER_SIDE as usize);
        for side in corners.windows(2) {
            for i in 0..POINTS_PER_SIDE {
                let t = f64::from(i) / f64::from(POINTS_PER_SIDE);
                let along = |a: f64, b: f64| a + (b - a) * t;
                outline.push(self.geodetic_from_pixel(along(side[0].0, side[1].0), along(side[0].1, side[1].1))?);
            }
        }
        Ok(outline)
    }

    /// Returns the extent in the world of the tile matrix. Longitudes are unwrapped around the outline from the centre, so
    /// that an extent over the antimeridian stays whole. An image that contains a pole has every longitude.
    fn world_extent(&self) -> Result<[f64; 4], CrsError> {
        let centre = self.geodetic_from_pixel(self.size_px.0 / 2.0, self.size_px.1 / 2.0)?;
        let mut last_deg = centre.longitude_deg();
        let (mut west, mut east) = (last_deg, last_deg);
        let (mut south, mut north) = (centre.latitude_deg(), centre.latitude_deg());
        for point in &self.outline {
            let step = point.longitude_deg() - last_deg;
            last_deg += step - 360.0 * (step / 360.0).round();
            (west, east) = (west.min(last_deg), east.max(last_deg));
            (south, north) = (south.min(point.latitude_deg()), north.max(point.latitude_deg()));
        }
        for pole_deg in [-90.0, 90.0] {
            let pole = Geodetic::from_degrees(pole_deg, 0.0).expect("a pole is a position");
            let inside = self
                .pixel_from_geodetic(pole)
                .is_some_and(|(x, y)| (0.0..=self.size_px.0).contains(&x) && (0.0..=self.size_px.1).contains(&y));
            if inside && !self.crs.is_geographic() {
                (south, north) = (south.min(pole_deg), north.max(pole_deg));
                (west, east) = (-180.0, 180.0);
            }
        }
        let world_y = |latitude_deg: f64| {
            let clamped = latitude_deg.clamp(-MAX_LATITUDE_DEG, MAX_LATITUDE_DEG);
            let point = Geodetic::from_degrees(clamped, 0.0).expect("clamped");
            0.5 - MercatorPoint::from_geodetic(point).map_or(0.5 * clamped.signum(), |m| m.y_m / WORLD_M)
        };
        // Between its points the outline bends outwards by at most this share of the extent.
        let (dx, dy) = ((east - west) / 360.0 * 0.01, (world_y(south) - world_y(north)) * 0.01);
        Ok([west / 360.0 + 0.5 - dx, world_y(north) - dy, east / 360.0 + 0.5 + dx, world_y(south) + dy])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn placed(crs: u32, origin: [f64; 2], pixel: f64, size: u64) -> Result<Georeference, RasterError> {
        let affine = Affine { origin, column: [pixel, 0.0], row: [0.0, -pixel] };
        Georeference::new(Path::new("a.tif"), affine, Crs::from_epsg(crs).unwrap(), size, size)
    }

    #[test]
    fn measures_ground_pixels_in_true_metres() {
        // UTM at its central meridian: scale 0.9996.
        let g = placed(32614, [499_000.0, 5_206_000.0], 2.0, 1000).unwrap();
        assert!((g.gsd_m_per_px - 2.0 / 0.9996).abs() < 1e-5, "{}", g.gsd_m_per_px);
        // Web Mercator at 60 degrees: half, less the ellipsoid's part.
        let g = placed(3857, [0.0, 8_399_737.9 + 50.0], 1.0, 100).unwrap();
        assert!((g.gsd_m_per_px - 0.5).abs() < 0.003, "{}", g.gsd_m_per_px);
    }

    #[test]
    fn stays_whole_across_the_antimeridian() {
        for (crs, origin, pixel) in [(4326, [179.9, 10.1], 0.0002), (32660, [820_000.0, 1_110_000.0], 20.0)] {
            let g = placed(crs, origin, pixel, 1000).unwrap();
            let crosses = |at: f64| g.world[0] < at && at < g.world[2];
            assert!(g.world[2] - g.world[0] < 0.002 && (crosses(0.0) || crosses(1.0)), "EPSG:{crs} {:?}", g.world);
            let east = Geodetic::from_degrees(10.0, -179.95).unwrap();
            let (x, y) = g.pixel_from_geodetic(east).unwrap();
            assert!((0.0..1000.0).contains(&x) && (0.0..1000.0).contains(&y), "EPSG:{crs} {x} {y}");
        }
    }

    #[test]
    fn a_pole_has_every_longitude() {
        let g = placed(3413, [-500_000.0, 500_000.0], 1000.0, 1000).unwrap();
        assert!(g.world[0] <= 0.0 && g.world[2] >= 1.0);
    }

    #[test]
    fn refuses_images_off_the_earth() {
        assert_eq!(placed(4326, [400.0, 95.0], 0.1, 10).unwrap_err().code(), "source_bad_georeference");
        assert_eq!(placed(32614, [5e5, 5e6], 1e-9, 10).unwrap_err().code(), "source_bad_georeference");
        assert_eq!(placed(4326, [f64::NAN, 0.0], 0.1, 10).unwrap_err().code(), "source_bad_georeference");
    }
}
