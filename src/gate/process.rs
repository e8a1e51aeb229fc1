//! How is a program judged that is not ours? As a black box behind two pipes, kept alive over all problems.

use super::accept::{Breakage, id_in, read_line};
use super::protocol::{Answer, Problem};
use super::solver::{Reply, Solver, reply};
use std::collections::BTreeSet;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// After this many breakages in a row a worker stops asking a program that never gave an answer: it does not work at all.
const PATIENCE: usize = 3;
/// The same for a program that has answered before: more than all bad input of a run, which may well break it every time.
const LONG_PATIENCE: usize = 24;
/// Bytes of standard error that are quoted.
const STDERR_TAIL: usize = 400;

/// Process groups that run, to be ended when the gate is interrupted: a group of its own hears no Ctrl-C.
static GROUPS: Mutex<BTreeSet<u32>> = Mutex::new(BTreeSet::new());

/// Ends every program that any gate of this process started.
pub fn end_all() {
    let groups = std::mem::take(&mut *GROUPS.lock().unwrap_or_else(PoisonError::into_inner));
    groups.into_iter().for_each(end_group);
}

/// Ends a program and what it started. This fails only where all have ended already.
fn end_group(id: u32) {
    #[cfg(unix)]
    let _ = Command::new("kill").args(["-KILL", "--", &format!("-{id}")]).stderr(Stdio::null()).status();
    #[cfg(not(unix))]
    let _ = id;
}

/// A program that reads problems and writes answers, one JSON object a line.
#[derive(Debug)]
pub struct Process {
    command: String,
    timeout: Duration,
    workers: Vec<Mutex<Worker>>,
}

/// One running copy of the program.
#[derive(Debug, Default)]
struct Worker {
    running: Option<Running>,
    broken_in_a_row: usize,
    has_answered: bool,
}

#[derive(Debug)]
struct Running {
    child: Child,
    to_child: Sender<String>,
    from_child: Receiver<String>,
    stderr: Arc<Mutex<Vec<u8>>>,
}

impl Process {
    /// A program started by the shell as `command`, `jobs` copies of it, each given `timeout` for a problem.
    pub fn new(command: &str, timeout: Duration, jobs: usize) -> Process {
        let workers = (0..jobs.max(1)).map(|_| Mutex::new(Worker::default())).collect();
        Process { command: command.to_string(), timeout, workers }
    }

    fn ask_worker(&self, worker: &mut Worker, problem: &Problem) -> Result<Answer, Breakage> {
        let patience = if worker.has_answered { LONG_PATIENCE } else { PATIENCE };
        if worker.broken_in_a_row >= patience {
            return Err(Breakage::NotAsked(format!("{patience} breakages in a row before")));
        }
        let result = self.converse(worker, problem);
        worker.has_answered |= result.is_ok();
        worker.broken_in_a_row = if result.is_ok() { 0 } else { worker.broken_in_a_row + 1 };
        if result.is_err() {
            // A late or half-read answer must not meet the next problem.
            worker.running = None;
        }
        result
    }

    /// Sends the problem and reads until its answer, the deadline or the end of the program. A line that is no answer, or the
    /// answer to another problem, is what is reported.
    fn converse(&self, worker: &mut Worker, problem: &Problem) -> Result<Answer, Breakage> {
        let crashed = |how: String| Breakage::Crashed { how, stderr: String::new() };
        if worker.running.is_none() {
            worker.running = Some(Running::start(&self.command).map_err(|e| crashed(e.to_string()))?);
        }
        let Some(running) = worker.running.as_mut() else { return Err(crashed("not started".into())) };
        if running.to_child.send(problem.to_line()).is_err() {
            return Err(running.obituary());
        }
        let deadline = Instant::now() + self.timeout;
        let mut wrong: Option<Breakage> = None;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let line = match running.from_child.recv_timeout(left) {
                Ok(line) => line,
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(wrong.unwrap_or_else(|| running.obituary()));
                }
                Err(RecvTimeoutError::Timeout) => {
                    return Err(wrong.unwrap_or(Breakage::Timeout { seconds: self.timeout.as_secs_f64() }));
                }
            };
            match read_line(&line) {
                Ok(answer) if answer.id == problem.id => return wrong.map_or(Ok(answer), Err),
                Ok(answer) => wrong = wrong.or(Some(Breakage::WrongId { got: answer.id })),
                Err(breakage) => {
                    wrong = wrong.or(Some(breakage));
                    if id_in(&line) == Some(&problem.id) {
                        return Err(wrong.unwrap_or(Breakage::Missing { what: "an answer".into() }));
                    }
                }
            }
        }
    }
}

