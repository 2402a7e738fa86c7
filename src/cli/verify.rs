//! `overfly verify`: checks every hash, the digests, the signature, and the rules of SQLite and GeoPackage.

use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::output::{Output, one_line};
use crate::cli::remedy::spell_for_crew;
use crate::today::today;
use overfly_store::Layer;
use overfly_store::package::{
    Date, Manifest, ManifestRoute, PackageVerification, PublicKey, VerifyOptions, acquisition_day, days_between,
    is_future, verify_package,
};
use std::path::PathBuf;
use std::time::Instant;

const HELP: &str = "\
The first line is the verdict. The next ones say what the file is for: the ends of its route, its last day, the age of its imagery, and
the first digits of its signer's key. Without --key nobody has checked who signed it.

For an exported store, checks the digest of the whole file (every byte counts), the seal, manifest and signature, the last day, and
every footprint. If the file's digest is wrong, with --every-tile, and for a store that is not exported, also checks every tile by
itself, the indexes, and the rules of SQLite and GeoPackage; the first ten damaged tiles are named, and --json lists all.

Exit codes: 0 good, 2 not a store, 3 damaged, cut off or not verified.

Examples:
  overfly verify map.gpkg
  overfly verify flight.gpkg --key ground.key.pub";

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    /// The store.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The public key that must verify the signature (see `overfly keygen`).
    #[arg(long, value_name = "PUB")]
    key: Option<PathBuf>,
    /// Check every tile by itself even if the digest of the whole file is right.
    #[arg(long)]
    every_tile: bool,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let key = args.key.as_deref().map(PublicKey::read).transpose().map_err(Failure::of_crew)?;
    let options = VerifyOptions { key: key.as_ref(), today: today(), every_tile: args.every_tile };
    let start = Instant::now();
    let outcome = output.during("", |tell| verify_package(&args.file, &options, tell));
    let elapsed_s = start.elapsed().as_secs_f64();
    let found = outcome.map_err(|e| {
        let exit = if e.is_unusable_input() { Exit::Unusable } else { Exit::NoFix };
        Failure { exit, ..Failure::of_crew(e) }
    })?;
    let mut json = serde_json::to_value(&found).expect("results serialise");
    json["elapsed_s"] = elapsed_s.into();
    json["signer_checked"] = (found.store.ok && found.signed_by.is_some() && args.key.is_some()).into();
    output.say(&json, || describe(args, &found));
    Ok(if found.store.ok { Exit::Done } else { Exit::NoFix })
}

/// The verdict first, then what the store is for, then what is wrong.
fn describe(args: &Args, found: &PackageVerification) -> String {
    let (file, store) = (args.file.display(), &found.store);
    if store.ok {
        return verify_text(args, found);
    }
    let code = found.code.unwrap_or("damaged_store");
    let remedy = found.remedy.map(|remedy| format!("; {}", spell_for_crew(remedy))).unwrap_or_default();
    let mut text = format!("NOT GOOD: do not fly with {file} [{code}]{remedy}");
    text.push_str(&listed(store.problems.iter().cloned()));
    text.push_str(&listed(store.bad_tiles.iter().enumerate().map(|(index, tile)| {
        let first = if index == 0 { "first wrong: " } else { "" };
        format!("{first}tile {} of layer {}: {}", tile.id, tile.layer, tile.reason)
    })));
    text
}

/// Problems, and bad tiles, that are named one by one; `--json` lists all.
const NAMED: usize = 10;

/// The first of these texts, a line each, and how many more there are.
fn listed(texts: impl ExactSizeIterator<Item = String>) -> String {
    let more = texts.len().saturating_sub(NAMED);
    let mut text: String = texts.take(NAMED).map(|text| format!("\n  {text}")).collect();
    if more > 0 {
        text.push_str(&format!("\n  and {more} more; --json lists all"));
    }
    text
}

/// A good store as the person who loads the aircraft asks about it.
fn verify_text(args: &Args, found: &PackageVerification) -> String {
    let (file, today) = (args.file.display(), today());
    let but = match (&found.manifest, &found.signed_by, &args.key) {
        (Some(_), None, _) => " (NOT signed: anyone may have made this file)",
        (_, Some(_), None) => " (the signer was NOT checked: name the key with --key KEY.pub)",
        _ => "",
    };
    let mut lines = vec![format!("GOOD: {file}{but}")];
    if let Some(manifest) = &found.manifest {
        lines.extend(mission(manifest).map(|mission| format!("mission    {mission}")));
        lines.push(format!("route      {}", route_text(&manifest.route)));
        lines.push(format!("valid      {}", validity(manifest, today)));
    } else {
        lines.push("kind       a map, not an export: it has no route, last day or signature".into());
    }
    let kind = |l: &Layer| if l.terrain.is_some() { "heights" } else { "imagery" };
    let complete = found.layers.iter().filter(|l| l.complete);
    lines.extend(complete.map(|l| format!("{:<10} {}", kind(l), age(l, today))));
    lines.extend(found.manifest.as_ref().map(|manifest| format!("signer     {}", signer(manifest, args))));
    let whole = if found.sealed { ", every byte checked" } else { "" };
    let megabytes = found.bytes as f64 / 1e6;
    lines.push(format!(
        "content    {} tiles, {megabytes:.1} MB{whole}, digest {}",
        found.store.tiles, found.store.digest
    ));
    lines.join("\n")
}

