//! Faults in a lens model: another is fitted, a part of it is left out, or it is right only near the axis.

use super::{Class, How, Planted, correct, with_settings};
use crate::protocol::{Answer, Problem};
use calibench::calibrate::Settings;
use calibench::camera::{Model, Parameter};

pub(super) const FAULTS: &[Planted] = &[
    of_models(
        "another-lens",
        "a fisheye fitted as a division model, its k1 stated",
        &[Model::KannalaBrandt],
        |p, _| another_lens(p),
    ),
    of_models("last-coefficient-ignored", "the last free coefficient held at 0", OTHERS, |p, _| {
        with_settings(p, without_last_coefficient)
    }),
    of_models(
        "prisms-exchanged",
        "s1, s2 taken for those of y and s3, s4 for those of x",
        &[Model::ThinPrism],
        |p, _| prisms_exchanged(p),
    ),
    of_models(
        "marks-far-out-dropped",
        "marks in the outer third of the image are not used",
        OTHERS,
        |p, _| far_out_dropped(p),
    ),
];

/// Every model but Brown-Conrady's, which is the first of all.
const OTHERS: &[Model] = {
    let [first, others @ ..] = &Model::ALL;
    assert!(matches!(first, Model::BrownConrady));
    others
};

const fn of_models(id: &'static str, about: &'static str, models: &'static [Model], how: How) -> Planted {
    Planted { id, about, class: Class::Gross, models, how }
}

/// The answer with another model's parameters under the names that are asked; what it lacks is 0.
fn another_lens(problem: &Problem) -> Answer {
    let linear = |name: &&String| Parameter::LINEAR.iter().any(|p| p.name() == **name);
    let changed = Problem {
        model: Model::Division.name().into(),
        free: problem.free.iter().filter(linear).cloned().chain(["k1".to_string()]).collect(),
        ..problem.clone()
    };
    let right = correct(problem);
    let mut given = correct(&changed);
    if right.parameters.is_empty() || given.parameters.is_empty() {
        return right;
    }
    for name in &problem.free {
        given.parameters.entry(name.clone()).or_insert(0.0);
    }
    given.covariance = right.covariance;
    given.pose_covariances = right.pose_covariances;
    given.warnings = right.warnings;
    given
}

fn without_last_coefficient(settings: Settings) -> Settings {
    match settings.free().iter().filter(|p| *p > Parameter::Skew).last() {
        Some(last) => settings.hold(last, 0.0),
        None => settings,
    }
}

fn prisms_exchanged(problem: &Problem) -> Answer {
    let mut given = correct(problem);
    for (x, y) in [("s1", "s3"), ("s2", "s4")] {
        if let (Some(&of_x), Some(&of_y)) = (given.parameters.get(x), given.parameters.get(y)) {
            given.parameters.insert(x.into(), of_y);
            given.parameters.insert(y.into(), of_x);
        }
    }
    given
}

fn far_out_dropped(problem: &Problem) -> Answer {
    let mut changed = problem.clone();
    let [width, height] = problem.image_size.map(|size| size as f64);
    let is_near =
        |&[u, v]: &[f64; 2]| (u / width - 0.5).abs() < 1.0 / 3.0 && (v / height - 0.5).abs() < 1.0 / 3.0;
    for view in &mut changed.views {
        let pairs = view.target.iter().zip(&view.pixels).filter(|(_, pixel)| is_near(pixel));
        let (target, pixels): (Vec<_>, Vec<_>) = pairs.map(|(t, p)| (*t, *p)).unzip();
        // A view with hardly a mark left is used whole.
        if pixels.len() >= 8 {
            (view.target, view.pixels) = (target, pixels);
        }
    }
    correct(&changed)
}

#[cfg(test)]
mod tests {
    use super::super::tests::asked_of;
    use super::*;

    #[test]
    fn marks_within_a_sixth_of_the_image_from_its_edges_are_not_used() {
        let problem = asked_of("four-pose");
        let mut near = problem.clone();
        for view in &mut near.views {
            // Of 640 by 480 the sixths end at these.
            let is_used =
                |[u, v]: [f64; 2]| (640.0 / 6.0..3200.0 / 6.0).contains(&u) && (80.0..400.0).contains(&v);
            let pairs = view.target.iter().zip(&view.pixels).filter(|(_, pixel)| is_used(**pixel));
            (view.target, view.pixels) = pairs.map(|(t, p)| (*t, *p)).unzip();
        }
        assert!(near.points() < problem.points() && near.views.iter().all(|view| view.pixels.len() >= 8));
        assert_eq!(far_out_dropped(&problem), correct(&near));
    }

    #[test]
    fn the_last_free_coefficient_is_held_at_zero_and_no_other() {
        for (scene, last, other) in [("four-pose", "k2", "k1"), ("held", "k1", "k2")] {
            let answer = with_settings(&asked_of(scene), without_last_coefficient);
            assert!(answer.parameters[last] == 0.0 && answer.parameters[other] != 0.0, "{answer:?}");
        }
    }

    #[test]
    fn prisms_are_exchanged_in_pairs() {
        let problem = asked_of("thin-prism");
        let of = |answer: &Answer| ["s1", "s2", "s3", "s4"].map(|name| answer.parameters[name]);
        let [s1, s2, s3, s4] = of(&correct(&problem));
        assert_eq!(of(&prisms_exchanged(&problem)), [s3, s4, s1, s2]);
    }

    #[test]
    fn another_lens_has_one_coefficient_of_its_own_and_the_uncertainty_of_the_right_one() {
        let problem = asked_of("fisheye");
        let (right, found) = (correct(&problem), another_lens(&problem));
        assert_ne!(found.parameters["k1"], right.parameters["k1"]);
        assert_eq!(["k2", "k3", "k4"].map(|name| found.parameters[name]), [0.0; 3]);
        assert_eq!((found.covariance, found.warnings), (right.covariance, right.warnings));
    }

    #[test]
    fn what_determines_no_lens_of_its_kind_is_refused_though_another_would_do() {
        let mut problem = asked_of("fisheye");
        // Three views of four marks are 24 coordinates: for 18 and 8 unknowns too few, for 18 and 5 enough.
        problem.views.truncate(3);
        for view in &mut problem.views {
            let corners = [0, 8, 54, 62];
            view.target = corners.map(|i| view.target[i]).to_vec();
            view.pixels = corners.map(|i| view.pixels[i]).to_vec();
        }
        let right = correct(&problem);
        assert!(right.parameters.is_empty(), "{right:?}");
        assert_eq!(another_lens(&problem), right);
    }
}
