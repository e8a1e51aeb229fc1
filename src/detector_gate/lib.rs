//! Is a detector of calibration boards to be trusted? The gate of calibrators, for those who find the marks
//! in photographs.
//!
//! ```text
//! Scene (a condition) -> Photo (exact render of known truth) -> Problem --Detector--> Answer
//!   -> Found (marks beside their true places, in units of the bound that the pixels' noise implies)
//!   -> Check (one a property, scene and kind of board) --decide (Holm)--> Report
//! ```

mod bound;
mod cell;
mod check;
mod detectors;
mod draw;
mod judge;
pub mod look;
mod observed;
mod outcome;
pub mod protocol;
mod report;
mod scene;
mod sight;
mod tally;

pub use bound::variance_px2;
pub use cell::Cell;
pub use check::{Check, Property};
pub use detectors::{Asked, Builtin, Detector, Program};
pub use judge::{Figures, MATTERS_PX};
pub use look::{Look, Photo};
pub use outcome::{Marks, Outcome, outcomes};
pub use report::Report;
pub use scene::{Demand, Scene, scenes};
pub use sight::{Sight, sights};
pub use tally::{Tally, tally};

use calibench::geometry::Vec2;
use calibench::raster::Raster;
use judge::{Answered, Shown};
use protocol::{Kind, Status};

/// Photographs of a scene in a quick run.
pub const QUICK: usize = 24;
/// Photographs of a scene in a thorough run.
pub const THOROUGH: usize = 512;
/// Most photographs of a scene.
pub const MOST_PHOTOS: usize = 20_000;
/// Photographs of a scene that are asked twice, and turned.
const REPEATED: usize = 4;
/// Photographs that are in memory at once.
const AT_ONCE: usize = 32;

/// Asks a detector `photos` photographs of every scene of these kinds of boards, and judges its answers.
///
/// # Errors
/// Photographs that cannot be handed to it.
pub fn run(
    detector: &mut dyn Detector,
    kinds: &[Kind],
    seed: u64,
    photos: usize,
    false_alarm_rate: f64,
) -> std::io::Result<Report> {
    let mut shown = Vec::new();
    let mut unsupported = Vec::new();
    for scene in scenes() {
        if unsupported.contains(&scene.kind) || !kinds.contains(&scene.kind) {
            continue;
        }
        match show(scene, detector, seed, photos)? {
            Some(scene) => shown.push(scene),
            None => {
                unsupported.push(scene.kind);
                shown.retain(|other: &Shown| other.scene.kind != scene.kind);
            }
        }
    }
    let checks = check::decide(shown.iter().flat_map(Shown::checks).collect(), false_alarm_rate);
    Ok(Report {
        detector: detector.name(),
        boards: Kind::ALL.into_iter().filter(|kind| kinds.contains(kind)).collect(),
        seed,
        photos,
        false_alarm_rate,
        scenes: shown.iter().map(Shown::figures).collect(),
        trusted: !checks.is_empty() && !checks.iter().any(Check::fails),
        unsupported,
        checks,
    })
}

/// A scene shown to a detector; `None` where it does not know such boards.
fn show(
    scene: Scene,
    detector: &mut dyn Detector,
    seed: u64,
    photos: usize,
) -> std::io::Result<Option<Shown>> {
    let mut shown =
        Shown { scene, truths: Vec::new(), answers: Vec::new(), again: Vec::new(), turned: Vec::new() };
    let trials: Vec<u64> = (0..photos as u64).collect();
    for some in trials.chunks(AT_ONCE) {
        let drawn = draw::photographs(&scene, seed, some);
        let questions: Vec<Asked> =
            drawn.iter().map(|(trial, photo)| Asked::new(&scene, *trial, "", photo.image.clone())).collect();
        let is_first = |trial: u64| (trial as usize) < REPEATED && scene.demand == Demand::Found;
        let first: Vec<&(u64, Photo)> = drawn.iter().filter(|(trial, _)| is_first(*trial)).collect();
        let again =
            first.iter().map(|(trial, photo)| Asked::new(&scene, *trial, "-again", photo.image.clone()));
        let turned =
            first.iter().map(|(trial, photo)| Asked::new(&scene, *trial, "-turned", half_turn(&photo.image)));
        let all: Vec<Asked> = questions.into_iter().chain(again).chain(turned).collect();
        let Some(mut answers) = answered(detector, &scene, &all)? else { return Ok(None) };
        let turned = answers.split_off(answers.len() - first.len());
        let again = answers.split_off(answers.len() - first.len());
        shown.answers.extend(answers);
        shown.again.extend(again);
        let turned_back = turned
            .into_iter()
            .map(|answer| answer.map(|marks| marks.map(|marks| back(&marks, scene.look.size))));
        shown.turned.extend(turned_back);
        shown.truths.extend(draw::truths(&scene, &drawn));
    }
    Ok(Some(shown))
}

