//! How many digits of an answer are right? The logarithm of its relative error, as McCullough (1998) measures
//! statistical programs.

use super::{Certified, ReferenceProblem};
use crate::accept::{Breakage, Estimate, Outcome};
use crate::solver::{Reply, Solver};
use calibench::camera::{Model, Parameter};

/// More than a double can say of a number: where the digits stop counting.
pub const DIGITS_OF_DOUBLES: f64 = 15.0;

/// `-log10(|x - c| / |c|)`, or `-log10 |x|` where `c = 0`, between 0 and [`DIGITS_OF_DOUBLES`] (McCullough
/// 1998, section 3.1).
pub fn log_relative_error(x: f64, certified: f64) -> f64 {
    let error = (x - certified).abs() / if certified == 0.0 { 1.0 } else { certified.abs() };
    if error.is_nan() { 0.0 } else { (-libm::log10(error)).clamp(0.0, DIGITS_OF_DOUBLES) }
}

/// The digits that an estimate shares with the certified values.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Digits {
    /// Of every free parameter, in order.
    pub parameters: Vec<(Parameter, f64)>,
    /// The least over the standard deviations, if they were stated.
    pub standard_deviations: Option<f64>,
    /// Of the RMSE, if it was stated.
    pub rmse: Option<f64>,
}

impl Digits {
    fn of(estimate: &Estimate, certified: &Certified) -> Digits {
        let free =
            || Parameter::OF_ALL_MODELS.into_iter().filter(|p| certified.parameters.contains_key(p.name()));
        let parameters = free()
            .map(|p| {
                (
                    p,
                    log_relative_error(
                        estimate.camera.value(p).unwrap_or(f64::NAN),
                        certified.parameters[p.name()],
                    ),
                )
            })
            .collect();
        let least = |deviations: &Vec<f64>| {
            deviations
                .iter()
                .zip(free())
                .map(|(&x, p)| {
                    certified.standard_deviations.get(p.name()).map_or(0.0, |&c| log_relative_error(x, c))
                })
                .fold(DIGITS_OF_DOUBLES, f64::min)
        };
        Digits {
            parameters,
            standard_deviations: estimate.standard_deviations.as_ref().map(least),
            rmse: estimate.rmse_px.map(|x| log_relative_error(x, certified.rmse)),
        }
    }

    /// The least over the parameters.
    pub fn least(&self) -> f64 {
        self.parameters.iter().map(|&(_, digits)| digits).fold(DIGITS_OF_DOUBLES, f64::min)
    }
}

/// Why a problem has no digits.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoDigits {
    /// The solver says which lens models it knows, and this is none of them: it was not asked.
    #[error("unsupported: it does not know the lens model {0}")]
    UnknownModel(Model),
    /// It said that it is not made for the problem.
    #[error("not supported: {0}")]
    NotSupported(String),
    /// It gave no estimate and said so.
    #[error("refused: {0}")]
    Refused(String),
    /// No answer, or one that breaks the protocol.
    #[error("no answer: {0}")]
    Broken(Breakage),
    /// It changed what is held.
    #[error("changed {parameter}, which is held at {wanted}, to {got}")]
    HeldChanged {
        /// Which.
        parameter: Parameter,
        /// As the problem says.
        wanted: f64,
        /// As the answer says.
        got: f64,
    },
}

/// What a solver reached on a problem.
pub type Measured = Result<Digits, NoDigits>;

/// Puts the problems to a solver that are of a lens model it knows: the digits of every answer, or why there
/// are none.
pub fn measure(problems: &[ReferenceProblem], solver: &dyn Solver) -> Vec<Measured> {
    let models = solver.models();
    let is_known = |p: &&ReferenceProblem| models.contains(&p.problem.lens_model());
    let asked: Vec<_> = problems.iter().filter(is_known).map(|p| p.problem.clone()).collect();
    let mut replies = solver.ask_all(&asked).into_iter();
    let of_problem = |problem: &ReferenceProblem| {
        let unknown = || Err(NoDigits::UnknownModel(problem.problem.lens_model()));
        match is_known(&problem).then(|| replies.next()).flatten() {
            Some(reply) => of_reply(reply, problem),
            None => unknown(),
        }
    };
    problems.iter().map(of_problem).collect()
}

/// The same of several programs of one name: each is asked what those before it do not know.
pub fn measure_in_turn(problems: &[ReferenceProblem], solvers: &[&dyn Solver]) -> Vec<Measured> {
    let unknown = |p: &ReferenceProblem| Err(NoDigits::UnknownModel(p.problem.lens_model()));
    let mut measured: Vec<Measured> = problems.iter().map(unknown).collect();
    for solver in solvers {
        let left: Vec<usize> =
            (0..problems.len()).filter(|&i| matches!(measured[i], Err(NoDigits::UnknownModel(_)))).collect();
        let asked: Vec<ReferenceProblem> = left.iter().map(|&i| problems[i].clone()).collect();
        for (i, found) in left.into_iter().zip(measure(&asked, *solver)) {
            measured[i] = found;
        }
    }
    measured
}

fn of_reply(reply: Reply, problem: &ReferenceProblem) -> Measured {
    match reply.outcome {
        Outcome::Estimate(estimate) => match estimate.held_changed {
            Some((parameter, wanted, got)) => Err(NoDigits::HeldChanged { parameter, wanted, got }),
            None => Ok(Digits::of(&estimate, &problem.reference.certified)),
        },
        Outcome::Refused(why) => Err(NoDigits::Refused(why)),
        Outcome::Unsupported(why) => Err(NoDigits::NotSupported(why)),
        Outcome::Broken(why) => Err(NoDigits::Broken(why)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_counted_from_the_relative_error() {
        assert_eq!(log_relative_error(600.0, 600.0), 15.0);
        // One part in 1e6, up to the rounding of 600.0006.
        assert!((log_relative_error(600.0006, 600.0) - 6.0).abs() < 1e-9);
        assert_eq!(log_relative_error(-600.0, 600.0), 0.0);
        assert_eq!(log_relative_error(f64::NAN, 600.0), 0.0);
        assert!((log_relative_error(1e-4, 0.0) - 4.0).abs() < 1e-12);
    }

    #[test]
    fn the_least_digits_are_those_of_the_worst_parameter() {
        let of = |digits: &[f64]| {
            let parameters = digits.iter().map(|&digits| (Parameter::Fx, digits)).collect();
            Digits { parameters, standard_deviations: None, rmse: None }.least()
        };
        assert_eq!((of(&[11.0, 3.5, 7.0]), of(&[])), (3.5, DIGITS_OF_DOUBLES));
    }
}
