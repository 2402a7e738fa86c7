//! `Experiment`: the paper's section V.D, repeated: which of its laws hold here, and its values beside those found.

use super::drift_curve::{DRIFT_BOUND_PX, DriftCurve};
use super::fix_table::quoted;
use super::relative_laws::{DescriptorRow, RelativeLaws};
use super::{OVERLAPS_PERCENT, RelativeMeasurement, RelativeSample, RelativeTrial, TrialError};
use overfly_core::coupling::{
    PAPER_DRIFT_MATCHES, PAPER_GSD_M_PER_PX, PAPER_LOAD_S, PAPER_SECONDS_PER_DESCRIPTOR, PROBABLE_LOAD_S,
    PixelDriftLaw, fit_power, fit_power_above, r_squared,
};
use serde::Serialize;
use std::path::PathBuf;

/// The summary of `overfly experiment`, as JSON spells it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Experiment {
    /// Images cut.
    pub images: usize,
    /// From so many photos or orthophotos.
    pub photos: usize,
    /// Pairs made of them and of views ahead of them.
    pub pairs: usize,
    /// Edge of images and views, pixels.
    pub edge_px: usize,
    /// Descriptors at most: each pair was registered with each of these.
    pub limits: Vec<usize>,
    /// Runs of each step.
    pub repeats: usize,
    /// Of images, pairs and noise.
    pub seed: u64,
    /// Pairs times numbers of descriptors.
    pub registrations: usize,
    /// Those that the program would have answered with a motion.
    pub registered: usize,
    /// Of those, off by more than a pixel.
    #[serde(rename = "false")]
    pub wrong: usize,
    /// By overlap, greatest first.
    pub by_overlap: Vec<OverlapRow>,
    /// The shapes of figures 12 to 15, and (45), and whether they came out.
    pub shapes: Vec<Shape>,
    /// Whether those of all four figures did.
    pub figures_reproduced: bool,
    /// The laws fitted, and what to.
    pub laws: RelativeLaws,
    /// What the paper prints.
    pub paper: PaperFigures,
}

/// Pairs of one overlap.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OverlapRow {
    /// Ground that the views share.
    pub overlap_percent: f64,
    /// Pairs.
    pub pairs: usize,
    /// Of them registered, for each of the numbers of descriptors.
    pub registered: Vec<usize>,
    /// Registrations off by more than a pixel, of all numbers of descriptors.
    #[serde(rename = "false")]
    pub wrong: usize,
}

/// What the paper prints of its own machine and images (section V.D). Its t0, B and t_c stand in no text.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PaperFigures {
    /// Images.
    pub images: usize,
    /// Pairs.
    pub pairs: usize,
    /// A_c, seconds.
    pub seconds_per_descriptor: f64,
    /// L as printed, seconds.
    pub load_s: f64,
    /// L as it is probably meant, seconds.
    pub probable_load_s: f64,
    /// The metre of drift that it speaks of, pixels.
    pub drift_px: f64,
    /// The matches that it needs for less.
    pub matches_needed: f64,
    /// The law 1 / sqrt(n) through that point.
    pub drift_law: PixelDriftLaw,
}

/// A law of the paper, and whether what was measured has its shape.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Shape {
    /// The paper's figure; (45) has none.
    pub figure: Option<u8>,
    /// The law.
    pub law: &'static str,
    /// Share of the variance of the medians (of each number of descriptors; of drift: of the bins' log10) that it explains.
    pub r2: Option<f64>,
    /// The same of single registrations, disturbances of the machine included; not of drift.
    pub r2_of_registrations: Option<f64>,
    /// The power with which the law says that the part grows.
    pub expected_power: Option<f64>,
    /// The power that fits best.
    pub power: Option<f64>,
    /// Of matches and drift, Spearman's; of times there is none.
    pub rank_correlation: Option<f64>,
    /// What had to be.
    pub test: &'static str,
    /// Whether it was.
    pub holds: bool,
}

const LEAST_R2: f64 = 0.95;
const POWER_TOLERANCE: f64 = 0.25;
const TIME_TEST: &str = "R2 of the medians at least 0.95, and the best power within 0.25 of the law's";
const TOTAL_TEST: &str = "R2 of the medians at least 0.95";
const DRIFT_TEST: &str = "best power at most -0.25, and rank correlation of matches and drift at most -0.5";

impl Experiment {
    /// Judges what was measured.
    ///
    /// # Errors
    /// [`TrialError::Option`] where not one pair was registered.
    pub fn of(trial: &RelativeTrial, measured: &RelativeMeasurement) -> Result<Self, TrialError> {
        let samples = &measured.samples;
        let laws = RelativeLaws::of(samples)?;
        let shapes = shapes(&laws, samples);
        Ok(Self {
            images: measured.images.len(),
            photos: trial.photos.len().min(measured.images.len()),
            pairs: trial.pairs * OVERLAPS_PERCENT.len(),
            edge_px: trial.edge_px,
            limits: laws.rows.iter().map(|row| row.limit).collect(),
            repeats: trial.repeats,
            seed: trial.seed,
            registrations: samples.len(),
            registered: samples.iter().filter(|s| s.is_registered()).count(),
            wrong: samples.iter().filter(|s| s.is_false()).count(),
            by_overlap: OVERLAPS_PERCENT.iter().map(|&overlap| OverlapRow::of(overlap, &laws.rows, samples)).collect(),
            figures_reproduced: shapes.iter().all(|shape| shape.figure.is_none() || shape.holds),
            shapes,
            laws,
            paper: PaperFigures::PRINTED,
        })
    }
}

