//! `overfly motion`: one relative registration.

use super::viewpoint::Viewpoint;
use super::{Exit, Failure, Output};
use overfly::camera::{Camera, View};
use overfly::pixels::Gray;
use overfly::raster::read_frame;
use overfly::registration::relative::{Motion, MotionAnswer, MotionPrior, register};
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

/// Arguments.
#[derive(clap::Args)]
#[command(allow_negative_numbers = true)]
pub struct Args {
    /// The first frame.
    a: PathBuf,
    /// The second frame: where does it lie on the first?
    b: PathBuf,
    /// With a scale, metres are reported as well; both frames looking straight down.
    #[command(flatten)]
    viewpoint: Viewpoint,
}

/// The answer as JSON spells it.
#[derive(Serialize)]
struct Line<'a> {
    #[serde(flatten)]
    answer: &'a MotionAnswer,
    #[serde(flatten)]
    metres: Option<Metres>,
    elapsed_ms: f64,
}

/// A displacement on the ground, in the first frame's own axes.
#[derive(Serialize, Clone, Copy)]
struct Metres {
    /// Ground sample distance of the first frame.
    gsd_m_per_px: f64,
    /// Towards the first frame's right edge.
    right_m: f64,
    /// Towards the first frame's upper edge.
    ahead_m: f64,
    /// Between both image centres.
    distance_m: f64,
}

/// Runs the command; exit code 3 where the frames cannot be registered.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let view = args.viewpoint.view()?;
    let (a, b) = (read_frame(&args.a)?, read_frame(&args.b)?);
    let gsd_m_per_px = view.map(|view| gsd(&view, &a)).transpose()?;
    let asked = Instant::now();
    let answer = register(&a, &b, &MotionPrior::default());
    let elapsed_ms = asked.elapsed().as_secs_f64() * 1e3;
    let metres = match (&answer, gsd_m_per_px) {
        (MotionAnswer::Motion(m), Some(gsd)) => Some(Metres::of(m, gsd)),
        _ => None,
    };
    output.say(&Line { answer: &answer, metres, elapsed_ms }, || text(&answer, metres, elapsed_ms));
    Ok(if matches!(answer, MotionAnswer::Motion(_)) { Exit::Done } else { Exit::NoFix })
}

fn gsd(view: &View, frame: &Gray) -> Result<f64, Failure> {
    let size = |n: usize| u32::try_from(n).expect("frames are bounded");
    Camera::new(view, size(frame.width_px()), size(frame.height_px()))
        .map(|camera| camera.gsd_m_per_px())
        .map_err(|e| Failure::unusable(e.code(), e))
}

impl Metres {
    fn of(motion: &Motion, gsd_m_per_px: f64) -> Self {
        let [x_px, y_px] = motion.displacement_px;
        let (right_m, ahead_m) = (x_px * gsd_m_per_px, -y_px * gsd_m_per_px);
        Self { gsd_m_per_px, right_m, ahead_m, distance_m: right_m.hypot(ahead_m) }
    }
}

fn text(answer: &MotionAnswer, metres: Option<Metres>, elapsed_ms: f64) -> String {
    match answer {
        MotionAnswer::Motion(m) => {
            let [x_px, y_px] = m.displacement_px;
            let ground = metres.map_or(String::new(), |g| {
                format!("\nground     {:.2} m right, {:.2} m ahead, {:.2} m in all", g.right_m, g.ahead_m, g.distance_m)
            });
            format!(
                "motion     {x_px:.3} px right, {y_px:.3} px down\nrotation   {:.3} degrees clockwise\nscale      {:.5}{ground}\n\
                 evidence   {} of {} matches agree\nelapsed    {elapsed_ms:.0} ms",
                m.rotation_rad.to_degrees(),
                m.scale,
                m.inliers,
                m.matches,
            )
        }
        MotionAnswer::NoMotion { reason } => format!("no motion  {reason}\nelapsed    {elapsed_ms:.0} ms"),
    }
}
