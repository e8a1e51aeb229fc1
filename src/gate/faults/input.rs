//! Faults between the data and a good solver: what is measured is not what is used.

use super::{Planted, correct, gross};
use crate::protocol::{Answer, Problem, Status};
use crate::solver::{answer, only_poses, settings, views};
use calibench::board::View;
use calibench::calibrate::calibrate_lens;

pub(super) const FAULTS: &[Planted] = &[
    gross("rounded-to-half-pixels", "observations rounded to half pixels", |p, _| {
        on_pixels(p, |x| 0.5 * (2.0 * x).round())
    }),
    gross("rounded-to-f32", "observations in single precision", |p, _| on_pixels(p, |x| f64::from(x as f32))),
    gross("target-rounded", "target points rounded to a thousandth of a unit", |p, _| {
        let mut changed = p.clone();
        let numbers = changed.views.iter_mut().flat_map(|v| v.target.iter_mut().flatten());
        numbers.for_each(|x| *x = (1000.0 * *x).round() / 1000.0);
        correct(&changed)
    }),
    gross("one-view-dropped", "the last view is not used; its pose is found afterwards", |p, _| {
        last_view_unused(p)
    }),
    gross("last-points-dropped", "the last point of every view is not used", |p, _| {
        let mut changed = p.clone();
        changed.views.iter_mut().for_each(|v| {
            v.target.pop();
            v.pixels.pop();
        });
        correct(&changed)
    }),
    gross(
        "views-cut-to-the-shortest",
        "marks beyond the number of the view with fewest are not used: a table of fixed width",
        |p, _| cut_to_the_shortest(p),
    ),
    gross("first-view-twice", "the first view counts twice", |p, _| {
        let mut changed = p.clone();
        // A hundredth of a pixel aside, as noise would put it: what is the same but for rounding the solver
        // under the fault counts once.
        changed.views.extend(p.views.first().cloned().map(|mut view| {
            view.pixels.iter_mut().flatten().for_each(|x| *x += 0.01);
            view
        }));
        let mut given = correct(&changed);
        given.poses.iter_mut().for_each(|poses| poses.truncate(p.views.len()));
        given.pose_covariances.iter_mut().for_each(|covariances| covariances.truncate(p.views.len()));
        given
    }),
    gross(
        "image-centre-offset",
        "coordinates measured from the image centre, which is not added back",
        |p, _| {
            let mut given = correct(p);
            let [width, height] = p.image_size;
            for (name, size) in [("cx", width), ("cy", height)] {
                if let Some(value) =
                    given.parameters.get_mut(name).filter(|_| p.free.iter().any(|f| f == name))
                {
                    *value -= 0.5 * (size as f64 - 1.0);
                }
            }
            given
        },
    ),
    gross("broken-input-mended", "points and pixels that do not pair are left out in silence", |p, _| {
        mended(p)
    }),
];

fn on_pixels(problem: &Problem, how: impl Fn(f64) -> f64) -> Answer {
    let mut changed = problem.clone();
    changed.views.iter_mut().flat_map(|v| v.pixels.iter_mut().flatten()).for_each(|x| *x = how(*x));
    correct(&changed)
}

/// Points and pixels that do not pair are noticed all the same.
fn cut_to_the_shortest(problem: &Problem) -> Answer {
    if problem.views.iter().any(|view| view.target.len() != view.pixels.len()) {
        return correct(problem);
    }
    let mut changed = problem.clone();
    let fewest = problem.views.iter().map(|view| view.pixels.len()).min().unwrap_or(0);
    changed.views.iter_mut().for_each(|view| {
        view.target.truncate(fewest);
        view.pixels.truncate(fewest);
    });
    correct(&changed)
}

fn last_view_unused(problem: &Problem) -> Answer {
    let whole = correct(problem);
    let (Status::Ok, Ok(mut all)) = (whole.status, views(problem)) else { return whole };
    let last: Option<View> = all.pop();
    let Ok(calibration) = calibrate_lens(&all, &settings(problem)) else { return whole };
    let mut given = answer(&problem.id, &calibration);
    let pose = last.and_then(|view| calibrate_lens(&[view], &only_poses(&calibration.camera)).ok());
    if let Some(found) = pose {
        let found = answer("", &found);
        given.poses.iter_mut().for_each(|poses| poses.extend(found.poses.iter().flatten().cloned()));
        let of_last = found.pose_covariances.iter().flatten();
        given.pose_covariances.iter_mut().for_each(|all| all.extend(of_last.clone().cloned()));
    }
    given
}

fn mended(problem: &Problem) -> Answer {
    let mut changed = problem.clone();
    for view in &mut changed.views {
        let pairs = view.target.iter().zip(&view.pixels).filter(|(_, p)| p.iter().all(|x| x.is_finite()));
        let (target, pixels) = pairs.map(|(t, p)| (*t, *p)).unzip();
        (view.target, view.pixels) = (target, pixels);
    }
    changed.views.retain(|view| !view.pixels.is_empty());
    let mut given = correct(&changed);
    // As many poses as were asked for, like a program that fills a fixed array.
    if let Some(poses) = &mut given.poses
        && let Some(last) = poses.last().cloned()
    {
        poses.resize(problem.views.len(), last);
    }
    given.pose_covariances = None;
    given
}

