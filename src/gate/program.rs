//! How is a program driven that is not ours? As a black box behind two pipes, ended with whatever it started.

use super::descendants;
use super::quoted::quoted;
use super::running;
use serde::Serialize;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStderr, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Bytes of a line. The answer to the largest problem, thirty-two poses with their covariances, takes 37 kB.
pub const MOST_LINE_BYTES: usize = 1 << 20;
/// How long is waited before something is looked at again.
const MOMENT: Duration = Duration::from_millis(5);
/// How long a program whose output is closed is given to end by itself.
const LAST_WORDS: Duration = Duration::from_millis(500);
/// How long a program is given to end by itself when its input has ended: some write out what they learnt.
const AFTER_INPUT: Duration = Duration::from_secs(5);
/// Bytes of standard error that are quoted.
const STDERR_TAIL: usize = 400;
/// Lines that are read ahead: with the longest lines 16 MB a program. A program that writes on waits for its
/// pipe.
const LINES_AHEAD: usize = 16;

/// Makes this process the parent of whatever a program leaves behind, so that [`end_all`] finds it. Only for
/// a process that starts no other programs: they would be ended too.
pub fn adopt_orphans() {
    descendants::adopt_orphans();
}

/// Ends every program that any gate of this process started, with what they started, and whatever else runs
/// below this process.
pub fn end_all() {
    running::take().iter().for_each(|(group, mark)| descendants::end(*group, mark));
    descendants::end_below();
}

/// The same for a process that is about to end itself. Meanwhile no program is started, and whoever asks one
/// waits for the end: a program that is ended here broke no rule.
pub fn end_for_good() {
    running::start_no_more();
    end_all();
}

/// What ends a program from another thread than the one that talks with it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Ending {
    group: u32,
    mark: String,
}

impl Ending {
    /// Ends the program with what it started, if it still runs: its number may be another's by now.
    pub fn end(&self) {
        if running::is_running(self.group, &self.mark) {
            descendants::end(self.group, &self.mark);
        }
    }
}

/// What a program wrote.
#[derive(Debug)]
enum Heard {
    Line(String),
    /// A line that did not end in time; nothing is read after it.
    TooLong,
}

impl Heard {
    /// Whether it may be an answer: other lines are a library's.
    fn is_object(&self) -> bool {
        matches!(self, Heard::Line(line) if line.starts_with('{'))
    }
}

/// Why a program is not heard.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Silence {
    /// No line before the deadline.
    #[error("no line in time")]
    Late,
    /// A line that is longer than [`MOST_LINE_BYTES`].
    #[error("a line of more than {MOST_LINE_BYTES} bytes")]
    TooLong,
    /// It ended, or closed its output.
    #[error("the process ended ({how}){}", if stderr.is_empty() { String::new() } else { format!(": {stderr}") })]
    Ended {
        /// Exit status.
        how: String,
        /// The end of its standard error, fit for a terminal.
        stderr: String,
    },
}

/// How a program ended when its input had ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct ProgramEnd {
    /// Whether it ended by itself, within five seconds; else it was ended.
    pub by_itself: bool,
    /// Its exit code, if it ended by itself and not by a signal.
    pub exit_code: Option<i32>,
    /// The signal that it ended by itself with.
    pub signal: Option<i32>,
    /// Most memory that was resident at a time, of the largest process of those that ran when its input
    /// ended; `None` where the system does not say, as systems other than Linux.
    pub peak_memory_bytes: Option<u64>,
    /// JSON objects that it wrote after its last answer, which nobody asked for.
    pub answers_unasked: usize,
}

impl ProgramEnd {
    fn of(status: Option<ExitStatus>, peak_memory_bytes: Option<u64>, answers_unasked: usize) -> ProgramEnd {
        #[cfg(unix)]
        let signal = status.and_then(|status| std::os::unix::process::ExitStatusExt::signal(&status));
        #[cfg(not(unix))]
        let signal = None;
        let exit_code = status.and_then(|status| status.code());
        ProgramEnd { by_itself: status.is_some(), exit_code, signal, peak_memory_bytes, answers_unasked }
    }

    /// In words.
    pub fn how(&self) -> String {
        let how = match (self.exit_code, self.signal) {
            (Some(code), _) => format!("exit code {code}"),
            (None, Some(signal)) => format!("ended by signal {signal}"),
            (None, None) => "did not end with its input".to_string(),
        };
        match self.answers_unasked {
            0 => how,
            1 => format!("{how} after an answer that nobody asked for"),
            unasked => format!("{how} after {unasked} answers that nobody asked for"),
        }
    }
}

/// A running program. Dropped, it is ended with all that it started.
#[derive(Debug)]
pub struct PipedProgram {
    child: Child,
    /// Nothing once its input has ended.
    to_child: Option<Sender<String>>,
    from_child: Receiver<Heard>,
    /// Its mark in the environment, see [`descendants`].
    mark: String,
    /// The end of what it wrote to standard error.
    stderr: Arc<Mutex<Vec<u8>>>,
    stderr_reader: JoinHandle<()>,
}

