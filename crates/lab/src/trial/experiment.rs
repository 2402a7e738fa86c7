//! `Experiment`: the paper's section V.D, repeated: which of its laws hold here, and its values beside the measured
//! ones.

use super::csv_file::{Decimals, csv_text};
use super::drift_curve::{DRIFT_BOUND_PX, DriftCurve};
use super::error::TrialError;
use super::relative_cost::{CutImage, OVERLAPS_PERCENT, RelativeMeasurement, RelativeTrial};
use super::relative_laws::{DescriptorRow, RelativeLaws};
use super::relative_sample::RelativeSample;
use overfly_core::coupling::{
    PAPER_DRIFT_MATCHES, PAPER_GSD_M_PER_PX, PAPER_LOAD_S, PAPER_SECONDS_PER_DESCRIPTOR, PROBABLE_LOAD_S,
    PixelDriftLaw, fit_power, fit_power_above, r_squared,
};
use serde::Serialize;
use std::path::PathBuf;

/// The summary of `overfly experiment`, as JSON spells it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Experiment {
    /// Number of images.
    pub images: usize,
    /// Number of photos or orthophotos they were cut from.
    pub photos: usize,
    /// Pairs of an image and a view ahead of it.
    pub pairs: usize,
    /// Edge of images and views, pixels.
    pub edge_px: usize,
    /// Descriptor limits. Each pair was registered with each limit.
    pub limits: Vec<usize>,
    /// Runs of each step.
    pub repeats: usize,
    /// Seed of images, pairs and noise.
    pub seed: u64,
    /// Number of registrations: pairs times descriptor limits.
    pub registrations: usize,
    /// Registrations that the program would have accepted.
    pub registered: usize,
    /// Accepted registrations with an error of more than a pixel.
    #[serde(rename = "false")]
    pub wrong: usize,
    /// Results by overlap, greatest first.
    pub by_overlap: Vec<OverlapRow>,
    /// The laws of figures 12 to 15 and of (45), and whether they hold.
    pub shapes: Vec<Shape>,
    /// Whether the laws of all four figures hold.
    pub figures_reproduced: bool,
    /// The fitted laws, and the registrations they were fitted to.
    pub laws: RelativeLaws,
    /// The figures that the paper prints.
    pub paper: PaperFigures,
}

/// The pairs of one overlap.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OverlapRow {
    /// Share of the ground that both views show, per cent.
    pub overlap_percent: f64,
    /// Number of pairs.
    pub pairs: usize,
    /// Registered pairs for each descriptor limit.
    pub registered: Vec<usize>,
    /// Registrations with an error of more than a pixel, for all descriptor limits together.
    #[serde(rename = "false")]
    pub wrong: usize,
}

/// What the paper prints about its own machine and images (section V.D). Its text does not state t0, B and t_c.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PaperFigures {
    /// Number of images.
    pub images: usize,
    /// Number of pairs.
    pub pairs: usize,
    /// A_c, seconds.
    pub seconds_per_descriptor: f64,
    /// L as printed, seconds.
    pub load_s: f64,
    /// L as probably meant, seconds.
    pub probable_load_s: f64,
    /// The drift of one metre that the paper discusses, pixels.
    pub drift_px: f64,
    /// Matches that the paper needs for less drift.
    pub matches_needed: f64,
    /// The law 1 / sqrt(n) through that point.
    pub drift_law: PixelDriftLaw,
}

/// A law of the paper, and whether the measurements follow it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Shape {
    /// The paper's figure; none for (45).
    pub figure: Option<u8>,
    /// The law.
    pub law: &'static str,
    /// Share of the variance that the law explains: of the medians of each descriptor limit; for drift, of the bins'
    /// log10.
    pub r2: Option<f64>,
    /// The same for single registrations, disturbances of the machine included; absent for drift.
    pub r2_of_registrations: Option<f64>,
    /// The power with which the quantity grows by the law.
    pub expected_power: Option<f64>,
    /// The best-fitting power.
    pub power: Option<f64>,
    /// Spearman's rank correlation of matches and drift; absent for times.
    pub rank_correlation: Option<f64>,
    /// The condition that was tested.
    pub test: &'static str,
    /// Whether it holds.
    pub holds: bool,
}

const LEAST_R2: f64 = 0.95;
const POWER_TOLERANCE: f64 = 0.25;
const TIME_TEST: &str = "R2 of the medians at least 0.95, and the best power within 0.25 of the law's";
const TOTAL_TEST: &str = "R2 of the medians at least 0.95";
const DRIFT_TEST: &str = "best power at most -0.25, and rank correlation of matches and drift at most -0.5";

