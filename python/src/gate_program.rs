//! How is a program judged so that Ctrl-C leaves none of its copies running?
//!
//! Python hears the interrupt in one thread while the run goes on in another, which would start the next copy of a program that was ended. So
//! the run is told to stop first, and programs are ended until no thread is with one any more.

use calibench::camera::Model;
use calibench_gate::accept::Breakage;
use calibench_gate::protocol::{Answer, Problem};
use calibench_gate::solver::Given;
use calibench_gate::{Process, Solver, program};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Between two looks whether a thread is still with a program.
const MOMENT: Duration = Duration::from_millis(10);
/// How long is waited for a program that cannot be ended.
const PATIENCE: Duration = Duration::from_secs(5);

/// A program, several copies of it, and whether anybody still wants its answers.
pub(crate) struct StoppableProgram {
    copies: Vec<Process>,
    stopped: AtomicBool,
    /// Threads that may start a program, or wait for one.
    busy: AtomicUsize,
}

impl StoppableProgram {
    /// A program started by the shell as `command`, `jobs` copies of it, each given `timeout` for a problem.
    pub(crate) fn new(command: &str, timeout: Duration, jobs: usize) -> StoppableProgram {
        let copies = (0..jobs).map(|_| Process::new(command, timeout, 1)).collect();
        StoppableProgram { copies, stopped: AtomicBool::new(false), busy: AtomicUsize::new(0) }
    }

    /// Ends every copy; none is started after it.
    pub(crate) fn stop(&self) {
        self.stopped.store(true, Ordering::SeqCst);
        let begun = Instant::now();
        loop {
            program::end_all();
            if self.busy.load(Ordering::SeqCst) == 0 || begun.elapsed() > PATIENCE {
                break;
            }
            std::thread::sleep(MOMENT);
        }
    }

    /// Does what may start a program, unless the run was stopped. Who is seen by `stop` as busy is waited for; who is not sees that it came.
    fn unless_stopped<T>(&self, work: impl FnOnce() -> T) -> Option<T> {
        self.busy.fetch_add(1, Ordering::SeqCst);
        let done = (!self.stopped.load(Ordering::SeqCst)).then(work);
        self.busy.fetch_sub(1, Ordering::SeqCst);
        done
    }

    fn ask_copy(&self, copy: &Process, problem: &Problem) -> Result<Answer, Breakage> {
        let stopped = || Err(Breakage::NotAsked("the run was ended".to_string()));
        self.unless_stopped(|| copy.ask(problem)).unwrap_or_else(stopped)
    }
}

impl Solver for StoppableProgram {
    fn name(&self) -> String {
        self.copies[0].name()
    }

    fn models(&self) -> Vec<Model> {
        self.unless_stopped(|| self.copies[0].models()).unwrap_or_default()
    }

    fn ask(&self, problem: &Problem) -> Result<Answer, Breakage> {
        self.ask_copy(&self.copies[0], problem)
    }

    /// Each copy takes the next problem when it has answered one.
    fn give_all(&self, problems: &[Problem]) -> Vec<Given> {
        let next = AtomicUsize::new(0);
        let given: Vec<Mutex<Option<Given>>> = problems.iter().map(|_| Mutex::new(None)).collect();
        std::thread::scope(|scope| {
            for copy in &self.copies {
                scope.spawn(|| {
                    let taken = || next.fetch_add(1, Ordering::SeqCst);
                    while let Some((i, problem)) = Some(taken()).and_then(|i| Some((i, problems.get(i)?))) {
                        let answer = Given::taken(|| self.ask_copy(copy, problem));
                        *given[i].lock().unwrap_or_else(PoisonError::into_inner) = Some(answer);
                    }
                });
            }
        });
        let told = |slot: Mutex<Option<Given>>| slot.into_inner().unwrap_or_else(PoisonError::into_inner);
        given.into_iter().map(|slot| told(slot).expect("every problem was taken by a copy")).collect()
    }
}
