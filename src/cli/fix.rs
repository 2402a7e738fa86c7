//! `overfly fix`: one absolute registration.

use crate::cli::attitude_note::view_note;
use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::fix_text::text;
use crate::cli::number::{any, metres, positive, risk};
use crate::cli::output::Output;
use crate::cli::outside_map::outside_note;
use crate::cli::pictures::Pictures;
use crate::cli::threads::default_threads;
use crate::cli::viewpoint::Viewpoint;
use crate::server::dto::AnswerJson;
use overfly_core::integrity::DEFAULT_INTEGRITY_RISK;
use overfly_core::pixels::Gray;
use overfly_flight::frame::{ReducedFrame, read_large_frame};
use overfly_flight::locate::candidates::CandidatesError;
use overfly_flight::locate::{
    Answer, CancellationToken, FixParameters, FixRequest, Hints, Reason, ViewParameters, hints, locate, locate_traced,
    requested_layer,
};
use overfly_store::Reader;
use std::path::PathBuf;
use std::time::{Duration, Instant};

const HELP: &str = "\
A prior position and heading make the search small and fast. The scale is always needed, either as --gsd-m-per-px or as
--height-m with --camera. The answer is the point straight below the camera with its covariance, or no fix with the
reason (exit code 3). That covariance carries --attitude-sigma-deg: a degree is 17 m at a height of 1000 m. The ground at
the image's centre, which is what registration measures, is reported with its own covariance. With --gsd-m-per-px no height
is known: prior and answer are then the image's centre (position_of: image_centre).

--layer any searches the layers one after the other, the newest first (layers without a date last, those of one date by name), and
an older one only on no fix; an ambiguous frame ends the search. The evidence that a fix needs counts all layers of the store, so
with n layers it is log10(n) harder to get. Every answer names its layer, the layer's date and the digest of the store.

Examples:
  overfly fix --db map.gpkg --image frame.jpg --gsd-m-per-px 1.25 --explain
  overfly fix --db map.gpkg --image frame.jpg --latitude-deg 48.4915 --longitude-deg 15.616 --sigma-m 200 \\
      --heading-deg 271.6 --height-m 500 --camera camera.toml --pitch-deg 1.2 --roll-deg 0 --json
  overfly fix --db map.gpkg --image frame.jpg --gsd-m-per-px 1.25 --layer any

camera.toml: width_px, height_px, focal_length_px, principal_point_px = [x, y], distortion = [k1, k2, p1, p2, k3] (the
OpenCV model; pixels are counted from the image's upper-left corner).";

/// Arguments.
#[derive(clap::Args)]
#[command(allow_negative_numbers = true, after_help = HELP)]
pub struct Args {
    /// The store.
    #[arg(long, value_name = "FILE")]
    db: PathBuf,
    /// The frame: PNG, JPEG or WebP.
    #[arg(long, value_name = "FILE")]
    image: PathBuf,
    /// Which layer; any: all layers, the newest first [default: the only one, or ortho].
    #[arg(long, value_name = "NAME")]
    layer: Option<String>,
    /// Most likely latitude of the point straight below the camera, in [-85.051128, 85.051128]; without a position, the whole layer is searched.
    #[arg(long, value_name = "DEG", value_parser = any, requires_all = ["longitude_deg", "sigma_m"])]
    latitude_deg: Option<f64>,
    /// Most likely longitude of that point, in [-180, 180].
    #[arg(long, value_name = "DEG", value_parser = any, requires_all = ["latitude_deg", "sigma_m"])]
    longitude_deg: Option<f64>,
    /// One standard deviation of that position per axis, metres in [0.001, 1e7].
    #[arg(long, value_name = "M", value_parser = metres, requires = "latitude_deg")]
    sigma_m: Option<f64>,
    /// Direction of the image's upper edge, degrees clockwise from true north, in [0, 360); without it, all headings are searched.
    #[arg(long, value_name = "DEG", value_parser = any)]
    heading_deg: Option<f64>,
    /// One standard deviation of the heading, degrees in (0, 180].
    #[arg(long, value_name = "DEG", value_parser = any, default_value_t = 3.0, requires = "heading_deg")]
    heading_sigma_deg: f64,
    #[command(flatten)]
    viewpoint: Viewpoint,
    /// Instead of --height-m: height above mean sea level (EGM2008), metres; requires --camera, and a store with terrain.
    #[arg(long, value_name = "M", value_parser = any, conflicts_with_all = ["height_m", "gsd_m_per_px"], requires = "camera")]
    height_msl_m: Option<f64>,
    /// Instead of --height-m: height above the WGS84 ellipsoid, metres; requires --camera, and a store with terrain.
    #[arg(long, value_name = "M", value_parser = any, conflicts_with_all = ["height_m", "gsd_m_per_px", "height_msl_m"], requires = "camera")]
    height_ellipsoidal_m: Option<f64>,
    /// One standard deviation of the height or ground sample distance, as a ratio in (0, 0.3]: 0.03 is 3 %.
    #[arg(long, value_name = "RATIO", value_parser = any, default_value_t = 0.03)]
    height_sigma_ratio: f64,
    /// Integrity risk of the protection level: the probability with which the error may exceed it without warning.
    #[arg(long, value_name = "P", value_parser = risk, default_value_t = DEFAULT_INTEGRITY_RISK)]
    integrity_risk: f64,
    /// When the image was taken, seconds of any clock; repeated in the answer.
    #[arg(long, value_name = "S", value_parser = any)]
    time_s: Option<f64>,
    /// On no fix, search on for what was stated wrongly: heading, scale or layer. The hints are no fix, and the exit code stays 3.
    #[arg(long)]
    explain: bool,
    /// Search for hints for at most so many seconds.
    #[arg(long, value_name = "S", value_parser = positive, default_value_t = 10.0, requires = "explain")]
    explain_limit_s: f64,
    #[command(flatten)]
    pictures: Pictures,
    /// Threads to search with.
    #[arg(long, value_name = "N", default_value_t = default_threads())]
    threads: std::num::NonZeroUsize,
}

/// Runs the command; exit code 3 if there is no fix.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let parameters = args.parameters()?;
    let ReducedFrame { gray: frame, reduction } = read_large_frame(&args.image)?;
    let store = Reader::open(&args.db).map_err(Failure::of_crew)?;
    let layer = requested_layer(&store, args.layer.as_deref()).map_err(not_requested)?;
    let mut request = parameters.request(&layer)?;
    request.view = request.view.reduced(reduction);
    output.note(&view_note(&request.view));
    let (start, threads) = (Instant::now(), args.threads.get());
    let (answer, trace) = if args.pictures.are_requested() {
        locate_traced(&store, &frame, &request, threads).map(|(answer, trace)| (answer, Some(trace)))?
    } else {
        (locate(&store, &frame, &request, threads)?, None)
    };
    let elapsed_ms = start.elapsed().as_micros() as f64 / 1e3;
    let answer = answer.for_original(reduction);
    if let Some(trace) = &trace {
        let traced = FixRequest { layer: answer.map().layer.clone(), ..request.clone() };
        args.pictures.write(&store, &args.image, &traced, &answer, trace, output)?;
    }
    if let (Answer::NoFix(none), Some(latitude_deg), Some(longitude_deg)) =
        (&answer, args.latitude_deg, args.longitude_deg)
        && none.reason == Reason::OutsideMap
    {
        output.note(&outside_note(store.layer(&none.map.layer)?, latitude_deg, longitude_deg));
    }
    let hints = args.hints(&store, &frame, &request, &answer)?;
    let line = AnswerJson::new(answer.clone(), elapsed_ms, args.integrity_risk).with_hints(hints.clone(), flag);
    output.say(&line, || text(&answer, elapsed_ms, args.integrity_risk) + &hints_text(hints.as_ref()));
    Ok(if matches!(answer, Answer::Fix(_)) { Exit::Done } else { Exit::NoFix })
}

