//! `overfly experiment`: the experiment of the paper's section V.D on other photos or orthophotos.

use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::folder::make_folder;
use crate::cli::lab::relative::{laws_text, measure};
use crate::cli::number;
use crate::cli::output::Output;
use overfly_lab::report::{experiment_html, relative_cost_svgs};
use overfly_lab::trial::{DriftCurve, Experiment, RelativeMeasurement, RelativeTrial, Shape, images_csv, samples_csv};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

const HELP: &str = "\
The paper took 72 images of 512 x 512 px and made 320 pairs from them, 64 at each of five overlaps. This command does the same: it cuts
72 images from the photos (PNG, JPEG, WebP, GeoTIFF), equally many from each, far apart and rotated at random. A pair consists of an
image and a view ahead of it that shares 95, 50, 35, 25 or 10 % of it, rotated by up to 8 degrees, with independent noise; the motion
between the two is known exactly. The first 64 images give the pairs of the first overlap, the next 64 (cyclically) those of the second,
and so on, so that each image gives four or five pairs.

Each pair is registered with at most 75, 150, 300, 600, 1200 and 2400 descriptors. Figures 12 to 15 show the times of loading (42),
matching (43) and thresholding (44) against descriptors, and drift against matches, with the fitted laws beside the paper's. A figure is
reproduced if its law passes the test that is printed with it.

Times are medians on one thread. Nothing else should run on the machine meanwhile: a law of times can fail on a busy machine. Drift is
measured between views of one photo: relief, lens distortion and height errors are not included.

DIR gets experiment.html, summary.json, samples.csv (one row per registration), images.csv (the place of each image) and the plots
(svg). Except for the times, equal photos and seeds give equal files.

Examples:
  overfly experiment photos/*.JPG --out experiment
  overfly experiment ortho.tif --images 9 --pairs 8 --out experiment --json";

/// Arguments of `experiment`.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    /// Photos or orthophotos to cut images from, each at least two and a half images wide and high.
    #[arg(value_name = "PHOTO", required = true)]
    photos: Vec<PathBuf>,
    /// Write the page, the tables and the plots here.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Number of images, at most 2000 [default: 72].
    #[arg(long, value_name = "N")]
    images: Option<NonZeroUsize>,
    /// Pairs for each overlap, at most one per image [default: 64].
    #[arg(long, value_name = "N")]
    pairs: Option<NonZeroUsize>,
    /// Edge of the square images, pixels.
    #[arg(long, value_name = "PX", default_value_t = NonZeroUsize::new(512).expect("not zero"))]
    edge_px: NonZeroUsize,
    /// Sample values shown as black and white, for GeoTIFFs of more than 8 bits.
    #[arg(long, value_name = "LO,HI", value_parser = number::stretch, allow_hyphen_values = true)]
    stretch: Option<(f64, f64)>,
    /// Seed for images, pairs and noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Use 9 images, 8 pairs for each overlap and few runs, for a first look and for tests.
    #[arg(long)]
    quick: bool,
}

/// Runs the command. A law that does not hold is a result, not a failure.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let or = |given: Option<NonZeroUsize>, quick: usize, whole: usize| {
        given.map_or(if args.quick { quick } else { whole }, NonZeroUsize::get)
    };
    let trial = RelativeTrial {
        photos: args.photos.clone(),
        stretch: args.stretch,
        images: or(args.images, 9, 72),
        pairs: or(args.pairs, 8, 64),
        limits: if args.quick { vec![75, 300, 600, 2400] } else { vec![75, 150, 300, 600, 1200, 2400] },
        repeats: if args.quick { 1 } else { 5 },
        edge_px: args.edge_px.get(),
        seed: args.seed,
    };
    make_folder(&args.out)?;
    let measured = measure(&trial, output)?;
    let found = Experiment::from_measurement(&trial, &measured)?;
    write(&args.out, &trial, &measured, &found, output)?;
    output.say(&found, || text(&found));
    Ok(Exit::Done)
}

fn write(
    folder: &Path,
    trial: &RelativeTrial,
    measured: &RelativeMeasurement,
    found: &Experiment,
    output: &Output,
) -> Result<(), Failure> {
    output.write(&folder.join("samples.csv"), samples_csv(&measured.samples).as_bytes())?;
    output.write(&folder.join("images.csv"), images_csv(&trial.photos, measured).as_bytes())?;
    for (name, plot) in relative_cost_svgs(&found.laws, &measured.samples) {
        output.write(&folder.join(format!("{name}.svg")), plot.as_bytes())?;
    }
    let json = serde_json::to_string_pretty(found).expect("results serialise");
    output.write(&folder.join("summary.json"), json.as_bytes())?;
    let sources = match found.photos {
        1 => "one photo or orthophoto".to_owned(),
        n => format!("{n} photos or orthophotos"),
    };
    output.write(&folder.join("experiment.html"), experiment_html(found, measured, &sources).as_bytes())
}

/// The summary as text.
fn text(found: &Experiment) -> String {
    let mut text = format!(
        "images     {} of {1} x {1} px from {2} photos, {3} pairs, {4} registrations\n\
         registered {5}, of them {6} off by more than a pixel\n{7}\n\n\
         the paper  A_c {8:.0} us, L {9:.0} us as printed (probably ms); the paper states no t0, B and t_c\n\n",
        found.images,
        found.edge_px,
        found.photos,
        found.pairs,
        found.registrations,
        found.registered,
        found.wrong,
        laws_text(&found.laws),
        1e6 * found.paper.seconds_per_descriptor,
        1e6 * found.paper.load_s,
    );
    found.shapes.iter().for_each(|shape| text.push_str(&shape_line(shape)));
    let bound = found.paper.drift_px;
    text.push_str(&format!(
        "\n  matches for a drift below {bound:.2} px (the paper: more than {})\n",
        found.paper.matches_needed
    ));
    let curves = [
        ("the program's answers", &found.laws.program),
        ("keypoints alone", &found.laws.keypoints),
        ("keypoints alone, every pair", &found.laws.keypoints_unchecked),
    ];
    curves.iter().for_each(|(name, curve)| text.push_str(&needed_line(name, curve)));
    text.trim_end().to_owned()
}

fn shape_line(shape: &Shape) -> String {
    let figure = shape.figure.map_or("          ".to_owned(), |f| format!("figure {f} "));
    let number = |v: Option<f64>, digits: usize| v.map_or("none".into(), |v| format!("{v:.digits$}"));
    let power = shape.expected_power.map_or(String::new(), |p| format!(", power {} for {p}", number(shape.power, 2)));
    let rank = shape.rank_correlation.map_or(String::new(), |r| format!(", rank correlation {r:.2}"));
    let verdict = if shape.holds { "holds" } else { "does not hold" };
    format!("  {figure} {:<50} {verdict}: R2 {}{power}{rank}\n", shape.law, number(shape.r2, 4))
}

fn needed_line(name: &str, curve: &DriftCurve) -> String {
    let Some(m) = curve.matches_needed else { return format!("  {name:<28} no registration\n") };
    let from = |n: Option<usize>| n.map_or("no count".into(), |n| n.to_string());
    format!(
        "  {name:<28} every registration from {} up ({} of them), every bin from {}, by the law {}; {} of {} have an answer, \
         with {} matches or more\n",
        from(m.by_every_registration),
        m.registrations_from_there,
        from(m.by_bins),
        m.law_in_words(),
        curve.scored,
        curve.tried,
        m.fewest_seen,
    )
}
