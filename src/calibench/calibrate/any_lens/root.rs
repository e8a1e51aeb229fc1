//! What do the marks say of a combination that the normal equations lose? The root of the information, by orthogonal
//! transformations of the Jacobian.
//!
//! Numerator and denominator of a rational lens that nearly cancel leave combinations of coefficients that are known a
//! million times worse than each coefficient alone. Normal equations `J^T J` square that ratio, and nothing but rounding
//! is left of it. `J_v = Q_v [R_v, B_v; 0, T_v]` of each view, with the pose's columns first, leaves `T_v` for what the
//! views share; the triangle `R` of all `T_v` has `R^T R = S`, the information with the poses unknown, and the digits of `J`
//! (Golub & Van Loan 2013, section 5.3).

use super::super::conditioning::Spectrum;
use super::super::minimise::{Descent, Minimum};
use super::super::system::{Reduction, System};
use super::WIDTH;
use super::kernel;
use super::problem::{Problem, State};
use nalgebra::{DMatrix, DVector, SVector};

/// Smallest eigenvalue, scaled, of information that has half of its digits.
const HALF_OF_THE_DIGITS: f64 = 1e-8;
/// Damping of the first step, in scaled units, its factor after a step that fails or succeeds, and the range.
const FIRST_DAMPING: f64 = 1e-12;
const FACTOR: f64 = 10.0;
const LEAST_DAMPING: f64 = 1e-26;
const LARGEST_DAMPING: f64 = 1.0;
/// Steps at most.
const STEPS: usize = 60;

/// Whether the reduced equations of a state have lost half of their digits.
pub(super) fn is_worth_it(system: &System<WIDTH>, reduction: &Reduction<WIDTH>) -> bool {
    let is_half_lost = |spectrum: Spectrum| spectrum.values.iter().any(|&value| value < HALF_OF_THE_DIGITS);
    Spectrum::of(reduction, &system.scale()).is_some_and(is_half_lost)
}

/// Gives the reduced equations of a state their root, where half of their digits are lost without.
pub(super) fn add_root(
    problem: &Problem<'_>,
    state: &State,
    system: &System<WIDTH>,
    reduction: &mut Reduction<WIDTH>,
) {
    if is_worth_it(system, reduction) {
        reduction.root = Root::of(problem, state).map(|root| root.triangle);
    }
}

/// Refines a minimum along what the normal equations lose, where half of their digits are lost: Levenberg and Marquardt's
/// steps by the singular values of the root.
pub(super) fn refine(problem: &Problem<'_>, minimum: &mut Minimum<State, WIDTH>) {
    let mut damping = FIRST_DAMPING;
    let mut trial = problem.system();
    for _ in 0..STEPS {
        let Some(reduction) = minimum.system.reduction().filter(|r| is_worth_it(&minimum.system, r)) else {
            return;
        };
        let Some(solver) =
            Root::of(problem, &minimum.state).and_then(|root| Steps::of(root, &minimum.system))
        else {
            return;
        };
        let enough = problem.relative_gain * minimum.system.cost + problem.rounding_cost;
        loop {
            let (step, gain) = solver.step(damping);
            if gain <= enough || damping > LARGEST_DAMPING {
                return;
            }
            let state = problem.stepped(&minimum.state, minimum.system.with_poses(&reduction, step));
            problem.linearise_into(&state, &mut trial);
            if trial.cost < minimum.system.cost {
                minimum.state = state;
                std::mem::swap(&mut minimum.system, &mut trial);
                damping = (damping / FACTOR).max(LEAST_DAMPING);
                break;
            }
            damping *= FACTOR;
        }
        minimum.iterations += 1;
    }
}

/// The least-squares problem of what the views share, with the poses eliminated: `|R d + z|` is to be least.
struct Root {
    triangle: DMatrix<f64>,
    right: DVector<f64>,
}

