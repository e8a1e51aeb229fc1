//! How many digits of an answer are right? The logarithm of its relative error, as McCullough (1998) measures
//! statistical programs.

use super::{Certified, ReferenceProblem};
use crate::accept::{Estimate, Outcome};
use crate::solver::Solver;
use calibench::camera::Parameter;

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
        let free = || Parameter::ALL.into_iter().filter(|p| certified.parameters.contains_key(p.name()));
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

/// Puts the problems to a solver: the digits of every answer, or why there are none.
pub fn measure(problems: &[ReferenceProblem], solver: &dyn Solver) -> Vec<Result<Digits, String>> {
    let asked: Vec<_> = problems.iter().map(|p| p.problem.clone()).collect();
    let of_reply = |(reply, problem): (crate::solver::Reply, &ReferenceProblem)| match reply.outcome {
        Outcome::Estimate(estimate) => match estimate.held_changed {
            Some((parameter, wanted, got)) => {
                Err(format!("changed {parameter}, which is held at {wanted}, to {got}"))
            }
            None => Ok(Digits::of(&estimate, &problem.reference.certified)),
        },
        Outcome::Refused(why) => Err(format!("refused: {why}")),
        Outcome::Unsupported(why) => Err(format!("not supported: {why}")),
        Outcome::Broken(why) => Err(format!("no answer: {why}")),
    };
    solver.ask_all(&asked).into_iter().zip(problems).map(of_reply).collect()
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
}
