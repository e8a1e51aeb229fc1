//! How far is it? A bar on standard error for work that takes over a second, nothing otherwise.

use calibench::io::significant;
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::fmt::Write;
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

    /// So many steps were done before, in no time: they count, but say nothing of the rate.
    pub fn already(&self, steps: usize) {
        self.bar.set_position(steps as u64);
        self.bar.tick();
        self.bar.reset_eta();
    }

    /// The work is now known to be so many steps.
    pub fn expect(&self, total: usize) {
        self.bar.set_length(total as u64);
    }

    /// Says something after the bar, such as what is worst so far.
    pub fn note(&self, text: &str) {
        self.bar.set_message(text.to_string());
    }

    /// Puts the bar on the display. The note comes last: a narrow terminal cuts it and nothing else.
    fn show(&self) {
        let template = "{prefix} {bar:20} {pos}/{len} {rate} eta {eta} {wide_msg}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            let rate = |state: &ProgressState, out: &mut dyn Write| {
                // A failure would be that of the terminal, and there is nobody left to tell.
                let _ = write!(out, "{}/s", significant(state.per_sec(), 3));
            };
            self.bar.set_style(style.with_key("rate", rate));
        }
        self.bar.set_prefix(self.label.clone());
        self.display.bars.add(self.bar.clone());
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
