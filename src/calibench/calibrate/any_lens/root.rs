//! What do the marks say of a combination that the normal equations lose? The root of the information, by
//! orthogonal transformations of the Jacobian.
//!
//! Numerator and denominator of a rational lens that nearly cancel leave combinations of coefficients that
//! are known a million times worse than each coefficient alone. Normal equations `J^T J` square that ratio,
//! and nothing but rounding is left of it. `J_v = Q_v [R_v, B_v; 0, T_v]` of each view, with the pose's
//! columns first, leaves `T_v` for what the views share; the triangle `R` of all `T_v` has `R^T R = S`, the
//! information with the poses unknown, and the digits of `J` (Golub & Van Loan 2013, section 5.3).

use super::super::conditioning::Spectrum;
use super::super::system::{Reduction, System};
use super::WIDTH;
use super::kernel;
use super::problem::{Problem, State};
use nalgebra::DMatrix;

/// Smallest eigenvalue, scaled, of information that has half of its digits.
const HALF_OF_THE_DIGITS: f64 = 1e-8;

/// Gives the reduced equations of a state their root, where half of their digits are lost without.
pub(super) fn add_root(
    problem: &Problem<'_>,
    state: &State,
    system: &System<WIDTH>,
    reduction: &mut Reduction<WIDTH>,
) {
    let is_half_lost = |spectrum: Spectrum| spectrum.values.iter().any(|&value| value < HALF_OF_THE_DIGITS);
    if Spectrum::of(reduction, &system.scale()).is_some_and(is_half_lost) {
        reduction.root = root(problem, state);
    }
}

/// `R`; `None` where the lens has no image of a mark, or there are fewer rows than unknowns.
fn root(problem: &Problem<'_>, state: &State) -> Option<DMatrix<f64>> {
    let columns = problem.columns(state);
    let shared = problem.free.len() + problem.deformations();
    let mut rest: Vec<DMatrix<f64>> = (0..problem.views.len())
        .map(|at| {
            kernel::rows_of_view(&problem.view(state, &columns, at)).map(|rows| without_pose(rows, shared))
        })
        .collect::<Option<_>>()?;
    rest.extend(problem.known(state).iter().filter_map(|known| {
        let mut row = DMatrix::zeros(1, shared);
        row[(0, known.row?)] = known.weight.information.sqrt();
        Some(row)
    }));
    let height = rest.iter().map(DMatrix::nrows).sum();
    let mut stacked = DMatrix::zeros(height, shared);
    let mut at = 0;
    for rows in &rest {
        stacked.rows_mut(at, rows.nrows()).copy_from(rows);
        at += rows.nrows();
    }
    (height >= shared).then(|| stacked.qr().unpack_r())
}

/// `T_v` of a view's rows.
fn without_pose(rows: DMatrix<f64>, shared: usize) -> DMatrix<f64> {
    let triangle = rows.qr().unpack_r();
    let left = triangle.nrows().saturating_sub(6);
    triangle.view((triangle.nrows() - left, 6), (left, shared)).into_owned()
}

#[cfg(test)]
mod tests {
    use super::super::super::minimise::{Descent, RELATIVE_GAIN};
    use super::super::super::noise::Noise;
    use super::super::super::target_frame::TargetFrames;
    use super::super::super::{Loss, Prior};
    use super::super::{marks, shape};
    use super::*;
    use crate::board::View;
    use crate::camera::{Camera, FreeParameters, Lens, Model, Parameter};
    use crate::geometry::{Pose, Vec2, Vec3, rotation};

    #[test]
    fn the_square_of_the_root_is_the_information() {
        let lens = Lens::new(Model::KannalaBrandt, &[-0.03, 0.004, 0.0, 0.0]).unwrap();
        let camera = Camera::with_lens(600.0, 610.0, 320.0, 240.0, lens);
        let points: Vec<Vec2> =
            (0..35).map(|i| Vec2::new(f64::from(i % 7) - 3.0, f64::from(i / 7) - 2.0) * 12.0).collect();
        let cam_from_target = [[0.3, 0.0, 0.1], [0.0, -0.3, 0.0], [-0.2, 0.25, 0.4]].map(|[x, y, z]| Pose {
            rotation: rotation::from_xyz_rad(x, y, z),
            translation: Vec3::new(2.0, -3.0, 120.0),
        });
        let seen = |pose: &Pose| {
            let pixel = |p: &Vec2| camera.pixel(&pose.apply(&Vec3::new(p.x, p.y, 0.0)));
            View::new(points.clone(), points.iter().filter_map(pixel).collect()).unwrap()
        };
        let views: Vec<View> = cam_from_target.iter().map(seen).collect();
        let frames = TargetFrames::of(&views);
        let listed = marks::of_views(&views, &frames, &shape::region(&views));
        let problem = Problem {
            views: &listed,
            free: FreeParameters::STANDARD,
            held: FreeParameters::NONE,
            fy_per_fx: None,
            priors: &[Prior { parameter: Parameter::K1, mean: 0.0, standard_deviation: 0.01 }],
            noise: Noise::of_squares(0.01),
            bend: None,
            loss: Loss::Huber { delta_px: 0.3 },
            max_iterations: 0,
            relative_gain: RELATIVE_GAIN,
            rounding_cost: 0.0,
            is_certifiable: false,
        };
        let poses = cam_from_target.iter().enumerate();
        let cam_from_target = poses.map(|(view, pose)| frames.at(view).of_pose(pose)).collect();
        // Another camera than the true one, so that the loss weighs.
        let camera = Camera { fx: 601.0, ..camera };
        let state = State { camera, cam_from_target, shape: [0.0; 3] };
        let mut system = problem.system();
        problem.linearise_into(&state, &mut system);
        let schur = system.reduction().unwrap().schur;
        let root = root(&problem, &state).unwrap();
        let square = root.transpose() * &root;
        for i in 0..6 {
            for j in 0..6 {
                let unit = (schur[(i, i)] * schur[(j, j)]).sqrt();
                // The elimination loses digits in the ratio of the information before and after: some
                // thousands.
                assert!((square[(i, j)] - schur[(i, j)]).abs() < 1e-10 * unit, "{i} {j}");
            }
        }
    }
}
