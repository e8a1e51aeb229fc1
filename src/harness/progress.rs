//! How far is it? A line on standard error for work that takes over a second, nothing otherwise.

use super::stopwatch::{Clock, Stopwatch, rate};
use calibench::io::{shown, significant};
use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Work that is done within this time is not shown.
const PATIENCE: Duration = Duration::from_secs(1);
/// The line is drawn no more often than this: a person reads no faster.
const PAUSE: Duration = Duration::from_millis(100);
/// Characters of the line: one less than the narrowest terminal in use, since a full line would wrap.
const COLUMNS: usize = 79;

/// Where the line is drawn. Standard error only, and only when it is a terminal.
#[derive(Debug, Clone)]
pub struct ProgressDisplay {
    screen: Option<Arc<Screen>>,
    clock: Clock,
}

/// One piece of work. Dropping it ends its line.
#[derive(Debug)]
pub struct Progress {
    screen: Option<Arc<Screen>>,
    work: Arc<Work>,
}

/// The one line, which all work of a display shares: the oldest piece is shown.
#[derive(Debug, Default)]
struct Screen {
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    running: Vec<Arc<Work>>,
    drawn: Option<Stopwatch>,
}

#[derive(Debug)]
struct Work {
    label: String,
    total: AtomicUsize,
    done: AtomicUsize,
    /// Steps that were done before, which say nothing of the rate.
    before: AtomicUsize,
    watch: Stopwatch,
    note: Mutex<String>,
}

impl ProgressDisplay {
    /// Draws nothing.
    pub fn hidden() -> ProgressDisplay {
        ProgressDisplay { screen: None, clock: Clock::System }
    }

    /// Draws on standard error.
    pub fn stderr() -> ProgressDisplay {
        let screen = std::io::stderr().is_terminal().then(Arc::default);
        ProgressDisplay { screen, clock: Clock::System }
    }

    /// The same by another clock.
    pub fn with_clock(self, clock: Clock) -> ProgressDisplay {
        ProgressDisplay { clock, ..self }
    }

    /// Announces `total` steps of work.
    pub fn start(&self, label: &str, total: usize) -> Progress {
        let work = Arc::new(Work {
            label: shown(label).into_owned(),
            total: AtomicUsize::new(total),
            done: AtomicUsize::new(0),
            before: AtomicUsize::new(0),
            watch: Stopwatch::on(&self.clock),
            note: Mutex::default(),
        });
        if let Some(screen) = &self.screen {
            screen.state().running.push(Arc::clone(&work));
        }
        Progress { screen: self.screen.clone(), work }
    }
}

impl Progress {
    /// One step is done.
    pub fn step(&self) {
        self.advance(1);
    }

    /// `steps` steps are done.
    pub fn advance(&self, steps: usize) {
        self.work.done.fetch_add(steps, Relaxed);
        if let Some(screen) = &self.screen
            && self.work.watch.elapsed() >= PATIENCE
        {
            screen.draw();
        }
    }

    /// So many steps were done before, in no time: they count, but say nothing of the rate.
    pub fn already(&self, steps: usize) {
        self.work.done.store(steps, Relaxed);
        self.work.before.store(steps, Relaxed);
    }

    /// The work is now known to be so many steps.
    pub fn expect(&self, total: usize) {
        self.work.total.store(total, Relaxed);
    }

    /// Says something after the counts, such as what is worst so far.
    pub fn note(&self, text: &str) {
        *self.work.note.lock().unwrap_or_else(PoisonError::into_inner) = shown(text).into_owned();
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        let Some(screen) = &self.screen else { return };
        let mut state = screen.state();
        state.running.retain(|work| !Arc::ptr_eq(work, &self.work));
        if state.drawn.is_some() && state.running.is_empty() {
            state.drawn = None;
            put("");
        }
    }
}

impl Screen {
    fn state(&self) -> std::sync::MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Draws the line, unless another thread does or it was drawn just now.
    fn draw(&self) {
        let Ok(mut state) = self.state.try_lock() else { return };
        if state.drawn.as_ref().is_some_and(|watch| watch.elapsed() < PAUSE) {
            return;
        }
        let Some(oldest) = state.running.first() else { return };
        put(&oldest.line(oldest.watch.elapsed(), state.running.len() - 1));
        state.drawn = Some(oldest.watch.again());
    }
}

impl Work {
    /// Counts, rate, time left and note, after `took`, with so many other pieces under way. The note comes
    /// last: a narrow line cuts it.
    fn line(&self, took: Duration, others: usize) -> String {
        let (done, total) = (self.done.load(Relaxed), self.total.load(Relaxed));
        let pace = rate(done.saturating_sub(self.before.load(Relaxed)) as u64, took).map_or_else(
            String::new,
            |rate| {
                let left = total.saturating_sub(done) as f64 / rate;
                let left = if left.is_finite() { format!(", {left:.0} s left") } else { String::new() };
                format!(" {}/s{left}", significant(rate, 3))
            },
        );
        let others = if others > 0 { format!(" (and {others} more)") } else { String::new() };
        let note = self.note.lock().unwrap_or_else(PoisonError::into_inner);
        let line = format!("{}{others} {done}/{total}{pace} {note}", self.label);
        line.trim_end().chars().take(COLUMNS).collect()
    }
}

/// Puts a line in the place of the last one. Spaces clear what was longer: no terminal needs to know an
/// escape sequence.
fn put(line: &str) {
    let mut stderr = std::io::stderr().lock();
    // A failure would be that of the terminal, and there is nobody left to tell.
    let _ = write!(stderr, "\r{line:COLUMNS$}\r");
    let _ = stderr.flush();
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicU64;

    #[test]
    fn the_rate_is_that_of_the_steps_done_now_and_a_long_note_is_cut() {
        let progress = ProgressDisplay::hidden().start("study", 100);
        progress.already(40);
        progress.advance(20);
        progress.note("worst: cell 3");
        let line = progress.work.line(Duration::from_secs(10), 0);
        assert_eq!(line, format!("study 60/100 {}/s, 20 s left worst: cell 3", significant(2.0, 3)));
        progress.note(&"x".repeat(200));
        assert_eq!(progress.work.line(Duration::from_secs(10), 2).chars().count(), COLUMNS);
    }

    #[test]
    fn a_clock_that_jumps_changes_the_rate_that_is_shown_and_nothing_else() {
        let milliseconds = Arc::new(AtomicU64::new(1_000_000));
        let clock = Clock::Set(milliseconds.clone());
        // Drawn, as on a terminal.
        let display = ProgressDisplay { screen: Some(Arc::default()), clock };
        let progress = display.start("study", 100);
        for (now, shown) in [
            (1_000_000, "study 1/100"),
            (0, "study 2/100"),
            (1_003_000, &format!("study 3/100 {}/s, 97 s left", significant(1.0, 3))),
            (999_000, "study 4/100"),
            (1_005_000, &format!("study 5/100 {}/s, 95 s left", significant(1.0, 3))),
        ] {
            milliseconds.store(now, Relaxed);
            progress.step();
            assert_eq!(progress.work.line(progress.work.watch.elapsed(), 0), shown, "at {now}");
        }
        milliseconds.store(u64::MAX, Relaxed);
        progress.step();
        assert!(progress.work.line(progress.work.watch.elapsed(), 0).starts_with("study 6/100 "));
    }
}
