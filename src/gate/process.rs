//! How is a program judged that is not ours? It is kept alive over all problems, and started again when it
//! breaks.

use super::accept::{Breakage, LINE_HEAD, id_in, read_line, within};
use super::greeting::{Greeting, probe};
use super::program::{Ending, MOST_LINE_BYTES, PipedProgram, ProgramEnd, Silence};
use super::protocol::{Answer, Problem};
use super::quoted::quoted;
use super::solver::{Given, Solver};
use calibench::camera::Model;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// After this many breakages in a row a worker stops asking a program that never gave an answer: it does not
/// work at all.
const PATIENCE: usize = 3;
/// The same for a program that has answered before: more than all bad input of a run, which may well break it
/// every time.
const LONG_PATIENCE: usize = 24;
/// Lines that are no answer before a problem is given up: a program that talks much is told from one that
/// never ends.
const MOST_WRONG_LINES: usize = 1000;
/// Between two looks whether a thread is still with a program that is to be ended.
const MOMENT: Duration = Duration::from_millis(10);
/// How long is waited for a program that cannot be ended.
const ENDING: Duration = Duration::from_secs(5);

/// A program that reads problems and writes answers, one JSON object a line.
#[derive(Debug)]
pub struct Process {
    command: String,
    timeout: Duration,
    workers: Vec<Mutex<Worker>>,
    /// Whatever was started.
    started: Mutex<Vec<Ending>>,
    is_stopped: AtomicBool,
    /// Threads that may start a program, or wait for one.
    busy: AtomicUsize,
}

/// One running copy of the program.
#[derive(Debug, Default)]
struct Worker {
    running: Option<Running>,
    broken_in_a_row: usize,
    has_answered: bool,
}

impl Worker {
    fn heard(&mut self, answer: &Result<Answer, Breakage>) {
        match (answer, &mut self.running) {
            (Ok(_), Some(running)) => running.has_answered = true,
            // A late or half-read answer must not meet the next problem.
            _ => self.running = None,
        }
    }
}

/// A program since its last start.
#[derive(Debug)]
struct Running {
    program: PipedProgram,
    greeting: Option<Greeting>,
    has_answered: bool,
}

impl Running {
    fn start(command: &str) -> std::io::Result<Running> {
        Ok(Running { program: PipedProgram::start(command)?, greeting: None, has_answered: false })
    }

    /// Takes a line for a greeting, if it is one: before the first answer, and once.
    ///
    /// # Errors
    /// A greeting that is malformed, late, or the second.
    fn is_greeted_by(&mut self, line: &str) -> Result<bool, Breakage> {
        let wrong = |reason: String| Breakage::Garbage {
            reason: quoted(&format!("the greeting is malformed: {reason}")),
            line: quoted(&line.chars().take(LINE_HEAD).collect::<String>()),
        };
        match Greeting::read(line).map_err(wrong)? {
            None => Ok(false),
            Some(_) if self.has_answered || self.greeting.is_some() => {
                Err(wrong("it comes once, before the first answer".to_string()))
            }
            greeting => {
                self.greeting = greeting;
                Ok(true)
            }
        }
    }
}

/// What it means for a problem that a program was not heard within `allowed`.
fn breakage(silence: Silence, allowed: Duration) -> Breakage {
    match silence {
        Silence::Late => Breakage::Timeout { seconds: allowed.as_secs_f64() },
        Silence::TooLong => Breakage::TooLong { limit: MOST_LINE_BYTES },
        Silence::Ended { how, stderr } => Breakage::Crashed { how, stderr },
    }
}

impl Process {
    /// A program started by the shell as `command`, `jobs` copies of it, each given `timeout` for a problem.
    pub fn new(command: &str, timeout: Duration, jobs: usize) -> Process {
        let workers = (0..jobs.max(1)).map(|_| Mutex::new(Worker::default())).collect();
        Process {
            command: command.to_string(),
            timeout,
            workers,
            started: Mutex::default(),
            is_stopped: AtomicBool::new(false),
            busy: AtomicUsize::new(0),
        }
    }

    /// Ends every copy, and starts none after it: what is asked from now on is not answered. For a thread
    /// that hears an interrupt while others ask; other programs of this process go on.
    pub fn stop(&self) {
        self.is_stopped.store(true, Ordering::SeqCst);
        let begun = Instant::now();
        loop {
            let started = self.started.lock().unwrap_or_else(PoisonError::into_inner).clone();
            started.iter().for_each(Ending::end);
            if self.busy.load(Ordering::SeqCst) == 0 || begun.elapsed() > ENDING {
                break;
            }
            std::thread::sleep(MOMENT);
        }
    }

