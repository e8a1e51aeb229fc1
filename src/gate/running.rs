//! Which programs run? Those that any gate of this process started, by process number, each with its mark: to
//! be ended when the gate is interrupted, since a group of its own hears no Ctrl-C.

use super::descendants;
use std::collections::BTreeMap;
use std::process::{Child, Command};
use std::sync::{Mutex, MutexGuard, PoisonError};

static RUNNING: Mutex<Running> = Mutex::new(Running { programs: BTreeMap::new(), is_over: false });

struct Running {
    /// Marks by process number.
    programs: BTreeMap<u32, String>,
    /// Whether no more is started.
    is_over: bool,
}

fn running() -> MutexGuard<'static, Running> {
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Starts a program: it is known before anybody looks for children that nobody waits for. Never returns once
/// no more is started.
///
/// # Errors
/// It cannot be started.
pub(super) fn start(starter: &mut Command, mark: &str) -> std::io::Result<Child> {
    let mut running = running();
    while running.is_over {
        drop(running);
        std::thread::park();
        running = self::running();
    }
    let child = starter.spawn()?;
    descendants::follow(&child);
    running.programs.insert(child.id(), mark.to_string());
    Ok(child)
}

/// Whether a program runs: its number may be another's by now.
pub(super) fn is_running(id: u32, mark: &str) -> bool {
    running().programs.get(&id).is_some_and(|known| known == mark)
}

/// Whether a process was started here: who started it waits for it.
#[cfg(target_os = "linux")]
pub(super) fn is_waited_for(id: u32) -> bool {
    running().programs.contains_key(&id)
}

/// Lets go of a program that has been waited for.
pub(super) fn let_go(id: u32) {
    running().programs.remove(&id);
}

/// Takes all programs that run, with their marks.
pub(super) fn take() -> BTreeMap<u32, String> {
    std::mem::take(&mut running().programs)
}

/// Never returns once no more is started: whoever asked a program that was ended from outside would take that
/// for the program's fault.
pub(super) fn halt_where_it_is_over() {
    if running().is_over {
        loop {
            std::thread::park();
        }
    }
}

/// From now on none is started.
pub(super) fn start_no_more() {
    running().is_over = true;
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Stdio;

    #[test]
    fn a_program_runs_under_its_mark_until_it_is_let_go() {
        let mut starter = Command::new(std::env::current_exe().unwrap());
        starter.arg("--version").stdout(Stdio::null()).stderr(Stdio::null());
        let mut child = start(&mut starter, "mark").unwrap();
        let id = child.id();
        assert!(is_running(id, "mark") && !is_running(id, "another"));
        child.wait().unwrap();
        let_go(id);
        assert!(!is_running(id, "mark"));
    }
}
