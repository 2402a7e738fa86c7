//! Prints how the present program fares on a flight where it gives few fixes: whether the first coarse peak is right, and how far the
//! small windows lie from the best similarity, in metres, where the place is right.
//!
//! `cargo run --release -p overfly-lab --example window_scatter -- --db map.gpkg --flight DIR --attitude-sigma-deg 8`. The true
//! columns of the flight must be the ground under the image's centre.

use clap::Parser;
use nalgebra::Vector2;
use overfly_core::camera::Camera;
use overfly_core::geodesy::{BodyFrame, Enu, Geodetic, LocalFrame};
use overfly_core::registration::Similarity;
use overfly_core::registration::windows::WindowMatch;
use overfly_flight::frame::read_large_frame;
use overfly_flight::locate::{
    Answer, CameraPose, FixRequest, HeadingPrior, PositionPrior, TracedWindows, locate_traced,
};
use overfly_lab::trial::{RecordedFlight, RecordedFrame};
use overfly_store::Reader;
use std::path::PathBuf;

/// Prints coarse peaks and scatter of windows of a flight.
#[derive(Parser)]
struct Args {
    /// The store.
    #[arg(long)]
    db: PathBuf,
    /// The flight.
    #[arg(long)]
    flight: PathBuf,
    /// One standard deviation of pitch and roll, degrees.
    #[arg(long, default_value_t = 8.0)]
    attitude_sigma_deg: f64,
    /// Half the side of the searched square around the truth, metres.
    #[arg(long, default_value_t = 100.0)]
    prior_error_m: f64,
    /// Greatest error that counts as right, metres.
    #[arg(long, default_value_t = 20.0)]
    right_m: f64,
}

/// Distances from the best similarity whose shares are printed, metres.
const WITHIN_M: [f64; 3] = [0.7, 1.5, 3.0];

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let store = Reader::open(&args.db)?;
    let flight = RecordedFlight::read(&args.flight)?.with_attitude_sigma_rad(args.attitude_sigma_deg.to_radians());
    let (mut peaks, mut places, mut fixes) = (0, 0, 0);
    let (mut own_m, mut best_m) = (Vec::new(), Vec::new());
    for frame in &flight.frames {
        let truth = frame.true_position.ok_or_else(|| anyhow::anyhow!("{} has no truth", frame.image))?;
        let pixels = read_large_frame(&frame.path)?;
        let request = request(&args, &flight, frame, truth);
        let (answer, trace) = locate_traced(&store, &pixels.gray, &request, 2)?;
        let size_px = (pixels.gray.width_px() as u32, pixels.gray.height_px() as u32);
        let camera = Camera::new(&request.view, size_px.0, size_px.1)?;
        let is_right = |pose: CameraPose| centre(&camera, pose).is_some_and(|c| off_m(truth, c) <= args.right_m);
        fixes += i32::from(matches!(answer, Answer::Fix(_)));
        peaks += i32::from(trace.peaks.first().is_some_and(|peak| is_right(peak.pose)));
        let Some(windows) = trace.windows.filter(|w| w.is_found && is_right(w.pose)) else { continue };
        places += 1;
        own_m.extend(from_own_similarity(&windows));
        best_m.extend(from_best_similarity(&windows, WITHIN_M[1]));
    }
    println!("frames     {}", flight.frames.len());
    println!("fixes      {fixes}");
    println!("coarse     the first peak is right in {peaks}; the best place is right in {places}");
    print_scatter("the program's similarity", &own_m);
    print_scatter("the best similarity", &best_m);
    Ok(())
}

fn print_scatter(of: &str, distances_m: &[f64]) {
    let count = distances_m.len().max(1);
    let shares = WITHIN_M.map(|m| {
        let inside = distances_m.iter().filter(|d| **d < m).count();
        format!("{:.2} within {m} m", inside as f64 / count as f64)
    });
    let near: Vec<f64> = distances_m.iter().copied().filter(|d| *d < WITHIN_M[2]).collect();
    let rms_m = (near.iter().map(|d| d * d).sum::<f64>() / near.len().max(1) as f64).sqrt();
    println!(
        "windows    {count}, {} of {of}; those within {} m scatter by {rms_m:.2} m",
        shares.join(", "),
        WITHIN_M[2]
    );
}

