//! What the program says to arguments that it cannot parse.

use crate::cli::failure::Failure;
use clap::error::{ContextKind, ContextValue, ErrorKind};

/// Flags that remove or replace what is stored. A misspelt flag is never answered with one of them.
const DESTRUCTIVE: [&str; 4] = ["--remove-layer", "--remove-source", "--replace-layer", "--yes"];
/// Commands that remove what is stored. A misspelt command is never answered with one of them.
const DESTRUCTIVE_COMMANDS: [&str; 1] = ["remove"];

/// What a flag expects, by the end of its name. The first that fits counts.
const EXPECTED: [(&str, &str); 27] = [
    ("-risk", "a probability from 1e-9 to 0.5, as in 1e-5"),
    ("-m-per-px", "metres per pixel, as in 1.25"),
    ("-mps", "metres per second, as in 40"),
    ("-deg", "degrees, as in 47.02"),
    ("-m", "metres, as in 400, or a length with its unit (m, km, ft, nmi or NM), as in 0.4km or 1300ft"),
    ("-s", "seconds, as in 0.5"),
    ("-px", "whole pixels, as in 512"),
    ("-ratio", "a ratio, as in 0.03 for 3 %"),
    ("-share", "a share from 0 to 1, as in 0.5"),
    ("--cloud", "a share from 0 to 1, as in 0.5"),
    ("--least-covered", "a share from 0 to 1, as in 0.5"),
    ("--require-covered", "a share from 0 to 1, as in 0.95"),
    ("--least-distinctiveness", "a share from 0 to 1, as in 0.5"),
    ("--least-keypoints", "a number, as in 40"),
    ("--correlation", "a number between -1 and 1, as in 0.3"),
    ("--crs", "an EPSG code, as in 32614 or EPSG:32614"),
    ("--zoom", "a zoom from 0 to 23, as in 16"),
    ("--stretch", "two numbers LO,HI, as in 0,4000"),
    ("--max-bytes", "bytes, as in 5000000, 5MB or 64MiB"),
    ("--memory", "megabytes, as in 128, or a size with its unit, as in 128MB or 1GiB"),
    ("--keep-exports-bytes", "megabytes, as in 500, or a size with its unit, as in 500MB or 20GB"),
    ("--keep-exports-h", "hours, as in 24"),
    ("--jpeg-quality", "a quality from 1 to 100, as in 60"),
    ("--valid-until", "the last day, as in 2027-03-31"),
    ("--blackout", "FIRST:COUNT, as in 20:10"),
    ("--regions", "numbers separated by commas, as in 1,10,100"),
    ("--tiles", "numbers separated by commas, as in 1,4,9"),
];

/// What any other flag for a number expects: trials, seeds, threads.
const WHOLE: &str = "a whole number, as in 8";

/// Why the usage is wrong, with what the flag expects and an example.
pub fn usage_failure(mut usage: clap::Error) -> Failure {
    let suggests = |kind: ContextKind, usage: &clap::Error| match usage.get(kind) {
        Some(ContextValue::String(name)) => DESTRUCTIVE.contains(&name.as_str()),
        Some(ContextValue::Strings(names)) => names.iter().any(|name| DESTRUCTIVE.contains(&name.as_str())),
        _ => false,
    };
    if suggests(ContextKind::SuggestedArg, &usage) {
        usage.remove(ContextKind::SuggestedArg);
        // It names the suggested flag.
        usage.remove(ContextKind::Usage);
    }
    withhold_destructive_commands(&mut usage);
    let text = usage.to_string();
    let message = text.strip_prefix("error: ").unwrap_or(&text).trim_end();
    let (first, rest) = message.split_once('\n').map_or((message, ""), |(first, rest)| (first, rest));
    let expected = expected(&usage).map_or(String::new(), |expected| format!("; expected {expected}"));
    let rest = if rest.is_empty() { String::new() } else { format!("\n{rest}") };
    let is_renaming = invalid_argument(&usage) == Some("--rename-layer");
    let renaming = if is_renaming { "; `overfly layer rename` gives a layer another name" } else { "" };
    Failure::unusable("usage", anyhow::anyhow!("{first}{expected}{renaming}{rest}"))
}

