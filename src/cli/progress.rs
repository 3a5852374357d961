//! A progress bar on a terminal, nothing elsewhere.

use std::io::{IsTerminal, stderr};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Progress of something whose length is known in samples, or not at all.
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// A bar that shows itself only on a terminal and if it may, and updates four times a second.
    pub fn new(label: &str, samples: Option<u64>, may: bool) -> Self {
        let target = if may && stderr().is_terminal() {
            ProgressDrawTarget::stderr_with_hz(4)
        } else {
            ProgressDrawTarget::hidden()
        };
        let bar = ProgressBar::with_draw_target(samples, target).with_prefix(label.to_owned());
        let template = match samples {
            Some(_) => "{prefix} {wide_bar} {percent:>3} %  {elapsed} elapsed, {eta} left",
            None => "{prefix} {spinner} {pos} samples, {elapsed} elapsed",
        };
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        Self { bar }
    }

    /// Shows that so many samples are done.
    pub fn set(&self, samples: u64) {
        self.bar.set_position(samples);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
