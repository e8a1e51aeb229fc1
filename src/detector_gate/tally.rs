//! How many boards are wrong? Photographs of the gate's scenes and of what else may stand before a camera,
//! counted.

use super::detectors::{Asked, Detector};
use super::judge::Answered;
use super::observed::{Found, Truth};
use super::scene::Scene;
use super::sight::{Shown, Sight};
use super::{AT_ONCE, answered};
use rayon::prelude::*;
use std::io;

/// A mark farther than this from its place is another's, or none's, px.
const WRONG_PX: f64 = 2.0;

/// What became of the photographs of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Tally {
    /// The scene.
    pub scene: Scene,
    /// Photographs in which the board was found with every mark at its place.
    pub found: usize,
    /// Photographs in which no board was found.
    pub refused: usize,
    /// Trials with a wrong board: a mark farther than 2 px from its place, marks numbered as in a mirror, or
    /// a board that is not there.
    pub wrong: Vec<u64>,
    /// Answers that break the protocol.
    pub broken: usize,
}

impl Tally {
    /// Photographs in all.
    pub fn photographs(&self) -> usize {
        self.found + self.refused + self.wrong.len() + self.broken
    }
}

/// Shows a detector `photos` photographs of a scene. A trial in which no pose fits the image is left out.
/// `None` where the detector does not know such boards.
///
/// # Errors
/// Photographs that cannot be handed to it.
pub fn tally(
    sight: &Sight,
    detector: &mut dyn Detector,
    seed: u64,
    photos: u64,
) -> io::Result<Option<Tally>> {
    let scene = *sight.scene();
    let mut counts = Tally { scene, found: 0, refused: 0, wrong: Vec::new(), broken: 0 };
    let trials: Vec<u64> = (0..photos).collect();
    for some in trials.chunks(AT_ONCE) {
        let shown: Vec<(u64, Shown)> =
            some.par_iter().filter_map(|&trial| Some((trial, sight.shown(seed, trial)?))).collect();
        let asked: Vec<Asked> =
            shown.iter().map(|(trial, shown)| Asked::new(&scene, *trial, "", shown.image.clone())).collect();
        let Some(answers) = answered(detector, &scene, &asked)? else { return Ok(None) };
        for ((trial, shown), answer) in shown.iter().zip(answers) {
            counts.add(*trial, &shown.boards, answer);
        }
    }
    Ok(Some(counts))
}

impl Tally {
    fn add(&mut self, trial: u64, boards: &[Truth], answer: Answered) {
        match answer {
            Err(_) => self.broken += 1,
            Ok(None) => self.refused += 1,
            Ok(Some(marks)) if boards.iter().any(|board| is_at_its_places(&Found::of(board, &marks))) => {
                self.found += 1
            }
            Ok(Some(_)) => self.wrong.push(trial),
        }
    }
}

fn is_at_its_places(found: &Found) -> bool {
    !found.order.is_mirrored() && found.errors.iter().all(|error| error.px.norm() <= WRONG_PX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::{Answer, Kind, Status};
    use crate::{Builtin, sights};

    fn sight(kind: Kind, id: &str) -> Sight {
        let is_it = |sight: &Sight| sight.scene().kind == kind && sight.scene().id == id;
        sights().into_iter().find(is_it).expect("it is a scene")
    }

    /// This library's detector, its marks moved by some pixels.
    struct Moved(f64);

    impl Detector for Moved {
        fn name(&self) -> String {
            "moved".to_string()
        }

        fn answer_all(&mut self, asked: &[Asked]) -> io::Result<Vec<Result<Answer, String>>> {
            let move_one = |mark: Option<[f64; 2]>| mark.map(|[u, v]| [u + self.0, v]);
            let moved = |answer: Answer| {
                let marks = answer.marks.map(|marks| marks.into_iter().map(move_one).collect());
                Answer { marks, ..answer }
            };
            Ok(Builtin.answer_all(asked)?.into_iter().map(|answer| answer.map(moved)).collect())
        }
    }

    /// A board wherever one is asked for.
    struct Inventive;

    impl Detector for Inventive {
        fn name(&self) -> String {
            "inventive".to_string()
        }

        fn answer_all(&mut self, asked: &[Asked]) -> io::Result<Vec<Result<Answer, String>>> {
            let invented = |asked: &Asked| {
                let count = asked.wanted().columns * asked.wanted().rows;
                let marks = Some((0..count).map(|i| Some([i as f64, 100.0])).collect());
                Ok(Answer { id: asked.id().to_string(), status: Status::Ok, marks, message: None })
            };
            Ok(asked.iter().map(invented).collect())
        }
    }

    #[test]
    fn a_mark_that_is_three_pixels_off_is_wrong_and_one_that_is_one_off_is_not() {
        for id in ["clean", "twice"] {
            let counts = |px| tally(&sight(Kind::Chessboard, id), &mut Moved(px), 1, 4).unwrap().unwrap();
            assert_eq!((counts(1.0).found, counts(1.0).wrong), (4, vec![]), "{id}");
            assert_eq!((counts(3.0).found, counts(3.0).wrong), (0, vec![0, 1, 2, 3]), "{id}");
        }
    }

    #[test]
    fn a_board_in_any_scene_is_wrong_where_it_is_not() {
        for sight in sights().iter().filter(|sight| sight.scene().kind == Kind::AprilGrid) {
            let counts = tally(sight, &mut Inventive, 1, 1).unwrap().unwrap();
            assert_eq!((counts.found, counts.wrong.len()), (0, 1), "{}", sight.scene().name());
        }
    }

    #[test]
    fn boards_beside_others_and_on_a_floor_are_found_and_none_is_wrong() {
        for kind in [Kind::Chessboard, Kind::Charuco, Kind::AprilGrid] {
            for id in ["on-floor", "beside", "respaced", "mirrored"] {
                // A chessboard in a mirror is one.
                let Some(sight) = sights().into_iter().find(|s| s.scene().kind == kind && s.scene().id == id)
                else {
                    continue;
                };
                let counts = tally(&sight, &mut Builtin, 1, 4).unwrap().unwrap();
                let least = if id == "on-floor" { 3 } else { 0 };
                assert!(counts.wrong.is_empty() && counts.found >= least, "{counts:?}");
            }
        }
    }
}
