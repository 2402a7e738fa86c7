//! `overfly layer remove`: removes a layer, after a question.

use super::outcome::Outcome;
use crate::cli::exit::Exit;
use crate::cli::failure::Failure;
use crate::cli::output::Output;
use overfly_store::{LayerChange, change_layer, preview_layer_change};
use std::io::{BufRead, IsTerminal, Write};
use std::path::PathBuf;

const HELP: &str = "\
There is no way back but to build the layer again from its orthophotos. On a terminal the command asks for the layer's name;
elsewhere it removes nothing without --yes.

Examples:
  overfly layer remove --db map.gpkg y2018 --dry-run
  overfly layer remove --db map.gpkg y2018";

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub struct Args {
    /// The store, as it was built.
    #[arg(long, value_name = "FILE")]
    db: PathBuf,
    /// The layer.
    #[arg(value_name = "NAME")]
    name: String,
    /// State what would be removed; write nothing.
    #[arg(long)]
    dry_run: bool,
    /// Remove it without a question.
    #[arg(long)]
    yes: bool,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<Exit, Failure> {
    let preview = preview_layer_change(&args.db, &args.name, &LayerChange::Remove)?;
    let changed = if args.dry_run {
        preview
    } else {
        if !args.yes {
            require_confirmation(args, preview.tiles)?;
        }
        change_layer(&args.db, &args.name, &LayerChange::Remove)?
    };
    Outcome::new("remove", &args.db, &args.name, args.dry_run, changed).say(output, "removed", "would be removed");
    Ok(Exit::Done)
}

/// Asks for the name of the layer on a terminal.
fn require_confirmation(args: &Args, tiles: u64) -> Result<(), Failure> {
    let not_confirmed = |why: &str| {
        let fact = format!("{}: layer {} was not removed: {why}", args.db.display(), args.name);
        Failure::unusable("not_confirmed", anyhow::anyhow!(fact))
    };
    let (stdin, mut stderr) = (std::io::stdin(), std::io::stderr());
    if !(stdin.is_terminal() && stderr.is_terminal()) {
        let why = "that cannot be undone and there is no terminal to ask on; --dry-run states what would be removed, --yes removes it";
        return Err(not_confirmed(why));
    }
    let question = format!(
        "Remove layer {} with {tiles} tiles from {}? That cannot be undone. Type its name to remove it: ",
        args.name,
        args.db.display()
    );
    let mut answer = String::new();
    let asked = stderr.write_all(question.as_bytes()).and_then(|()| stderr.flush());
    let read = asked.and_then(|()| stdin.lock().read_line(&mut answer));
    match read {
        Ok(_) if answer.trim() == args.name => Ok(()),
        Ok(_) => Err(not_confirmed("its name was not typed")),
        Err(error) => Err(not_confirmed(&error.to_string())),
    }
}
