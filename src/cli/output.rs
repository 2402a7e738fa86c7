//! `Output`: results on standard output, progress and errors on standard error.

use crate::cli::failure::Failure;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use overfly_store::write_output;
use serde::Serialize;
use std::io::{IsTerminal, Write};
use std::path::Path;

/// A text without what moves or recolours the cursor, or turns the reading direction: names and descriptions come from files, and a file
/// must not write over the verdict on it. Such characters are spelt out, as `\u{1b}`.
fn printable(text: &str) -> String {
    let is_plain = |c: char| c == '\n' || c == '\t' || !(c.is_control() || turns_direction(c));
    if text.chars().all(is_plain) {
        return text.to_owned();
    }
    text.chars().map(|c| if is_plain(c) { c.to_string() } else { c.escape_unicode().to_string() }).collect()
}

/// The bidirectional formatting characters of Unicode (UAX 9).
fn turns_direction(c: char) -> bool {
    matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// A text of several lines as one.
pub fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The two streams, and the format that the user wants.
#[derive(Debug, Clone, Copy)]
pub struct Output {
    json: bool,
    quiet: bool,
}

impl Output {
    /// `json`: JSON Lines instead of text; `quiet`: no progress bars.
    pub fn new(json: bool, quiet: bool) -> Self {
        Self { json, quiet }
    }

    /// Whether JSON Lines are requested.
    pub fn is_json(&self) -> bool {
        self.json
    }

    /// Prints one JSON line if JSON is requested, else the text.
    pub fn say(&self, value: &impl Serialize, text: impl FnOnce() -> String) {
        let line =
            if self.json { serde_json::to_string(value).expect("results serialise") } else { printable(&text()) };
        // A closed pipe is not a failure: the reader wants no more.
        let _ = writeln!(std::io::stdout(), "{line}");
    }

    /// Writes a file and reports that on standard error.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, path: &Path, bytes: &[u8]) -> Result<(), Failure> {
        write_output(path, bytes)
            .map_err(|e| Failure::failed("unwritable", anyhow::anyhow!("cannot write {}: {e}", path.display())))?;
        self.note(&format!("wrote {}", path.display()));
        Ok(())
    }

    /// Prints a note on standard error.
    pub fn note(&self, text: &str) {
        let _ = writeln!(std::io::stderr(), "{}", printable(text));
    }

    /// Prints a failure on standard error, and as a JSON line on standard output if JSON is requested.
    pub fn failure(&self, failure: &Failure) {
        let mut message = message(&failure.error);
        if let Some(remedy) = &failure.remedy {
            message = format!("{message}; {remedy}");
        }
        self.note(&format!("error[{}]: {message}", failure.code));
        if self.json {
            let line = serde_json::json!({"error": failure.code, "message": message});
            let _ = writeln!(std::io::stdout(), "{line}");
        }
    }

    /// Runs work that reports its progress (done, total), and shows a progress bar meanwhile.
    pub fn during<T>(&self, unit: &str, work: impl FnOnce(&(dyn Fn(u64, u64) + Sync)) -> T) -> T {
        let bar = self.progress(0, unit);
        let outcome = work(&|done, total| {
            bar.set_length(total);
            bar.set_position(done);
        });
        bar.finish_and_clear();
        outcome
    }

    /// A progress bar on standard error; hidden if that is not a terminal or the user wants none.
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

/// An error and its causes, each once: many errors repeat their cause in their own text.
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
    fn no_text_of_a_file_moves_the_cursor_or_the_reading_direction() {
        assert_eq!(printable("GOOD: a\n\troute é"), "GOOD: a\n\troute é");
        assert_eq!(printable("x\u{1b}[1A\r\u{202e}y\u{9b}"), r"x\u{1b}[1A\u{d}\u{202e}y\u{9b}");
        assert_eq!(one_line(" a\n GOOD: b\tc "), "a GOOD: b c");
    }

    #[test]
    fn prints_every_cause_once() {
        let inner = anyhow::anyhow!("the disk is gone");
        assert_eq!(message(&inner.context("a.gpkg: the disk is gone")), "a.gpkg: the disk is gone");
        let inner = anyhow::anyhow!("the disk is gone");
        assert_eq!(message(&inner.context("cannot write a.gpkg")), "cannot write a.gpkg: the disk is gone");
    }
}