    /// Does what may start a program, unless the run was stopped. Who is seen by [`stop`](Process::stop) as
    /// busy is waited for; who is not sees that it came.
    fn unless_stopped<T>(&self, work: impl FnOnce() -> T) -> Option<T> {
        self.busy.fetch_add(1, Ordering::SeqCst);
        let done = (!self.is_stopped.load(Ordering::SeqCst)).then(work);
        self.busy.fetch_sub(1, Ordering::SeqCst);
        done
    }

    fn ask_worker(&self, worker: &mut Worker, problem: &Problem) -> Result<Answer, Breakage> {
        let patience = if worker.has_answered { LONG_PATIENCE } else { PATIENCE };
        if worker.broken_in_a_row >= patience {
            return Err(Breakage::NotAsked(format!("{patience} breakages in a row before")));
        }
        let result = self.unless_stopped(|| self.converse(worker, problem));
        let result = result.unwrap_or_else(|| Err(Breakage::NotAsked("the run was ended".into())));
        worker.has_answered |= result.is_ok();
        worker.broken_in_a_row = if result.is_ok() { 0 } else { worker.broken_in_a_row + 1 };
        worker.heard(&result);
        result
    }

    /// Sends the problem and reads until its answer, the deadline or the end of the program. A line that is
    /// no answer, or the answer to another problem, is what is reported.
    fn converse(&self, worker: &mut Worker, problem: &Problem) -> Result<Answer, Breakage> {
        let running = match &mut worker.running {
            Some(running) => running,
            none => {
                let crashed =
                    |e: std::io::Error| Breakage::Crashed { how: e.to_string(), stderr: String::new() };
                let running = Running::start(&self.command).map_err(crashed)?;
                let mut started = self.started.lock().unwrap_or_else(PoisonError::into_inner);
                started.push(running.program.ending());
                none.insert(running)
            }
        };
        let mut allowed = self.timeout;
        running.program.send(problem.to_line()).map_err(|silence| breakage(silence, allowed))?;
        let asked = Instant::now();
        let mut wrong: Option<Breakage> = None;
        let mut lines = 0;
        loop {
            if let Some(first) = wrong.as_ref().filter(|_| lines >= MOST_WRONG_LINES) {
                return Err(Breakage::Flood { lines, first: first.to_string() });
            }
            lines += 1;
            let line = match running.program.line_before(asked + allowed) {
                Ok(line) => line,
                Err(Silence::TooLong) => return Err(breakage(Silence::TooLong, allowed)),
                Err(silence) => return Err(wrong.unwrap_or_else(|| breakage(silence, allowed))),
            };
            if running.is_greeted_by(&line)? {
                allowed += running.greeting.as_ref().map_or(Duration::ZERO, Greeting::warm_up);
                continue;
            }
            match read_line(&line) {
                Ok(answer) if answer.id == problem.id => {
                    return wrong.map_or_else(|| within(problem, answer), Err);
                }
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

    /// Asks the program a first easy problem: what it says of itself comes before the answer.
    fn models(&self) -> Vec<Model> {
        let mut worker = self.workers[0].lock().unwrap_or_else(PoisonError::into_inner);
        let Some(answer) = self.unless_stopped(|| self.converse(&mut worker, &probe())) else {
            return Vec::new();
        };
        let greeting = worker.running.as_ref().and_then(|running| running.greeting.as_ref());
        let models = greeting.map_or(vec![Model::BrownConrady], Greeting::models);
        worker.heard(&answer);
        models
    }

    fn ask(&self, problem: &Problem) -> Result<Answer, Breakage> {
        let mut worker = self.workers[0].lock().unwrap_or_else(PoisonError::into_inner);
        self.ask_worker(&mut worker, problem)
    }

    /// Of the copies that run; one that broke last is ended already.
    fn finish(&self) -> Vec<ProgramEnd> {
        let running = self
            .workers
            .iter()
            .filter_map(|worker| worker.lock().unwrap_or_else(PoisonError::into_inner).running.take());
        let running: Vec<Running> = running.collect();
        std::thread::scope(|scope| {
            let ends: Vec<_> =
                running.into_iter().map(|running| scope.spawn(|| running.program.finish())).collect();
            ends.into_iter().filter_map(|end| end.join().ok()).collect()
        })
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
