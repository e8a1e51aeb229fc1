//! How is a program asked that is not ours? As a black box behind two pipes, started again when it breaks.

use super::Solver;
use super::protocol::{Answer, Problem};
use calibench_gate::program::{PipedProgram, Silence};
use calibench_gate::quoted::quoted;
use std::time::{Duration, Instant};

/// After as many breakages in a row it is asked no more.
const PATIENCE: usize = 5;
/// Wrong lines before an answer, such as greetings of a library.
const MOST_WRONG_LINES: usize = 1000;

/// A program that reads problems and writes answers, one JSON object a line.
#[derive(Debug)]
pub struct Program {
    command: String,
    timeout: Duration,
    running: Option<PipedProgram>,
    broken_in_a_row: usize,
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
        let running = match &mut self.running {
            Some(running) => running,
            none => {
                let started = PipedProgram::start(&self.command);
                none.insert(started.map_err(|error| format!("not started: {error}"))?)
            }
        };
        let told = |silence: Silence| match silence {
            Silence::Late => format!("no answer within {} s", self.timeout.as_secs_f64()),
            other => other.to_string(),
        };
        running.send(problem.to_line()).map_err(told)?;
        let deadline = Instant::now() + self.timeout;
        for _ in 0..MOST_WRONG_LINES {
            let line = running.line_before(deadline).map_err(told)?;
            match serde_json::from_str::<Answer>(&line) {
                Ok(answer) if answer.id == problem.id => return Ok(answer),
                Ok(answer) => {
                    return Err(format!(
                        "the answer to `{}` has the id `{}`",
                        problem.id,
                        quoted(&answer.id)
                    ));
                }
                // What is no JSON may be a library's greeting.
                Err(_) if !line.starts_with('{') => {}
                Err(error) => return Err(format!("no answer: {}", quoted(&error.to_string()))),
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
