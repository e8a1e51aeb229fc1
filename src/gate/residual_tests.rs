//! Could a solver have noticed that the world is not its model? Five ordinary tests of the residuals of least
//! squares.
//!
//! None of them knows the noise: that is estimated from the same residuals. With `r` the residuals of `V`
//! views of `M` marks each, over their root mean square per coordinate:
//!
//! - neighbours along rows: `sum r_i . r_(i+1) / sqrt(2 n)` for `n` pairs is standard normal (Moran 1950);
//! - the two axes: `sum u^2 / sum v^2` is F-distributed, `V M` over `V M`;
//! - every view against the others: the ratio of its mean square to theirs is F-distributed, `2 M` over
//!   `2 M (V - 1)`;
//! - every mark over the views: variance between the marks' mean residuals over that within,
//!   F-distributed, `2 M` over `2 M (V - 1)`;
//! - a richer lens: by how much the sum of squares falls with p1, p2 and k3 free as well, over what is left,
//!   each by its degrees of freedom, F-distributed (Fisher 1924).
//!
//! The fit takes a little out of the residuals, which makes the first four cautious or changes them little.
//! What one of them shows at [`SURE`] a solver of ordinary quality could have shown its user. How often that
//! is so was measured for every scene that breaks an assumption, and stands in the suite: it decides whether
//! silence is a finding.

use super::plan::{Case, Plan, PlanError, Purpose};
use super::protocol::Problem;
use super::solver::solve;
use super::suite::{Demand, Scenario};
use calibench::calibrate::{LensCalibration, Settings};
use calibench::camera::{Imaging, Lens};
use calibench::evaluate::distribution::{fisher_tail, normal_cdf};
use calibench::geometry::{Vec2, Vec3};
use rayon::prelude::*;

/// Chance at which the five tests together see something where nothing is.
pub const SURE: f64 = 1e-6;
/// Draws behind the shares in the suite.
pub const DRAWS: u64 = 2000;
/// Coefficients that the richer lens has beside those that are free.
const RICHER: [&str; 3] = ["p1", "p2", "k3"];
/// Seed of these draws: far from those of runs.
const SEED: u64 = 0x7e87_b005;

/// The smallest p-value of the five tests, times their number; `None` where least squares has no answer.
pub fn doubt(problem: &Problem) -> Option<f64> {
    let fit = solve(problem, Settings::without_search).ok()?;
    let residuals = residuals(problem, &fit)?;
    let tests = [
        along_rows(&residuals),
        of_axes(&residuals),
        of_views(&residuals),
        of_marks(&residuals),
        of_richer_lens(problem, &fit),
    ];
    Some((tests.len() as f64 * tests.into_iter().fold(1.0, f64::min)).min(1.0))
}

/// Observed - predicted, view by view.
fn residuals(problem: &Problem, fit: &LensCalibration) -> Option<Vec<Vec<Vec2>>> {
    let of_view = |(view, pose): (&super::protocol::ProblemView, &calibench::geometry::Pose)| {
        let pairs = view.target.iter().zip(&view.pixels);
        let of_mark = |(&[x, y], &[u, v]): (&[f64; 2], &[f64; 2])| {
            Some(Vec2::new(u, v) - Lens::image(&fit.camera, &pose.apply(&Vec3::new(x, y, 0.0)))?)
        };
        pairs.map(of_mark).collect::<Option<Vec<Vec2>>>()
    };
    problem.views.iter().zip(&fit.cam_from_target).map(of_view).collect()
}

fn square(residuals: &[Vec2]) -> f64 {
    residuals.iter().map(Vec2::norm_squared).sum()
}

fn along_rows(residuals: &[Vec<Vec2>]) -> f64 {
    let marks: usize = residuals.iter().map(Vec::len).sum();
    let variance = residuals.iter().map(|view| square(view)).sum::<f64>() / (2.0 * marks as f64);
    let products: f64 =
        residuals.iter().flat_map(|view| view.windows(2)).map(|pair| pair[0].dot(&pair[1])).sum();
    let pairs: usize = residuals.iter().map(|view| view.len().saturating_sub(1)).sum();
    normal_cdf(-products / (variance * (2.0 * pairs as f64).sqrt()))
}

fn of_axes(residuals: &[Vec<Vec2>]) -> f64 {
    let marks: usize = residuals.iter().map(Vec::len).sum();
    let sum = |axis: usize| residuals.iter().flatten().map(|r| r[axis] * r[axis]).sum::<f64>();
    let ratio = sum(0) / sum(1);
    2.0 * fisher_tail(ratio.max(1.0 / ratio), marks, marks)
}

