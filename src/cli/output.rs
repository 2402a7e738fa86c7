//! Where a command prints: results on standard output, progress and errors on standard error.

use super::Failure;
use super::remedy::remedy;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;
use std::io::{IsTerminal, Write};
use std::path::Path;

/// The two streams and how the user wants them.
pub struct Output {
    json: bool,
    quiet: bool,
}

impl Output {
    /// `json`: JSON Lines instead of text; `quiet`: no progress bars.
    pub fn new(json: bool, quiet: bool) -> Self {
        Self { json, quiet }
    }

    /// Whether JSON Lines are wanted.
    pub fn is_json(&self) -> bool {
        self.json
    }

    /// Prints one JSON line where JSON is wanted, else the text.
    pub fn say(&self, value: &impl Serialize, text: impl FnOnce() -> String) {
        let line = if self.json { serde_json::to_string(value).expect("results serialise") } else { text() };
        // A closed pipe is the reader's choice, not a failure.
        let _ = writeln!(std::io::stdout(), "{line}");
    }

    /// Writes a file and says so on standard error.
    pub fn write(&self, path: &Path, bytes: &[u8]) -> Result<(), Failure> {
        std::fs::write(path, bytes)
            .map_err(|e| Failure::failed("unwritable", anyhow::anyhow!("cannot write {}: {e}", path.display())))?;
        self.note(&format!("wrote {}", path.display()));
        Ok(())
    }

    /// A note on standard error.
    pub fn note(&self, text: &str) {
        let _ = writeln!(std::io::stderr(), "{text}");
    }

    /// Prints a failure: on standard error for people, and as a JSON line on standard output where JSON is wanted.
    pub fn failure(&self, failure: &Failure) {
        let mut message = message(&failure.error);
        if let Some(remedy) = remedy(&failure.error) {
            message = format!("{message}; {remedy}");
        }
        self.note(&format!("error[{}]: {message}", failure.code));
        if self.json {
            let line = serde_json::json!({"error": failure.code, "message": message});
            let _ = writeln!(std::io::stdout(), "{line}");
        }
    }

    /// Does work that tells what of how much is done, with a progress bar for it.
    pub fn during<T>(&self, unit: &str, work: impl FnOnce(&(dyn Fn(u64, u64) + Sync)) -> T) -> T {
        let bar = self.progress(0, unit);
        let outcome = work(&|done, total| {
            bar.set_length(total);
            bar.set_position(done);
        });
        bar.finish_and_clear();
        outcome
    }

    /// A progress bar on standard error; hidden unless that is a terminal and the user wants it.
    pub fn progress(&self, total: u64, unit: &str) -> ProgressBar {
        let bar = ProgressBar::new(total);
        if self.quiet || !std::io::stderr().is_terminal() {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        }
        let template = format!("{{bar:40}} {{pos}}/{{len}} {unit} {{elapsed}} (left {{eta}}) {{msg}}");
        bar.set_style(ProgressStyle::with_template(&template).expect("the template is constant"));
        bar
    }
}

/// An error and its causes, each said once: many name their cause in their own text.
fn message(error: &anyhow::Error) -> String {
    error.chain().skip(1).fold(error.to_string(), |mut text, cause| {
        let cause = cause.to_string();
        if !text.contains(&cause) {
            text.push_str(": ");
            text.push_str(&cause);
        }
        text
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn says_every_cause_once() {
        let inner = anyhow::anyhow!("the disk is gone");
        assert_eq!(message(&inner.context("a.gpkg: the disk is gone")), "a.gpkg: the disk is gone");
        let inner = anyhow::anyhow!("the disk is gone");
        assert_eq!(message(&inner.context("cannot write a.gpkg")), "cannot write a.gpkg: the disk is gone");
    }
}
