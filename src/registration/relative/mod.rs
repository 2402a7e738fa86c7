//! Relative registration: the motion between two frames.
//!
//! Keypoints find it, from any turn; the brightness of all that both frames see makes it exact.

mod alignment;
mod consensus;

use crate::feature::keypoint::{self, Keypoints};
use crate::pixels::{Gray, Mask};
use nalgebra::{Matrix2, Vector2};
use serde::Serialize;
use utoipa::ToSchema;

/// What two frames are known to share before they are compared.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MotionPrior {
    /// Expected ratio of b's ground sample distance to a's; `None` when unknown.
    pub scale: Option<f64>,
}

/// The answer: how frame b lies on frame a, or why that cannot be said.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(tag = "status", rename_all = "snake_case")]
pub enum MotionAnswer {
    /// Registered.
    Motion(Motion),
    /// Not registered.
    NoMotion {
        /// Why, as a stable word.
        reason: NoMotionReason,
        /// Why, for people and logs.
        detail: String,
    },
}

/// Why two frames could not be registered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum NoMotionReason {
    /// Too few correspondences agree on one motion: another place, too little overlap, or too little texture.
    TooFewAgreeingMatches,
    /// They agree on a scale that the prior excludes.
    OtherScale,
}

/// A similarity taking a point of image b to image a, pixels counted from the corner.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct Motion {
    /// Row-major 2 x 3: a point (x, y, 1) of b to a.
    pub a_from_b: [[f64; 3]; 2],
    /// Rotation of b against a, degrees in (-180, 180], clockwise as seen in the image.
    pub rotation_deg: f64,
    /// Pixels of a per pixel of b.
    pub scale: f64,
    /// Where b's centre lies in a minus a's centre, pixels of a: the displacement.
    pub displacement_px: [f64; 2],
    /// Covariance of `displacement_px`, px^2.
    pub covariance_px2: [[f64; 2]; 2],
    /// Correspondences that agree.
    pub inliers: usize,
    /// Correspondences that were tried.
    pub matches: usize,
}

/// A similarity of the plane: x -> (c x - s y + t_x, s x + c y + t_y).
#[derive(Debug, Clone, Copy, PartialEq)]
struct Similarity {
    /// Scale times cosine, scale times sine of the clockwise turn (y runs down).
    c: f64,
    s: f64,
    t: Vector2<f64>,
}

impl Similarity {
    /// The one that takes two points of b to two of a; `None` where the points of b coincide.
    ///
    /// # References
    /// Equations 34 to 36, which hold at equal scale; here normalised by the lengths' ratio.
    fn through(b: [Vector2<f64>; 2], a: [Vector2<f64>; 2]) -> Option<Self> {
        let (db, da) = (b[1] - b[0], a[1] - a[0]);
        let square = db.norm_squared();
        if square < 1e-9 {
            return None;
        }
        let c = (db.x * da.x + db.y * da.y) / square;
        let s = (db.x * da.y - db.y * da.x) / square;
        let t = a[0] - Vector2::new(c * b[0].x - s * b[0].y, s * b[0].x + c * b[0].y);
        Some(Self { c, s, t })
    }

    fn apply(&self, p: Vector2<f64>) -> Vector2<f64> {
        Vector2::new(self.c * p.x - self.s * p.y, self.s * p.x + self.c * p.y) + self.t
    }

    fn scale(&self) -> f64 {
        self.c.hypot(self.s)
    }

    fn rotation_rad(&self) -> f64 {
        self.s.atan2(self.c)
    }
}

/// Keypoints described in each frame.
const KEYPOINTS: usize = 1000;
/// Nearest over second nearest descriptor.
const RATIO: f32 = 0.85;
/// A correspondence agrees within this distance, pixels of a.
const TOLERANCE_PX: f64 = 2.5;
/// Fewer agreeing correspondences than this prove nothing: by accident 6 rarely agree among some hundred.
const LEAST_INLIERS: usize = 8;
/// Scales outside are no consecutive frames.
const SCALE_BOUNDS: (f64, f64) = (0.4, 2.5);
/// How far the scale found may be from the stated one.
const SCALE_SLACK: f64 = 0.15;

/// Frames are compared at this edge (square root of the area) at most: beyond, only time and memory grow.
const MOST_EDGE_PX: f64 = 2048.0;

