//! `sim.toml`: a scenario, and variations of it.

use super::scenario::Scenario;
use crate::trial::error::TrialError;
use overfly_store::read_small_text;
use std::path::Path;
use toml::{Table, Value};

/// Most variations in a file.
const MOST_VARIATIONS: usize = 200;

/// A scenario with its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Variation {
    /// `base`, or the name in the file.
    pub name: String,
    /// The scenario with the changes of the variation.
    pub scenario: Scenario,
}

/// Reads a `sim.toml`: the scenario that it describes, named `base`, then each `[[variation]]`, which has a `name`
/// and any keys to change (`aircraft.speed_mps = 80`). A `[store]` path is relative to the file.
///
/// # Errors
/// [`TrialError::Unreadable`]; [`TrialError::NotASimulation`] with the variation and the field.
pub fn read_simulation(path: &Path) -> Result<Vec<Variation>, TrialError> {
    let unreadable = |cause| TrialError::Unreadable { path: path.into(), cause };
    let refuse = |reason: String| TrialError::NotASimulation { path: path.into(), reason };
    let text = read_small_text(path).map_err(unreadable)?;
    let mut variations = parse(&text).map_err(refuse)?;
    for store in variations.iter_mut().filter_map(|v| v.scenario.store.as_mut()) {
        store.path = store.path.take().map(|file| path.parent().unwrap_or(Path::new("")).join(file));
    }
    Ok(variations)
}

/// The scenarios of a file's text, or what is wrong with it.
pub fn parse(text: &str) -> Result<Vec<Variation>, String> {
    let mut base: Table = toml::from_str(text).map_err(|e| in_a_line(&e))?;
    let changes = match base.remove("variation") {
        None => Vec::new(),
        Some(Value::Array(changes)) => changes,
        Some(_) => return Err("variation: write [[variation]], once for each".into()),
    };
    if changes.len() > MOST_VARIATIONS {
        return Err(format!("{} variations, of at most {MOST_VARIATIONS}", changes.len()));
    }
    let mut variations = vec![checked("base".into(), base.clone())?];
    for change in changes {
        let Value::Table(mut change) = change else { return Err("variation: a table, [[variation]]".into()) };
        let Some(Value::String(name)) = change.remove("name") else {
            return Err(format!("variation {}: it needs a name", variations.len()));
        };
        if variations.iter().any(|v| v.name == name) {
            return Err(format!("variation {name}: another has that name"));
        }
        let mut table = base.clone();
        merge(&mut table, change);
        variations.push(checked(name, table)?);
    }
    Ok(variations)
}

fn checked(name: String, table: Table) -> Result<Variation, String> {
    let said = |what: String| if name == "base" { what } else { format!("variation {name}: {what}") };
    let scenario: Scenario = Value::Table(table).try_into().map_err(|e: toml::de::Error| said(in_a_line(&e)))?;
    scenario.check().map_err(said)?;
    Ok(Variation { name, scenario })
}

/// Sets in a table the values of another, nested tables included.
fn merge(into: &mut Table, from: Table) {
    for (key, value) in from {
        match (into.get_mut(&key), value) {
            (Some(Value::Table(inner)), Value::Table(change)) => merge(inner, change),
            (_, value) => {
                into.insert(key, value);
            }
        }
    }
}

