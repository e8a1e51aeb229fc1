//! How is a program judged that is not ours? As a black box behind two pipes, kept alive over all problems.

use super::accept::{Breakage, id_in, read_line};
use super::descendants;
use super::protocol::{Answer, Problem};
use super::quoted::quoted;
use super::solver::{Given, Solver};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// After this many breakages in a row a worker stops asking a program that never gave an answer: it does not
/// work at all.
const PATIENCE: usize = 3;
/// The same for a program that has answered before: more than all bad input of a run, which may well break it
/// every time.
const LONG_PATIENCE: usize = 24;
/// How long is waited before something is looked at again.
const MOMENT: Duration = Duration::from_millis(5);
/// Bytes of standard error that are quoted.
const STDERR_TAIL: usize = 400;

/// Bytes of a line. The answer to the largest problem, poses of all views and a full covariance, takes 20 kB.
pub const MOST_LINE_BYTES: usize = 1 << 20;
/// Lines that are read ahead: with the longest lines 16 MB a program. A program that writes on waits for its
/// pipe.
const LINES_AHEAD: usize = 16;
/// Lines that are no answer before a problem is given up: a program that talks much is told from one that
/// never ends.
const MOST_WRONG_LINES: usize = 1000;

/// Programs that run, by process group, each with its mark: to be ended when the gate is interrupted, since a
/// group of its own hears no Ctrl-C.
static RUNNING: Mutex<BTreeMap<u32, String>> = Mutex::new(BTreeMap::new());

/// Makes this process the parent of whatever a program leaves behind, so that [`end_all`] finds it. Only for
/// a process that starts no other programs: they would be ended too.
pub fn adopt_orphans() {
    descendants::adopt_orphans();
}

/// Ends every program that any gate of this process started, with what they started, and whatever else runs
/// below this process.
pub fn end_all() {
    let running = std::mem::take(&mut *RUNNING.lock().unwrap_or_else(PoisonError::into_inner));
    running.iter().for_each(|(group, mark)| descendants::end(*group, mark));
    descendants::end_below();
}

/// Whether a process was started here: who started it waits for it.
#[cfg(target_os = "linux")]
pub(super) fn is_waited_for(id: u32) -> bool {
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner).contains_key(&id)
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

/// What a program wrote.
#[derive(Debug)]
enum Heard {
    Line(String),
    /// A line that did not end in time; nothing is read after it.
    TooLong,
}

#[derive(Debug)]
struct Running {
    child: Child,
    to_child: Sender<String>,
    from_child: Receiver<Heard>,
    /// Its mark in the environment, see [`descendants`].
    mark: String,
    /// The end of what it wrote to standard error.
    stderr: Arc<Mutex<Vec<u8>>>,
    stderr_reader: JoinHandle<()>,
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