fn request(args: &Args, flight: &RecordedFlight, frame: &RecordedFrame, truth: Geodetic) -> FixRequest {
    FixRequest {
        layer: "ortho".into(),
        position: PositionPrior::Square { centre: truth, half_width_m: args.prior_error_m },
        heading: Some(HeadingPrior { heading_rad: frame.heading_rad, sigma_rad: 3f64.to_radians() }),
        view: frame.view(&flight.camera),
        scale_sigma_ratio: 0.03,
        time_s: Some(frame.time_s),
    }
}

/// The ground in the middle of the image under a pose.
fn centre(camera: &Camera, pose: CameraPose) -> Option<Geodetic> {
    let offset = camera.at_height_ratio(pose.height_ratio).image_centre_in_body()?;
    let nadir = pose.nadir.to_geodetic(pose.zoom).ok()?;
    LocalFrame::at(nadir).geodetic_from_enu(BodyFrame::from_heading_rad(pose.heading_rad).enu_from_body(offset)).ok()
}

fn off_m(a: Geodetic, b: Geodetic) -> f64 {
    let Enu { east_m, north_m } = LocalFrame::at(a).enu_from_geodetic(b);
    east_m.hypot(north_m)
}

/// Where a window is in the view and where it was found, pixels.
type Pair = (Vector2<f64>, Vector2<f64>);

fn pairs(traced: &TracedWindows) -> Vec<Pair> {
    let pair = |w: &WindowMatch| (Vector2::from(w.centre_px), Vector2::from(w.centre_px) + w.displacement_px);
    traced.windows.iter().map(pair).collect()
}

fn distances(model: &Similarity, pairs: &[Pair], m_per_px: f64) -> Vec<f64> {
    pairs.iter().map(|(from, to)| (model.apply(*from) - to).norm() * m_per_px).collect()
}

/// How far each window lies from the similarity of those that agree, by least squares, metres.
fn from_own_similarity(traced: &TracedWindows) -> Vec<f64> {
    let pairs = pairs(traced);
    let chosen: Vec<Pair> = traced.inliers.iter().map(|&i| pairs[i]).collect();
    let count = chosen.len().max(1) as f64;
    let (p, q) =
        chosen.iter().fold((Vector2::zeros(), Vector2::zeros()), |(p, q), (a, b)| (p + a / count, q + b / count));
    let (mut c, mut s, mut square) = (0.0, 0.0, 1e-9);
    for (from, to) in &chosen {
        let (a, b) = (from - p, to - q);
        c += a.dot(&b);
        s += a.x * b.y - a.y * b.x;
        square += a.norm_squared();
    }
    let model = Similarity::about(c / square, s / square, p, q);
    distances(&model, &pairs, traced.observation.gsd.mean_m_per_px())
}

/// How far each window lies from the similarity through two of them that has most windows within a distance, metres.
fn from_best_similarity(traced: &TracedWindows, within_m: f64) -> Vec<f64> {
    let m_per_px = traced.observation.gsd.mean_m_per_px();
    let pairs = pairs(traced);
    let mut best = (0, Vec::new());
    for (i, a) in pairs.iter().enumerate() {
        for b in &pairs[..i] {
            let Some(model) = Similarity::through([a.0, b.0], [a.1, b.1]) else { continue };
            if (model.scale() - 1.0).abs() > 0.1 || model.rotation_rad().abs() > 0.1 {
                continue;
            }
            let distances_m = distances(&model, &pairs, m_per_px);
            let count = distances_m.iter().filter(|d| **d < within_m).count();
            if count > best.0 {
                best = (count, distances_m);
            }
        }
    }
    best.1
}
