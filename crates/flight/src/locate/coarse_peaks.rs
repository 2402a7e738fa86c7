//! `CoarsePeaks`: the local maxima that the coarse search found, with the moments of its statistic.

use super::camera_pose::CameraPose;

/// Number of peaks kept.
pub const MAX_PEAKS: usize = 8;
/// Of two peaks nearer than this, pixels, only the stronger is kept.
const MIN_DISTANCE_PX: f64 = 4.0;

/// A local maximum of the correlation surface: a place where the frame may lie.
#[derive(Debug, Clone, Copy)]
pub struct CoarsePeak {
    /// The pose there.
    pub pose: CameraPose,
    /// The statistic T there.
    pub statistic: f64,
}

/// The result of the coarse search.
#[derive(Debug, Clone, Default)]
pub struct CoarsePeaks {
    /// The best peaks, best first, none within a few pixels of a better one.
    pub peaks: Vec<CoarsePeak>,
    /// Mean of T over all places and hypotheses compared.
    pub mean: f64,
    /// Standard deviation of T over all places and hypotheses compared.
    pub deviation: f64,
    /// Number of places times hypotheses compared.
    pub places: f64,
}

impl CoarsePeaks {
    /// Returns the distinct peaks of a search, with the moments of T.
    pub fn from_sums(sums: SurfaceSums) -> Self {
        let mean = if sums.count > 0.0 { sums.sum / sums.count } else { 0.0 };
        let variance = if sums.count > 0.0 { sums.sum_squares / sums.count - mean * mean } else { 0.0 };
        let peaks = distinct(sums.peaks);
        Self { peaks, mean, deviation: variance.max(0.0).sqrt(), places: sums.count }
    }

    /// Merges the results of two searches.
    pub fn merged_with(self, other: Self) -> Self {
        let places = self.places + other.places;
        let share = |a: f64, b: f64| if places > 0.0 { (a * self.places + b * other.places) / places } else { 0.0 };
        let mean = share(self.mean, other.mean);
        let square = |r: &Self| r.deviation.powi(2) + (r.mean - mean).powi(2);
        let deviation = share(square(&self), square(&other)).sqrt();
        Self { mean, deviation, places, peaks: distinct([self.peaks, other.peaks].concat()) }
    }

    /// The z-score of a statistic: its distance from the mean in standard deviations of the surface.
    pub fn z_score(&self, statistic: f64) -> f64 {
        if self.deviation > 0.0 { (statistic - self.mean) / self.deviation } else { 0.0 }
    }
}

/// Sums over all surfaces, and the peaks of every block.
#[derive(Default)]
pub struct SurfaceSums {
    /// Sum of T.
    pub sum: f64,
    /// Sum of T squared.
    pub sum_squares: f64,
    /// Places times hypotheses compared.
    pub count: f64,
    /// The peaks found so far.
    pub peaks: Vec<CoarsePeak>,
}

/// Keeps the strongest peaks, and drops peaks near stronger ones.
fn distinct(mut peaks: Vec<CoarsePeak>) -> Vec<CoarsePeak> {
    strongest_first(&mut peaks);
    let mut kept: Vec<CoarsePeak> = Vec::new();
    for peak in peaks {
        let near = |k: &CoarsePeak| {
            let (dx, dy) = (k.pose.nadir.x_px - peak.pose.nadir.x_px, k.pose.nadir.y_px - peak.pose.nadir.y_px);
            dx.hypot(dy) < MIN_DISTANCE_PX
        };
        if !kept.iter().any(near) {
            kept.push(peak);
        }
        if kept.len() == MAX_PEAKS {
            break;
        }
    }
    kept
}

/// Sorts peaks by falling statistic.
pub fn strongest_first(peaks: &mut [CoarsePeak]) {
    peaks.sort_by(|a, b| b.statistic.total_cmp(&a.statistic));
}