impl Experiment {
    /// Compares the measurement with the paper's laws.
    ///
    /// # Errors
    /// [`TrialError::Option`] if no pair was registered.
    pub fn from_measurement(trial: &RelativeTrial, measured: &RelativeMeasurement) -> Result<Self, TrialError> {
        let samples = &measured.samples;
        let laws = RelativeLaws::fit(samples)?;
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
            by_overlap: OVERLAPS_PERCENT
                .iter()
                .map(|&overlap| OverlapRow::from_samples(overlap, &laws.rows, samples))
                .collect(),
            figures_reproduced: shapes.iter().all(|shape| shape.figure.is_none() || shape.holds),
            shapes,
            laws,
            paper: PaperFigures::PRINTED,
        })
    }
}

impl OverlapRow {
    fn from_samples(overlap_percent: f64, rows: &[DescriptorRow], samples: &[RelativeSample]) -> Self {
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
    /// The printed values. The drift law is that of section III through the one printed point.
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

/// The laws of figures 12 to 14, of the sum (45), and of figure 15.
fn shapes(laws: &RelativeLaws, samples: &[RelativeSample]) -> Vec<Shape> {
    let cost = laws.relative;
    let time = |figure, law, expected_power: f64, model: &dyn Fn(f64) -> f64, of: TimeOfStep| {
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
            TimeOfStep { of_row: |r| Some(r.times.loading_s), of_sample: |s| Some(s.times.loading_s) },
        ),
        time(
            13,
            "t_m = t0 N^2 (43)",
            2.0,
            &matching,
            TimeOfStep { of_row: |r| Some(r.times.matching_s), of_sample: |s| Some(s.times.matching_s) },
        ),
        time(
            14,
            "t_tau = B N (44)",
            1.0,
            &threshold,
            TimeOfStep { of_row: |r| Some(r.times.threshold_s), of_sample: |s| Some(s.times.threshold_s) },
        ),
        total(laws, samples, &|n| loading(n) + matching(n) + threshold(n) + cost.estimate_s),
        drift(&laws.keypoints),
    ]
}

/// Access to the time of one step.
struct TimeOfStep {
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

/// The law of figure 15, for keypoints alone, as the paper registers.
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

/// A row of `images.csv`.
#[derive(Serialize, Default)]
struct ImageRow {
    image: usize,
    photo: String,
    centre_x_px: Decimals<3>,
    centre_y_px: Decimals<3>,
    turn_deg: Decimals<4>,
}

/// The places of the images as CSV, a row each: the name of the photo, the centre on the photo, and how the image is turned.
pub fn images_csv(photos: &[PathBuf], measured: &RelativeMeasurement) -> String {
    let row = |(i, image): (usize, &CutImage)| {
        let [x, y] = image.place.centre_px;
        ImageRow {
            image: i + 1,
            photo: photos[image.photo].file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned()),
            centre_x_px: Decimals(x),
            centre_y_px: Decimals(y),
            turn_deg: Decimals(image.place.heading_rad.to_degrees()),
        }
    };
    csv_text(measured.images.iter().enumerate().map(row))
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

    /// Registrations that follow every law.
    fn lawful() -> Vec<RelativeSample> {
        [(75, 4), (150, 12), (300, 40), (600, 110), (1200, 250), (2400, 600)]
            .map(|(limit, n)| sample(limit, limit as f64, n, 0.4 / (n as f64).sqrt()))
            .to_vec()
    }

    fn judged(samples: Vec<RelativeSample>) -> Experiment {
        Experiment::from_measurement(&trial(), &RelativeMeasurement { images: vec![], samples }).unwrap()
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
            |s| s.drifts = super::super::relative_sample::Drifts { drift_px: Some(0.1), keypoint_drift_px: Some(0.1) },
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
        assert!((law.pair_drift_px * PAPER_GSD_M_PER_PX - DriftLaw::from_paper().pair_drift_m).abs() < 1e-9);
        assert!((law.drift_px(PAPER_DRIFT_MATCHES) - DRIFT_BOUND_PX).abs() < 1e-12);
    }

    #[test]
    fn places_are_told_with_their_photo() {
        let image = super::super::relative_cost::CutImage {
            photo: 0,
            place: super::super::photo_cuts::ImagePlacement {
                centre_px: [400.5, 300.25],
                heading_rad: std::f64::consts::PI,
            },
            picture: overfly_core::pixels::Gray::filled(1, 1, 0.0),
        };
        let measured = RelativeMeasurement { images: vec![image], samples: vec![] };
        let text = images_csv(&["x/a \"1\", b.jpg".into()], &measured);
        assert_eq!(text.lines().nth(1), Some("1,\"a \"\"1\"\", b.jpg\",400.500,300.250,180.0000"));
    }
}
