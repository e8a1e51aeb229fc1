//! What became of each photograph? One by one, so that a table of them says where its figures come from.

use super::detectors::{Asked, Detector};
use super::draw;
use super::observed::{Found, Truth};
use super::scene::{Demand, Scene};
use super::{AT_ONCE, answered};
use std::io;
use std::ops::Range;

/// How a photograph was answered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outcome {
    /// Not as the protocol wants it.
    Broken,
    /// No board was found.
    NotFound,
    /// A board was found that is not in the photograph.
    Invented,
    /// The board that is there was found.
    Found(Marks),
}

/// The marks of a board that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Marks {
    /// Whether they are numbered as in a mirror.
    pub is_mirrored: bool,
    /// Marks at another's place.
    pub confused: usize,
    /// Marks that were not seen.
    pub missing: usize,
    /// Marks that were.
    pub count: usize,
    /// Sum of the squared distances of these from their places, px^2.
    pub squares_px2: f64,
    /// Largest of the distances, px.
    pub worst_px: f64,
    /// What the sum is at the bound, px^2; `None` where there is no bound.
    pub bound_px2: Option<f64>,
}

impl Outcome {
    /// Whether a board was answered.
    pub fn is_board(&self) -> bool {
        matches!(self, Outcome::Invented | Outcome::Found(_))
    }

    /// The marks of a board that is there, each at its own place.
    pub fn right(&self) -> Option<&Marks> {
        match self {
            Outcome::Found(marks) if marks.confused == 0 => Some(marks),
            _ => None,
        }
    }
}

impl Marks {
    fn of(found: &Found) -> Marks {
        let errors = || found.errors.iter();
        let variances: Option<Vec<f64>> = errors().map(|error| error.variance_px2).collect();
        Marks {
            is_mirrored: found.order.is_mirrored(),
            confused: errors().filter(|error| error.is_confused).count(),
            missing: found.missing,
            count: found.errors.len(),
            squares_px2: errors().map(|error| error.px.norm_squared()).sum(),
            worst_px: errors().map(|error| error.px.norm()).fold(0.0, f64::max),
            bound_px2: variances.map(|variances| 2.0 * variances.iter().sum::<f64>()),
        }
    }
}

/// Shows a detector these photographs of a scene, and judges each by itself. A trial in which no pose fits
/// the image is left out. `None` where the detector does not know such boards.
///
/// # Errors
/// Photographs that cannot be handed to it.
pub fn outcomes(
    scene: &Scene,
    detector: &mut dyn Detector,
    seed: u64,
    trials: Range<u64>,
) -> io::Result<Option<Vec<(u64, Outcome)>>> {
    let trials: Vec<u64> = trials.collect();
    let mut found = Vec::new();
    for some in trials.chunks(AT_ONCE) {
        let drawn = draw::photographs(scene, seed, some);
        let asked: Vec<Asked> =
            drawn.iter().map(|(trial, photo)| Asked::new(scene, *trial, "", photo.image.clone())).collect();
        let Some(answers) = answered(detector, scene, &asked)? else { return Ok(None) };
        let truths = draw::truths(scene, &drawn);
        for (((trial, _), truth), answer) in drawn.iter().zip(&truths).zip(answers) {
            found.push((*trial, outcome(scene, truth, answer)));
        }
    }
    Ok(Some(found))
}

fn outcome(scene: &Scene, truth: &Truth, answer: super::judge::Answered) -> Outcome {
    match answer {
        Err(_) => Outcome::Broken,
        Ok(None) => Outcome::NotFound,
        Ok(Some(_)) if scene.demand == Demand::Nothing => Outcome::Invented,
        Ok(Some(marks)) => Outcome::Found(Marks::of(&Found::of(truth, &marks))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::Kind;
    use crate::{Builtin, scenes, show};

    fn scene(id: &str) -> Scene {
        scenes().into_iter().find(|scene| scene.id == id).expect("it is a scene")
    }

    #[test]
    fn the_figures_of_a_report_are_sums_over_its_photographs() {
        let scene = scene("tilted");
        let figures = show(scene, &mut Builtin, 1, 6).unwrap().unwrap().figures();
        let each = outcomes(&scene, &mut Builtin, 1, 0..6).unwrap().unwrap();
        let marks: Vec<&Marks> = each.iter().filter_map(|(_, outcome)| outcome.right()).collect();
        let sum = |of: fn(&Marks) -> f64| marks.iter().map(|marks| of(marks)).sum::<f64>();
        let squares = sum(|marks| marks.squares_px2);
        let near = |a: f64, b: Option<f64>| (a / b.unwrap() - 1.0).abs() < 1e-12;
        assert_eq!((marks.len(), figures.found), (6, 6));
        assert!(near((squares / (2.0 * sum(|m| m.count as f64))).sqrt(), figures.rms_px));
        assert!(near((squares / sum(|m| m.bound_px2.unwrap())).sqrt(), figures.over_bound));
        assert!(near(marks.iter().map(|m| m.worst_px).fold(0.0, f64::max), figures.worst_px));
    }

    #[test]
    fn a_photograph_does_not_depend_on_those_before_it() {
        let scene = scene("noisy");
        let all = outcomes(&scene, &mut Builtin, 1, 0..3).unwrap().unwrap();
        assert_eq!(outcomes(&scene, &mut Builtin, 1, 2..3).unwrap().unwrap(), all[2..]);
    }

    #[test]
    fn a_board_that_is_not_there_is_not_found() {
        let each = outcomes(&scene("another-size"), &mut Builtin, 1, 0..4).unwrap().unwrap();
        assert!(each.iter().all(|(_, outcome)| *outcome == Outcome::NotFound));
    }

    /// Two photographs of the search for wrong boards: a disc taken for the missing one beside it, and a
    /// moved corner fitted to a marker's edge.
    #[test]
    fn a_mark_is_not_answered_at_anothers_place() {
        for (kind, id, trial) in [(Kind::Asymmetric, "steep", 34), (Kind::Charuco, "moved", 32)] {
            let is_it = |scene: &Scene| scene.kind == kind && scene.id == id;
            let scene = scenes().into_iter().find(is_it).expect("it is a scene");
            let each = outcomes(&scene, &mut Builtin, 1, trial..trial + 1).unwrap().unwrap();
            for (_, outcome) in each {
                assert!(outcome.right().is_none_or(|marks| marks.worst_px < 2.0), "{id}: {outcome:?}");
                assert!(!outcome.is_board() || outcome.right().is_some(), "{id}: {outcome:?}");
            }
        }
    }
}
