//! Hints: at which other heading, scale or layer a frame matches that was not located. A hint is never a fix: it says which
//! statement of the request to check.

use super::answer::{Answer, Fix};
use super::cancellation::CancellationToken;
use super::epochs::searched_layers;
use super::error::LocateError;
use super::locate_frame::locate_cancellable;
use super::request::{FixRequest, HeadingPrior};
use overfly_core::camera::{Camera, Height, View};
use overfly_core::pixels::Gray;
use overfly_store::Reader;
use std::f64::consts::TAU;
use std::time::Duration;

/// Metres in a foot.
const FOOT_M: f64 = 0.3048;
/// Metres in a kilometre.
const KILOMETRE_M: f64 = 1000.0;
/// Heights below this, metres, are taken for kilometres too.
const MOST_KILOMETRES: f64 = 30.0;
/// The scales that are tried, as ratios to the stated one: steps of a factor of 1.26 cover half to twice with their standard
/// deviation. Large ones first: they are searched faster.
const SCALES: [f64; 6] = [1.26, 1.59, 2.0, 0.79, 0.63, 0.5];
/// One trial takes at most this part of the time limit.
const TRIAL_SHARE: u32 = 4;
/// The standard deviation of a scale that is tried, as a ratio.
const SCALE_SIGMA: f64 = 0.06;

/// A change of the request with which the frame matches.
#[derive(Debug, Clone, PartialEq)]
pub enum Hint {
    /// The stated heading is right in radians.
    HeadingInRadians {
        /// The stated heading, as degrees.
        stated_deg: f64,
        /// The heading that matches, degrees.
        heading_deg: f64,
    },
    /// Another heading matches.
    Heading {
        /// The stated heading, degrees.
        stated_deg: f64,
        /// The heading that matches, degrees.
        heading_deg: f64,
    },
    /// The stated height is right in feet.
    HeightInFeet {
        /// The stated height, as metres.
        stated_m: f64,
        /// The height that matches, metres.
        height_m: f64,
    },
    /// The stated height is right in kilometres.
    HeightInKilometres {
        /// The stated height, as metres.
        stated_m: f64,
        /// The height that matches, metres.
        height_m: f64,
    },
    /// The stated ground sample distance is right in feet.
    GsdInFeet {
        /// The stated ground sample distance, as metres per pixel.
        stated_m_per_px: f64,
        /// The one that matches, metres per pixel.
        gsd_m_per_px: f64,
    },
    /// Another scale matches.
    Scale {
        /// The scale that matches over the stated one: the height, or the ground sample distance.
        ratio: f64,
    },
    /// The frame matches in another layer.
    Layer {
        /// The layer.
        layer: String,
        /// Date of its imagery there, if known.
        map_epoch: Option<String>,
    },
}

impl Hint {
    /// The hint in words. `spell` gives the name of a parameter as the caller's users know it.
    pub fn message(&self, spell: impl Fn(&str) -> String) -> String {
        match self {
            Self::HeadingInRadians { stated_deg, heading_deg } => {
                let name = spell("heading_deg");
                format!("matches at heading {heading_deg:.1}, not {stated_deg}: {name} looks like radians")
            }
            Self::Heading { stated_deg, heading_deg } => {
                let name = spell("heading_deg");
                format!("matches at heading {heading_deg:.1}, not {stated_deg:.1}: check {name}")
            }
            Self::HeightInFeet { stated_m, height_m } => {
                let name = spell("height_m");
                format!(
                    "matches at a height of {height_m:.0} m, not {stated_m:.0} m: {name} looks like feet (ratio 3.28)"
                )
            }
            Self::HeightInKilometres { stated_m, height_m } => {
                let name = spell("height_m");
                format!("matches at a height of {height_m:.0} m, not {stated_m} m: {name} looks like kilometres")
            }
            Self::GsdInFeet { stated_m_per_px, gsd_m_per_px } => {
                let name = spell("gsd_m_per_px");
                format!("matches at {gsd_m_per_px:.2} m/px, not {stated_m_per_px}: {name} looks like feet (ratio 3.28)")
            }
            Self::Scale { ratio } => {
                let (height, gsd) = (spell("height_m"), spell("gsd_m_per_px"));
                format!("matches at {ratio:.2} times the stated scale: check {height} and camera, or {gsd}")
            }
            Self::Layer { layer, map_epoch } => {
                let date = map_epoch.as_ref().map_or(String::new(), |date| format!(", of {date}"));
                format!("matches in the layer {layer}{date}: try {} {layer}", spell("layer"))
            }
        }
    }
}

/// The hints that were found.
#[derive(Debug, Clone, PartialEq)]
pub struct Hints {
    /// The hints, the likeliest confusion first.
    pub found: Vec<Hint>,
    /// Whether the search came to its end; otherwise its time was up, or it was cancelled.
    pub is_complete: bool,
}

/// Searches for hints about a request that gave no fix, until `limit` has passed or `cancellation` is cancelled: first what people
/// confuse most often. The search ends within about a second after its time is up.
///
/// # Errors
/// [`LocateError`] where the request or the store cannot be used.
pub fn hints(
    store: &Reader,
    frame: &Gray,
    request: &FixRequest,
    threads: usize,
    limit: Duration,
    cancellation: &CancellationToken,
) -> Result<Hints, LocateError> {
    let whole = cancellation.child_within(limit);
    let mut hints = Hints { found: Vec::new(), is_complete: true };
    for trial in trials(store, request) {
        if whole.is_cancelled() {
            hints.is_complete = false;
            break;
        }
        if trial.is_scale() && hints.found.iter().any(|hint| matches!(hint, Hint::Scale { .. })) {
            continue;
        }
        let part = whole.child_within(limit / TRIAL_SHARE);
        let fix = match locate_cancellable(store, frame, &trial.request, threads, &part) {
            Ok(Answer::Fix(fix)) => fix,
            Err(error @ LocateError::Store(_)) => return Err(error),
            Err(LocateError::Cancelled) => {
                hints.is_complete = false;
                continue;
            }
            // A scale or a layer that cannot be searched gives no hint.
            Ok(Answer::NoFix(_)) | Err(_) => continue,
        };
        let hint = trial.hint(request, frame, &fix);
        // The confusion of a heading or a unit explains everything.
        let explains = !matches!(hint, Hint::Scale { .. } | Hint::Layer { .. });
        hints.found.push(hint);
        if explains {
            break;
        }
    }
    Ok(hints)
}

