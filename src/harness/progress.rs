//! How far is it? A bar on standard error for work that takes over a second, nothing otherwise.

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// Work that is done within this time is not shown.
const PATIENCE: Duration = Duration::from_secs(1);

/// Where bars are drawn. Standard error only, and only when it is a terminal.
#[derive(Debug, Clone)]
pub struct ProgressDisplay {
    bars: MultiProgress,
}

/// One piece of work. Dropping it removes the bar.
#[derive(Debug)]
pub struct Progress {
    display: ProgressDisplay,
    bar: ProgressBar,
    label: String,
    started: Instant,
    shown: OnceLock<()>,
}

impl ProgressDisplay {
    /// Draws nothing.
    pub fn hidden() -> ProgressDisplay {
        ProgressDisplay { bars: MultiProgress::with_draw_target(ProgressDrawTarget::hidden()) }
    }

    /// Draws on standard error.
    pub fn stderr() -> ProgressDisplay {
        ProgressDisplay { bars: MultiProgress::new() }
    }

    /// Announces `total` steps of work.
    pub fn start(&self, label: &str, total: usize) -> Progress {
        let bar = ProgressBar::with_draw_target(Some(total as u64), ProgressDrawTarget::hidden());
        Progress {
            display: self.clone(),
            bar,
            label: label.to_string(),
            started: Instant::now(),
            shown: OnceLock::new(),
        }
    }
}

impl Progress {
    /// One step is done.
    pub fn step(&self) {
        self.advance(1);
    }

    /// `steps` steps are done.
    pub fn advance(&self, steps: usize) {
        if self.started.elapsed() >= PATIENCE {
            self.shown.get_or_init(|| self.show());
        }
        self.bar.inc(steps as u64);
    }

    /// Says something beside the bar, such as what is worst so far.
    pub fn note(&self, text: &str) {
        self.bar.set_message(format!("{} {text}", self.label));
    }

    /// Puts the bar on the display.
    fn show(&self) {
        if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {per_sec} eta {eta}") {
            self.bar.set_style(style);
        }
        self.bar.set_message(self.label.clone());
        self.display.bars.add(self.bar.clone());
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
