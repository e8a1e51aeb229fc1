//! How are questions put to a program that is not ours, one after the other? As JSON objects, one a line,
//! with a time limit for each; it is started again when it breaks.

use crate::program::{PipedProgram, Silence};
use crate::quoted::quoted;
use serde::de::DeserializeOwned;
use std::time::{Duration, Instant};

/// After as many breakages in a row it is asked no more.
const PATIENCE: usize = 5;
/// Wrong lines before an answer, such as greetings of a library.
const MOST_WRONG_LINES: usize = 1000;

/// What is asked.
pub trait Question {
    /// The answer repeats it.
    fn id(&self) -> &str;

    /// The line that is sent, without its end.
    fn to_line(&self) -> String;
}

/// What is answered.
pub trait Reply: DeserializeOwned {
    /// That of the question.
    fn id(&self) -> &str;
}

/// A program that reads questions and writes answers, one JSON object a line.
#[derive(Debug)]
pub struct Dialogue {
    command: String,
    timeout: Duration,
    running: Option<PipedProgram>,
    broken_in_a_row: usize,
}

impl Dialogue {
    /// A program started by the shell as `command`, given `timeout` for a question.
    pub fn new(command: &str, timeout: Duration) -> Dialogue {
        Dialogue { command: command.to_string(), timeout, running: None, broken_in_a_row: 0 }
    }

    /// The command.
    pub fn command(&self) -> &str {
        &self.command
    }

    /// Puts a question.
    ///
    /// # Errors
    /// How the protocol was broken.
    pub fn ask<R: Reply>(&mut self, question: &impl Question) -> Result<R, String> {
        if self.broken_in_a_row >= PATIENCE {
            return Err(format!("not asked: {PATIENCE} breakages in a row before"));
        }
        let answer = self.converse(question);
        if answer.is_err() {
            // A late or half-read answer must not meet the next question.
            self.running = None;
        }
        self.broken_in_a_row = if answer.is_ok() { 0 } else { self.broken_in_a_row + 1 };
        answer
    }

    fn converse<R: Reply>(&mut self, question: &impl Question) -> Result<R, String> {
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
        running.send(question.to_line()).map_err(told)?;
        let deadline = Instant::now() + self.timeout;
        for _ in 0..MOST_WRONG_LINES {
            let line = running.line_before(deadline).map_err(told)?;
            match serde_json::from_str::<R>(&line) {
                Ok(answer) if answer.id() == question.id() => return Ok(answer),
                Ok(answer) => {
                    return Err(format!(
                        "the answer to `{}` has the id `{}`",
                        question.id(),
                        quoted(answer.id())
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