/// A changed request.
struct Trial {
    request: FixRequest,
    change: Change,
}

/// What is changed.
enum Change {
    Radians(f64),
    AnyHeading(f64),
    HeightUnit { stated_m: f64, unit_m: f64 },
    GsdInFeet(f64),
    Scale,
    Layer,
}

impl Trial {
    fn is_scale(&self) -> bool {
        matches!(self.change, Change::Scale)
    }

    fn hint(&self, stated: &FixRequest, frame: &Gray, fix: &Fix) -> Hint {
        let heading_deg = fix.heading.degrees();
        match self.change {
            Change::Radians(stated_deg) => Hint::HeadingInRadians { stated_deg, heading_deg },
            Change::AnyHeading(stated_deg) => Hint::Heading { stated_deg, heading_deg },
            Change::HeightUnit { stated_m, unit_m } if unit_m < 1.0 => {
                Hint::HeightInFeet { stated_m, height_m: stated_m * unit_m }
            }
            Change::HeightUnit { stated_m, unit_m } => {
                Hint::HeightInKilometres { stated_m, height_m: stated_m * unit_m }
            }
            Change::GsdInFeet(stated_m_per_px) => {
                Hint::GsdInFeet { stated_m_per_px, gsd_m_per_px: stated_m_per_px * FOOT_M }
            }
            Change::Scale => Hint::Scale { ratio: fix.gsd_m_per_px / gsd_m_per_px(&stated.view, frame) },
            Change::Layer => Hint::Layer { layer: self.request.layer.clone(), map_epoch: fix.map_epoch.clone() },
        }
    }
}

/// The requests that are tried, the likeliest confusion first.
fn trials(store: &Reader, request: &FixRequest) -> Vec<Trial> {
    let mut trials = Vec::new();
    let scaled = |ratio: f64| FixRequest {
        view: scaled_view(request.view.clone(), ratio),
        scale_sigma_ratio: request.scale_sigma_ratio.max(SCALE_SIGMA),
        ..request.clone()
    };
    if let Some(heading) = request.heading {
        let stated_deg = heading.heading_rad.to_degrees();
        if (0.0..TAU).contains(&stated_deg) {
            let heading = Some(HeadingPrior { heading_rad: stated_deg, ..heading });
            trials.push(Trial {
                request: FixRequest { heading, ..request.clone() },
                change: Change::Radians(stated_deg),
            });
        }
    }
    trials
        .extend(other_units(&request.view).into_iter().map(|(ratio, change)| Trial { request: scaled(ratio), change }));
    if let Some(heading) = request.heading {
        let stated_deg = heading.heading_rad.to_degrees();
        let request = FixRequest { heading: None, ..request.clone() };
        trials.push(Trial { request, change: Change::AnyHeading(stated_deg) });
    }
    let searched = searched_layers(store, &request.layer).unwrap_or_default();
    for layer in store.imagery_layers().filter(|layer| !searched.iter().any(|s| s.name == layer.name)) {
        let request = FixRequest { layer: layer.name.clone(), ..request.clone() };
        trials.push(Trial { request, change: Change::Layer });
    }
    trials.extend(SCALES.map(|ratio| Trial { request: scaled(ratio), change: Change::Scale }));
    trials
}

/// The units that people confuse with metres: the ratio to the stated scale, and what is changed.
fn other_units(view: &View) -> Vec<(f64, Change)> {
    match *view {
        View::Nadir { gsd_m_per_px } => vec![(FOOT_M, Change::GsdInFeet(gsd_m_per_px))],
        View::Posed { height: Height::AboveGround(stated_m) | Height::AboveDatum(_, stated_m), .. } => {
            let feet = (FOOT_M, Change::HeightUnit { stated_m, unit_m: FOOT_M });
            let kilometres = (KILOMETRE_M, Change::HeightUnit { stated_m, unit_m: KILOMETRE_M });
            // A few metres are no height of a flight.
            if stated_m < MOST_KILOMETRES { vec![kilometres, feet] } else { vec![feet] }
        }
    }
}

fn scaled_view(view: View, ratio: f64) -> View {
    match view {
        View::Nadir { gsd_m_per_px } => View::Nadir { gsd_m_per_px: gsd_m_per_px * ratio },
        View::Posed { intrinsics, height, attitude } => {
            let height = match height {
                Height::AboveGround(height_m) => Height::AboveGround(height_m * ratio),
                Height::AboveDatum(datum, height_m) => Height::AboveDatum(datum, height_m * ratio),
            };
            View::Posed { intrinsics, height, attitude }
        }
    }
}

/// The ground sample distance that a view states for a frame, metres per pixel.
fn gsd_m_per_px(view: &View, frame: &Gray) -> f64 {
    let camera = Camera::new(view, frame.width_px() as u32, frame.height_px() as u32);
    camera.map_or(f64::NAN, |camera| camera.gsd_m_per_px())
}