    /// Sends the problem and reads until its answer, the deadline or the end of the program. A line that is
    /// no answer, or the answer to another problem, is what is reported.
    fn converse(&self, worker: &mut Worker, problem: &Problem) -> Result<Answer, Breakage> {
        let crashed = |how: String| Breakage::Crashed { how, stderr: String::new() };
        if worker.running.is_none() {
            worker.running = Some(Running::start(&self.command).map_err(|e| crashed(e.to_string()))?);
        }
        let Some(running) = worker.running.as_mut() else { return Err(crashed("not started".into())) };
        if running.to_child.send(problem.to_line()).is_err() {
            return Err(running.crash());
        }
        let deadline = Instant::now() + self.timeout;
        let mut wrong: Option<Breakage> = None;
        let mut lines = 0;
        loop {
            if let Some(first) = wrong.as_ref().filter(|_| lines >= MOST_WRONG_LINES) {
                return Err(Breakage::Flood { lines, first: first.to_string() });
            }
            lines += 1;
            let left = deadline.saturating_duration_since(Instant::now());
            let line = match running.from_child.recv_timeout(left) {
                Ok(Heard::Line(line)) => line,
                Ok(Heard::TooLong) => return Err(Breakage::TooLong { limit: MOST_LINE_BYTES }),
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(wrong.unwrap_or_else(|| running.crash()));
                }
                Err(RecvTimeoutError::Timeout) => {
                    return Err(wrong.unwrap_or(Breakage::Timeout { seconds: self.timeout.as_secs_f64() }));
                }
            };
            match read_line(&line) {
                Ok(answer) if answer.id == problem.id => return wrong.map_or(Ok(answer), Err),
                Ok(answer) => wrong = wrong.or(Some(Breakage::WrongId { got: quoted(&answer.id) })),
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

    fn give_all(&self, problems: &[Problem]) -> Vec<Given> {
        let next = AtomicUsize::new(0);
        let answers: Vec<Mutex<Option<Given>>> = problems.iter().map(|_| Mutex::new(None)).collect();
        std::thread::scope(|scope| {
            for worker in &self.workers {
                scope.spawn(|| {
                    let mut worker = worker.lock().unwrap_or_else(PoisonError::into_inner);
                    while let Some(i) =
                        Some(next.fetch_add(1, Ordering::Relaxed)).filter(|i| *i < problems.len())
                    {
                        let given = Given::taken(|| self.ask_worker(&mut worker, &problems[i]));
                        *answers[i].lock().unwrap_or_else(PoisonError::into_inner) = Some(given);
                    }
                });
            }
        });
        let told = |slot: Mutex<Option<Given>>| slot.into_inner().unwrap_or_else(PoisonError::into_inner);
        answers.into_iter().map(|slot| told(slot).expect("every problem was taken by a worker")).collect()
    }
}

impl Running {
    fn start(command: &str) -> std::io::Result<Running> {
        let (shell, flag) = if cfg!(windows) { ("cmd", "/C") } else { ("sh", "-c") };
        let mut starter = Command::new(shell);
        starter.args([flag, command]).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        static STARTS: AtomicU64 = AtomicU64::new(0);
        let mark = format!("{}.{}", std::process::id(), STARTS.fetch_add(1, Ordering::Relaxed));
        starter.env(descendants::MARK, &mark);
        // A group of its own: what the shell starts can be ended together with it.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut starter, 0);
        // Known before anybody looks for children that nobody waits for.
        let mut running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
        let mut child = starter.spawn()?;
        running.insert(child.id(), mark.clone());
        drop(running);
        let broken = || std::io::Error::other("the program has no pipes");
        let mut stdin = child.stdin.take().ok_or_else(broken)?;
        let stdout = child.stdout.take().ok_or_else(broken)?;
        let mut errors = child.stderr.take().ok_or_else(broken)?;
        let (to_child, lines_in) = channel::<String>();
        let (lines_out, from_child) = sync_channel::<Heard>(LINES_AHEAD);
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
            loop {
                let mut limited = reader.by_ref().take(MOST_LINE_BYTES as u64 + 1);
                if !matches!(limited.read_until(b'\n', &mut bytes), Ok(n) if n > 0) {
                    break;
                }
                if bytes.len() > MOST_LINE_BYTES {
                    // The receiver is gone only where nobody asks any more.
                    let _ = lines_out.send(Heard::TooLong);
                    break;
                }
                let line = String::from_utf8_lossy(&bytes).trim().to_string();
                bytes.clear();
                if !line.is_empty() && lines_out.send(Heard::Line(line)).is_err() {
                    break;
                }
            }
        });
        let stderr = Arc::new(Mutex::new(Vec::new()));
        let kept = Arc::clone(&stderr);
        let stderr_reader = std::thread::spawn(move || {
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
        Ok(Running { child, to_child, from_child, mark, stderr, stderr_reader })
    }

    /// How the program ended, and the end of what it wrote to standard error.
    fn crash(&mut self) -> Breakage {
        // Its output is closed; it is given a moment to end by itself, and the reader of its standard error
        // to come to the end of that.
        let deadline = Instant::now() + Duration::from_millis(500);
        let status = loop {
            match self.child.try_wait() {
                Ok(Some(status)) => break status.to_string(),
                Ok(None) if Instant::now() < deadline => std::thread::sleep(MOMENT),
                Ok(None) => break "its output was closed".to_string(),
                Err(error) => break error.to_string(),
            }
        };
        while !self.stderr_reader.is_finished() && Instant::now() < deadline {
            std::thread::sleep(MOMENT);
        }
        let kept = self.stderr.lock().unwrap_or_else(PoisonError::into_inner);
        let last = quoted(&String::from_utf8_lossy(&kept).trim().replace('\n', " | "));
        Breakage::Crashed { how: status, stderr: last }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let id = self.child.id();
        descendants::end(id, &self.mark);
        // As there: it fails only where the program has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
        RUNNING.lock().unwrap_or_else(PoisonError::into_inner).remove(&id);
    }
}
