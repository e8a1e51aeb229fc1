//! What did a program start, and how is all of it ended? By its process group, and on Linux wherever its
//! processes have moved to.
//!
//! A process that calls `setsid` leaves the group, one whose parent ends leaves the tree. Both keep the
//! environment they were started with: a mark in it finds them (`/proc/PID/environ`). The command also
//! becomes the parent of orphans (`PR_SET_CHILD_SUBREAPER`), so that at its end even those that cleared their
//! environment are found below it.
//!
//! On Windows a program is put into a job object, whose processes end with it, the gate's own end included;
//! what it starts in the moment before is not among them. Limits of the others: systems other than Linux end
//! the process group only; and where the gate itself is killed, a program that does not end when its standard
//! input does goes on.

/// The name of the mark. Its value is of one program and one start.
pub(super) const MARK: &str = "CALIBENCH_GATE_SOLVER";

/// Looks one after the other that must find nothing: a process that starts itself anew may have ended when it
/// is looked at, and what it started was not there when the look began.
#[cfg(target_os = "linux")]
const QUIET_LOOKS: usize = 5;
/// Time after which looking ends, whatever is left: a process in the kernel's hands does not end either.
#[cfg(target_os = "linux")]
const PATIENCE: std::time::Duration = std::time::Duration::from_secs(5);

/// Ends a process group, and every process that carries the mark `value`.
pub(super) fn end(group: u32, value: &str) {
    end_group(group);
    #[cfg(target_os = "linux")]
    linux::end_while_found(|process| process.id == group || process.carries(value));
    #[cfg(not(target_os = "linux"))]
    let _ = value;
}

/// Most memory that was resident at a time of the largest process among the program `group` and those that
/// carry the mark `value`, bytes; `None` where the system does not say.
pub(super) fn peak_memory_bytes(group: u32, value: &str) -> Option<u64> {
    #[cfg(target_os = "linux")]
    return linux::peak_memory_bytes(|process| process.id == group || process.carries(value));
    #[cfg(not(target_os = "linux"))]
    {
        let _ = (group, value);
        None
    }
}

/// Whether orphans become children of this process.
#[cfg(target_os = "linux")]
static ADOPTS: std::sync::atomic::AtomicBool = std::sync::atomic::AtomicBool::new(false);

