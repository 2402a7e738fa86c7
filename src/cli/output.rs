//! Where a command prints: results on standard output, progress and errors on standard error.

use super::Failure;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;
use std::io::{IsTerminal, Write};

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

    /// A note on standard error.
    pub fn note(&self, text: &str) {
        let _ = writeln!(std::io::stderr(), "{text}");
    }

    /// Prints a failure: on standard error for people, and as a JSON line on standard output where JSON is wanted.
    pub fn failure(&self, failure: &Failure) {
        self.note(&format!("error[{}]: {:#}", failure.code, failure.error));
        if self.json {
            let line = serde_json::json!({"error": failure.code, "message": format!("{:#}", failure.error)});
            let _ = writeln!(std::io::stdout(), "{line}");
        }
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