#[cfg(test)]
mod tests {
    use super::super::tests::{asked_of, with_fault};
    use super::*;

    #[test]
    fn a_target_is_rounded_to_thousandths_before_it_is_used() {
        let exact = asked_of("four-pose");
        let mut problem = exact.clone();
        problem.views.iter_mut().flat_map(|view| view.target.iter_mut().flatten()).for_each(|x| *x += 4e-4);
        assert_ne!(correct(&problem), correct(&exact));
        assert_eq!(with_fault("target-rounded", &problem), correct(&exact));
    }

    #[test]
    fn the_image_centre_is_taken_from_a_principal_point_that_is_estimated() {
        let problem = asked_of("four-pose");
        let value = |answer: &Answer, name: &str| answer.parameters[name];
        let (right, found) = (correct(&problem), with_fault("image-centre-offset", &problem));
        // The middle pixel of 640 by 480.
        assert_eq!(value(&found, "cx"), value(&right, "cx") - 319.5);
        assert_eq!(value(&found, "cy"), value(&right, "cy") - 239.5);
        assert_eq!(value(&found, "fx"), value(&right, "fx"));
        let held = asked_of("held");
        assert_eq!(with_fault("image-centre-offset", &held), correct(&held));
    }

    /// The problem with every pixel changed.
    fn with_pixels(problem: &Problem, how: impl Fn(f64) -> f64) -> Problem {
        let mut changed = problem.clone();
        changed.views.iter_mut().flat_map(|view| view.pixels.iter_mut().flatten()).for_each(|x| *x = how(*x));
        changed
    }

    #[test]
    fn pixels_are_rounded_to_halves_and_to_single_precision() {
        let halves = with_pixels(&asked_of("four-pose"), |x| x.floor() + 0.5);
        for (fault, off) in [("rounded-to-half-pixels", 0.2), ("rounded-to-f32", 1e-9)] {
            let problem = with_pixels(&halves, |x| x + off);
            assert_ne!(correct(&problem), correct(&halves));
            assert_eq!(with_fault(fault, &problem), correct(&halves), "{fault}");
        }
    }

    /// The problem with so many marks of every view.
    fn with_marks(problem: &Problem, marks: [usize; 4]) -> Problem {
        let mut changed = problem.clone();
        for (view, count) in changed.views.iter_mut().zip(marks) {
            view.target.truncate(count);
            view.pixels.truncate(count);
        }
        changed
    }

    #[test]
    fn marks_at_the_end_are_not_used() {
        let problem = asked_of("four-pose");
        assert_eq!(with_fault("last-points-dropped", &problem), correct(&with_marks(&problem, [62; 4])));
        let ragged = with_marks(&problem, [63, 40, 63, 50]);
        let shortest = correct(&with_marks(&problem, [40; 4]));
        assert_eq!(with_fault("views-cut-to-the-shortest", &ragged), shortest);
        let unpaired = asked_of("a-pixel-too-few");
        assert_eq!(with_fault("views-cut-to-the-shortest", &unpaired), correct(&unpaired));
    }

    #[test]
    fn a_view_that_is_dropped_gets_a_pose_of_the_camera_that_the_others_give() {
        let problem = asked_of("four-pose");
        let others = correct(&Problem { views: problem.views[..3].to_vec(), ..problem.clone() });
        let (right, found) = (correct(&problem), with_fault("one-view-dropped", &problem));
        assert_eq!((&found.parameters, &found.covariance), (&others.parameters, &others.covariance));
        let [found, right] = [found, right].map(|answer| answer.poses.unwrap());
        assert_eq!((found.len(), &found[..3]), (4, &others.poses.unwrap()[..]));
        let apart = found[3].pose().translation - right[3].pose().translation;
        assert!(apart.norm() < 0.2 && apart.norm() > 0.0, "{apart}");
    }

    #[test]
    fn a_view_that_counts_twice_has_one_pose_and_pulls_the_camera() {
        let problem = asked_of("four-pose");
        let (right, found) = (correct(&problem), with_fault("first-view-twice", &problem));
        assert_ne!(found.parameters, right.parameters);
        let stated = (found.poses.unwrap().len(), found.pose_covariances.unwrap().len());
        assert_eq!(stated, (4, 4));
    }

    #[test]
    fn broken_input_is_mended_where_it_does_not_pair_and_used_where_it_does() {
        for scene in ["a-pixel-too-few", "a-coordinate-not-measured", "an-empty-view"] {
            let problem = asked_of(scene);
            assert_ne!(correct(&problem).status, Status::Ok, "{scene}");
            let mended = with_fault("broken-input-mended", &problem);
            assert_eq!((mended.status, mended.poses.unwrap().len()), (Status::Ok, 4), "{scene}");
        }
        let good = asked_of("four-pose");
        let unstated = Answer { pose_covariances: None, ..correct(&good) };
        assert_eq!(with_fault("broken-input-mended", &good), unstated);
    }
}