/// Makes this process the parent of orphans below it. Only for a program that starts no others than those it
/// judges.
pub(super) fn adopt_orphans() {
    // Where the system refuses, the marks remain.
    #[cfg(target_os = "linux")]
    ADOPTS.store(nix::sys::prctl::set_child_subreaper(true).is_ok(), std::sync::atomic::Ordering::Relaxed);
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

#[cfg(windows)]
use windows::end_job as end_group;

#[cfg(not(any(unix, windows)))]
fn end_group(_: u32) {}

/// Sees to it that what a program starts can be ended with it, right after it was started.
pub(super) fn follow(child: &std::process::Child) {
    #[cfg(windows)]
    windows::put_into_job(child);
    #[cfg(not(windows))]
    let _ = child;
}

#[cfg(windows)]
mod windows {
    use std::collections::BTreeMap;
    use std::os::windows::io::AsRawHandle;
    use std::process::Child;
    use std::sync::{Mutex, PoisonError};
    use win32job::{ExtendedLimitInfo, Job};

    /// Jobs of the programs that run, by process number.
    static JOBS: Mutex<BTreeMap<u32, Job>> = Mutex::new(BTreeMap::new());

    pub fn put_into_job(child: &Child) {
        let mut limits = ExtendedLimitInfo::new();
        limits.limit_kill_on_job_close();
        let job = Job::create_with_limit_info(&limits).ok();
        let assigned = job.filter(|job| job.assign_process(child.as_raw_handle() as isize).is_ok());
        // Where the system refuses, the program itself is ended and not what it started.
        let mut jobs = JOBS.lock().unwrap_or_else(PoisonError::into_inner);
        jobs.extend(assigned.map(|job| (child.id(), job)));
    }

    /// Ends the processes of a program's job: they end when its last handle is closed.
    pub fn end_job(id: u32) {
        drop(JOBS.lock().unwrap_or_else(PoisonError::into_inner).remove(&id));
    }
}

#[cfg(target_os = "linux")]
mod linux {
    use super::super::running::is_waited_for;
    use super::{ADOPTS, MARK, PATIENCE, QUIET_LOOKS};
    use nix::sys::signal::{Signal, kill, killpg};
    use nix::sys::wait::{WaitPidFlag, waitpid};
    use nix::unistd::Pid;
    use std::sync::atomic::Ordering;
    use std::time::{Duration, Instant};

    /// A process of the system.
    pub struct Process {
        pub id: u32,
        pub parent: u32,
        group: i32,
        session: i32,
        has_ended: bool,
    }

    impl Process {
        /// Whether its environment, as it was started, has the mark with this value.
        pub fn carries(&self, value: &str) -> bool {
            let wanted = format!("{MARK}={value}");
            // Those of other users cannot be read, and are not ours.
            let environment = std::fs::read(format!("/proc/{}/environ", self.id)).unwrap_or_default();
            environment.split(|byte| *byte == 0).any(|variable| variable == wanted.as_bytes())
        }

        /// Ends it. In a session of its own there are only its like: their group ends in one moment, also
        /// with what the process has started since it was seen.
        fn end(&self, our_session: i32) {
            // Each fails only where all have ended, or are another's children.
            if self.session != our_session && self.group > 1 {
                let _ = killpg(Pid::from_raw(self.group), Signal::SIGKILL);
            }
            let _ = kill(self.pid(), Signal::SIGKILL);
        }

        /// Lets go of an orphan that has ended: the system keeps its number until its parent has asked how.
        /// What was started here is asked by who started it.
        fn let_go(&self, ourselves: u32) {
            if ADOPTS.load(Ordering::Relaxed) && self.parent == ourselves && !is_waited_for(self.id) {
                let _ = waitpid(self.pid(), Some(WaitPidFlag::WNOHANG));
            }
        }

        fn pid(&self) -> Pid {
            Pid::from_raw(self.id as i32)
        }
    }

    /// Every process, looked at one after the other, the newest first: one that starts itself anew is among
    /// them, and ends soon.
    fn processes() -> impl Iterator<Item = Process> {
        let names = std::fs::read_dir("/proc").into_iter().flatten().flatten();
        let mut ids: Vec<u32> = names.filter_map(|name| name.file_name().to_str()?.parse().ok()).collect();
        ids.sort_unstable_by(|a, b| b.cmp(a));
        ids.into_iter().filter_map(process)
    }

    fn process(id: u32) -> Option<Process> {
        let stat = std::fs::read_to_string(format!("/proc/{id}/stat")).ok()?;
        // The name, in parentheses, may hold spaces; after it come state, parent, group and session.
        let mut fields = stat.rsplit_once(')')?.1.split_whitespace();
        let (state, parent) = (fields.next()?, fields.next()?.parse().ok()?);
        let (group, session) = (fields.next()?.parse().ok()?, fields.next()?.parse().ok()?);
        Some(Process { id, parent, group, session, has_ended: matches!(state, "Z" | "X") })
    }

    /// The largest peak of resident memory of the processes that `wanted` names, bytes.
    pub fn peak_memory_bytes(wanted: impl Fn(&Process) -> bool) -> Option<u64> {
        let peaks = processes().filter(wanted).filter_map(|process| {
            let status = std::fs::read_to_string(format!("/proc/{}/status", process.id)).ok()?;
            // `VmHWM:     1234 kB`, see proc_pid_status(5).
            let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
            line.trim().strip_suffix(" kB")?.trim().parse::<u64>().ok()
        });
        peaks.max().map(|kilobytes| 1024 * kilobytes)
    }

    /// Ends the processes that `wanted` names, until none is found.
    pub fn end_while_found(wanted: impl Fn(&Process) -> bool) {
        let (begun, mut quiet) = (Instant::now(), 0);
        while quiet < QUIET_LOOKS && begun.elapsed() < PATIENCE {
            quiet = if end_found(&wanted) { 0 } else { quiet + 1 };
            std::thread::sleep(Duration::from_micros(500));
        }
    }

    /// Ends each process that `wanted` names in the moment in which it is seen; whether there was one.
    fn end_found(wanted: impl Fn(&Process) -> bool) -> bool {
        let Some(ourselves) = process(std::process::id()) else { return false };
        let mut found = false;
        for process in processes() {
            if process.has_ended {
                process.let_go(ourselves.id);
            } else if wanted(&process) {
                process.end(ourselves.session);
                found = true;
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(target_os = "linux")]
    #[test]
    fn the_peak_of_memory_is_as_large_as_what_was_held() {
        let held = std::hint::black_box(vec![1u8; 32 << 20]);
        let peak = peak_memory_bytes(std::process::id(), "no mark").unwrap();
        assert!((held.len() as u64..1 << 40).contains(&peak), "{peak}");
        // No process has this number, and none carries this mark.
        assert_eq!(peak_memory_bytes(u32::MAX, "no mark"), None);
    }
}
