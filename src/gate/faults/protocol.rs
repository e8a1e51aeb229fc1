//! Faults of the program around a good solver: wrong, missing or impossible answers now and then.

use super::{Planted, chosen, correct, fingerprint, gross, spoilt};
use crate::protocol::{Answer, Problem, Status};

/// A camera that nothing tells, known to a thousandth of a pixel.
fn confident_nonsense(problem: &Problem) -> Answer {
    let mut answer = Answer::without_estimate(&problem.id, Status::Ok, String::new());
    answer.message = None;
    answer.parameters = problem.free.iter().map(|name| (name.clone(), 92_779.0)).collect();
    answer.standard_deviations = Some(problem.free.iter().map(|name| (name.clone(), 1e-3)).collect());
    answer
}

pub(super) const FAULTS: &[Planted] = &[
    gross("nan-now-and-then", "one answer in fifty has cy = NaN", |p, _| {
        spoilt(p, |a| {
            if chosen(p, 50) {
                a.parameters.insert("cy".into(), f64::NAN);
            }
        })
    }),
    gross("answer-to-another", "one answer in fifty carries the id of another problem", |p, _| {
        let mut given = correct(p);
        if chosen(p, 50) {
            given.id = format!("{:x}", fingerprint(p));
        }
        given
    }),
    gross("a-pose-missing", "the last pose is not stated", |p, _| {
        spoilt(p, |a| a.poses.iter_mut().for_each(|poses| poses.truncate(p.views.len() - 1)))
    }),
    gross("refuses-good-data", "one good problem in twenty is refused", |p, _| {
        if chosen(p, 20) { Answer::without_estimate(&p.id, Status::Refused, "bad luck") } else { correct(p) }
    }),
    gross("refuses-everything", "every problem is refused", |p, _| {
        Answer::without_estimate(&p.id, Status::Refused, "no luck")
    }),
    gross(
        "warns-of-everything",
        "a warning with every answer, and one with a tiny deviation where data are refused",
        |p, _| {
            let mut given = correct(p);
            if given.status != Status::Ok {
                given = confident_nonsense(p);
            }
            given.warnings.push("use with care".into());
            given
        },
    ),
];

#[cfg(test)]
mod tests {
    use super::super::tests::{asked_of, with_fault};
    use super::*;
    use crate::plan::{Asked, Plan};

    #[test]
    fn who_warns_of_everything_answers_rightly_where_it_can_and_confidently_where_it_cannot() {
        let (good, bad) = (asked_of("four-pose"), asked_of("one-facing-view"));
        let warned = |problem| with_fault("warns-of-everything", problem);
        assert_eq!(warned(&good).parameters, correct(&good).parameters);
        assert!(warned(&bad).standard_deviations.unwrap().values().all(|sd| *sd == 1e-3));
        for answer in [warned(&good), warned(&bad)] {
            assert_eq!(answer.status, Status::Ok);
            assert!(answer.warnings.iter().any(|warning| warning == "use with care"));
        }
    }

    #[test]
    fn the_last_pose_is_missing_and_no_other() {
        let problem = asked_of("four-pose");
        let (all, stated) = (correct(&problem).poses, with_fault("a-pose-missing", &problem).poses.unwrap());
        assert_eq!(stated, all.unwrap()[..3]);
    }

    #[test]
    fn what_strikes_now_and_then_changes_what_it_says_and_nothing_elsewhere() {
        let asked = Asked { scenes: vec!["four-pose".into()], ..Asked::default() };
        let plan = Plan::of(1, 1000, asked).unwrap();
        let problem = |wanted: fn(&Problem) -> bool| {
            plan.cases.iter().map(|case| plan.problem(case)).find(wanted).unwrap()
        };
        // One in a hundred is one in fifty and one in twenty as well.
        let struck = problem(|p| chosen(p, 100));
        let right = correct(&struck);
        assert!(with_fault("nan-now-and-then", &struck).parameters["cy"].is_nan());
        assert_ne!(with_fault("answer-to-another", &struck).id, struck.id);
        assert_eq!(with_fault("refuses-good-data", &struck).status, Status::Refused);
        let variance = |answer: Answer| answer.covariance.unwrap().matrix[1][1];
        let stated = variance(with_fault("certain-now-and-then", &struck)) / variance(right);
        assert!((stated - 1e-6).abs() < 1e-15, "{stated}");

        let spared = problem(|p| !chosen(p, 10));
        for fault in ["nan-now-and-then", "answer-to-another", "refuses-good-data", "certain-now-and-then"] {
            assert_eq!(with_fault(fault, &spared), correct(&spared), "{fault}");
        }
    }
}