fn of_views(residuals: &[Vec<Vec2>]) -> f64 {
    let all: f64 = residuals.iter().map(|view| square(view)).sum();
    let marks: usize = residuals.iter().map(Vec::len).sum();
    let of_view = |view: &Vec<Vec2>| {
        let (own, others) = (2 * view.len(), 2 * (marks - view.len()));
        let ratio = square(view) / own as f64 / ((all - square(view)) / others as f64);
        fisher_tail(ratio, own, others)
    };
    residuals.len() as f64 * residuals.iter().map(of_view).fold(1.0, f64::min)
}

fn of_marks(residuals: &[Vec<Vec2>]) -> f64 {
    let (views, marks) = (residuals.len(), residuals[0].len());
    if views < 2 || residuals.iter().any(|view| view.len() != marks) {
        return 1.0;
    }
    let mean = |i: usize| residuals.iter().map(|view| view[i]).sum::<Vec2>() / views as f64;
    let means: Vec<Vec2> = (0..marks).map(mean).collect();
    let between = views as f64 * square(&means);
    let within = residuals.iter().map(|view| square(view)).sum::<f64>() - between;
    let (above, below) = (2 * marks, 2 * marks * (views - 1));
    fisher_tail(between / above as f64 / (within / below as f64), above, below)
}

/// Without another coefficient to free, or where the search with it fails, nothing is seen.
fn of_richer_lens(problem: &Problem, fit: &LensCalibration) -> f64 {
    let mut richer = problem.clone();
    for name in RICHER {
        if richer.held.remove(name).is_some() {
            richer.free.push(name.to_string());
        }
    }
    let added = richer.free.len() - problem.free.len();
    let all = 2 * problem.points();
    let Some(left) = all.checked_sub(richer.free.len() + 6 * problem.views.len()).filter(|&left| left > 0)
    else {
        return 1.0;
    };
    let sum = |fit: &LensCalibration| fit.rmse_px * fit.rmse_px * problem.points() as f64;
    match solve(&richer, Settings::without_search) {
        Ok(other) if added > 0 => {
            let fall = (sum(fit) - sum(&other)).max(0.0);
            fisher_tail(fall / added as f64 / (sum(&other) / left as f64), added, left)
        }
        _ => 1.0,
    }
}

/// A scene that breaks an assumption, and in how many draws its residuals show it.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Shown {
    /// The scene.
    pub scenario: Scenario,
    /// Problems drawn.
    pub draws: u64,
    /// Problems whose residuals show it.
    pub count: usize,
}

impl Shown {
    /// Whether the suite's share for the scene agrees with the count, within five standard deviations of
    /// their difference and one draw.
    pub fn agrees(&self) -> bool {
        let (share, draws) = (self.scenario.seen_in_residuals, self.draws as f64);
        let variance = share * (1.0 - share) * (1.0 / draws + 1.0 / DRAWS as f64);
        (self.count as f64 / draws - share).abs() <= 5.0 * variance.sqrt() + 1.0 / draws
    }
}