impl Root {
    /// `None` where the lens has no image of a mark, or there are fewer rows than unknowns.
    fn of(problem: &Problem<'_>, state: &State) -> Option<Root> {
        let columns = problem.columns(state);
        let shared = problem.free.len() + problem.deformations();
        let mut rest: Vec<DMatrix<f64>> = (0..problem.views.len())
            .map(|at| {
                let rows = kernel::rows_of_view(&problem.view(state, &columns, at))?;
                Some(without_pose(rows, shared + 1))
            })
            .collect::<Option<_>>()?;
        rest.extend(problem.known(state).iter().map(|known| {
            let mut row = DMatrix::zeros(1, shared + 1);
            row[(0, known.row)] = known.weight.sqrt();
            row[(0, shared)] = known.weight.sqrt() * known.off;
            row
        }));
        let height: usize = rest.iter().map(DMatrix::nrows).sum();
        let mut stacked = DMatrix::zeros(height, shared + 1);
        let mut at = 0;
        for rows in &rest {
            stacked.rows_mut(at, rows.nrows()).copy_from(rows);
            at += rows.nrows();
        }
        let whole = (height > shared).then(|| stacked.qr().unpack_r())?;
        let triangle = whole.view((0, 0), (shared, shared)).into_owned();
        Some(Root { triangle, right: whole.view((0, shared), (shared, 1)).column(0).into_owned() })
    }
}

/// What is left of a view's rows without its pose: `T_v` and the residual's part.
fn without_pose(rows: DMatrix<f64>, columns: usize) -> DMatrix<f64> {
    let triangle = rows.qr().unpack_r();
    let left = triangle.nrows().saturating_sub(6);
    triangle.view((triangle.nrows() - left, 6), (left, columns)).into_owned()
}

/// Damped steps of one linearisation.
struct Steps {
    scale: DVector<f64>,
    values: DVector<f64>,
    directions: DMatrix<f64>,
    /// `U^T z`.
    right: DVector<f64>,
}

impl Steps {
    fn of(root: Root, system: &System<WIDTH>) -> Option<Steps> {
        let scale = system.scale();
        let scaled = DMatrix::from_fn(scale.len(), scale.len(), |i, j| root.triangle[(i, j)] * scale[j]);
        let is_finite = scaled.iter().chain(root.right.iter()).all(|x| x.is_finite());
        let svd = is_finite.then(|| scaled.svd(true, true))?;
        let (left, directions) = (svd.u?, svd.v_t?);
        let right = DVector::from_fn(scale.len(), |i, _| left.column(i).dot(&root.right));
        Some(Steps { scale, values: svd.singular_values, directions, right })
    }

    /// The step of what views share, and how much the cost falls by it in linear theory.
    fn step(&self, damping: f64) -> (SVector<f64, WIDTH>, f64) {
        let mut step = SVector::zeros();
        let mut gain = 0.0;
        for (i, (&value, &right)) in self.values.iter().zip(self.right.iter()).enumerate() {
            let part = value / (value * value + damping);
            let left = 1.0 - value * part;
            gain += right * right * (1.0 - left * left);
            for j in 0..self.scale.len() {
                step[j] -= part * right * self.directions[(i, j)] * self.scale[j];
            }
        }
        (step, gain)
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::minimise::RELATIVE_GAIN;
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
            fy_per_fx: None,
            priors: &[Prior { parameter: Parameter::K1, mean: 0.0, standard_deviation: 0.01 }],
            variance: 0.01,
            bend: None,
            loss: Loss::Huber { delta_px: 0.3 },
            max_iterations: 0,
            relative_gain: RELATIVE_GAIN,
            rounding_cost: 0.0,
        };
        let poses = cam_from_target.iter().enumerate();
        let cam_from_target = poses.map(|(view, pose)| frames.at(view).of_pose(pose)).collect();
        // Another camera than the true one, so that the loss weighs.
        let camera = Camera { fx: 601.0, ..camera };
        let state = State { camera, cam_from_target, shape: [0.0; 3] };
        let mut system = problem.system();
        problem.linearise_into(&state, &mut system);
        let schur = system.reduction().unwrap().schur;
        let root = Root::of(&problem, &state).unwrap().triangle;
        let square = root.transpose() * &root;
        for i in 0..6 {
            for j in 0..6 {
                let unit = (schur[(i, i)] * schur[(j, j)]).sqrt();
                // The elimination loses digits in the ratio of the information before and after: some thousands.
                assert!((square[(i, j)] - schur[(i, j)]).abs() < 1e-10 * unit, "{i} {j}");
            }
        }
    }
}
