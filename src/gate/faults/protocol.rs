//! Faults of the program around a good solver: wrong, missing or impossible answers now and then.

use super::{Planted, chosen, correct, fingerprint, gross, spoilt};
use crate::protocol::{Answer, Status};

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
];
