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
    use super::super::tests::{asked_of, with_fault};
    use super::super::{Faulty, correct, planted};
    use super::*;
    use crate::plan::{Asked, Plan};
    use crate::protocol::{AnswerCovariance, Status};
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

    #[test]
    fn the_layout_and_units_of_an_answer_are_changed_as_named() {
        let problem = asked_of("four-pose");
        let right = correct(&problem);
        let value = |fault: &str, name: &str| with_fault(fault, &problem).parameters[name];
        assert_eq!(value("fy-cx-swapped", "fy"), right.parameters["cx"]);
        assert_eq!(value("fy-cx-swapped", "cx"), right.parameters["fy"]);
        assert_eq!(value("half-pixel-shift", "cy"), right.parameters["cy"] + 0.5);
        let poses = |answer: Answer| answer.poses.unwrap();
        for (pose, right) in
            poses(with_fault("translation-in-metres", &problem)).iter().zip(poses(right.clone()))
        {
            assert_eq!(pose.translation, right.translation.map(|x| x / 1000.0));
        }
        let turned = poses(with_fault("rotation-transposed", &problem));
        assert_eq!(turned[3].rotation[0][2], poses(right)[3].rotation[2][0]);
    }

    #[test]
    fn what_is_held_is_not_exchanged_or_shifted() {
        let problem = asked_of("held");
        for fault in ["fy-cx-swapped", "half-pixel-shift", "inverse-distortion", "p1-p2-swapped"] {
            assert_eq!(with_fault(fault, &problem), correct(&problem), "{fault}");
        }
    }

    #[test]
    fn an_rmse_is_divided_by_coordinates_or_by_degrees_of_freedom() {
        let problem = asked_of("four-pose");
        let square = |answer: Answer| answer.rmse.map(|rmse| rmse * rmse).unwrap();
        // Four views of 63 marks, six parameters.
        let sum = 252.0 * square(correct(&problem));
        for (fault, divisor) in [("rmse-per-coordinate", 504.0), ("rmse-by-freedom", 474.0)] {
            let found = square(with_fault(fault, &problem));
            assert!((found * divisor / sum - 1.0).abs() < 1e-12, "{fault}: {found}");
        }
    }

    #[test]
    fn the_inverse_distortion_undoes_the_lens_to_fourth_order() {
        let problem = asked_of("four-pose");
        let mut answer = correct(&problem);
        let lens = |answer: &Answer, r: f64| {
            let [k1, k2] = ["k1", "k2"].map(|name| answer.parameters[name]);
            r * (1.0 + k1 * r * r + k2 * r * r * r * r)
        };
        let distorted = lens(&answer, 0.05);
        inverse_distortion(&problem, &mut answer);
        // The sixth order is 1e-9; a coefficient of the fourth wrong by a hundredth would be 3e-9.
        let left = lens(&answer, distorted) - 0.05;
        assert!(left.abs() < 1e-9, "{left}");
    }

    #[test]
    fn the_bias_is_a_tenth_of_the_stated_deviation() {
        let answer = Answer {
            covariance: Some(AnswerCovariance {
                parameters: ["cx", "fx"].map(String::from).to_vec(),
                matrix: vec![vec![4.0, 1.0], vec![1.0, 9.0]],
            }),
            ..Answer::without_estimate("a", Status::Ok, "")
        };
        assert_eq!(["fx", "cx", "k1"].map(|name| deviation(&answer, name)), [3.0, 2.0, 0.0]);
        let problem = asked_of("four-pose");
        let right = correct(&problem);
        let moved = with_fault("biased-fx", &problem).parameters["fx"] - right.parameters["fx"];
        assert!((moved / deviation(&right, "fx") - 0.1).abs() < 1e-9, "{moved}");
    }

    #[test]
    fn p1_and_p2_are_exchanged_or_turned_round() {
        let problem = asked_of("tangential");
        let of = |answer: Answer| ["p1", "p2"].map(|name| answer.parameters[name]);
        let [p1, p2] = of(correct(&problem));
        assert_eq!(of(with_fault("p1-p2-swapped", &problem)), [p2, p1]);
        assert_eq!(of(with_fault("tangential-sign", &problem)), [-p1, -p2]);
    }
}
