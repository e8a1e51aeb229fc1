//! How is a program asked that is not ours? As a black box behind two pipes, started again when it breaks.

use super::Solver;
use super::protocol::{Answer, Problem};
use calibench_gate::process::MOST_LINE_BYTES;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// After as many breakages in a row it is asked no more.
const PATIENCE: usize = 5;
/// Lines that are read ahead.
const LINES_AHEAD: usize = 16;
/// Wrong lines before an answer, such as greetings of a library.
const MOST_WRONG_LINES: usize = 1000;

/// How long an ended program's last words are waited for.
const MOMENT: Duration = Duration::from_millis(100);
/// Bytes of standard error that are told when it ends.
const STDERR_TAIL: usize = 300;

/// A program that reads problems and writes answers, one JSON object a line.
#[derive(Debug)]
pub struct Program {
    command: String,
    timeout: Duration,
    running: Option<Running>,
    broken_in_a_row: usize,
}

#[derive(Debug)]
struct Running {
    child: Child,
    to_child: ChildStdin,
    from_child: Receiver<String>,
    /// The end of what it wrote to standard error.
    stderr: Arc<Mutex<Vec<u8>>>,
}

impl Program {
    /// A program started by the shell as `command`, given `timeout` for a problem.
    pub fn new(command: &str, timeout: Duration) -> Program {
        Program { command: command.to_string(), timeout, running: None, broken_in_a_row: 0 }
    }

    fn ask(&mut self, problem: &Problem) -> Result<Answer, String> {
        if self.broken_in_a_row >= PATIENCE {
            return Err(format!("not asked: {PATIENCE} breakages in a row before"));
        }
        let answer = self.converse(problem);
        if answer.is_err() {
            // A late or half-read answer must not meet the next problem.
            self.running = None;
        }
        self.broken_in_a_row = if answer.is_ok() { 0 } else { self.broken_in_a_row + 1 };
        answer
    }

    fn converse(&mut self, problem: &Problem) -> Result<Answer, String> {
        if self.running.is_none() {
            self.running =
                Some(Running::start(&self.command).map_err(|error| format!("not started: {error}"))?);
        }
        let running = self.running.as_mut().ok_or("not started")?;
        // A problem is far smaller than a pipe holds, and is asked only after the last was answered.
        let line = problem.to_line() + "\n";
        let sent = running.to_child.write_all(line.as_bytes()).and_then(|()| running.to_child.flush());
        sent.map_err(|_| running.ended())?;
        let deadline = Instant::now() + self.timeout;
        for _ in 0..MOST_WRONG_LINES {
            let left = deadline.saturating_duration_since(Instant::now());
            let line = running.from_child.recv_timeout(left).map_err(|error| match error {
                RecvTimeoutError::Timeout => format!("no answer within {} s", self.timeout.as_secs_f64()),
                RecvTimeoutError::Disconnected => running.ended(),
            })?;
            match serde_json::from_str::<Answer>(&line) {
                Ok(answer) if answer.id == problem.id => return Ok(answer),
                Ok(answer) => {
                    return Err(format!("the answer to `{}` has the id `{}`", problem.id, answer.id));
                }
                // What is no JSON may be a library's greeting.
                Err(_) if !line.starts_with('{') => {}
                Err(error) => return Err(format!("no answer: {error}")),
            }
        }
        Err(format!("{MOST_WRONG_LINES} lines and no answer among them"))
    }
}

impl Solver for Program {
    fn name(&self) -> String {
        self.command.clone()
    }

    fn answer_all(&mut self, problems: &[Problem]) -> Vec<Result<Answer, String>> {
        problems.iter().map(|problem| self.ask(problem)).collect()
    }
}

impl Running {
    fn start(command: &str) -> std::io::Result<Running> {
        let (shell, flag) = if cfg!(windows) { ("cmd", "/C") } else { ("sh", "-c") };
        let mut starter = Command::new(shell);
        starter.args([flag, command]).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        // A group of its own: what the shell starts is ended together with it.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut starter, 0);
        let mut child = starter.spawn()?;
        let no_pipe = || std::io::Error::other("the program has no pipes");
        let to_child = child.stdin.take().ok_or_else(no_pipe)?;
        let stdout = child.stdout.take().ok_or_else(no_pipe)?;
        let mut errors = child.stderr.take().ok_or_else(no_pipe)?;
        let stderr = Arc::new(Mutex::new(Vec::new()));
        let kept = Arc::clone(&stderr);
        std::thread::spawn(move || {
            let mut chunk = [0u8; 4096];
            while let Ok(n @ 1..) = errors.read(&mut chunk) {
                let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
                kept.extend_from_slice(&chunk[..n]);
                let surplus = kept.len().saturating_sub(STDERR_TAIL);
                kept.drain(..surplus);
            }
        });
        let (lines_out, from_child) = sync_channel(LINES_AHEAD);
        std::thread::spawn(move || {
            let mut reader = BufReader::new(stdout);
            let mut bytes = Vec::new();
            loop {
                let mut limited = reader.by_ref().take(MOST_LINE_BYTES as u64);
                let is_whole = limited.read_until(b'\n', &mut bytes).is_ok() && bytes.last() == Some(&b'\n');
                let line = String::from_utf8_lossy(&bytes).trim().to_string();
                bytes.clear();
                if !is_whole || lines_out.send(line).is_err() {
                    break;
                }
            }
        });
        Ok(Running { child, to_child, from_child, stderr })
    }

    /// That the program ended, or wrote a line without end, with the end of its standard error.
    fn ended(&mut self) -> String {
        // Its output is closed; it is given a moment to write the reason.
        std::thread::sleep(MOMENT);
        let kept = self.stderr.lock().unwrap_or_else(PoisonError::into_inner);
        let last = String::from_utf8_lossy(&kept).trim().replace('\n', " | ");
        format!("the program ended, or wrote an endless line: {last}")
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        #[cfg(unix)]
        if let Ok(group) = i32::try_from(self.child.id()) {
            // It fails only where the program has ended already; so does what follows.
            let _ = nix::sys::signal::killpg(
                nix::unistd::Pid::from_raw(group),
                nix::sys::signal::Signal::SIGKILL,
            );
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
