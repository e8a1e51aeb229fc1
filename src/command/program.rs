//! How is a user's program asked? As many copies of it, for as long, as the arguments allow.

use super::MOST_THREADS;
use calibench_gate::Process;
use std::time::Duration;

/// Longest time for a problem.
const LONGEST: Duration = Duration::from_secs(86_400);

/// `jobs` copies of the program `command`, each given `seconds` for a problem; what is wrong with these
/// numbers is for people.
pub(super) fn process(command: &str, seconds: f64, jobs: usize) -> Result<Process, String> {
    if jobs > MOST_THREADS {
        return Err(format!("--jobs {jobs}, and the limit is {MOST_THREADS}"));
    }
    if jobs == 0 {
        return Err("--jobs must be at least 1".to_string());
    }
    Ok(Process::new(command, timeout(seconds)?, jobs))
}

/// How long a program may take for a problem.
pub(super) fn timeout(seconds: f64) -> Result<Duration, String> {
    let timeout = Duration::try_from_secs_f64(seconds)
        .ok()
        .filter(|t| (1..=LONGEST.as_nanos()).contains(&t.as_nanos()));
    timeout.ok_or_else(|| "--timeout must be a positive number of seconds, at most a day".to_string())
}
