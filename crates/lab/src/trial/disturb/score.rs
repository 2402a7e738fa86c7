//! `DisturbanceScore`: fixes of disturbed frames against their truth, by kind.

use super::kind::DisturbanceKind;
use super::trial::DisturbedOutcome;
use overfly_core::geodesy::{CHI_SQUARE_999, CHI_SQUARE_9999, Enu, EnuCovariance};
use overfly_flight::locate::Answer;
use serde::Serialize;

/// The score of a trial of disturbed frames.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DisturbanceScore {
    /// All kinds together.
    pub total: DisturbedKindScore,
    /// Each kind.
    pub by_kind: Vec<DisturbedKindScore>,
    /// Greatest error of a right fix at the image's centre, metres.
    pub right_m: f64,
}

/// The score of one kind.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DisturbedKindScore {
    /// The kind; `None`: all.
    pub kind: Option<DisturbanceKind>,
    /// Frames.
    pub frames: usize,
    /// Accepted fixes.
    pub fixes: usize,
    /// Accepted fixes whose image's centre lies within `right_m` of the truth, or inside the fix's own 99.99 % ellipse of it.
    pub right: usize,
    /// The other accepted fixes: further off than a right one, and than the fix itself admits.
    #[serde(rename = "false")]
    pub wrong: usize,
    /// Accepted fixes whose nadir has the truth outside its own 99.9 % ellipse.
    pub outside999_nadir: usize,
    /// The same for the image's centre.
    pub outside999_centre: usize,
    /// Median semi-major axis of the 99.9 % ellipse of the nadir, metres.
    pub semi_major_999_nadir_m: Option<f64>,
    /// The same for the image's centre.
    pub semi_major_999_centre_m: Option<f64>,
}

impl DisturbanceScore {
    /// Scores outcomes.
    pub fn from_outcomes(outcomes: &[DisturbedOutcome], kinds: &[DisturbanceKind], right_m: f64) -> Self {
        let all: Vec<&DisturbedOutcome> = outcomes.iter().collect();
        let of = |kind| outcomes.iter().filter(|o| o.kind == kind).collect::<Vec<_>>();
        Self {
            total: DisturbedKindScore::new(None, &all, right_m),
            by_kind: kinds.iter().map(|&kind| DisturbedKindScore::new(Some(kind), &of(kind), right_m)).collect(),
            right_m,
        }
    }
}

impl DisturbedKindScore {
    fn new(kind: Option<DisturbanceKind>, outcomes: &[&DisturbedOutcome], right_m: f64) -> Self {
        let judged: Vec<Judged> = outcomes.iter().filter_map(|o| Judged::new(o)).collect();
        let count = |holds: &dyn Fn(&Judged) -> bool| judged.iter().filter(|j| holds(j)).count();
        let right = count(&|j| j.centre.error.length_m() <= right_m || !j.centre.is_outside(CHI_SQUARE_9999));
        let semi_major = |of: fn(&Judged) -> &JudgedPoint| {
            median(judged.iter().map(|j| CHI_SQUARE_999.sqrt() * of(j).covariance.ellipse().semi_major_m).collect())
        };
        Self {
            kind,
            frames: outcomes.len(),
            fixes: judged.len(),
            right,
            wrong: judged.len() - right,
            outside999_nadir: count(&|j| j.nadir.is_outside(CHI_SQUARE_999)),
            outside999_centre: count(&|j| j.centre.is_outside(CHI_SQUARE_999)),
            semi_major_999_nadir_m: semi_major(|j| &j.nadir),
            semi_major_999_centre_m: semi_major(|j| &j.centre),
        }
    }
}

struct Judged {
    nadir: JudgedPoint,
    centre: JudgedPoint,
}

struct JudgedPoint {
    error: Enu,
    covariance: EnuCovariance,
}

impl JudgedPoint {
    fn is_outside(&self, chi_square: f64) -> bool {
        // Infinite where the covariance is not positive definite; NaN counts as outside.
        let square = self.covariance.squared_mahalanobis(self.error);
        square.is_nan() || square > chi_square
    }
}

impl Judged {
    fn new(outcome: &DisturbedOutcome) -> Option<Self> {
        let (Answer::Fix(fix), Some(errors)) = (&outcome.answer, outcome.errors) else { return None };
        Some(Self {
            nadir: JudgedPoint { error: errors.nadir, covariance: fix.covariance },
            centre: JudgedPoint { error: errors.centre, covariance: fix.image_centre_covariance },
        })
    }
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
