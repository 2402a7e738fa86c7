//! `overfly motion`: one relative registration.

use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::output::Output;
use crate::cli::viewpoint::Viewpoint;
use crate::ground_motion::GroundMotion;
use overfly_core::camera::{Camera, View};
use overfly_core::pixels::Gray;
use overfly_core::registration::relative::{MotionAnswer, MotionPrior, register};
use overfly_flight::frame::read_frame;
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

const HELP: &str = "\
Prints where the centre of B lies on A, in pixels of A, and the rotation and scale between the two. If the scale of A on the
ground is known (--gsd-m-per-px, or --height-m with --camera), also in metres. No map is used. Exit code 3: no motion, with the
reason.

Example:
  overfly motion 019.jpg 020.jpg --gsd-m-per-px 1.25";

/// Arguments.
#[derive(clap::Args)]
#[command(allow_negative_numbers = true, after_help = HELP)]
pub struct Args {
    /// The first frame.
    a: PathBuf,
    /// The second frame, to be located on the first.
    b: PathBuf,
    /// The scale of A; both frames look straight down.
    #[command(flatten)]
    viewpoint: Viewpoint,
}

/// The answer as a JSON line.
#[derive(Serialize)]
struct MotionLine<'a> {
    #[serde(flatten)]
    answer: &'a MotionAnswer,
    #[serde(flatten)]
    metres: Option<GroundMotion>,
    elapsed_ms: f64,
}

/// Runs the command; exit code 3 if the frames cannot be registered.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let view = args.viewpoint.parameters()?.view()?;
    let (a, b) = (read_frame(&args.a)?, read_frame(&args.b)?);
    let gsd_m_per_px = view.map(|view| gsd(&view, &a)).transpose()?;
    let asked = Instant::now();
    let answer = register(&a, &b, &MotionPrior::default());
    let elapsed_ms = asked.elapsed().as_micros() as f64 / 1e3;
    let metres = match (&answer, gsd_m_per_px) {
        (MotionAnswer::Motion(m), Some(gsd)) => Some(GroundMotion::new(m, gsd)),
        _ => None,
    };
    output.say(&MotionLine { answer: &answer, metres, elapsed_ms }, || text(&answer, metres, elapsed_ms));
    Ok(if matches!(answer, MotionAnswer::Motion(_)) { Exit::Done } else { Exit::NoFix })
}

fn gsd(view: &View, frame: &Gray) -> Result<f64, Failure> {
    let size = |n: usize| u32::try_from(n).expect("frames are bounded");
    Camera::new(view, size(frame.width_px()), size(frame.height_px()))
        .map(|camera| camera.gsd_m_per_px())
        .map_err(|e| Failure::unusable(e.code(), e))
}

fn text(answer: &MotionAnswer, metres: Option<GroundMotion>, elapsed_ms: f64) -> String {
    match answer {
        MotionAnswer::Motion(m) => {
            let [x_px, y_px] = m.displacement_px;
            let ground = metres.map_or(String::new(), |g| {
                let (across, along) = (towards(g.right_m, "right", "left"), towards(g.ahead_m, "ahead", "back"));
                format!(
                    "\nground     {:.2} m {}, {:.2} m {}, {:.2} m in all",
                    across.0, across.1, along.0, along.1, g.distance_m
                )
            });
            let (across, along) = (towards(x_px, "right", "left"), towards(y_px, "down", "up"));
            let turn = towards(m.rotation_deg, "clockwise", "counterclockwise");
            format!(
                "motion     {:.3} px {}, {:.3} px {} (the centre of B, seen from the centre of A)\n\
                 rotation   {:.3} degrees {}\nscale      {:.5} pixels of A per pixel of B{ground}\n\
                 evidence   {} of {} matches agree\nelapsed    {elapsed_ms:.0} ms",
                across.0, across.1, along.0, along.1, turn.0, turn.1, m.scale, m.inliers, m.matches,
            )
        }
        MotionAnswer::NoMotion { detail, .. } => format!("no motion  {detail}\nelapsed    {elapsed_ms:.0} ms"),
    }
}

/// The magnitude and the direction of a signed number.
fn towards(value: f64, positive: &'static str, negative: &'static str) -> (f64, &'static str) {
    (value.abs(), if value < 0.0 { negative } else { positive })
}
