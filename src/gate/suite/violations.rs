//! In which scenes is the world not the model? Noise that is not independent or not equal, boards that are
//! not what they are said to be, lenses that the model cannot be.

use super::{Draft, example_draft, ring};
use crate::violation::Violation;
use calibench::camera::{BrownConrady, Camera, Lens, Model};
use calibench::synth::Truth;

/// Each with what is left out, and with the share of samples whose residuals show it.
pub(super) fn drafts() -> Vec<(Draft, Violation, f64)> {
    let eight = |id, about| Draft { poses: ring(8, 25.0, 12.0, 128.0), ..example_draft(id, about) };
    let base = Truth::example_camera();
    let decentred = BrownConrady { p1: 0.0006, p2: -0.0009, ..base.distortion };
    let equidistant = Lens::new(Model::KannalaBrandt, &[0.0; 4]).expect("four coefficients");
    let wide = Camera { fx: 380.0, fy: 380.0, ..base.with_distortion(BrownConrady::radial(-0.28, 0.05)) };
    vec![
        (
            eight(
                "noise-of-neighbours",
                "noise that neighbouring marks share, correlation 0.6 from one to the next",
            ),
            Violation::CorrelatedNoise(0.6),
            1.0,
        ),
        (
            eight("noise-along-u", "noise three times as large along u as along v"),
            Violation::NoisePerAxis(3.0),
            1.0,
        ),
        (
            Draft {
                poses: six_and_two(),
                ..example_draft(
                    "noise-of-tilted-views",
                    "four times the noise in the two views that are tilted most",
                )
            },
            Violation::NoisePerView { last: 2, factor: 4.0 },
            1.0,
        ),
        (
            eight("board-of-another-size", "a board one per cent larger than stated"),
            Violation::BoardScale(1.01),
            0.0,
        ),
        (
            eight("board-stretched", "a board three thousandths wider than stated, and as high as stated"),
            Violation::BoardWidth(1.003),
            0.0,
        ),
        (
            eight("board-bowed", "a board whose middle stands out by three thousandths of its diagonal"),
            Violation::BowedBoard(0.3),
            1.0,
        ),
        (
            eight("board-bowed-less", "a board whose middle stands out by two thousandths of its diagonal"),
            Violation::BowedBoard(0.2),
            0.84,
        ),
        (
            eight("lens-decentred", "a decentred lens, fitted without p1 and p2"),
            Violation::OtherLens(base.with_distortion(decentred).into()),
            1.0,
        ),
        (
            Draft {
                camera: wide.into(),
                poses: ring(8, 25.0, 12.0, 80.0),
                ..example_draft("lens-of-another-kind", "an equidistant fisheye, fitted with k1 and k2")
            },
            Violation::OtherLens(Camera::with_lens(wide.fx, wide.fy, wide.cx, wide.cy, equidistant)),
            1.0,
        ),
    ]
}

/// Six views tilted by ten degrees, and two by forty: those that tell most of the focal length.
fn six_and_two() -> Vec<[f64; 6]> {
    let mut poses = ring(6, 10.0, 12.0, 132.0);
    poses.extend([[40.0, 0.0, 0.0, 0.0, 5.0, 132.0], [0.0, 40.0, 0.0, -5.0, 0.0, 132.0]]);
    poses
}
