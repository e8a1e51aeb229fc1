//! Faults between a good estimate and its user: layout, units, definitions.

use super::{Planted, chosen, freedom, gross, spoilt, subtle};
use crate::protocol::{Answer, Problem};

pub(super) const FAULTS: &[Planted] = &[
    gross("fy-cx-swapped", "fy and cx exchanged in the output layout", |p, _| exchanged(p, "fy", "cx")),
    gross("p1-p2-swapped", "p1 and p2 exchanged", |p, _| exchanged(p, "p1", "p2")),
    gross("tangential-sign", "p1 and p2 with the other sign", |p, _| {
        spoilt(p, |a| ["p1", "p2"].into_iter().for_each(|name| change(a, name, |x| -x)))
    }),
    gross("half-pixel-shift", "pixel (0, 0) taken as a corner: principal point half a pixel off", |p, _| {
        spoilt(p, |a| {
            ["cx", "cy"].into_iter().filter(|n| is_free(p, n)).for_each(|name| change(a, name, |x| x + 0.5))
        })
    }),
    gross("inverse-distortion", "k1, k2 of the model that undistorts", |p, _| {
        spoilt(p, |a| inverse_distortion(p, a))
    }),
    gross("rmse-per-coordinate", "RMSE divided by 2N", |p, _| {
        spoilt(p, |a| a.rmse = a.rmse.map(|x| x * std::f64::consts::FRAC_1_SQRT_2))
    }),
    gross("rmse-by-freedom", "RMSE divided by degrees of freedom", |p, _| {
        spoilt(p, |a| a.rmse = a.rmse.map(|x| x * (p.points() as f64 / freedom(p)).sqrt()))
    }),
    gross("translation-in-metres", "translations a thousand times too small", |p, _| {
        spoilt(p, |a| {
            a.poses.iter_mut().flatten().flat_map(|pose| &mut pose.translation).for_each(|x| *x /= 1000.0)
        })
    }),
    gross("rotation-transposed", "rotation matrices transposed", |p, _| {
        spoilt(p, |a| {
            for pose in a.poses.iter_mut().flatten() {
                let r = pose.rotation;
                pose.rotation = std::array::from_fn(|i| std::array::from_fn(|j| r[j][i]));
            }
        })
    }),
    subtle("biased-fx", "fx too large by a tenth of its standard deviation", |p, _| {
        spoilt(p, |a| {
            let shift = 0.1 * deviation(a, "fx");
            change(a, "fx", |x| x + shift);
        })
    }),
    gross("last-bits", "the last bit of fx changes when a problem is asked again", |p, asked_before| {
        spoilt(p, |a| change(a, "fx", |x| f64::from_bits(x.to_bits() ^ (asked_before() & 1))))
    }),
    gross("never-warns", "no warning is ever given", |p, _| spoilt(p, |a| a.warnings.clear())),
    subtle("silent-failure", "one answer in a hundred has fx 10 % too large", |p, _| {
        spoilt(p, |a| change(a, "fx", |x| if chosen(p, 100) { 1.1 * x } else { x }))
    }),
];

fn is_free(problem: &Problem, name: &str) -> bool {
    problem.free.iter().any(|free| free == name)
}

fn change(answer: &mut Answer, name: &str, how: impl Fn(f64) -> f64) {
    if let Some(value) = answer.parameters.get_mut(name) {
        *value = how(*value);
    }
}

/// Exchanges two parameters that are both estimated.
fn exchanged(problem: &Problem, a: &str, b: &str) -> Answer {
    spoilt(problem, |answer| {
        if !(is_free(problem, a) && is_free(problem, b)) {
            return;
        }
        let value = |name: &str| answer.parameters.get(name).copied();
        if let (Some(x), Some(y)) = (value(a), value(b)) {
            answer.parameters.insert(a.to_string(), y);
            answer.parameters.insert(b.to_string(), x);
        }
    })
}

/// To second order the inverse of `r (1 + k1 r^2 + k2 r^4)` has the coefficients `-k1` and `3 k1^2 - k2`.
fn inverse_distortion(problem: &Problem, answer: &mut Answer) {
    if !(is_free(problem, "k1") && is_free(problem, "k2")) {
        return;
    }
    let value = |name: &str| answer.parameters.get(name).copied().unwrap_or(0.0);
    let (k1, k2) = (value("k1"), value("k2"));
    answer.parameters.insert("k1".into(), -k1);
    answer.parameters.insert("k2".into(), 3.0 * k1 * k1 - k2);
}

fn deviation(answer: &Answer, name: &str) -> f64 {
    answer
        .covariance
        .as_ref()
        .and_then(|c| {
            let i = c.parameters.iter().position(|p| p == name)?;
            Some(c.matrix[i][i].sqrt())
        })
        .unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::super::{Faulty, planted};
    use super::*;
    use crate::plan::{Asked, Plan};
    use crate::solver::{Builtin, Solver};

    #[test]
    fn the_silent_failure_makes_fx_a_tenth_too_large_where_it_strikes_and_changes_nothing_elsewhere() {
        let faulty = Faulty::new(planted().into_iter().find(|fault| fault.id == "silent-failure").unwrap());
        let asked = Asked { scenes: vec!["four-pose".into()], ..Asked::default() };
        let plan = Plan::of(1, 1000, asked).unwrap();
        for (is_struck, factor) in [(true, 1.1), (false, 1.0)] {
            let mut problems = plan.cases.iter().map(|case| plan.problem(case));
            let problem = problems.find(|problem| chosen(problem, 100) == is_struck).unwrap();
            let fx = |solver: &dyn Solver| solver.ask(&problem).unwrap().parameters["fx"];
            assert_eq!(fx(&faulty), factor * fx(&Builtin));
        }
    }
}