/// Counts on every scene with this demand.
///
/// # Errors
/// A plan that cannot be made.
pub fn measure(draws: u64, demand: Demand) -> Result<Vec<Shown>, PlanError> {
    let plan = Plan::new(SEED, 1)?;
    let is_shown = |scenario: usize, trial: u64| {
        let case = Case { scenario, purpose: Purpose::Sample, trial };
        doubt(&plan.problem(&case)).is_some_and(|p| p < SURE)
    };
    let wanted = plan.scenarios.iter().enumerate().filter(|(_, s)| s.demand == demand);
    Ok(wanted
        .map(|(index, scenario)| Shown {
            scenario: scenario.clone(),
            draws,
            count: (0..draws).into_par_iter().filter(|&trial| is_shown(index, trial)).count(),
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shares_in_the_suite_are_those_of_the_tests() {
        for seen in measure(200, Demand::Assumptions).unwrap() {
            assert!(seen.agrees(), "{}: {} of {}", seen.scenario.id, seen.count, seen.draws);
        }
    }

    /// Where the law holds nothing is seen: 800 samples at one in a million.
    #[test]
    fn sound_data_show_nothing() {
        for seen in measure(40, Demand::Law).unwrap() {
            assert_eq!(seen.count, 0, "{}", seen.scenario.id);
        }
    }

    fn views(of: &[&[[f64; 2]]]) -> Vec<Vec<Vec2>> {
        of.iter().map(|view| view.iter().map(|&[u, v]| Vec2::new(u, v)).collect()).collect()
    }

    fn near(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-6, "{found} for {expected}");
    }

    #[test]
    fn neighbours_along_rows_are_tested_by_their_normal_score() {
        // Six marks of mean square 1/2 per coordinate; products 2 and 0 of four pairs: a score of 2 / (0.5
        // sqrt(8)) = sqrt(2), above which lies erfc(1) / 2.
        let alike = [[1.0, 0.0], [1.0, 0.0], [1.0, 0.0]];
        let turned = [[0.0, 1.0], [0.0, 1.0], [0.0, -1.0]];
        near(along_rows(&views(&[&alike, &turned])), 0.078_649_603_5);
    }

    #[test]
    fn the_two_axes_are_tested_by_the_ratio_of_their_squares() {
        // Of F with two and two degrees of freedom 1 / (1 + x) lies above x: twice that of x = 3.
        let wide = [[1.0, 1.0], [2.0f64.sqrt(), 0.0]];
        near(of_axes(&views(&[&wide])), 0.5);
        near(of_axes(&views(&[&wide.map(|[u, v]| [v, u])])), 0.5);
    }

    #[test]
    fn a_view_is_tested_against_the_others() {
        // Of F with two and d degrees of freedom (1 + 2 x / d)^(-d / 2) lies above x. The first view has 4 /
        // 2 against 2 / 4: one in nine, and it is the worst of three.
        near(of_views(&views(&[&[[2.0, 0.0]], &[[1.0, 0.0]], &[[0.0, 1.0]]])), 1.0 / 3.0);
    }

    #[test]
    fn a_mark_is_tested_by_its_mean_over_the_views() {
        // Means of 2 and 0: between 2 * 4 = 8, within 2 + 2 = 4; of F with 4 and 4 degrees of freedom (1 + 3
        // x) / (1 + x)^3 lies above x.
        let marks = [&[[3.0, 0.0], [0.0, 1.0]][..], &[[1.0, 0.0], [0.0, -1.0]][..]];
        near(of_marks(&views(&marks)), 7.0 / 27.0);
        // Between 8, within 2, each on 2; and 1 / (1 + x) above x.
        near(of_marks(&views(&[&[[3.0, 0.0]], &[[1.0, 0.0]]])), 0.2);
        // Three views: between 3 * 4 = 12 on 2, within 2 on 4: (1 + x / 2)^-2 above x.
        near(of_marks(&views(&[&[[3.0, 0.0]], &[[1.0, 0.0]], &[[2.0, 0.0]]])), 1.0 / 49.0);
    }

    #[test]
    fn marks_of_one_view_or_of_ragged_views_tell_nothing() {
        assert_eq!(of_marks(&views(&[&[[3.0, 0.0], [1.0, 1.0]]])), 1.0);
        assert_eq!(of_marks(&views(&[&[[3.0, 0.0], [1.0, 1.0]], &[[1.0, 0.0]]])), 1.0);
    }

    #[test]
    fn a_richer_lens_is_tested_by_what_its_coefficients_take_from_the_residuals() {
        use statrs::distribution::{ContinuousCDF, FisherSnedecor};
        let plan = Plan::new(1, 1).unwrap();
        let problem = plan.problem(&Case { scenario: 0, purpose: Purpose::Sample, trial: 0 });
        let mut richer = problem.clone();
        for name in ["p1", "p2", "k3"] {
            richer.held.remove(name).unwrap();
            richer.free.push(name.into());
        }
        let [few, many] = [&problem, &richer].map(|problem| {
            let fit = solve(problem, Settings::without_search).unwrap();
            residuals(problem, &fit).unwrap().iter().flatten().map(Vec2::norm_squared).sum::<f64>()
        });
        // Four views of 63 marks: 504 coordinates less 9 and 24 unknowns.
        let ratio = (few - many) / 3.0 / (many / 471.0);
        let fit = solve(&problem, Settings::without_search).unwrap();
        near(of_richer_lens(&problem, &fit), FisherSnedecor::new(3.0, 471.0).unwrap().sf(ratio));
    }

    #[test]
    fn a_share_agrees_within_five_deviations_of_the_difference_and_one_draw() {
        let scenario = crate::suite::suite().unwrap().remove(0);
        let shown = |share: f64, count: usize| Shown {
            scenario: Scenario { seen_in_residuals: share, ..scenario.clone() },
            draws: 2000,
            count,
        };
        // 5 sqrt(0.25 * 2 / 2000) = 0.07906 and 0.0005: 159.1 of 2000. 5 sqrt(0.09 * 2 / 2000) is 0.04743.
        for (share, count) in [(0.5, 1159), (0.5, 841), (0.1, 295), (0.1, 105)] {
            assert!(shown(share, count).agrees(), "{share} {count}");
        }
        for (share, count) in [(0.5, 1160), (0.5, 840), (0.1, 296), (0.1, 104)] {
            assert!(!shown(share, count).agrees(), "{share} {count}");
        }
    }
}