impl OverlapRow {
    fn of(overlap_percent: f64, rows: &[DescriptorRow], samples: &[RelativeSample]) -> Self {
        let these: Vec<_> = samples.iter().filter(|s| s.overlap_percent == overlap_percent).collect();
        let registered = |limit: usize| these.iter().filter(|s| s.limit == limit && s.is_registered()).count();
        Self {
            overlap_percent,
            pairs: these.len() / rows.len().max(1),
            registered: rows.iter().map(|row| registered(row.limit)).collect(),
            wrong: these.iter().filter(|s| s.is_false()).count(),
        }
    }
}

impl PaperFigures {
    /// As printed; the drift law is that of section III through its one point.
    pub const PRINTED: Self = Self {
        images: 72,
        pairs: 320,
        seconds_per_descriptor: PAPER_SECONDS_PER_DESCRIPTOR,
        load_s: PAPER_LOAD_S,
        probable_load_s: PROBABLE_LOAD_S,
        drift_px: DRIFT_BOUND_PX,
        matches_needed: PAPER_DRIFT_MATCHES,
        // sqrt(600) times a metre in pixels.
        drift_law: PixelDriftLaw { pair_drift_px: 24.494_897_427_831_78 / PAPER_GSD_M_PER_PX, floor_px: 0.0 },
    };
}

/// Figures 12 to 14, the sum (45), and figure 15.
fn shapes(laws: &RelativeLaws, samples: &[RelativeSample]) -> Vec<Shape> {
    let cost = laws.relative;
    let time = |figure, law, expected_power: f64, model: &dyn Fn(f64) -> f64, of: Step| {
        let medians = points(&laws.rows, |r| r.descriptors, of.of_row);
        let fitted = if figure == 12 { fit_power_above(&medians) } else { fit_power(&medians) };
        let r2 = r_squared(&medians, model);
        let is_near = fitted.is_some_and(|p| (p - expected_power).abs() <= POWER_TOLERANCE);
        Shape {
            figure: Some(figure),
            law,
            r2,
            r2_of_registrations: r_squared(&points(samples, |s| s.descriptors, of.of_sample), model),
            expected_power: Some(expected_power),
            power: fitted,
            rank_correlation: None,
            test: TIME_TEST,
            holds: is_near && r2.is_some_and(|r2| r2 >= LEAST_R2),
        }
    };
    let loading = |n: f64| cost.seconds_per_descriptor * n + cost.load_s;
    let matching = |n: f64| cost.pair_comparison_s * n * n;
    let threshold = |n: f64| cost.threshold_s_per_descriptor * n;
    vec![
        time(
            12,
            "t_l = A_c N + L (42)",
            1.0,
            &loading,
            Step { of_row: |r| Some(r.times.loading_s), of_sample: |s| Some(s.times.loading_s) },
        ),
        time(
            13,
            "t_m = t0 N^2 (43)",
            2.0,
            &matching,
            Step { of_row: |r| Some(r.times.matching_s), of_sample: |s| Some(s.times.matching_s) },
        ),
        time(
            14,
            "t_tau = B N (44)",
            1.0,
            &threshold,
            Step { of_row: |r| Some(r.times.threshold_s), of_sample: |s| Some(s.times.threshold_s) },
        ),
        total(laws, samples, &|n| loading(n) + matching(n) + threshold(n) + cost.estimate_s),
        drift(&laws.keypoints),
    ]
}

/// Where the time of a step stands.
struct Step {
    of_row: fn(&DescriptorRow) -> Option<f64>,
    of_sample: fn(&RelativeSample) -> Option<f64>,
}

fn points<T>(of: &[T], x: fn(&T) -> f64, y: fn(&T) -> Option<f64>) -> Vec<(f64, f64)> {
    of.iter().filter_map(|item| Some((x(item), y(item)?))).collect()
}

fn total(laws: &RelativeLaws, samples: &[RelativeSample], model: &dyn Fn(f64) -> f64) -> Shape {
    let r2 = r_squared(&points(&laws.rows, |r| r.descriptors, |r| r.total_s), model);
    Shape {
        figure: None,
        law: "T_exe = t0 N^2 + (A_c + B) N + L + t_c (45)",
        r2,
        r2_of_registrations: r_squared(&points(samples, |s| s.descriptors, |s| s.times.total_s()), model),
        expected_power: None,
        power: None,
        rank_correlation: None,
        test: TOTAL_TEST,
        holds: r2.is_some_and(|r2| r2 >= LEAST_R2),
    }
}

