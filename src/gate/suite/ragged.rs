//! In which scenes does every view see another part of the board, or every sample other poses?

use super::{Draft, LAW_SIGMA_PX, Poses, Scenario, SuiteError, example_draft, ring, scenario, truth_of};
use crate::setup::Setup;
use calibench::geometry::Vec2;
use calibench::synth::{Stream, StreamKey};

/// The scenes; all obey the law.
pub(super) fn scenarios() -> Result<Vec<Scenario>, SuiteError> {
    Ok(vec![over_the_edge()?, marks_missing()?, poses_anew()?])
}

/// A board that no view sees whole.
fn over_the_edge() -> Result<Scenario, SuiteError> {
    let draft = Draft {
        board: (13, 11, 10.0),
        poses: ring(8, 25.0, 40.0, 112.0),
        ..example_draft(
            "over-the-edge",
            "a board that reaches over the edge of every image, another part each time",
        )
    };
    let (width, height) = draft.image_size;
    let inside = |p: &Vec2| p.x > 0.0 && p.y > 0.0 && p.x < width as f64 - 1.0 && p.y < height as f64 - 1.0;
    ragged(draft, |_, _, pixel| inside(pixel))
}

/// Marks that are not found, at random: from one in ten in the first view to six in ten in the last.
fn marks_missing() -> Result<Scenario, SuiteError> {
    let draft = Draft {
        poses: ring(6, 25.0, 10.0, 134.0),
        ..example_draft(
            "marks-missing",
            "marks that are not found, from a tenth in the first view to six in the last",
        )
    };
    let found = |view: usize, mark: usize, _: &Vec2| {
        let key = StreamKey { seed: 1, scenario: "marks-missing", trial: view as u64, purpose: "found" };
        let mut stream = Stream::open(key);
        let draw = std::iter::repeat_with(|| stream.uniform()).nth(mark);
        draw.is_some_and(|x| x > 0.1 * (view + 1) as f64)
    };
    ragged(draft, found)
}

fn ragged(draft: Draft, sees: impl FnMut(usize, usize, &Vec2) -> bool) -> Result<Scenario, SuiteError> {
    let setup = Setup::ragged(truth_of(&draft)?, sees, draft.free, LAW_SIGMA_PX);
    Ok(scenario(&draft, LAW_SIGMA_PX, setup.map_err(SuiteError::of(draft.id))?))
}

/// The bound of every sample is another: errors are seen in units of their own.
fn poses_anew() -> Result<Scenario, SuiteError> {
    let draft = Draft {
        poses: ring(6, 22.0, 6.0, 142.0),
        ..example_draft("poses-anew", "six views whose poses are drawn anew for every sample")
    };
    let setup =
        Setup::whole(truth_of(&draft)?, draft.free, LAW_SIGMA_PX).map_err(SuiteError::of(draft.id))?;
    Ok(Scenario { poses: Poses::DrawnAnew, ..scenario(&draft, LAW_SIGMA_PX, setup) })
}

#[cfg(test)]
mod tests {
    use crate::suite::suite;

    fn marks(id: &str) -> Vec<usize> {
        let suite = suite().unwrap();
        let scenario = suite.iter().find(|s| s.id == id).unwrap();
        scenario.setup.exact().iter().map(|view| view.len()).collect()
    }

    #[test]
    fn every_ragged_view_sees_a_part_and_no_two_scenes_the_same() {
        for (id, whole) in [("over-the-edge", 143), ("marks-missing", 63)] {
            let marks = marks(id);
            let of_suite = suite().unwrap();
            let setup = &of_suite.iter().find(|s| s.id == id).unwrap().setup;
            assert_eq!(setup.observations(), marks.iter().sum::<usize>());
            // No view sees the whole board, or less than determines a pose well, and most see other numbers.
            assert!(marks.iter().all(|count| (15..whole).contains(count)), "{id}: {marks:?}");
            let mut different = marks.clone();
            different.sort_unstable();
            different.dedup();
            assert!(different.len() >= 5, "{id}: {marks:?}");
        }
    }

    #[test]
    fn poses_are_drawn_anew_and_the_bound_with_them() {
        let suite = suite().unwrap();
        let scenario = suite.iter().find(|s| s.id == "poses-anew").unwrap();
        let drawn = |trial| scenario.setup_of(1, trial);
        assert_eq!(drawn(3).scene, drawn(3).scene);
        assert_ne!(drawn(3).scene, drawn(4).scene);
        let sd: Vec<f64> = (0..200)
            .map(|trial| drawn(trial).bound.standard_deviation(calibench::camera::Parameter::Fx).unwrap())
            .collect();
        assert!((0..200).all(|trial| drawn(trial).outside_image_px() == 0.0));
        let (least, most) =
            (sd.iter().copied().fold(f64::MAX, f64::min), sd.iter().copied().fold(0.0, f64::max));
        // Judged by one bound for all, samples would differ in variance by more than four.
        assert!(most / least > 2.0 && most < 0.02 * 600.0, "{least} to {most}");
    }
}
