//! What did a program start, and how is all of it ended? By its process group, and on Linux wherever its
//! processes have moved to.
//!
//! A process that calls `setsid` leaves the group, one whose parent ends leaves the tree. Both keep the
//! environment they were started with: a mark in it finds them (`/proc/PID/environ`). The command also
//! becomes the parent of orphans (`PR_SET_CHILD_SUBREAPER`), so that at its end even those that cleared their
//! environment are found below it.
//!
//! Limits: other systems end the process group only; and where the gate itself is killed, a program that does
//! not end when its standard input does goes on.

/// The name of the mark. Its value is of one program and one start.
pub(super) const MARK: &str = "CALIBENCH_GATE_SOLVER";

/// Times that processes are looked for again after some were ended: between a look and an end they may start
/// others.
#[cfg(target_os = "linux")]
const LOOKS: usize = 50;

/// Ends a process group, and every process that carries the mark `value`.
pub(super) fn end(group: u32, value: &str) {
    end_group(group);
    #[cfg(target_os = "linux")]
    linux::end_while_found(|process| process.id == group || process.carries(value));
    #[cfg(not(target_os = "linux"))]
    let _ = value;
}

/// Makes this process the parent of orphans below it. Only for a program that starts no others than those it
/// judges.
pub(super) fn adopt_orphans() {
    // Where the system refuses, the marks remain.
    #[cfg(target_os = "linux")]
    let _ = nix::sys::prctl::set_child_subreaper(true);
}

/// Ends whatever still runs below this process.
pub(super) fn end_below() {
    #[cfg(target_os = "linux")]
    linux::end_while_found(|process| process.parent == std::process::id());
}

#[cfg(unix)]
fn end_group(id: u32) {
    use nix::sys::signal::{Signal, killpg};
    let Ok(group) = i32::try_from(id) else { return };
    // It fails only where all have ended.
    let _ = killpg(nix::unistd::Pid::from_raw(group), Signal::SIGKILL);
}

#[cfg(not(unix))]
fn end_group(_: u32) {}

#[cfg(target_os = "linux")]
mod linux {
    use super::{LOOKS, MARK};
    use nix::sys::signal::{Signal, kill};
    use nix::unistd::Pid;

    /// A running process.
    pub struct Process {
        pub id: u32,
        pub parent: u32,
    }

    impl Process {
        /// Whether its environment, as it was started, has the mark with this value.
        pub fn carries(&self, value: &str) -> bool {
            let wanted = format!("{MARK}={value}");
            // Those of other users cannot be read, and are not ours.
            let environment = std::fs::read(format!("/proc/{}/environ", self.id)).unwrap_or_default();
            environment.split(|byte| *byte == 0).any(|variable| variable == wanted.as_bytes())
        }
    }

    /// Every process that has not ended.
    fn running() -> Vec<Process> {
        let names = std::fs::read_dir("/proc").into_iter().flatten().flatten();
        names.filter_map(|name| process(name.file_name().to_str()?.parse().ok()?)).collect()
    }

    fn process(id: u32) -> Option<Process> {
        let stat = std::fs::read_to_string(format!("/proc/{id}/stat")).ok()?;
        // The name, in parentheses, may hold spaces; after it come state and parent.
        let mut fields = stat.rsplit_once(')')?.1.split_whitespace();
        let (state, parent) = (fields.next()?, fields.next()?.parse().ok()?);
        (!matches!(state, "Z" | "X")).then_some(Process { id, parent })
    }

    /// Ends the processes that `wanted` names, until none is found.
    pub fn end_while_found(wanted: impl Fn(&Process) -> bool) {
        for _ in 0..LOOKS {
            let found: Vec<Pid> = running()
                .iter()
                .filter(|p| wanted(p))
                .filter_map(|p| i32::try_from(p.id).ok().map(Pid::from_raw))
                .collect();
            if found.is_empty() {
                return;
            }
            for &id in &found {
                // Each fails only where the process has ended, or is another's child.
                let _ = kill(id, Signal::SIGKILL);
            }
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
    }
}
