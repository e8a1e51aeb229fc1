//! How is a user's program asked? As many copies of it, for as long, as the arguments allow.

use super::MOST_THREADS;
use calibench::io::ShownPath;
use calibench_gate::Process;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Longest time for a problem.
const LONGEST: Duration = Duration::from_secs(86_400);

/// Characters of which names of programs are made; a command of the shell has others.
const OF_NAMES: &str = "-_.+/";

/// `jobs` copies of the program `command`, each given `seconds` for a problem; what is wrong with these
/// numbers, or that there is no such program, is for people.
pub(super) fn process(command: &str, seconds: f64, jobs: usize) -> Result<Process, String> {
    refuse_missing(command)?;
    let timeout = limits(seconds, jobs)?;
    Ok(Process::new(command, timeout, jobs))
}

/// How long a program may take for a problem, once numbers that no program can be asked with are refused.
pub(super) fn limits(seconds: f64, jobs: usize) -> Result<Duration, String> {
    if jobs > MOST_THREADS {
        return Err(format!("--jobs {jobs}, and the limit is {MOST_THREADS}"));
    }
    if jobs == 0 {
        return Err("--jobs must be at least 1".to_string());
    }
    timeout(seconds)
}

/// Refuses a name of which there is no program: every question to it would only be answered that it is not
/// found.
pub(super) fn refuse_missing(command: &str) -> Result<(), String> {
    if is_missing(command) {
        return Err(format!(
            "{}: no such program; give the path of one that is there, or a command of the shell, such as \"python3 adapter.py\"",
            Path::new(command).shown()
        ));
    }
    Ok(())
}

/// Whether a command is a name, and there is no program of it.
pub(super) fn is_missing(command: &str) -> bool {
    let is_a_name = command.chars().all(|c| c.is_alphanumeric() || OF_NAMES.contains(c));
    // Windows completes names.
    if !is_a_name || cfg!(windows) {
        return false;
    }
    let path = Path::new(command);
    let in_folder = |folder: PathBuf| folder.join(command).is_file();
    let is_bare = path.components().count() == 1;
    let on_path = || std::env::var_os("PATH").is_some_and(|all| std::env::split_paths(&all).any(in_folder));
    !(path.exists() || is_bare && on_path())
}

/// How long a program may take for a problem.
pub(super) fn timeout(seconds: f64) -> Result<Duration, String> {
    let timeout = Duration::try_from_secs_f64(seconds)
        .ok()
        .filter(|t| (1..=LONGEST.as_nanos()).contains(&t.as_nanos()));
    timeout.ok_or_else(|| "--timeout must be a positive number of seconds, at most a day".to_string())
}
