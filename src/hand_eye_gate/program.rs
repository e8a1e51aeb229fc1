//! How is a program asked that is not ours? As every gate asks one.

use super::Solver;
use super::protocol::{Answer, Problem};
use calibench_gate::{Dialogue, Question, Reply};
use std::time::Duration;

/// A program that reads problems and writes answers, one JSON object a line.
#[derive(Debug)]
pub struct Program(Dialogue);

impl Program {
    /// A program started by the shell as `command`, given `timeout` for a problem.
    pub fn new(command: &str, timeout: Duration) -> Program {
        Program(Dialogue::new(command, timeout))
    }
}

impl Question for Problem {
    fn id(&self) -> &str {
        &self.id
    }

    fn to_line(&self) -> String {
        serde_json::to_string(self).expect("a problem has text keys only")
    }
}

impl Reply for Answer {
    fn id(&self) -> &str {
        &self.id
    }
}

impl Solver for Program {
    fn name(&self) -> String {
        self.0.command().to_string()
    }

    fn answer_all(&mut self, problems: &[Problem]) -> Vec<Result<Answer, String>> {
        problems.iter().map(|problem| self.0.ask(problem)).collect()
    }
}