/// Registers frame b against frame a. Frames of many megapixels are compared at a whole fraction of their size; the
/// answer is in their own pixels.
///
/// # References
/// Equations 32 to 36 of the paper, over many correspondences; the final alignment is Lucas and Kanade's (IJCAI 1981)
/// for a similarity with gain and offset.
pub fn register(a: &Gray, b: &Gray, prior: &MotionPrior) -> MotionAnswer {
    let edge_px = |g: &Gray| ((g.width_px() * g.height_px()) as f64).sqrt();
    let factor = (edge_px(a).max(edge_px(b)) / MOST_EDGE_PX).ceil() as usize;
    if factor <= 1 {
        return register_as_is(a, b, prior, 1, middle(a), middle(b));
    }
    let reduced = |p: Vector2<f64>| p / factor as f64;
    register_as_is(&a.binned(factor), &b.binned(factor), prior, factor, reduced(middle(a)), reduced(middle(b)))
}

/// The middle of a frame, pixels from its corner.
fn middle(frame: &Gray) -> Vector2<f64> {
    Vector2::new(frame.width_px() as f64 / 2.0, frame.height_px() as f64 / 2.0)
}

/// Registers frames whose pixels are `factor` of the answer's wide; the centres are those of the frames before binning,
/// which may have dropped a remainder.
fn register_as_is(
    a: &Gray,
    b: &Gray,
    prior: &MotionPrior,
    factor: usize,
    centre_of_a: Vector2<f64>,
    centre_of_b: Vector2<f64>,
) -> MotionAnswer {
    use NoMotionReason::{OtherScale, TooFewAgreeingMatches};
    let (of_a, of_b) = (described(a), described(b));
    let matches = keypoint::match_mutual(&of_a, &of_b, RATIO);
    let pairs: Vec<_> = matches.iter().map(|m| (place(&of_a, m.a), place(&of_b, m.b))).collect();
    let Some(found) = consensus::estimate(&pairs, TOLERANCE_PX, SCALE_BOUNDS) else {
        return refused(
            TooFewAgreeingMatches,
            format!("{} correspondences, no two of which agree on a similarity", pairs.len()),
        );
    };
    if found.inliers < LEAST_INLIERS {
        let detail = format!("{} of {} correspondences agree, {LEAST_INLIERS} needed", found.inliers, pairs.len());
        return refused(TooFewAgreeingMatches, detail);
    }
    if let Some(expected) = prior.scale.filter(|e| (found.similarity.scale() / e).ln().abs() > SCALE_SLACK) {
        return refused(OtherScale, format!("scale {:.3}, but {expected:.3} was stated", found.similarity.scale()));
    }
    let (similarity, covariance) = match alignment::align(a, b, &found.similarity) {
        Some(aligned) => (aligned.similarity, aligned.covariance),
        None => (found.similarity, found.covariance_at(centre_of_b)),
    };
    let displacement = similarity.apply(centre_of_b) - centre_of_a;
    MotionAnswer::Motion(motion(similarity, displacement, covariance, factor as f64, [found.inliers, pairs.len()]))
}

/// The answer in pixels `factor` times as small; `counts` are inliers and matches.
fn motion(
    similarity: Similarity,
    displacement: Vector2<f64>,
    covariance: Matrix2<f64>,
    factor: f64,
    counts: [usize; 2],
) -> Motion {
    let Similarity { c, s, t } = similarity;
    let (t, displacement, covariance) = (t * factor, displacement * factor, covariance * factor * factor);
    Motion {
        a_from_b: [[c, -s, t.x], [s, c, t.y]],
        rotation_deg: similarity.rotation_rad().to_degrees(),
        scale: similarity.scale(),
        displacement_px: [displacement.x, displacement.y],
        covariance_px2: [[covariance[(0, 0)], covariance[(0, 1)]], [covariance[(1, 0)], covariance[(1, 1)]]],
        inliers: counts[0],
        matches: counts[1],
    }
}

fn described(gray: &Gray) -> Keypoints {
    keypoint::describe(gray, &Mask::filled(gray.width_px(), gray.height_px(), true), KEYPOINTS)
}

fn place(keypoints: &Keypoints, i: usize) -> Vector2<f64> {
    let p = keypoints.points[i];
    Vector2::new(f64::from(p.x_px), f64::from(p.y_px))
}

fn refused(reason: NoMotionReason, detail: String) -> MotionAnswer {
    MotionAnswer::NoMotion { reason, detail }
}

#[cfg(test)]
mod tests;