fn withhold_destructive_commands(usage: &mut clap::Error) {
    let Some(ContextValue::Strings(names)) = usage.get(ContextKind::SuggestedSubcommand) else { return };
    let kept: Vec<String> =
        names.iter().filter(|name| !DESTRUCTIVE_COMMANDS.contains(&name.as_str())).cloned().collect();
    usage.remove(ContextKind::SuggestedSubcommand);
    if !kept.is_empty() {
        usage.insert(ContextKind::SuggestedSubcommand, ContextValue::Strings(kept));
    }
}

fn invalid_argument(usage: &clap::Error) -> Option<&str> {
    match usage.get(ContextKind::InvalidArg) {
        Some(ContextValue::String(argument)) => Some(argument),
        _ => None,
    }
}

/// What the flag expects whose value is wrong: `None` where nothing but the text of clap is known.
fn expected(usage: &clap::Error) -> Option<&'static str> {
    let argument = invalid_argument(usage)?;
    let flag = argument.split_whitespace().next().filter(|flag| flag.starts_with("--"))?;
    if usage.kind() != ErrorKind::ValueValidation {
        return None;
    }
    let known = EXPECTED.iter().find(|(end, _)| flag.ends_with(end)).map(|(_, expected)| *expected);
    known.or_else(|| argument.ends_with("<N>").then_some(WHOLE))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::Cli;
    use clap::{Command, CommandFactory};
    use std::any::TypeId;

    /// Whether the argument's value is a number.
    fn is_number(argument: &clap::Arg) -> bool {
        let value = argument.get_value_parser().type_id();
        [
            TypeId::of::<f64>(),
            TypeId::of::<(f64, f64)>(),
            TypeId::of::<(usize, usize)>(),
            TypeId::of::<u8>(),
            TypeId::of::<u16>(),
            TypeId::of::<u32>(),
            TypeId::of::<u64>(),
            TypeId::of::<usize>(),
            TypeId::of::<std::num::NonZeroUsize>(),
        ]
        .iter()
        .any(|number| value == *number)
    }

    fn numbers(command: &Command, path: &[String], found: &mut Vec<Vec<String>>) {
        for argument in command.get_arguments().filter(|a| is_number(a)) {
            let flag = argument.get_long().map(|long| format!("--{long}"));
            found.push(path.iter().cloned().chain(flag).chain(["zz".into()]).collect());
        }
        for below in command.get_subcommands() {
            let path: Vec<String> = path.iter().cloned().chain([below.get_name().to_owned()]).collect();
            numbers(below, &path, found);
        }
    }

    #[test]
    fn every_number_says_what_it_expects_with_an_example() {
        let mut found = Vec::new();
        numbers(&Cli::command(), &["overfly".into()], &mut found);
        assert!(found.len() >= 20, "{found:?}");
        for words in found {
            let Err(usage) = Cli::command().try_get_matches_from(&words) else { panic!("{words:?} is accepted") };
            let said = usage_failure(usage).error.to_string();
            let first = said.lines().next().unwrap();
            assert!(first.contains("; expected ") && first.contains("as in "), "{words:?}: {first}");
        }
    }

    #[test]
    fn nothing_destructive_is_suggested() {
        for typo in ["--rename-layer", "--remove-layr", "--remove-sourc", "--replace-laye"] {
            let Err(usage) = Cli::command().try_get_matches_from(["overfly", "build", "--db", "a.gpkg", typo]) else {
                panic!("{typo} is accepted")
            };
            let said = usage_failure(usage).error.to_string();
            assert!(said.contains(typo), "{said}");
            assert!(DESTRUCTIVE.iter().all(|flag| !said.replace(typo, "").contains(flag)), "{said}");
        }
        for (typo, suggested) in [("remov", None), ("renove", Some("rename")), ("renam", Some("rename"))] {
            let Err(usage) = Cli::command().try_get_matches_from(["overfly", "layer", typo, "--db", "a.gpkg"]) else {
                panic!("{typo} is accepted")
            };
            let said = usage_failure(usage).error.to_string();
            assert!(!said.contains("remove"), "{said}");
            assert!(suggested.is_none_or(|name| said.contains(name)), "{said}");
        }
        let typo = ["overfly", "layer", "remove", "--db", "a.gpkg", "ortho", "--yess"];
        let Err(usage) = Cli::command().try_get_matches_from(typo) else { panic!("--yess is accepted") };
        assert!(!usage_failure(usage).error.to_string().contains("'--yes'"));
    }
}