/// Answers by their marks; `None` where the first says that such boards are not known. A board that is not in
/// the photograph may be another than the scene's: who does not know it does not find it.
fn answered(
    detector: &mut dyn Detector,
    scene: &Scene,
    asked: &[Asked],
) -> std::io::Result<Option<Vec<Answered>>> {
    let answers = detector.answer_all(asked)?;
    if let Some(Ok(first)) = answers.first()
        && first.status == Status::Unsupported
        && scene.demand != Demand::Nothing
    {
        return Ok(None);
    }
    let marks = |(asked, answer): (&Asked, Result<protocol::Answer, String>)| answer?.places(&asked.wanted());
    Ok(Some(asked.iter().zip(answers).map(marks).collect()))
}

fn half_turn(image: &Raster<u8>) -> Raster<u8> {
    let (width, height) = (image.width(), image.height());
    Raster::from_fn(width, height, |x, y| image.get(width - 1 - x, height - 1 - y))
}

/// Places in a turned photograph as places in the one that is not.
fn back(marks: &[Option<Vec2>], (width, height): (usize, usize)) -> Vec<Option<Vec2>> {
    let last = Vec2::new(width as f64 - 1.0, height as f64 - 1.0);
    marks.iter().map(|mark| mark.map(|place| last - place)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::Answer;
    use std::time::Duration;

    /// This library's detector with its answers changed.
    struct Changed(fn(&Asked, Answer) -> Answer);

    impl Detector for Changed {
        fn name(&self) -> String {
            "changed".to_string()
        }

        fn answer_all(&mut self, asked: &[Asked]) -> std::io::Result<Vec<Result<Answer, String>>> {
            let answers = Builtin.answer_all(asked)?;
            let each = asked.iter().zip(answers);
            Ok(each.map(|(asked, answer)| answer.map(|answer| (self.0)(asked, answer))).collect())
        }
    }

    fn marks(answer: Answer, change: impl Fn(Vec<Option<[f64; 2]>>) -> Vec<Option<[f64; 2]>>) -> Answer {
        Answer { marks: answer.marks.map(change), ..answer }
    }

    /// Boards that are numbered from either end.
    const EITHER_END: [Kind; 2] = [Kind::Chessboard, Kind::Circles];

    /// The properties that fail with a changed detector, in some of the scenes.
    fn failing(change: fn(&Asked, Answer) -> Answer, scenes: &[&str]) -> Vec<Property> {
        failing_of(&EITHER_END, change, scenes)
    }

    fn failing_of(kinds: &[Kind], change: fn(&Asked, Answer) -> Answer, scenes: &[&str]) -> Vec<Property> {
        let is_asked = |scene: &Scene| kinds.contains(&scene.kind) && scenes.contains(&scene.id);
        let some: Vec<Scene> = super::scenes().into_iter().filter(is_asked).collect();
        let shown = some.into_iter().map(|scene| show(scene, &mut Changed(change), 1, 12).unwrap().unwrap());
        let checks = check::decide(shown.flat_map(|shown| shown.checks()).collect(), 1e-3);
        let mut failing: Vec<Property> =
            checks.iter().filter(|check| check.fails()).map(|check| check.property).collect();
        failing.sort_unstable();
        failing.dedup();
        failing
    }

    fn moved(answer: Answer, step: impl Fn(f64, f64) -> [f64; 2]) -> Answer {
        marks(answer, |list| list.iter().map(|mark| mark.map(|[u, v]| step(u, v))).collect())
    }

    #[test]
    fn nothing_fails_where_nothing_is_changed() {
        let scenes = ["clean", "facing", "noisy"];
        assert_eq!(failing_of(&Kind::ALL, |_, answer| answer, &scenes), []);
    }

    #[test]
    fn the_marks_of_a_board_with_markers_have_one_order() {
        let reversed = |_: &Asked, answer| marks(answer, |list| list.into_iter().rev().collect());
        for kind in [Kind::Charuco, Kind::AprilGrid] {
            assert!(failing_of(&[kind], reversed, &["clean"]).contains(&Property::Places), "{}", kind.name());
        }
    }

    #[test]
    fn a_board_of_another_kind_or_size_is_not_found() {
        let scenes = ["another-size", "another-kind", "noise-only"];
        assert_eq!(failing_of(&Kind::ALL, |_, answer| answer, &scenes), []);
    }

    #[test]
    fn this_librarys_detectors_hold_beside_the_end_of_a_sheet() {
        assert_eq!(failing(|_, answer| answer, &["uneven-light", "dark-surround", "blurred", "tilted"]), []);
    }

    #[test]
    fn faint_boards_before_something_bright_are_found() {
        let is_asked = |scene: &Scene| scene.id == "faint" && EITHER_END.contains(&scene.kind);
        for scene in super::scenes().into_iter().filter(is_asked) {
            let figures = show(scene, &mut Builtin, 1, 12).unwrap().unwrap().figures();
            assert_eq!((figures.found, figures.wrong), (12, 0), "{}", scene.kind.name());
        }
    }

    #[test]
    fn half_a_pixel_too_many_is_a_bias_and_does_not_turn() {
        let half = |_: &Asked, answer| moved(answer, |u, v| [u + 0.5, v + 0.5]);
        assert_eq!(failing(half, &["clean"]), [Property::Strays, Property::Bias, Property::Turned]);
    }

    #[test]
    fn places_drawn_towards_the_middle_of_their_pixels_show() {
        let drawn = |_: &Asked, answer| {
            let towards = |x: f64| x - 0.05 * libm::sin(std::f64::consts::TAU * x);
            moved(answer, |u, v| [towards(u), towards(v)])
        };
        assert_eq!(failing(drawn, &["facing"]), [Property::PixelPhase]);
    }

    #[test]
    fn a_board_from_the_other_end_holds_and_one_in_a_mirror_does_not() {
        let reversed = |_: &Asked, answer| marks(answer, |list| list.into_iter().rev().collect());
        assert_eq!(failing(reversed, &["clean"]), []);
        let mirrored = |asked: &Asked, answer| {
            marks(answer, |list| {
                list.chunks(asked.wanted().columns).flat_map(|row| row.iter().rev().copied()).collect()
            })
        };
        assert_eq!(failing(mirrored, &["clean"]), [Property::Order]);
    }

    #[test]
    fn a_board_that_is_a_column_off_is_grave() {
        let shifted = |_: &Asked, answer| {
            marks(answer, |mut list| {
                list.rotate_left(1);
                list
            })
        };
        assert!(failing(shifted, &["clean"]).contains(&Property::Places));
    }

    #[test]
    fn a_board_where_there_is_none_is_grave() {
        let invented = |asked: &Asked, answer: Answer| {
            let count = asked.wanted().columns * asked.wanted().rows;
            let marks = (0..count).map(|i| Some([i as f64, 100.0])).collect();
            Answer { status: Status::Ok, marks: Some(marks), ..answer }
        };
        assert_eq!(failing(invented, &["noise-only", "another-size"]), [Property::NothingInvented]);
    }

    #[test]
    fn one_mark_a_pixel_off_is_astray() {
        // In one photograph of twelve: no bias that matters.
        let stray = |asked: &Asked, answer| match asked.id().ends_with("-7") {
            true => marks(answer, |mut list| {
                if let Some(Some([u, _])) = list.get_mut(7) {
                    *u += 1.5;
                }
                list
            }),
            false => answer,
        };
        assert_eq!(failing(stray, &["clean"]), [Property::Strays]);
    }

    #[test]
    fn a_program_that_echoes_breaks_the_protocol_and_leaves_no_photograph() {
        let mut program = Program::new("cat", Duration::from_secs(5)).unwrap();
        let shown = show(scenes()[0], &mut program, 1, 2).unwrap().unwrap();
        let checks = check::decide(shown.checks(), 1e-3);
        let failing: Vec<Property> = checks.iter().filter(|c| c.fails()).map(|c| c.property).collect();
        assert!(failing.contains(&Property::Protocol) && failing.contains(&Property::Found));
        let folder = program.folder().to_path_buf();
        assert!(folder.is_dir());
        drop(program);
        assert!(!folder.exists());
    }
}
