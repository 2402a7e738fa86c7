//! `Mosaic`: a layer's tiles as one picture that knows where it lies.

use overfly_core::camera::Camera;
use overfly_core::geodesy::{BodyFrame, Geodetic, LocalFrame};
use overfly_core::pixels::{Colour, MaskedColour};
use overfly_core::tile::{TILE_SIZE_PX, TileId, WorldPixel, gsd_at};

/// Greatest number of pixels of a mosaic.
const MAX_PIXELS: usize = 120_000_000;
/// Colour where the map has no pixel.
const EMPTY: [u8; 3] = [128, 128, 128];

/// Tiles of one zoom side by side, cropped to what is valid.
pub struct Mosaic {
    zoom: u8,
    /// World pixel of the upper-left corner.
    corner_px: [usize; 2],
    colour: Colour,
}

impl Mosaic {
    /// Assembles tiles of one zoom; `None` without valid pixels, or if the picture would be too large.
    pub fn assemble(tiles: &[(TileId, MaskedColour)]) -> Option<Self> {
        let size = TILE_SIZE_PX as usize;
        let corners = || tiles.iter().map(|(id, _)| [id.column() as usize * size, id.row() as usize * size]);
        let [mut west, mut north, mut east, mut south] = [usize::MAX, usize::MAX, 0, 0];
        for ((_, tile), [x0, y0]) in tiles.iter().zip(corners()) {
            for y in 0..tile.mask.height_px() {
                for x in (0..tile.mask.width_px()).filter(|&x| tile.mask.at(x, y)) {
                    (west, north) = (west.min(x0 + x), north.min(y0 + y));
                    (east, south) = (east.max(x0 + x + 1), south.max(y0 + y + 1));
                }
            }
        }
        let (width, height) = (east.checked_sub(west)?, south.checked_sub(north)?);
        if width.checked_mul(height)? > MAX_PIXELS {
            return None;
        }
        let mut colour = Colour::black(width, height);
        colour.values_mut().chunks_exact_mut(3).for_each(|p| p.copy_from_slice(&EMPTY));
        for ((_, tile), [x0, y0]) in tiles.iter().zip(corners()) {
            for y in 0..tile.mask.height_px() {
                for x in (0..tile.mask.width_px()).filter(|&x| tile.mask.at(x, y)) {
                    colour.set(x0 + x - west, y0 + y - north, tile.colour.at(x, y));
                }
            }
        }
        Some(Self { zoom: tiles.first()?.0.zoom(), corner_px: [west, north], colour })
    }

    /// Columns and rows.
    pub fn size_px(&self) -> [usize; 2] {
        [self.colour.width_px(), self.colour.height_px()]
    }

    /// The place of a point in the picture, pixels from its corner, also outside the map; `None` beyond the tile
    /// matrix.
    pub fn pixel_of(&self, point: Geodetic) -> Option<[f64; 2]> {
        let p = WorldPixel::from_geodetic(point, self.zoom).ok()?;
        Some([p.x_px - self.corner_px[0] as f64, p.y_px - self.corner_px[1] as f64])
    }

    /// Pixels per metre on the ground at a point, east and north.
    pub fn pixels_per_m(&self, point: Geodetic) -> [f64; 2] {
        let gsd = gsd_at(point, self.zoom);
        [1.0 / gsd.east_m_per_px, 1.0 / gsd.north_m_per_px]
    }

    /// The picture shrunk by a whole factor to at most `width_px`, and the factor.
    pub fn shrunk(&self, width_px: usize) -> (Colour, usize) {
        let factor = self.colour.width_px().div_ceil(width_px.max(1)).max(1);
        let (width, height) = ((self.colour.width_px() / factor).max(1), (self.colour.height_px() / factor).max(1));
        let mut small = Colour::black(width, height);
        for y in 0..height {
            for x in 0..width {
                let mut sum = [0u32; 3];
                for i in 0..factor * factor {
                    let at = |v: usize, n: usize| v.min(n - 1);
                    let (sx, sy) = (x * factor + i % factor, y * factor + i / factor);
                    let p = self.colour.at(at(sx, self.colour.width_px()), at(sy, self.colour.height_px()));
                    (0..3).for_each(|k| sum[k] += u32::from(p[k]));
                }
                small.set(x, y, sum.map(|v| (v / (factor * factor) as u32) as u8));
            }
        }
        (small, factor)
    }