impl PipedProgram {
    /// Starts `command` by the system's shell.
    ///
    /// # Errors
    /// The shell cannot be started.
    pub fn start(command: &str) -> std::io::Result<PipedProgram> {
        let (shell, flag) = if cfg!(windows) { ("cmd", "/C") } else { ("sh", "-c") };
        let mut starter = Command::new(shell);
        starter.args([flag, command]).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        static STARTS: AtomicU64 = AtomicU64::new(0);
        let mark = format!("{}.{}", std::process::id(), STARTS.fetch_add(1, Ordering::Relaxed));
        starter.env(descendants::MARK, &mark);
        // A group of its own: what the shell starts can be ended together with it.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut starter, 0);
        let mut child = running::start(&mut starter, &mark)?;
        let no_pipe = || std::io::Error::other("the program has no pipes");
        let stdin = child.stdin.take().ok_or_else(no_pipe)?;
        let stdout = child.stdout.take().ok_or_else(no_pipe)?;
        let errors = child.stderr.take().ok_or_else(no_pipe)?;
        let (to_child, lines_in) = channel();
        let (lines_out, from_child) = sync_channel(LINES_AHEAD);
        let stderr = Arc::new(Mutex::new(Vec::new()));
        let kept = Arc::clone(&stderr);
        // A thread of its own writes: a program that never reads would block the gate for ever.
        std::thread::spawn(move || write_lines(stdin, &lines_in));
        std::thread::spawn(move || read_lines(stdout, &lines_out));
        let stderr_reader = std::thread::spawn(move || keep_tail(errors, &kept));
        Ok(PipedProgram { child, to_child: Some(to_child), from_child, mark, stderr, stderr_reader })
    }

    pub(super) fn ending(&self) -> Ending {
        Ending { group: self.child.id(), mark: self.mark.clone() }
    }

    /// Sends a line, given without its end.
    ///
    /// # Errors
    /// The program reads no more.
    pub fn send(&mut self, line: String) -> Result<(), Silence> {
        let sent = self.to_child.as_ref().is_some_and(|to_child| to_child.send(line).is_ok());
        if sent { Ok(()) } else { Err(self.ended()) }
    }

    /// The next line that is not empty, without white space around it.
    ///
    /// # Errors
    /// None came before the deadline, or none will come.
    pub fn line_before(&mut self, deadline: Instant) -> Result<String, Silence> {
        let left = deadline.saturating_duration_since(Instant::now());
        match self.from_child.recv_timeout(left) {
            Ok(Heard::Line(line)) => Ok(line),
            Ok(Heard::TooLong) => Err(Silence::TooLong),
            Err(RecvTimeoutError::Timeout) => {
                running::halt_where_it_is_over();
                Err(Silence::Late)
            }
            Err(RecvTimeoutError::Disconnected) => Err(self.ended()),
        }
    }

    /// Ends the program's input and waits for it to end by itself; what it still writes is counted and not
    /// judged.
    pub fn finish(mut self) -> ProgramEnd {
        running::halt_where_it_is_over();
        let peak = descendants::peak_memory_bytes(self.child.id(), &self.mark);
        self.to_child = None;
        let deadline = Instant::now() + AFTER_INPUT;
        let mut unasked = 0;
        let status = loop {
            // A program that writes to a full pipe would never end.
            unasked += self.from_child.try_iter().filter(Heard::is_object).count();
            match self.child.try_wait() {
                Ok(Some(status)) => break Some(status),
                Ok(None) if Instant::now() < deadline => std::thread::sleep(MOMENT),
                _ => break None,
            }
        };
        // What it wrote last may still be on its way; what it left behind may hold its output open.
        let deadline = Instant::now() + LAST_WORDS;
        while status.is_some()
            && let Ok(heard) =
                self.from_child.recv_timeout(deadline.saturating_duration_since(Instant::now()))
        {
            unasked += usize::from(heard.is_object());
        }
        ProgramEnd::of(status, peak, unasked)
    }

    /// How the program ended, and the end of what it wrote to standard error.
    fn ended(&mut self) -> Silence {
        running::halt_where_it_is_over();
        // Its output is closed; it is given a moment to end by itself, and the reader of its standard error
        // to come to the end of that.
        let deadline = Instant::now() + LAST_WORDS;
        let how = loop {
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
        let stderr = quoted(&String::from_utf8_lossy(&kept).trim().replace('\n', " | "));
        Silence::Ended { how, stderr }
    }
}

impl Drop for PipedProgram {
    fn drop(&mut self) {
        let id = self.child.id();
        descendants::end(id, &self.mark);
        // As there: it fails only where the program has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
        running::let_go(id);
    }
}

fn write_lines(mut stdin: ChildStdin, lines: &Receiver<String>) {
    while let Ok(mut line) = lines.recv() {
        line.push('\n');
        if stdin.write_all(line.as_bytes()).and_then(|()| stdin.flush()).is_err() {
            break;
        }
    }
}

fn read_lines(stdout: ChildStdout, heard: &SyncSender<Heard>) {
    let mut reader = BufReader::new(stdout);
    let mut bytes = Vec::new();
    loop {
        let mut limited = reader.by_ref().take(MOST_LINE_BYTES as u64 + 1);
        if !matches!(limited.read_until(b'\n', &mut bytes), Ok(n) if n > 0) {
            break;
        }
        if bytes.len() > MOST_LINE_BYTES {
            // The receiver is gone only where nobody asks any more.
            let _ = heard.send(Heard::TooLong);
            break;
        }
        let line = String::from_utf8_lossy(&bytes).trim().to_string();
        bytes.clear();
        if !line.is_empty() && heard.send(Heard::Line(line)).is_err() {
            break;
        }
    }
}

fn keep_tail(mut errors: ChildStderr, kept: &Mutex<Vec<u8>>) {
    let mut chunk = [0u8; 4096];
    while let Ok(n @ 1..) = errors.read(&mut chunk) {
        let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.extend_from_slice(&chunk[..n]);
        let surplus = kept.len().saturating_sub(STDERR_TAIL);
        kept.drain(..surplus);
    }
}
