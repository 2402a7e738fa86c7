//! Progress on standard error.

use indicatif::{ProgressBar, ProgressStyle};
use std::time::Duration;

/// Makes progress bars, or none.
pub struct Bars {
    is_quiet: bool,
}

/// A bar that is removed when it is dropped.
pub struct Bar(ProgressBar);

impl Bars {
    /// Bars, or none when quiet.
    pub fn new(is_quiet: bool) -> Self {
        Self { is_quiet }
    }

    /// A step of unknown length.
    pub fn step(&self, what: &str) -> Bar {
        let bar = if self.is_quiet { ProgressBar::hidden() } else { ProgressBar::new_spinner() };
        bar.set_message(what.to_owned());
        bar.enable_steady_tick(Duration::from_millis(200));
        Bar(bar)
    }

    /// A bar that counts.
    pub fn bar(&self, what: &str) -> Bar {
        let bar = if self.is_quiet { ProgressBar::hidden() } else { ProgressBar::new(0) };
        let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {eta}").expect("a valid template");
        bar.set_style(style);
        bar.set_message(what.to_owned());
        Bar(bar)
    }
}

impl Bar {
    /// Shows how much is done.
    pub fn show(&self, done: usize, all: usize) {
        self.0.set_length(all as u64);
        self.0.set_position(done as u64);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