/// Of keypoints alone, as the paper registers.
fn drift(curve: &DriftCurve) -> Shape {
    let falls = curve.power.is_some_and(|p| p <= -POWER_TOLERANCE);
    Shape {
        figure: Some(15),
        law: "D_U = sqrt(floor^2 + pair^2 / n), keypoints alone",
        r2: curve.r2,
        r2_of_registrations: None,
        expected_power: Some(-0.5),
        power: curve.power,
        rank_correlation: curve.rank_correlation,
        test: DRIFT_TEST,
        holds: falls && curve.rank_correlation.is_some_and(|r| r <= -0.5),
    }
}

/// Where the images lie, a row each: the photo's name, the centre on it, and how the image is turned.
pub fn images_csv(photos: &[PathBuf], measured: &RelativeMeasurement) -> String {
    let mut text = String::from("image,photo,centre_x_px,centre_y_px,turn_deg\n");
    for (i, image) in measured.images.iter().enumerate() {
        let name = photos[image.photo].file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
        let [x, y] = image.place.centre_px;
        let turn_deg = image.place.heading_rad.to_degrees();
        text.push_str(&format!("{},{},{x:.3},{y:.3},{turn_deg:.4}\n", i + 1, quoted(&name)));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::drift_curve::tests::sample;
    use super::*;
    use overfly_core::coupling::DriftLaw;

    fn trial() -> RelativeTrial {
        RelativeTrial {
            photos: vec!["a.jpg".into()],
            stretch: None,
            images: 2,
            pairs: 1,
            limits: vec![],
            repeats: 1,
            edge_px: 512,
            seed: 1,
        }
    }

    /// Registrations of which every law holds.
    fn lawful() -> Vec<RelativeSample> {
        [(75, 4), (150, 12), (300, 40), (600, 110), (1200, 250), (2400, 600)]
            .map(|(limit, n)| sample(limit, limit as f64, n, 0.4 / (n as f64).sqrt()))
            .to_vec()
    }

    fn judged(samples: Vec<RelativeSample>) -> Experiment {
        Experiment::of(&trial(), &RelativeMeasurement { images: vec![], samples }).unwrap()
    }

    fn holds(experiment: &Experiment) -> Vec<bool> {
        experiment.shapes.iter().map(|s| s.holds).collect()
    }

    #[test]
    fn what_follows_the_laws_reproduces_the_figures() {
        let found = judged(lawful());
        assert_eq!(holds(&found), [true; 5], "{:#?}", found.shapes);
        assert!(found.figures_reproduced && found.wrong == 0 && found.registered == 6);
        assert_eq!(found.by_overlap[1].registered, [1; 6]);
        assert!(found.shapes[..4].iter().all(|s| s.r2.unwrap() > 0.999_999));
    }

    #[test]
    fn what_does_not_follow_a_law_does_not_reproduce_its_figure() {
        let breaks: [fn(&mut RelativeSample); 4] = [
            |s| s.times.loading_s = 0.004 + 1e-8 * s.descriptors.powi(2),
            |s| s.times.matching_s = 1e-6 * s.descriptors,
            |s| s.times.threshold_s = 1e-6,
            |s| s.drifts = super::super::Drifts { drift_px: Some(0.1), keypoint_drift_px: Some(0.1) },
        ];
        for (figure, broken) in [12, 13, 14, 15].into_iter().zip(breaks) {
            let mut samples = lawful();
            samples.iter_mut().for_each(broken);
            let found = judged(samples);
            let failed: Vec<_> = found.shapes.iter().filter(|s| !s.holds).map(|s| s.figure).collect();
            assert!(failed.contains(&Some(figure)) && !found.figures_reproduced, "{figure}: {:#?}", found.shapes);
            assert!(failed.iter().flatten().all(|f| *f == figure), "{figure}: {failed:?}");
        }
    }

    #[test]
    fn the_papers_law_is_that_of_section_iii_on_its_pixels() {
        let law = PaperFigures::PRINTED.drift_law;
        assert!((law.pair_drift_px * PAPER_GSD_M_PER_PX - DriftLaw::of_the_paper().pair_drift_m).abs() < 1e-9);
        assert!((law.drift_px(PAPER_DRIFT_MATCHES) - DRIFT_BOUND_PX).abs() < 1e-12);
    }

    #[test]
    fn places_are_told_with_their_photo() {
        let image = super::super::CutImage {
            photo: 0,
            place: super::super::Place { centre_px: [400.5, 300.25], heading_rad: std::f64::consts::PI },
            picture: overfly_core::pixels::Gray::filled(1, 1, 0.0),
        };
        let measured = RelativeMeasurement { images: vec![image], samples: vec![] };
        let text = images_csv(&["x/a \"1\", b.jpg".into()], &measured);
        assert_eq!(text.lines().nth(1), Some("1,\"a \"\"1\"\", b.jpg\",400.500,300.250,180.0000"));
    }
}