fn in_a_line(error: &toml::de::Error) -> String {
    error.to_string().trim().replace('\n', " ")
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// The paper's aircraft over an endless map, without inaccuracy and constant: the paper's own assumptions.
    pub const PLAIN: &str = r#"
modes = ["sequential"]
runs = 10
[aircraft]
speed_mps = 27.8
across_m = 609.28
along_m = 609.28
[errors]
inaccuracy_m = 0
unit_drift_m = 1
[execution]
relative_s = 0.154
seconds_per_tile = 0.047
"#;

    #[test]
    fn a_variation_changes_what_it_names_and_nothing_else() {
        let text = format!("{PLAIN}[[variation]]\nname = \"fast\"\naircraft.speed_mps = 80\n");
        let [base, fast] = &parse(&text).unwrap()[..] else { panic!("two scenarios") };
        assert_eq!((base.name.as_str(), fast.name.as_str()), ("base", "fast"));
        assert_eq!((base.scenario.aircraft.speed_mps, fast.scenario.aircraft.speed_mps), (27.8, 80.0));
        let mut slowed = fast.scenario.clone();
        slowed.aircraft.speed_mps = 27.8;
        assert_eq!(slowed, base.scenario);
    }

    #[test]
    fn what_cannot_be_is_refused_by_name() {
        let with = |line: &str| format!("{line}\n{PLAIN}");
        let within = |table: &str, line: &str| PLAIN.replace(&format!("[{table}]"), &format!("[{table}]\n{line}"));
        let after = |lines: &str| format!("{PLAIN}{lines}\n");
        let covariance = "[covariance]\nruns = 5\nheight_m = 500\nheading_offset_deg = 3\nheading_noise_deg = 3\n\
            height_offset_ratio = 0.03\nheight_noise_ratio = 0.03\nturn_noise_deg = 0.1\nclimb_noise_ratio = 0.002\n\
            start_sigma_m = 10\nfix_sigma_m = 2\nfix_heading_deg = 0.2\nfix_scale_ratio = 0.003";
        let broken = [
            (with("speed_kmh = 3"), "speed_kmh"),
            (within("aircraft", "speed_kmh = 3"), "speed_kmh"),
            (PLAIN.replace("27.8", "nan"), "aircraft.speed_mps"),
            (PLAIN.replace("27.8", "-1"), "aircraft.speed_mps"),
            (PLAIN.replace("27.8", "\"fast\""), "speed_mps"),
            (PLAIN.replace("runs = 10", "runs = 0"), "runs"),
            (PLAIN.replace("runs = 10", "runs = -3"), "runs"),
            (PLAIN.replace("runs = 10", "runs = 5000000"), "runs"),
            (PLAIN.replace("[\"sequential\"]", "[\"auto\"]"), "auto"),
            (PLAIN.replace("[\"sequential\"]", "[]"), "modes"),
            (PLAIN.replace("[\"sequential\"]", "[\"parallel\", \"parallel\"]"), "modes"),
            (PLAIN.replace("[\"sequential\"]", "[\"relative_only\"]"), "covariance"),
            (PLAIN.replace("inaccuracy_m = 0", "inaccuracy_m = -1"), "errors.inaccuracy_m"),
            (PLAIN.replace("inaccuracy_m = 0\n", ""), "inaccuracy_m"),
            (PLAIN.replace("0.047", "0"), "execution.seconds_per_tile"),
            (with("mission_s = 0"), "mission_s"),
            (with("without_fix_s = inf"), "without_fix_s"),
            (after("[failures]\nlaw = \"constant\""), "failures.probability"),
            (after("[failures]\nprobability = 0.1"), "failures.probability"),
            (after("[failures]\nlaw = \"constant\"\nprobability = 1.5"), "failures.probability"),
            (after("[failures]\nlaw = \"luck\""), "luck"),
            (after("[failures]\nfalse_share = 1.1"), "failures.false_share"),
            (after("[sequential]\nrelative_count = -1"), "relative_count"),
            (after("[store]\nleast_covered = 0.5"), "aircraft.min_turn_radius_m"),
            (after(covariance), "aircraft.min_turn_radius_m"),
            (after(&covariance.replace("runs = 5", "runs = 11")), "aircraft.min_turn_radius_m"),
            (after("[[variation]]\nruns = 5"), "name"),
            (after("[[variation]]\nname = \"base\""), "base"),
            (after("[variation]\nname = \"x\""), "[[variation]]"),
            (after("[[variation]]\nname = \"x\"\naircraft.speed_mps = inf"), "variation x: aircraft.speed_mps"),
            ("modes = [".into(), "line 1"),
        ];
        for (text, named) in broken {
            let reason = parse(&text).unwrap_err();
            assert!(reason.contains(named), "{named}: {reason}");
        }
        let turning = within("aircraft", "min_turn_radius_m = 300");
        let many = format!("{turning}{}", covariance.replace("runs = 5", "runs = 11"));
        assert!(parse(&many).unwrap_err().contains("covariance.runs"));
        assert!(parse(&format!("{turning}{covariance}")).is_ok());
        let calm = format!("{turning}{}", covariance.replace("heading_noise_deg = 3", "heading_noise_deg = 0"));
        assert!(parse(&calm).unwrap_err().contains("covariance.heading_noise_deg"));
    }
}
