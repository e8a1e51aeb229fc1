//! What did a solver answer, word for word? It is asked as ever, and its answers are kept, those that broke
//! the protocol too.

use super::accept::Breakage;
use super::program::ProgramEnd;
use super::protocol::{Answer, Problem};
use super::solver::{Given, Solver};
use calibench::camera::Model;
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// A solver whose answers are kept.
pub struct Recorder<'a> {
    solver: &'a dyn Solver,
    lines: Mutex<BTreeMap<String, String>>,
}

impl<'a> Recorder<'a> {
    /// Keeps what `solver` answers.
    pub fn new(solver: &'a dyn Solver) -> Recorder<'a> {
        Recorder { solver, lines: Mutex::new(BTreeMap::new()) }
    }

    /// The line to be filed for a problem, if it was asked.
    pub fn line(&self, id: &str) -> Option<String> {
        self.lines.lock().unwrap_or_else(PoisonError::into_inner).get(id).cloned()
    }

    fn keep(&self, problem: &Problem, answer: &Result<Answer, Breakage>) {
        let line = match answer {
            // Plain fields and text keys: nothing in them can fail to serialise.
            Ok(answer) => serde_json::to_string(answer).expect("an answer serialises"),
            Err(breakage) => {
                serde_json::json!({"id": problem.id, "broken": breakage.to_string()}).to_string()
            }
        };
        self.lines.lock().unwrap_or_else(PoisonError::into_inner).insert(problem.id.clone(), line);
    }
}

impl Solver for Recorder<'_> {
    fn name(&self) -> String {
        self.solver.name()
    }

    fn models(&self) -> Vec<Model> {
        self.solver.models()
    }

    fn ask(&self, problem: &Problem) -> Result<Answer, Breakage> {
        let answer = self.solver.ask(problem);
        self.keep(problem, &answer);
        answer
    }

    fn finish(&self) -> Vec<ProgramEnd> {
        self.solver.finish()
    }

    fn give_all(&self, problems: &[Problem]) -> Vec<Given> {
        let given = self.solver.give_all(problems);
        problems.iter().zip(&given).for_each(|(problem, given)| self.keep(problem, &given.answer));
        given
    }
}

/// Why a filed line holds no answer, if it says so.
pub(super) fn broken(line: &str) -> Option<(String, Breakage)> {
    #[derive(serde::Deserialize)]
    struct Broken {
        id: String,
        broken: String,
    }
    let read: Broken = serde_json::from_str(line).ok()?;
    Some((read.id, Breakage::Recorded(super::quoted::quoted(&read.broken))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::Status;

    /// Refuses the problem `a` and breaks on all others.
    struct Fragile;

    impl Solver for Fragile {
        fn name(&self) -> String {
            "fragile".into()
        }

        fn ask(&self, problem: &Problem) -> Result<Answer, Breakage> {
            match problem.id.as_str() {
                "a" => Ok(Answer::without_estimate("a", Status::Refused, "no")),
                _ => Err(Breakage::Timeout { seconds: 2.0 }),
            }
        }
    }

    #[test]
    fn what_was_answered_is_kept_and_so_is_how_it_was_not() {
        let case = crate::bad_input::bad_cases(1).unwrap().remove(0);
        let problems = ["a", "b"].map(|id| Problem { id: id.into(), ..case.problem.clone() });
        let recorder = Recorder::new(&Fragile);
        assert_eq!(recorder.line("a"), None);
        recorder.give_all(&problems);
        let [answered, told] = ["a", "b"].map(|id| recorder.line(id).unwrap());
        assert_eq!(serde_json::from_str::<Answer>(&answered).ok(), Fragile.ask(&problems[0]).ok());
        assert_eq!(broken(&answered), None);
        let (id, breakage) = broken(&told).unwrap();
        assert!(id == "b" && breakage.to_string().contains("no answer within 2 s"), "{told}");
        assert_eq!(recorder.line("c"), None);
    }
}