/// Name and serial, where the manifest states either.
fn mission(manifest: &Manifest) -> Option<String> {
    let serial = manifest.serial.map(|serial| format!("serial {serial}"));
    let stated: Vec<String> = manifest.name.as_deref().map(one_line).into_iter().chain(serial).collect();
    (!stated.is_empty()).then(|| stated.join(", "))
}

fn route_text(route: &ManifestRoute) -> String {
    let ends = route.lines_deg.first().and_then(|line| Some((line.first()?, line.last()?)));
    let place = |[longitude_deg, latitude_deg]: &[f64; 2]| format!("{latitude_deg:.4} {longitude_deg:.4}");
    let ends = ends.map_or("none".into(), |(from, to)| format!("from {} to {}", place(from), place(to)));
    let alternates = match route.lines_deg.len() {
        0 | 1 => String::new(),
        lines => format!(", {} alternate(s)", lines - 1),
    };
    let widest = match route.widest_m > route.corridor_m {
        true => format!(", up to {:.0} m", route.widest_m),
        false => String::new(),
    };
    format!("{ends}{alternates}; corridor {:.0} m on each side{widest}", route.corridor_m)
}

fn validity(manifest: &Manifest, today: Date) -> String {
    match manifest.valid_until() {
        None => "on any day".into(),
        Some(last) => match days_between(today, last) {
            0 => format!("until {last}: today is the last day (UTC)"),
            days => format!("until {last}, {days} day{} left", if days == 1 { "" } else { "s" }),
        },
    }
}

fn age(layer: &Layer, today: Date) -> String {
    let name = &layer.name;
    let Some((first, last)) = &layer.acquired else { return format!("{name}, of unknown date") };
    let day = |text: &str| acquisition_day(text);
    let years = |date: Date| days_between(date, today) as f64 / 365.25;
    match (day(first), day(last)) {
        (_, Some(last)) if is_future(last, today) => {
            format!("{name}, of {last}, which is in the FUTURE: the date or the clock is wrong")
        }
        (Some(first), Some(last)) if first == last => format!("{name}, of {first}, {:.1} years old", years(first)),
        (Some(first), Some(last)) => {
            format!("{name}, of {first} to {last}, {:.1} to {:.1} years old", years(last), years(first))
        }
        _ => format!("{name}, of {first} to {last}"),
    }
}

fn signer(manifest: &Manifest, args: &Args) -> String {
    let Some(key) = manifest.signed_by.as_deref().and_then(PublicKey::from_hex) else {
        return "nobody: anyone may have made this file".into();
    };
    match &args.key {
        Some(path) => format!("{}, checked with {}", key.fingerprint(), path.display()),
        None => format!("{}, NOT checked", key.fingerprint()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly_store::package::parse_date;

    #[test]
    fn the_age_of_imagery_is_that_of_its_sources() {
        let layer = |acquired: Option<(&str, &str)>| Layer {
            name: "y2018".into(),
            base_zoom: 14,
            min_zoom: 13,
            base_tiles: 1,
            tiles: 2,
            bounds_deg: [0.0; 4].into(),
            acquired: acquired.map(|(first, last)| (first.into(), last.into())),
            complete: true,
            digest: None,
            terms: Default::default(),
            terrain: None,
        };
        let on = parse_date("2026-07-16").unwrap();
        assert_eq!(age(&layer(None), on), "y2018, of unknown date");
        let one = layer(Some(("2018-07-16", "2018-07-16")));
        assert_eq!(age(&one, on), "y2018, of 2018-07-16, 8.0 years old");
        let two = layer(Some(("2018-07-16", "2020-07-16T10:00:00Z")));
        assert_eq!(age(&two, on), "y2018, of 2018-07-16 to 2020-07-16, 6.0 to 8.0 years old");
        let future = layer(Some(("2018-07-16", "2112-07-31")));
        assert_eq!(age(&future, on), "y2018, of 2112-07-31, which is in the FUTURE: the date or the clock is wrong");
    }

    #[test]
    fn a_damaged_file_is_told_in_a_few_lines() {
        let many =
            |count: usize| listed((0..count).map(|n| format!("Page {n}: never used")).collect::<Vec<_>>().into_iter());
        assert_eq!(many(10).lines().count(), 11);
        assert!(many(130).ends_with("Page 9: never used\n  and 120 more; --json lists all"), "{}", many(130));
        assert_eq!(many(0), "");
    }
}
