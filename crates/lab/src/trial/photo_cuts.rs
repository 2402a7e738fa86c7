//! `ImagePlacement` and `ViewPair`: images cut from a photo or an orthophoto, and views ahead of them that share a
//! part of their ground.

use super::error::TrialError;
use nalgebra::Vector2;
use overfly_core::pixels::{Gray, Mask};
use overfly_ingest::raster::{Imagery, ImageryError};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use std::path::Path;

/// Noise added to the views, one standard deviation, gray levels.
const NOISE: f32 = 4.0;
/// Greatest turn between the views of a pair, degrees.
const MOST_TURN_DEG: f64 = 8.0;
/// Greatest lateral offset of the second view of a pair, pixels.
const MOST_ASIDE_PX: f64 = 2.0;
/// Candidate places drawn at a time, from at most `MOST_DRAWS` draws. The candidate farthest from other places that
/// has all its pixels is taken.
const CANDIDATES: usize = 16;
const MOST_DRAWS: usize = 400;
/// Rounds of candidates until the photo counts as too small.
const ROUNDS: usize = 16;
/// Reach of a turned view beyond its edge, as a share of the edge: half of cos 8 + sin 8 degrees minus one.
const TURNED_SHARE: f64 = 0.065;

/// The place and the direction of an image in a photo. The views ahead of it fit into the photo too.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImagePlacement {
    /// Centre of the image, pixels from the photo's corner.
    pub centre_px: [f64; 2],
    /// Turn of the image in the photo, radians clockwise.
    pub heading_rad: f64,
}

/// Size of the views, and the least overlap of a pair.
#[derive(Debug, Clone, Copy)]
pub struct CutOptions {
    /// Edge of the square views, pixels.
    pub edge_px: usize,
    /// Least overlap, in [0, 1].
    pub least_overlap: f64,
}

impl CutOptions {
    /// Distance from a view's centre within which pixels are needed: half its diagonal and the lateral offset.
    fn reach_px(self) -> f64 {
        self.edge_px as f64 * std::f64::consts::FRAC_1_SQRT_2 + MOST_ASIDE_PX + 2.0
    }

    /// Offset from the image's centre to the centre of the farthest view ahead, pixels of the view.
    fn farthest_px(self) -> Vector2<f64> {
        Vector2::new(0.0, -(1.0 - self.least_overlap) * self.edge_px as f64)
    }
}

impl ImagePlacement {
    /// Chooses a place in the photo, far from the `others`. The same generator gives the same place.
    ///
    /// # Errors
    /// [`TrialError::NoPlace`] if the photo, or the part with pixels, is too small; pixels that cannot be read.
    pub fn choose(
        imagery: &Imagery,
        path: &Path,
        cut: CutOptions,
        others: &[Self],
        rng: &mut ChaCha8Rng,
    ) -> Result<Self, TrialError> {
        for _ in 0..ROUNDS {
            let mut candidates = Self::candidates(imagery, cut, rng);
            let apart = |place: &Self| {
                let away = |other: &Self| {
                    (place.centre_px[0] - other.centre_px[0]).hypot(place.centre_px[1] - other.centre_px[1])
                };
                others.iter().map(away).fold(f64::INFINITY, f64::min)
            };
            candidates.sort_by(|a, b| apart(b).total_cmp(&apart(a)));
            for place in candidates {
                if place.ground(imagery, cut)?.is_some() {
                    return Ok(place);
                }
            }
        }
        let [width_px, height_px] = imagery.size_px();
        Err(TrialError::NoPlace { path: path.into(), width_px, height_px, edge_px: cut.edge_px })
    }

    /// Draws places whose views lie within the photo.
    fn candidates(imagery: &Imagery, cut: CutOptions, rng: &mut ChaCha8Rng) -> Vec<Self> {
        let mut candidates = Vec::with_capacity(CANDIDATES);
        for _ in 0..MOST_DRAWS {
            let drawn = Self::drawn(imagery.size_px(), cut, rng);
            candidates.extend(drawn.filter(|place| place.corners(imagery, cut).is_some()));
            if candidates.len() == CANDIDATES {
                break;
            }
        }
        candidates
    }

    /// Draws a place for an image with any heading; `None` if the photo is too small.
    fn drawn(size_px: [usize; 2], cut: CutOptions, rng: &mut ChaCha8Rng) -> Option<Self> {
        let reach_px = cut.reach_px();
        let ends = size_px.map(|n| n as f64 - reach_px);
        (ends[0] > reach_px && ends[1] > reach_px).then(|| Self {
            centre_px: ends.map(|end| rng.random_range(reach_px..end)),
            heading_rad: rng.random_range(0.0..std::f64::consts::TAU),
        })
    }

