//! How long did it take? By the system's clock, or by one that a test sets. A clock may stand still, run
//! ahead and go back: what is told of time is wrong then, and nothing that is written depends on it.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, LazyLock};
use std::time::{Duration, Instant};

/// What time is it? Only differences mean something.
#[derive(Debug, Clone, Default)]
pub enum Clock {
    /// The system's, which does not follow the date.
    #[default]
    System,
    /// A test's: milliseconds.
    Set(Arc<AtomicU64>),
}

impl Clock {
    fn now(&self) -> Duration {
        static BEGINNING: LazyLock<Instant> = LazyLock::new(Instant::now);
        match self {
            Clock::System => BEGINNING.elapsed(),
            Clock::Set(milliseconds) => Duration::from_millis(milliseconds.load(Relaxed)),
        }
    }
}

/// Time from a beginning on.
#[derive(Debug, Clone)]
pub struct Stopwatch {
    clock: Clock,
    started: Duration,
}

impl Stopwatch {
    /// Begins now.
    pub fn start() -> Stopwatch {
        Stopwatch::on(&Clock::System)
    }

    /// Begins now, by the given clock.
    pub fn on(clock: &Clock) -> Stopwatch {
        Stopwatch { clock: clock.clone(), started: clock.now() }
    }

    /// Another that begins now, by the same clock.
    pub fn again(&self) -> Stopwatch {
        Stopwatch::on(&self.clock)
    }

    /// Time since the beginning; none where the clock stands before it.
    pub fn elapsed(&self) -> Duration {
        self.clock.now().saturating_sub(self.started)
    }
}

/// Steps a second; `None` where no time has passed.
pub fn rate(steps: u64, took: Duration) -> Option<f64> {
    let seconds = took.as_secs_f64();
    (seconds > 0.0).then(|| steps as f64 / seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_stands_or_goes_back_gives_no_time_and_no_rate() {
        let milliseconds = Arc::new(AtomicU64::new(5000));
        let watch = Stopwatch::on(&Clock::Set(milliseconds.clone()));
        let at = |now: u64| {
            milliseconds.store(now, Relaxed);
            (watch.elapsed(), rate(10, watch.elapsed()))
        };
        assert_eq!(at(5000), (Duration::ZERO, None));
        assert_eq!(at(0), (Duration::ZERO, None));
        assert_eq!(at(9000), (Duration::from_secs(4), Some(2.5)));
        assert!(at(u64::MAX).1.is_some_and(|rate| rate > 0.0 && rate < 1e-9));
    }

    #[test]
    fn the_clock_of_the_system_goes_on() {
        let watch = Stopwatch::start();
        std::thread::sleep(Duration::from_millis(2));
        assert!(watch.elapsed() >= Duration::from_millis(2));
    }
}
