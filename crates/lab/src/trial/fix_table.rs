//! `fixes.csv`: a row per frame, from which others recompute the score.

use super::{FixOutcome, TrialError};
use overfly_flight::locate::Answer;
use std::path::{Path, PathBuf};

const HEADER: &str = "image,status,latitude_deg,longitude_deg,heading_deg,covariance_ee_m2,covariance_en_m2,covariance_nn_m2,elapsed_ms,reason";

/// Writes `fixes.csv` into a folder (made where absent) and returns its path.
///
/// # Errors
/// Where the folder or file cannot be written.
pub fn write_fixes(folder: &Path, outcomes: &[FixOutcome]) -> Result<PathBuf, TrialError> {
    write_table(folder, "fixes.csv", &to_csv(outcomes))
}

/// Writes a table into a folder, made where absent, and returns its path.
pub(super) fn write_table(folder: &Path, name: &str, text: &str) -> Result<PathBuf, TrialError> {
    let path = folder.join(name);
    std::fs::create_dir_all(folder)
        .and_then(|()| std::fs::write(&path, text))
        .map_err(|cause| TrialError::Unwritable { path: path.clone(), cause })?;
    Ok(path)
}

fn to_csv(outcomes: &[FixOutcome]) -> String {
    let mut text = format!("{HEADER}\n");
    for o in outcomes {
        let image = quoted(&o.image);
        let row = match &o.answer {
            Answer::Fix(f) => {
                let [[ee, en], [_, nn]] = f.covariance_m2;
                format!(
                    "{image},fix,{:.9},{:.9},{:.4},{ee:.6},{en:.6},{nn:.6},{:.3},\n",
                    f.latitude_deg, f.longitude_deg, f.heading_deg, o.elapsed_ms
                )
            }
            Answer::NoFix(n) => {
                let reason = serde_json::to_value(n.reason).expect("a word");
                format!("{image},no_fix,,,,,,,{:.3},{}\n", o.elapsed_ms, reason.as_str().expect("a word"))
            }
        };
        text.push_str(&row);
    }
    text
}

/// A cell's text, in quotes where it must be.
pub(super) fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::super::fix_score::tests::outcome;
    use super::*;

    #[test]
    fn writes_the_columns_others_read() {
        let covariance = [[1.5, 0.25], [0.25, 2.0]];
        let csv = to_csv(&[outcome(Some([0.0, 0.0]), covariance), outcome(None, covariance)]);
        let lines: Vec<_> = csv.lines().collect();
        assert_eq!(lines[0], HEADER);
        assert_eq!(lines[1], "a.png,fix,48.000000000,15.000000000,12.0000,1.500000,0.250000,2.000000,10.000,");
        assert_eq!(lines[2], "a.png,no_fix,,,,,,,10.000,ambiguous");
    }
}