    /// Upper-left and lower-right corner of the pixels that all views of this place need; `None` if they leave the
    /// photo.
    fn corners(&self, imagery: &Imagery, cut: CutOptions) -> Option<[[usize; 2]; 2]> {
        let reach_px = cut.reach_px();
        let far = ahead(self.centre_px, cut.farthest_px(), self.heading_rad);
        let size_px = imagery.size_px();
        let low = [0, 1].map(|k| (self.centre_px[k].min(far[k]) - reach_px).floor());
        let high = [0, 1].map(|k| (self.centre_px[k].max(far[k]) + reach_px).ceil());
        let fits = (0..2).all(|k| low[k] >= 0.0 && high[k] <= size_px[k] as f64);
        fits.then(|| [low.map(|v| v as usize), high.map(|v| v as usize)])
    }

    /// Reads the ground that all views of this place need; `None` if a pixel is missing.
    ///
    /// # Errors
    /// If pixels cannot be read.
    pub fn ground(&self, imagery: &Imagery, cut: CutOptions) -> Result<Option<PhotoGround>, ImageryError> {
        let Some([low, high]) = self.corners(imagery, cut) else { return Ok(None) };
        let Some((gray, mask)) = imagery.gray(low, [high[0] - low[0], high[1] - low[1]])? else { return Ok(None) };
        let corner_px = low.map(|v| v as f64);
        let is_there = self.has_all(&mask, corner_px, cut);
        Ok(is_there.then_some(PhotoGround { gray, corner_px, edge_px: cut.edge_px, place: *self }))
    }

    /// Whether the strip of the image and all views ahead of it has all its pixels.
    fn has_all(&self, mask: &Mask, corner_px: [f64; 2], cut: CutOptions) -> bool {
        let half_px = cut.edge_px as f64 * (0.5 + TURNED_SHARE) + MOST_ASIDE_PX + 1.0;
        let farthest_px = cut.farthest_px().y - half_px;
        let (sin, cos) = self.heading_rad.sin_cos();
        let from_centre = [0, 1].map(|k| corner_px[k] + 0.5 - self.centre_px[k]);
        let in_strip = |x: usize, y: usize| {
            let (dx, dy) = (from_centre[0] + x as f64, from_centre[1] + y as f64);
            let (aside, down) = (cos * dx + sin * dy, cos * dy - sin * dx);
            aside.abs() <= half_px && (farthest_px..=half_px).contains(&down)
        };
        (0..mask.height_px()).all(|y| (0..mask.width_px()).all(|x| mask.at(x, y) || !in_strip(x, y)))
    }
}

/// The ground around a place.
pub struct PhotoGround {
    gray: Gray,
    corner_px: [f64; 2],
    edge_px: usize,
    place: ImagePlacement,
}

/// Two views of the same ground.
pub struct ViewPair {
    /// The image.
    pub a: Gray,
    /// The view ahead of the image.
    pub b: Gray,
    /// True displacement of b's centre from a's, pixels of a.
    pub shift_px: Vector2<f64>,
}

impl PhotoGround {
    /// Cuts the image: its pixels with noise, rounded as by a camera.
    pub fn image(&self, rng: &mut ChaCha8Rng) -> Gray {
        self.view(self.place.centre_px, self.place.heading_rad, rng)
    }

    /// Pairs the image `a` with a view that shares the fraction `overlap`: ahead, a little to the side, and turned.
    pub fn pair(&self, a: &Gray, overlap: f64, rng: &mut ChaCha8Rng) -> ViewPair {
        let aside_px = rng.random_range(-MOST_ASIDE_PX..MOST_ASIDE_PX);
        let shift_px = Vector2::new(aside_px, -(1.0 - overlap) * self.edge_px as f64);
        let turn_rad = rng.random_range(-MOST_TURN_DEG..MOST_TURN_DEG).to_radians();
        let ImagePlacement { centre_px, heading_rad } = self.place;
        let b = self.view(ahead(centre_px, shift_px, heading_rad), heading_rad + turn_rad, rng);
        ViewPair { a: a.clone(), b, shift_px }
    }

