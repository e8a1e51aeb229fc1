//! How often do poor data mislead least squares itself? The measure of honesty on scenes where the linear law
//! fails.
//!
//! The textbook answer is the minimum of the squared residuals with the covariance `s^2 (J^T J)^-1`, and no
//! warning. Where poses are nearly parallel, or a few points are wrong, even that covariance is exceeded now
//! and then by more than chance on a normal distribution allows. How often is measured here, on noise that no
//! run of the gate draws, and stands in the suite; a solver is dishonest where it is misled more often than
//! that.

use super::accept::Breakage;
use super::judge::misled;
use super::plan::{Case, Plan, PlanError, Purpose};
use super::protocol::{Answer, Problem, Status};
use super::solver::{Given, Solver, answer, solve};
use super::suite::{Demand, Scenario};
use super::trial::reduce;
use rayon::prelude::*;

/// Draws behind the rates in the suite.
pub const DRAWS: u64 = 100_000;
/// Seed of these draws: far from those of runs, which count from 1.
const SEED: u64 = 0x7e87_b004;

/// Least squares without a word of warning.
struct Textbook;

impl Solver for Textbook {
    fn name(&self) -> String {
        "textbook least squares".into()
    }

    fn ask(&self, problem: &Problem) -> Result<Answer, Breakage> {
        Ok(match solve(problem, |settings| settings) {
            Err(message) => Answer::without_estimate(&problem.id, Status::Refused, message),
            Ok(calibration) => Answer { warnings: Vec::new(), ..answer(&problem.id, &calibration) },
        })
    }
}

/// A doubtful scene, and of how many draws textbook least squares is confidently wrong.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Misled {
    /// The scene.
    pub scenario: Scenario,
    /// Problems drawn.
    pub draws: u64,
    /// Confidently wrong answers.
    pub count: usize,
}

impl Misled {
    /// Whether the suite's rate for the scene agrees with the count: both are counts, so their difference is
    /// normal with the sum of their variances. Five standard deviations: a false alarm in a million.
    pub fn agrees(&self) -> bool {
        let (rate, draws) = (self.scenario.textbook_misled, self.draws as f64);
        let variance = rate * (1.0 - rate) * (1.0 / draws + 1.0 / DRAWS as f64);
        (self.count as f64 / draws - rate).abs() <= 5.0 * variance.sqrt()
    }
}

/// Counts on every doubtful scene of the suite.
///
/// # Errors
/// A plan that cannot be made.
pub fn measure(draws: u64) -> Result<Vec<Misled>, PlanError> {
    let plan = Plan::new(SEED, 1)?;
    let is_misled = |scenario: usize, trial: u64| {
        let case = Case { scenario, purpose: Purpose::Sample, trial };
        let problem = plan.problem(&case);
        misled(&reduce(&plan, &case, &problem, Given::taken(|| Textbook.ask(&problem)).checked(&problem)))
    };
    let doubtful = plan.scenarios.iter().enumerate().filter(|(_, s)| s.demand == Demand::Honesty);
    Ok(doubtful
        .map(|(index, scenario)| Misled {
            scenario: scenario.clone(),
            draws,
            count: (0..draws).into_par_iter().filter(|&trial| is_misled(index, trial)).count(),
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rates_in_the_suite_are_those_of_least_squares() {
        for seen in measure(2000).unwrap() {
            assert!(seen.agrees(), "{}: {} of {}", seen.scenario.id, seen.count, seen.draws);
        }
    }

    #[test]
    fn a_rate_agrees_within_five_deviations_of_the_difference_of_two_counts() {
        let scenario = crate::suite::suite().unwrap().remove(0);
        let seen = |count: usize| Misled {
            scenario: Scenario { textbook_misled: 0.01, ..scenario.clone() },
            draws: DRAWS,
            count,
        };
        // 5 sqrt(0.0099 * 2 / 100 000) of 100 000 draws are 222.5.
        assert!(seen(1222).agrees() && seen(778).agrees());
        assert!(!seen(1223).agrees() && !seen(777).agrees());
    }
}
