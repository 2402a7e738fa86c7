//! `overfly layer describe`: states description, licence, attribution or date of a layer anew.

use super::outcome::Outcome;
use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::output::Output;
use crate::today::today;
use overfly_ingest::build::DescribeRequest;
use std::path::PathBuf;

const HELP: &str = "\
What is not stated stays as it is; an empty text ('') takes away what is stated. The description is a text for people, which GIS
tools show: it is part of no digest, and exports and patches do not carry it. Licence, attribution and date are part of the digest.
--date is the acquisition date of all sources of the layer: `overfly fix --layer any` searches the newest layer first. Where sources
that overlap have different dates, one date would change which covers which: such dates are stated by `overfly build SOURCE --date D`.

Example:
  overfly layer describe --db map.gpkg y2018 --date 2018-07-16 --description 'Summer flight, leaves on'";

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = HELP, group = clap::ArgGroup::new("stated").required(true).multiple(true))]
pub struct Args {
    /// The store, as it was built.
    #[arg(long, value_name = "FILE")]
    db: PathBuf,
    /// The layer.
    #[arg(value_name = "NAME")]
    name: String,
    /// A text for people.
    #[arg(long, value_name = "TEXT", group = "stated")]
    description: Option<String>,
    /// Licence of the imagery: an SPDX identifier, a name or a URL.
    #[arg(long, value_name = "TEXT", group = "stated")]
    licence: Option<String>,
    /// Whom maps of the layer must name.
    #[arg(long, value_name = "TEXT", group = "stated")]
    attribution: Option<String>,
    /// Acquisition date of all sources of the layer, YYYY-MM-DD.
    #[arg(long, value_name = "D", group = "stated")]
    date: Option<String>,
    /// State what would change; write nothing.
    #[arg(long)]
    dry_run: bool,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let request = DescribeRequest {
        db: args.db.clone(),
        layer: args.name.clone(),
        description: args.description.clone(),
        licence: args.licence.clone(),
        attribution: args.attribution.clone(),
        date: args.date.clone(),
        today: Some(today()),
    };
    let changed = if args.dry_run { request.preview()? } else { request.run()? };
    let stated = [
        ("description", &args.description),
        ("licence", &args.licence),
        ("attribution", &args.attribution),
        ("date", &args.date),
    ];
    let stated: Vec<&str> = stated.iter().filter(|(_, value)| value.is_some()).map(|(name, _)| *name).collect();
    let stated = stated.join(", ");
    Outcome::new("describe", &args.db, &args.name, args.dry_run, changed).say(
        output,
        &format!("{stated} stated anew"),
        &format!("{stated} would be stated anew"),
    );
    Ok(Exit::Done)
}