    /// Cuts a square about `centre_px` of the photo, turned, with noise.
    fn view(&self, centre_px: [f64; 2], heading_rad: f64, rng: &mut ChaCha8Rng) -> Gray {
        let edge = self.edge_px;
        let middle = edge as f64 / 2.0;
        let mut seen = Gray::filled(edge, edge, 0.0);
        for (i, value) in seen.values_mut().iter_mut().enumerate() {
            let from_centre = Vector2::new((i % edge) as f64 + 0.5 - middle, (i / edge) as f64 + 0.5 - middle);
            let [x, y] = ahead(centre_px, from_centre, heading_rad);
            // The sum of four uniform numbers, minus its mean and over its standard deviation, is close enough to
            // normal.
            let noise = ((0..4).map(|_| rng.random::<f32>()).sum::<f32>() - 2.0) * 3f32.sqrt();
            let ground = self.gray.sample(x - self.corner_px[0], y - self.corner_px[1]);
            *value = (ground + NOISE * noise).round().clamp(0.0, 255.0);
        }
        seen
    }
}

/// The point of the photo at `shift_px` from a point, in the axes of a view with this heading.
fn ahead([x, y]: [f64; 2], shift_px: Vector2<f64>, heading_rad: f64) -> [f64; 2] {
    let (sin, cos) = heading_rad.sin_cos();
    [x + cos * shift_px.x - sin * shift_px.y, y + sin * shift_px.x + cos * shift_px.y]
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_ingest::raster::OpenOptions;
    use rand::SeedableRng;

    const CUT: CutOptions = CutOptions { edge_px: 256, least_overlap: 0.1 };

    /// A photo whose brightness tells the column: 0.15 levels per column.
    fn ramp(width: u32, height: u32) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ramp.png");
        image::GrayImage::from_fn(width, height, |x, _| image::Luma([(x as f32 * 0.15) as u8])).save(&path).unwrap();
        (folder, path)
    }

    fn opened(path: &Path) -> Imagery {
        Imagery::open(path, &OpenOptions::default()).unwrap()
    }

    fn dice(seed: u64) -> ChaCha8Rng {
        ChaCha8Rng::seed_from_u64(seed)
    }

    #[test]
    fn the_stated_shift_is_where_the_other_views_centre_lies() {
        let (_folder, path) = ramp(1400, 1400);
        let imagery = opened(&path);
        let place = ImagePlacement::choose(&imagery, &path, CUT, &[], &mut dice(4)).unwrap();
        let ground = place.ground(&imagery, CUT).unwrap().unwrap();
        let a = ground.image(&mut dice(5));
        let views = ground.pair(&a, 0.5, &mut dice(6));
        // On a plane, the mean of a view is the brightness of its centre, and the slope of a predicts the brightness
        // of a shifted view.
        let mean = |g: &Gray| g.values().iter().map(|&v| f64::from(v)).sum::<f64>() / (256.0 * 256.0);
        let slope = |at: fn(f64, f64) -> f64| {
            let weight = |i: usize| at((i % 256) as f64 - 127.5, (i / 256) as f64 - 127.5);
            let total: f64 = (0..65536).map(|i| weight(i).powi(2)).sum();
            views.a.values().iter().enumerate().map(|(i, &v)| f64::from(v) * weight(i)).sum::<f64>() / total
        };
        let expected = slope(|x, _| x) * views.shift_px.x + slope(|_, y| y) * views.shift_px.y;
        // Noise of 4 levels over 65536 pixels: 0.02 levels each; the slopes' error times 128 px: about 0.03.
        assert!((mean(&views.b) - mean(&views.a) - expected).abs() < 0.2, "{expected}");
        assert!((views.shift_px.norm() - 128.0).abs() < 0.1);
    }

    #[test]
    fn places_of_a_photo_keep_apart_and_the_same_dice_give_the_same() {
        let (_folder, path) = ramp(1600, 1500);
        let imagery = opened(&path);
        let choose = || {
            let mut places = Vec::new();
            for k in 0..4 {
                places.push(ImagePlacement::choose(&imagery, &path, CUT, &places, &mut dice(k)).unwrap());
            }
            places
        };
        let places = choose();
        assert_eq!(places, choose());
        for (k, a) in places.iter().enumerate() {
            for b in &places[..k] {
                // Four independent places in the 1230 x 1130 px that centres may take: in one case of eight a pair
                // would be nearer.
                let away = (a.centre_px[0] - b.centre_px[0]).hypot(a.centre_px[1] - b.centre_px[1]);
                assert!(away > 300.0, "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn a_photo_that_is_too_small_is_named() {
        let (_folder, path) = ramp(360, 900);
        let refused = ImagePlacement::choose(&opened(&path), &path, CUT, &[], &mut dice(1)).map(|_| ()).unwrap_err();
        assert_eq!(refused.code(), "no_place_for_views");
        assert!(refused.to_string().contains("ramp.png") && refused.to_string().contains("360 x 900"), "{refused}");
    }
}
