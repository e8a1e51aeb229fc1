//! Which camera explains the pixels? Zhang's method: homographies, closed form, maximum-likelihood
//! refinement, covariance.
//!
//! [`calibrate`] is the whole way; the steps stand in files of their own. Truth never enters here.

mod any_lens;
mod blocks;
mod certificate;
mod chance;
mod choice;
mod chunks;
mod closed_form;
mod condensed;
mod conditioning;
mod copies;
mod counted;
mod covariance;
pub(crate) mod domain;
mod duplicates;
mod elimination;
mod error;
mod estimate;
mod from_relaxed;
mod identifiability;
mod in_words;
mod intervals;
mod judged;
mod kernel;
mod left_out;
mod lens;
mod loss;
mod minimise;
mod noise;
mod normal;
mod outliers;
mod polish;
mod prior;
mod radial_centre;
mod relaxed;
mod report;
mod retraction;
mod rival;
mod search;
mod settings;
pub mod single_plane;
mod start;
mod strays;
mod structure;
mod system;
mod target_frame;
mod termination;
mod tie;
mod tilt;
mod unknown;
mod walk;
mod warnings;

pub use any_lens::{BoardShape, Deformation, Located, lens_information, locate};
pub use certificate::Certificate;
pub use choice::{Candidate, Compared, Freedom, compare_models, explaining_freedoms};
pub use closed_form::{ClosedFormError, closed_form, pose_from_homography};
pub use conditioning::{Conditioning, WeakComponent};
pub use covariance::Covariance;
pub use error::CalibrationError;
pub use estimate::calibrate;
pub use in_words::in_words;
pub use intervals::ProfileInterval;
pub(crate) use left_out::{CostFalls, DEFORMATIONS, Freedoms, asked};
pub use lens::{LensCalibration, calibrate_lens};
pub use loss::Loss;
pub use normal::information;
pub use outliers::Outliers;
pub use prior::Prior;
pub(crate) use prior::contradiction;
pub use report::{Calibration, Warning};
pub use settings::{Board, Role, Settings};
pub use system::System;
pub use termination::Termination;
pub(crate) use tilt::mirrored;
pub use unknown::Unknown;

#[cfg(test)]
mod tests {
    //! Views for the unit tests of this folder, which does not know the scenes that `synth` draws.

    use super::minimise::Problem;
    use super::normal::Observations;
    use super::prior::Priors;
    use super::retraction::Retraction;
    use super::system::System;
    use super::{Calibration, Loss, Warning, information};
    use crate::board::View;
    use crate::camera::{BrownConrady, Camera, FreeParameters};
    use crate::geometry::{Pose, Vec2, Vec3, rotation};

    /// Least squares of these parameters, nothing known beforehand and nothing held.
    pub(super) fn plain_problem(observations: &[Observations], free: FreeParameters) -> Problem<'_> {
        Problem {
            free,
            fy_per_fx: None,
            priors: Priors::NONE,
            observations,
            loss: Loss::Squares,
            max_iterations: 100,
            hold_tilt: false,
            retraction: Retraction::Straight,
            focal_limits: (0.0, f64::INFINITY),
            rounding_cost: 0.0,
        }
    }

    /// Four views from 120 mm, with deviations of standard deviation `noise_px`.
    pub(super) fn four_views(noise_px: f64) -> Vec<View> {
        let camera =
            Camera::pinhole(600.0, 600.0, 326.0, 243.0).with_distortion(BrownConrady::radial(-0.18, 0.05));
        let pose = |[x, y, z]: [f64; 3]| Pose {
            rotation: rotation::from_xyz_rad(x, y, z),
            translation: Vec3::new(0.0, 0.0, 120.0),
        };
        seen(&camera, &TURNS.map(pose), noise_px)
    }

    /// Turns of four views that tell a camera.
    pub(super) const TURNS: [[f64; 3]; 4] =
        [[0.0, 0.0, 0.0], [0.35, 0.0, 0.0], [0.0, -0.35, 0.0], [-0.26, 0.26, 0.17]];

    /// Views of 9 x 7 marks, 10 mm apart, with deviations that have nothing in common: the phases are those
    /// of a chirp.
    pub(super) fn seen(camera: &Camera, poses: &[Pose], noise_px: f64) -> Vec<View> {
        let points: Vec<Vec2> =
            (0..63).map(|i| Vec2::new(f64::from(i % 9) - 4.0, f64::from(i / 9) - 3.0) * 10.0).collect();
        let mut count = 0.0;
        let mut noise = || {
            count += 1.0;
            noise_px * std::f64::consts::SQRT_2 * libm::sin(0.7 * count * count)
        };
        let mut of = |pose: &Pose| {
            let mut pixel = |p: &Vec2| {
                camera.project(&pose.apply(&Vec3::new(p.x, p.y, 0.0))).unwrap() + Vec2::new(noise(), noise())
            };
            View::new(points.clone(), points.iter().map(&mut pixel).collect()).unwrap()
        };
        poses.iter().map(&mut of).collect()
    }

    /// The marks of these views, as the solver has them.
    pub(super) fn observations(views: &[View]) -> Vec<Observations> {
        views.iter().map(|view| Observations::new(view.pairs().map(|(p, q)| (*p, *q)))).collect()
    }

    /// Normal equations of three views, six parameters free.
    pub(super) fn equations() -> System {
        let camera =
            Camera::pinhole(600.0, 590.0, 320.0, 240.0).with_distortion(BrownConrady::radial(-0.2, 0.1));
        let points: Vec<Vec2> =
            (0..35).map(|i| Vec2::new(f64::from(i % 7) - 3.0, f64::from(i / 7) - 2.0) * 12.0).collect();
        let poses = [[0.3, 0.0, 0.1], [0.0, -0.3, 0.0], [-0.2, 0.25, 0.4]].map(|[x, y, z]| Pose {
            rotation: rotation::from_xyz_rad(x, y, z),
            translation: Vec3::new(2.0, -3.0, 120.0),
        });
        information(&camera, FreeParameters::STANDARD, &poses, &points).unwrap()
    }

    /// The correlation that a calibration tells of, and that of its residuals by the definition: the mean
    /// product of a mark's residual with the next one's of its view, over the mean square.
    pub(super) fn correlations<L>(found: &Calibration<L>) -> (f64, f64) {
        let of = |warning: &Warning| match warning {
            Warning::Structured { correlation } => Some(*correlation),
            _ => None,
        };
        let told = found.warnings.iter().find_map(of).unwrap();
        let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
        let products =
            found.residuals.iter().flat_map(|view| view.windows(2).map(|pair| pair[0].dot(&pair[1])));
        let squares = found.residuals.iter().flatten().map(Vec2::norm_squared);
        (told, mean(products.collect()) / mean(squares.collect()))
    }
}