/// Why no layer can be searched, and, where none is named among several, that all can be.
fn not_requested(error: CandidatesError) -> Failure {
    let remedy = matches!(error, CandidatesError::LayerNotStated { .. })
        .then_some("name one with --layer, or search all of them, the newest first, with --layer any");
    let failure = Failure::from(error);
    if remedy.is_some() { failure.with_remedy(remedy) } else { failure }
}

/// A parameter as the flag that states it.
fn flag(parameter: &str) -> String {
    format!("--{}", parameter.replace('_', "-"))
}

fn hints_text(hints: Option<&Hints>) -> String {
    match hints {
        None => String::new(),
        Some(Hints { found, is_complete }) if found.is_empty() => {
            let limited = if *is_complete { "" } else { ", as far as the time allowed" };
            format!(
                "\nhint       none: no other heading, unit or layer matches, and no scale from half to twice the stated one{limited}"
            )
        }
        Some(hints) => hints.found.iter().map(|hint| format!("\nhint       {}", hint.message(flag))).collect(),
    }
}

impl Args {
    /// The hints, if they are asked for and there is no fix.
    fn hints(
        &self,
        store: &Reader,
        frame: &Gray,
        request: &FixRequest,
        answer: &Answer,
    ) -> Result<Option<Hints>, Failure> {
        if !self.explain || matches!(answer, Answer::Fix(_)) {
            return Ok(None);
        }
        let limit = Duration::try_from_secs_f64(self.explain_limit_s).unwrap_or(Duration::MAX);
        Ok(Some(hints(store, frame, request, self.threads.get(), limit, &CancellationToken::new())?))
    }

    /// The flags as the library takes them; the library checks the values.
    fn parameters(&self) -> Result<FixParameters, Failure> {
        let view = ViewParameters {
            height_msl_m: self.height_msl_m,
            height_ellipsoidal_m: self.height_ellipsoidal_m,
            ..self.viewpoint.parameters()?
        };
        let heights = [view.height_m, view.height_msl_m, view.height_ellipsoidal_m];
        if view.gsd_m_per_px.is_none() && heights.iter().all(Option::is_none) {
            let reason = "state how large a pixel is on the ground: --gsd-m-per-px, or --height-m with --camera; over a store with terrain also --height-msl-m";
            return Err(Failure::unusable("no_scale", anyhow::anyhow!(reason)));
        }
        Ok(FixParameters {
            latitude_deg: self.latitude_deg,
            longitude_deg: self.longitude_deg,
            sigma_m: self.sigma_m,
            heading_deg: self.heading_deg,
            heading_sigma_deg: self.heading_deg.map(|_| self.heading_sigma_deg),
            view,
            height_sigma_ratio: Some(self.height_sigma_ratio),
            time_s: self.time_s,
            ..FixParameters::default()
        })
    }
}
