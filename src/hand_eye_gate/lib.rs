//! Is a hand-eye solver to be trusted? The gate of calibrators, for those who find a camera's place on a
//! robot.
//!
//! ```text
//! Scene (stations of known truth, errors of robot and camera)
//!   -> Problem --Solver (in process, or a program behind two pipes)--> Answer
//!   -> Check (one a property and scene) --decide (Holm, one overall false-alarm rate)--> Report
//! ```
//!
//! Errors are held against the Cramer-Rao bound of each scene: the smallest covariance that an unbiased X can
//! have when every true pose of the robot and Y are unknown too.

mod judge;
pub mod program;
pub mod protocol;
mod report;
mod scene;
pub mod stations;

pub use program::Program;
pub use report::{Report, SceneResult};
pub use scene::{Demand, Scene, scenes};

use calibench_gate::Terms;
use protocol::{Answer, Problem, Status};

/// Samples of a scene in a quick run.
pub const QUICK: usize = 256;
/// Most samples of a scene: a file of its problems has some 100 MB.
pub const MOST_SAMPLES: usize = 20_000;

/// A hand-eye solver as the gate sees it.
pub trait Solver {
    /// What it is called in reports.
    fn name(&self) -> String;

    /// Answers problems one after the other; an error says how the protocol was broken.
    fn answer_all(&mut self, problems: &[Problem]) -> Vec<Result<Answer, String>>;
}

/// This library's solver.
#[derive(Debug, Clone, Copy, Default)]
pub struct Builtin;

impl Solver for Builtin {
    fn name(&self) -> String {
        "calibench".to_string()
    }

    fn answer_all(&mut self, problems: &[Problem]) -> Vec<Result<Answer, String>> {
        problems.iter().map(|problem| Ok(solved(problem))).collect()
    }
}

fn solved(problem: &Problem) -> Answer {
    match problem.solve() {
        Ok(found) => Answer {
            id: problem.id.clone(),
            status: Status::Ok,
            x: Some(protocol::rows(&found.x)),
            covariance: Some(protocol::rows_of(&found.x_covariance())),
            message: None,
        },
        Err(error) => Answer {
            id: problem.id.clone(),
            status: Status::Refused,
            x: None,
            covariance: None,
            message: Some(error.to_string()),
        },
    }
}

/// Asks a solver `samples` problems of every scene and judges its answers.
pub fn run(solver: &mut dyn Solver, seed: u64, samples: usize, terms: &Terms) -> Report {
    let asked: Vec<judge::Asked> =
        scenes().into_iter().map(|scene| judge::Asked::new(scene, seed, samples)).collect();
    let answered: Vec<judge::Answered> = asked.into_iter().map(|asked| asked.ask(solver)).collect();
    Report::new(solver.name(), seed, samples, &answered, terms)
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench_gate::judge::{Property, Verdict};
    use protocol::rows;
    use std::time::Duration;

    const SAMPLES: usize = 96;

    /// This library's solver with its answers changed.
    struct Changed(fn(&Problem, Answer) -> Answer);

    impl Solver for Changed {
        fn name(&self) -> String {
            "changed".to_string()
        }

        fn answer_all(&mut self, problems: &[Problem]) -> Vec<Result<Answer, String>> {
            problems.iter().map(|problem| Ok((self.0)(problem, solved(problem)))).collect()
        }
    }

    fn failing(report: &Report) -> Vec<Property> {
        let fails = |verdict| matches!(verdict, Verdict::Failed | Verdict::Grave);
        let mut found: Vec<Property> =
            report.checks.iter().filter(|c| fails(c.verdict)).map(|c| c.property).collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    fn judged(change: fn(&Problem, Answer) -> Answer) -> Report {
        run(&mut Changed(change), 5, SAMPLES, &Terms::default())
    }

    #[test]
    fn this_library_is_trusted() {
        let report = run(&mut Builtin, 1, SAMPLES, &Terms::default());
        assert!(report.trusted, "{}", report.to_text());
        assert!(report.to_row("ours").ends_with("| **trusted** |"));
    }

    #[test]
    fn a_closed_form_is_exact_and_less_precise_than_the_bound_and_knows_the_order_of_stations() {
        let report = judged(|problem, answer| match problem.solve() {
            Ok(found) => Answer { x: Some(rows(&found.park_martin)), covariance: None, ..answer },
            Err(_) => answer,
        });
        // A motion and its inverse leave other equations for the translation where rotations of robot and
        // camera differ.
        assert_eq!(failing(&report), [Property::Nees, Property::ViewOrder], "{}", report.to_text());
    }

    #[test]
    fn a_covariance_half_as_large_is_found_out() {
        let report = judged(|_, answer| {
            let halved =
                |rows: Vec<Vec<f64>>| rows.iter().map(|r| r.iter().map(|x| 0.5 * x).collect()).collect();
            Answer { covariance: answer.covariance.map(halved), ..answer }
        });
        assert_eq!(failing(&report), [Property::Covariance]);
    }

    #[test]
    fn a_shift_of_half_a_standard_deviation_is_found_out() {
        let report = judged(|problem, mut answer| {
            if let (Some(x), Ok(found)) = (answer.x.as_mut(), problem.solve()) {
                x.translation[1] += 0.5 * found.x_covariance()[(4, 4)].sqrt();
            }
            answer
        });
        assert!(failing(&report).contains(&Property::Bias), "{}", report.to_text());
    }

    #[test]
    fn an_answer_where_the_motions_leave_x_open_is_grave() {
        let report = judged(|problem, answer| match answer.status {
            Status::Ok => answer,
            _ => Answer {
                status: Status::Ok,
                x: Some(problem.cam_from_target[0].clone()),
                message: None,
                ..answer
            },
        });
        assert_eq!(failing(&report), [Property::Degenerate]);
        assert!(report.checks.iter().any(|check| check.verdict == Verdict::Grave));
    }

    #[test]
    fn a_program_that_echoes_breaks_the_protocol() {
        let mut program = Program::new("cat", Duration::from_secs(5));
        let report = run(&mut program, 1, 2, &Terms::default());
        assert!(failing(&report).contains(&Property::Protocol), "{}", report.to_text());
    }

    #[test]
    fn what_a_program_writes_commands_no_terminal() {
        let mut program = Program::new("printf 'dead\\033[2J' >&2", Duration::from_secs(5));
        let answers = program.answer_all(&[scenes()[0].exact()]);
        let said = answers[0].as_ref().unwrap_err();
        assert!(said.contains("dead\\u001b[2J"), "{said}");
    }

    #[test]
    fn a_program_that_says_nothing_is_given_up() {
        let mut program = Program::new("sleep 60", Duration::from_millis(50));
        let problem = scenes()[0].exact();
        let answers = program.answer_all(&vec![problem; 8]);
        assert!(answers[0].as_ref().unwrap_err().contains("no answer within 0.05 s"), "{:?}", answers[0]);
        assert!(answers[7].as_ref().unwrap_err().contains("not asked"));
    }
}
