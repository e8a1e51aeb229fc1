//! Faults of the estimate itself: the wrong model, the wrong loss, a search that ends too early, data that
//! should be refused.

use super::{Planted, correct, gross, subtle, with_settings};
use crate::protocol::{Answer, AnswerCovariance, Problem, Status};
use crate::solver::{answer, solve};
use calibench::calibrate::Loss;
use calibench::camera::Parameter;

pub(super) const FAULTS: &[Planted] = &[
    gross("k2-ignored", "k2 held at 0", |p, _| held_if_free(p, Parameter::K2, 0.0)),
    gross("fx-equals-fy", "one focal length for both axes", |p, _| one_focal_length(p)),
    gross("centred-principal-point", "principal point held at the image centre", |p, _| {
        let [width, height] = p.image_size;
        let centre = |size: usize| 0.5 * (size as f64 - 1.0);
        with_settings(p, |s| {
            if !s.free().contains(Parameter::Cx) {
                return s;
            }
            s.hold(Parameter::Cx, centre(width)).hold(Parameter::Cy, centre(height))
        })
    }),
    gross("held-values-ignored", "parameters to be held are set to their defaults", |p, _| {
        let mut changed = p.clone();
        let [width, height] = p.image_size;
        for (name, value) in changed.held.iter_mut() {
            *value = match name.as_str() {
                "cx" => 0.5 * (width as f64 - 1.0),
                "cy" => 0.5 * (height as f64 - 1.0),
                _ => 0.0,
            };
        }
        correct(&changed)
    }),
    gross("no-refinement", "the closed form without refinement", |p, _| iterations(p, 0)),
    gross("one-iteration", "one iteration of the refinement", |p, _| iterations(p, 1)),
    gross(
        "stopped-early",
        "stopped before the first step that changes fx by less than a thousandth",
        |p, _| stopped_early(p),
    ),
    subtle(
        "robust-loss-unasked",
        "a robust loss that nobody asked for: less efficient by a few per cent",
        |p, _| with_settings(p, |s| s.with_loss(Loss::Huber { delta_px: 0.02 })),
    ),
    gross("facing-views-accepted", "unidentifiable data answered with a guessed focal length", |p, _| {
        guessed(p)
    }),
];

fn held_if_free(problem: &Problem, parameter: Parameter, value: f64) -> Answer {
    with_settings(problem, |s| if s.free().contains(parameter) { s.hold(parameter, value) } else { s })
}

fn one_focal_length(problem: &Problem) -> Answer {
    let right = correct(problem);
    let value = |name: &str| right.parameters.get(name).copied();
    let (Some(fx), Some(fy)) = (value("fx"), value("fy")) else { return right };
    let focal = 0.5 * (fx + fy);
    with_settings(problem, |s| s.hold(Parameter::Fx, focal).hold(Parameter::Fy, focal))
}

fn iterations(problem: &Problem, most: usize) -> Answer {
    with_settings(problem, |mut s| {
        s.max_iterations = most;
        s.without_search()
    })
}

fn stopped_early(problem: &Problem) -> Answer {
    let mut last = iterations(problem, 0);
    for most in 1..20 {
        let next = iterations(problem, most);
        let (Some(before), Some(after)) = (last.parameters.get("fx"), next.parameters.get("fx")) else {
            return next;
        };
        if ((after - before) / before).abs() < 1e-3 {
            return last;
        }
        last = next;
    }
    last
}

/// What the correct solver refuses is answered with the image width as focal length, and a small uncertainty.
fn guessed(problem: &Problem) -> Answer {
    let right = correct(problem);
    if right.status == Status::Ok {
        return right;
    }
    let focal = problem.image_size[0] as f64;
    let Ok(calibration) = solve(problem, |s| s.hold(Parameter::Fx, focal).hold(Parameter::Fy, focal)) else {
        return right;
    };
    let mut given = answer(&problem.id, &calibration);
    given.warnings.clear();
    given.status = Status::Ok;
    let n = problem.free.len();
    let matrix = (0..n).map(|i| (0..n).map(|j| if i == j { 0.1 } else { 0.0 }).collect()).collect();
    given.covariance = Some(AnswerCovariance { parameters: problem.free.clone(), matrix });
    given
}

#[cfg(test)]
mod tests {
    use super::super::tests::{asked_of, with_fault};
    use super::*;

    #[test]
    fn the_principal_point_is_held_at_the_middle_pixel() {
        let answer = with_fault("centred-principal-point", &asked_of("four-pose"));
        assert_eq!(["cx", "cy"].map(|name| answer.parameters[name]), [319.5, 239.5]);
    }

    #[test]
    fn held_values_are_replaced_by_the_image_centre_and_by_no_distortion() {
        let (problem, names) = (asked_of("held"), ["cx", "cy", "k2"]);
        assert!(names.iter().all(|name| ![319.5, 239.5, 0.0].contains(&problem.held[*name])));
        let answer = with_fault("held-values-ignored", &problem);
        assert_eq!(names.map(|name| answer.parameters[name]), [319.5, 239.5, 0.0]);
    }

    #[test]
    fn the_one_focal_length_lies_half_way_between_the_two() {
        let problem = asked_of("non-square");
        let (right, found) = (correct(&problem).parameters, with_fault("fx-equals-fy", &problem).parameters);
        assert!(right["fx"] > right["fy"] + 100.0);
        assert_eq!(found["fx"], found["fy"]);
        assert!((right["fx"] - found["fx"] - (found["fy"] - right["fy"])).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn who_stops_early_leaves_out_the_first_step_that_is_small() {
        let problem = asked_of("strong-distortion");
        let fx = |most| iterations(&problem, most).parameters["fx"];
        let found = stopped_early(&problem).parameters["fx"];
        let steps = (0..20).position(|most| fx(most) == found).unwrap();
        let change = |step: usize| (fx(step) / fx(step - 1) - 1.0).abs();
        assert!(steps > 0 && (1..=steps).all(|step| change(step) >= 1e-3), "{steps}");
        // Small, and yet more than a thousandth of a pixel.
        assert!((1e-3 / found..1e-3).contains(&change(steps + 1)), "{steps}: {}", change(steps + 1));
    }

    #[test]
    fn facing_views_are_given_the_image_width_as_focal_length_and_little_doubt() {
        let problem = asked_of("three-parallel-views");
        assert_ne!(correct(&problem).status, Status::Ok);
        let answer = with_fault("facing-views-accepted", &problem);
        assert_eq!((answer.status, answer.warnings.len()), (Status::Ok, 0));
        assert_eq!(["fx", "fy"].map(|name| answer.parameters[name]), [640.0; 2]);
        let stated = answer.covariance.unwrap();
        assert_eq!(stated.parameters, problem.free);
        for (i, row) in stated.matrix.iter().enumerate() {
            assert!(row.iter().enumerate().all(|(j, x)| *x == if i == j { 0.1 } else { 0.0 }));
        }
    }
}