impl Solver for Process {
    fn name(&self) -> String {
        self.command.clone()
    }

    fn ask(&self, problem: &Problem) -> Result<Answer, Breakage> {
        let mut worker = self.workers[0].lock().unwrap_or_else(PoisonError::into_inner);
        self.ask_worker(&mut worker, problem)
    }

    fn ask_all(&self, problems: &[Problem]) -> Vec<Reply> {
        let next = AtomicUsize::new(0);
        let replies: Vec<Mutex<Option<Reply>>> = problems.iter().map(|_| Mutex::new(None)).collect();
        std::thread::scope(|scope| {
            for worker in &self.workers {
                scope.spawn(|| {
                    let mut worker = worker.lock().unwrap_or_else(PoisonError::into_inner);
                    while let Some(i) =
                        Some(next.fetch_add(1, Ordering::Relaxed)).filter(|i| *i < problems.len())
                    {
                        let given = reply(&problems[i], || self.ask_worker(&mut worker, &problems[i]));
                        *replies[i].lock().unwrap_or_else(PoisonError::into_inner) = Some(given);
                    }
                });
            }
        });
        let told = |slot: Mutex<Option<Reply>>| slot.into_inner().unwrap_or_else(PoisonError::into_inner);
        replies.into_iter().map(|slot| told(slot).expect("every problem was taken by a worker")).collect()
    }
}

impl Running {
    fn start(command: &str) -> std::io::Result<Running> {
        let (shell, flag) = if cfg!(windows) { ("cmd", "/C") } else { ("sh", "-c") };
        let mut starter = Command::new(shell);
        starter.args([flag, command]).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        // A group of its own: what the shell starts can be ended together with it.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut starter, 0);
        let mut child = starter.spawn()?;
        GROUPS.lock().unwrap_or_else(PoisonError::into_inner).insert(child.id());
        let broken = || std::io::Error::other("the program has no pipes");
        let mut stdin = child.stdin.take().ok_or_else(broken)?;
        let stdout = child.stdout.take().ok_or_else(broken)?;
        let mut errors = child.stderr.take().ok_or_else(broken)?;
        let (to_child, lines_in) = channel::<String>();
        let (lines_out, from_child) = channel::<String>();
        // A thread of its own writes: a program that never reads would block the gate for ever.
        std::thread::spawn(move || {
            while let Ok(mut line) = lines_in.recv() {
                line.push('\n');
                if stdin.write_all(line.as_bytes()).and_then(|()| stdin.flush()).is_err() {
                    break;
                }
            }
        });
        std::thread::spawn(move || {
            let mut reader = BufReader::new(stdout);
            let mut bytes = Vec::new();
            while matches!(reader.read_until(b'\n', &mut bytes), Ok(n) if n > 0) {
                let line = String::from_utf8_lossy(&bytes).trim().to_string();
                bytes.clear();
                if !line.is_empty() && lines_out.send(line).is_err() {
                    break;
                }
            }
        });
        let stderr = Arc::new(Mutex::new(Vec::new()));
        let kept = Arc::clone(&stderr);
        std::thread::spawn(move || {
            let mut chunk = [0u8; 4096];
            while let Ok(n) = errors.read(&mut chunk) {
                if n == 0 {
                    break;
                }
                let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
                kept.extend_from_slice(&chunk[..n]);
                let surplus = kept.len().saturating_sub(STDERR_TAIL);
                kept.drain(..surplus);
            }
        });
        Ok(Running { child, to_child, from_child, stderr })
    }

    /// How the program ended, and its last words.
    fn obituary(&mut self) -> Breakage {
        // Its output is closed; it is given a moment to end by itself.
        let deadline = Instant::now() + Duration::from_millis(500);
        let status = loop {
            match self.child.try_wait() {
                Ok(Some(status)) => break status.to_string(),
                Ok(None) if Instant::now() < deadline => std::thread::sleep(Duration::from_millis(5)),
                Ok(None) => break "its output was closed".to_string(),
                Err(error) => break error.to_string(),
            }
        };
        let kept = self.stderr.lock().unwrap_or_else(PoisonError::into_inner);
        let last = String::from_utf8_lossy(&kept).trim().replace('\n', " | ");
        Breakage::Crashed { how: status, stderr: last }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let id = self.child.id();
        end_group(id);
        GROUPS.lock().unwrap_or_else(PoisonError::into_inner).remove(&id);
        // As there: it fails only where the program has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