    /// Draws what a camera above `nadir` with this heading would see if the map were the ground; gray where there is
    /// no map.
    pub fn seen_by(&self, camera: &Camera, nadir: Geodetic, heading_rad: f64) -> Colour {
        let (width, height) = camera.frame_size_px();
        let (width, height) = (width as usize, height as usize);
        let frame = LocalFrame::at(nadir);
        let body = BodyFrame::from_heading_rad(heading_rad);
        let mut view = Colour::black(width, height);
        for y in 0..height {
            for x in 0..width {
                let seen = camera.body_from_frame([x as f64 + 0.5, y as f64 + 0.5]).and_then(|ground| {
                    self.sample(self.pixel_of(frame.geodetic_from_enu(body.enu_from_body(ground)).ok()?)?)
                });
                view.set(x, y, seen.unwrap_or(EMPTY));
            }
        }
        view
    }

    fn sample(&self, [x_px, y_px]: [f64; 2]) -> Option<[u8; 3]> {
        let (x, y) = (x_px - 0.5, y_px - 0.5);
        let [width, height] = self.size_px();
        if !(x >= 0.0 && y >= 0.0 && x < (width - 1) as f64 && y < (height - 1) as f64) {
            return None;
        }
        let (x0, y0) = (x as usize, y as usize);
        let (fx, fy) = (x.fract(), y.fract());
        let p = |dx, dy| self.colour.at(x0 + dx, y0 + dy).map(f64::from);
        let (a, b, c, d) = (p(0, 0), p(1, 0), p(0, 1), p(1, 1));
        Some(std::array::from_fn(|k| {
            let (top, bottom) = (a[k] + (b[k] - a[k]) * fx, c[k] + (d[k] - c[k]) * fx);
            (top + (bottom - top) * fy).round() as u8
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_core::camera::View;
    use overfly_core::pixels::Mask;

    /// Two tiles side by side; only column 500 of the first to column 20 of the second is valid, in rows 100 to 200.
    fn two_tiles() -> Mosaic {
        let id = |dx: u32| TileId::new(16, 35_600 + dx, 22_700).unwrap();
        let tile = |columns: std::ops::Range<usize>, rgb| {
            let (mut colour, mut mask) = (Colour::black(512, 512), Mask::filled(512, 512, false));
            for y in 100..200 {
                for x in columns.clone() {
                    colour.set(x, y, rgb);
                    mask.set(x, y, true);
                }
            }
            MaskedColour { colour, mask }
        };
        Mosaic::assemble(&[(id(0), tile(500..512, [200, 0, 0])), (id(1), tile(0..20, [0, 200, 0]))]).unwrap()
    }

    #[test]
    fn is_cropped_to_what_is_valid_and_knows_where_it_lies() {
        let mosaic = two_tiles();
        assert_eq!(mosaic.size_px(), [32, 100]);
        let seam = WorldPixel { x_px: 35_601.0 * 512.0, y_px: 22_700.0 * 512.0 + 100.0 }.to_geodetic(16).unwrap();
        let [x, y] = mosaic.pixel_of(seam).unwrap();
        assert!((x - 12.0).abs() < 1e-6 && y.abs() < 1e-6);
    }

    #[test]
    fn shows_a_camera_what_lies_ahead_at_the_top() {
        let mosaic = two_tiles();
        let middle = WorldPixel { x_px: 35_601.0 * 512.0, y_px: 22_700.0 * 512.0 + 150.0 }.to_geodetic(16).unwrap();
        let gsd_m_per_px = gsd_at(middle, 16).mean_m_per_px();
        let camera = Camera::new(&View::Nadir { gsd_m_per_px }, 9, 9).unwrap();
        // Heading east: the eastern, green tile is ahead, so at the top of the view.
        let view = mosaic.seen_by(&camera, middle, std::f64::consts::FRAC_PI_2);
        assert_eq!((view.at(4, 0), view.at(4, 8)), ([0, 200, 0], [200, 0, 0]));
    }

    #[test]
    fn nothing_makes_no_mosaic() {
        assert!(Mosaic::assemble(&[]).is_none());
    }
}
