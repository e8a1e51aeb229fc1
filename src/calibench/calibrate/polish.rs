//! What are the minimum's last digits? Gauss-Newton steps from a converged calibration, in numbers of 31
//! digits.
//!
//! The refinement ends where a step would gain less than 1e-14 of the cost: some 1e-7 of a standard
//! deviation, which no measurement notices. To compare solvers digit by digit, or with certified values, the
//! rest of the way is gone here: residuals, normal equations and their solution in double-double arithmetic,
//! until a step moves no residual by more than 1e-20 px. It costs some twenty refinements, and is done only
//! when it is asked for.
#![allow(clippy::needless_range_loop, reason = "indices are those of the equations")]

use super::kernel::{self, Model, Rows};
use super::noise::Noise;
use super::prior::{Priors, Weight};
use super::{Calibration, Covariance, Loss, Warning};
use crate::board::View;
use crate::camera::{Camera, FreeParameters, Parameter};
use crate::geometry::double_double::DoubleDouble as Number;
use crate::geometry::lanes::Arithmetic;
use crate::geometry::{Pose, Vec2};
use nalgebra::{DMatrix, MatrixXx6, SMatrix};

/// Root of the squared length of a step, measured by the residuals that it changes: seven orders below what
/// rounding of a pixel in doubles does, and as many above the rounding of 31 digits.
const SETTLED_PX: f64 = 1e-20;
/// Steps shrink by a factor of ten to ten thousand each on every data set seen; a search of so many does not
/// shrink.
const MOST_STEPS: usize = 100;
/// Pose columns.
const POSE: usize = 6;
/// Pose columns, all intrinsics, and the residual.
const COLUMNS: usize = POSE + Parameter::COUNT + 1;

/// Symmetric, of which the lower triangle is used.
type Square = [[Number; COLUMNS]; COLUMNS];

/// The calibration at the exact minimum near to it: parameters, poses, residuals and, under least squares,
/// the covariance have their last digits. One that did not converge is left as it is; one whose steps do not
/// shrink too, with a warning.
///
/// Under a robust loss the covariance stays that of the unpolished minimum, which differs from this one by
/// some 1e-7 of itself. `noise` is that which weighs the priors.
pub(super) fn polish(views: &[View], loss: Loss, noise: Noise, mut calibration: Calibration) -> Calibration {
    if !calibration.termination.is_minimum() {
        return calibration;
    }
    let mut state = State::of(&calibration, noise);
    let mut last = f64::INFINITY;
    for _ in 0..MOST_STEPS {
        let Some((step, length_px)) = Equations::of(&state, views, loss).and_then(|e| e.step()) else {
            break;
        };
        if length_px.is_nan() || length_px >= last {
            break;
        }
        state.take(&step);
        if length_px <= SETTLED_PX {
            return Equations::of(&state, views, loss)
                .and_then(|at| at.report(&state, views, loss, &calibration))
                .unwrap_or(calibration);
        }
        last = length_px;
    }
    calibration.warnings.push(Warning::NotPolished);
    calibration
}

/// Camera and poses.
struct State {
    free: FreeParameters,
    fy_per_fx: Option<Number>,
    /// The noise that weighs the priors.
    noise: Noise,
    /// Parameter, mean and weight.
    priors: Vec<(Parameter, f64, Weight)>,
    parameters: [Number; Parameter::COUNT],
    poses: Vec<PoseNumbers>,
}

/// `R`, column by column, and `t`.
struct PoseNumbers {
    columns: [[Number; 3]; 3],
    translation: [Number; 3],
}

impl State {
    fn of(calibration: &Calibration, noise: Noise) -> State {
        let priors = Priors { list: &calibration.priors, noise };
        State {
            noise,
            priors: priors.weighted().map(|(prior, weight)| (prior.parameter, prior.mean, weight)).collect(),
            free: calibration.free,
            fy_per_fx: calibration.covariance.fy_per_fx.map(Number::from),
            parameters: calibration.camera.parameters().map(Number::from),
            poses: calibration.cam_from_target.iter().map(PoseNumbers::of).collect(),
        }
    }

    /// Held parameters keep their bits.
    fn take(&mut self, step: &Step) {
        for (parameter, &d) in self.free.iter().zip(&step.intrinsics) {
            self.parameters[parameter as usize] += d;
        }
        if let Some(ratio) = self.fy_per_fx {
            self.parameters[Parameter::Fy as usize] = ratio * self.parameters[Parameter::Fx as usize];
        }
        for (pose, d) in self.poses.iter_mut().zip(&step.poses) {
            pose.take(d);
        }
    }

    fn model(&self, view: usize) -> Model<Number> {
        let PoseNumbers { columns, translation } = &self.poses[view];
        Model::of_numbers(
            &self.parameters,
            std::array::from_fn(|i| [columns[0][i], columns[1][i]]),
            *translation,
        )
    }
}

impl PoseNumbers {
    /// Gram and Schmidt: a rotation in doubles is one to 16 digits only.
    fn of(pose: &Pose) -> PoseNumbers {
        let column = |j: usize| std::array::from_fn(|i| Number::from(pose.rotation[(i, j)]));
        let first = unit(column(0));
        let along = dot(&first, &column(1));
        let second = unit(std::array::from_fn(|i| column(1)[i] - along * first[i]));
        let third = cross(&first, &second);
        PoseNumbers {
            columns: [first, second, third],
            translation: std::array::from_fn(|i| pose.translation[i].into()),
        }
    }

    /// `R <- exp(delta) R`, `t <- t + step`: each column turned by the series of the exponential. Steps are
    /// below 1e-3, so that its twelfth term is below 1e-44.
    fn take(&mut self, step: &[Number; POSE]) {
        let turn = [step[0], step[1], step[2]];
        for column in &mut self.columns {
            let mut term = *column;
            for k in 1..=12 {
                term = cross(&turn, &term).map(|x| x / Number::from(f64::from(k)));
                (0..3).for_each(|i| column[i] += term[i]);
            }
        }
        (0..3).for_each(|i| self.translation[i] += step[POSE / 2 + i]);
    }

    fn to_pose(&self) -> Pose {
        Pose {
            rotation: SMatrix::from_fn(|i, j| self.columns[j][i].to_f64()),
            translation: SMatrix::from_fn(|i, _| self.translation[i].to_f64()),
        }
    }
}

fn dot(a: &[Number; 3], b: &[Number; 3]) -> Number {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: &[Number; 3], b: &[Number; 3]) -> [Number; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn unit(a: [Number; 3]) -> [Number; 3] {
    let norm = dot(&a, &a).sqrt();
    a.map(|x| x / norm)
}

/// A step of all unknowns.
struct Step {
    intrinsics: Vec<Number>,
    poses: Vec<[Number; POSE]>,
}

/// Normal equations with the poses eliminated. The residual is one more column, so that gradients are
/// eliminated with the rest.
struct Equations {
    /// Free intrinsics.
    n: usize,
    /// A view's factored columns: the first six are those of its Cholesky factor, rows in the order pose,
    /// intrinsics, residual.
    views: Vec<Square>,
    /// The Cholesky factor of the Schur complement, with a row for the residual.
    reduced: Square,
}

impl Equations {
    /// `None` where a point is not in front of the camera or something is not determined.
    fn of(state: &State, views: &[View], loss: Loss) -> Option<Equations> {
        let n = state.free.len();
        let mut reduced = Square::default();
        let mut factored = Vec::with_capacity(views.len());
        for (index, view) in views.iter().enumerate() {
            let mut square = view_square(state, index, view, loss)?;
            factor(&mut square, POSE, POSE + n + 1)?;
            for i in 0..=n {
                for j in 0..=i {
                    reduced[i][j] += square[POSE + i][POSE + j];
                }
            }
            factored.push(square);
        }
        for &(parameter, mean, weight) in &state.priors {
            let row = state.free.position(parameter)?;
            reduced[row][row] += Number::from(weight.information);
            reduced[n][row] +=
                Number::from(weight.cost) * (state.parameters[parameter as usize] - Number::from(mean));
        }
        factor(&mut reduced, n, n + 1)?;
        Some(Equations { n, views: factored, reduced })
    }

    /// The Gauss-Newton step, and its length as the residuals see it, px.
    fn step(&self) -> Option<(Step, f64)> {
        let (n, reduced) = (self.n, &self.reduced);
        let mut intrinsics = vec![Number::ZERO; n];
        for i in (0..n).rev() {
            let known: Number = (i + 1..n).map(|k| reduced[k][i] * intrinsics[k]).sum();
            intrinsics[i] = -(reduced[n][i] + known) / reduced[i][i];
        }
        let mut square: Number = reduced[n][..n].iter().map(|&x| x * x).sum();
        let pose_step = |view: &Square| {
            let mut pose = [Number::ZERO; POSE];
            for i in (0..POSE).rev() {
                let known: Number = (i + 1..POSE).map(|k| view[k][i] * pose[k]).sum();
                let moved: Number = (0..n).map(|k| view[POSE + k][i] * intrinsics[k]).sum();
                pose[i] = -(view[POSE + n][i] + moved + known) / view[i][i];
            }
            pose
        };
        let poses = self.views.iter().map(pose_step).collect();
        square += self.views.iter().flat_map(|view| view[POSE + n][..POSE].iter()).map(|&x| x * x).sum();
        let length_px = square.to_f64().sqrt();
        length_px.is_finite().then_some((Step { intrinsics, poses }, length_px))
    }

    /// What the calibration says at this state.
    fn report(&self, state: &State, views: &[View], loss: Loss, before: &Calibration) -> Option<Calibration> {
        let mut square = Number::ZERO;
        let mut residuals = Vec::with_capacity(views.len());
        for (index, view) in views.iter().enumerate() {
            let model = state.model(index);
            let mut of_view = Vec::with_capacity(view.len());
            for (point, pixel) in view.pairs() {
                let [u, v] = residual(&kernel_rows(&model, point), pixel);
                square += u * u + v * v;
                of_view.push(Vec2::new(u.to_f64(), v.to_f64()));
            }
            residuals.push(of_view);
        }
        let root_mean = |count: f64| (square / Number::from(count.max(1.0))).sqrt().to_f64();
        // Priors settle a part of an unknown: the degrees of freedom are then no whole number, and stay those
        // of the unpolished minimum.
        let squares =
            |residuals: &[Vec<Vec2>]| residuals.iter().flatten().map(|r| r.norm_squared()).sum::<f64>();
        let freedom = match state.priors.is_empty() {
            true => before.degrees_of_freedom as f64,
            false => squares(&before.residuals) / (before.sigma_px * before.sigma_px),
        };
        let variance = match state.priors.is_empty() {
            true => square / Number::from(freedom.max(1.0)),
            false => Number::from(state.noise.variance),
        };
        let covariance = match loss {
            Loss::Squares => {
                Covariance { fy_per_fx: before.covariance.fy_per_fx, ..self.covariance(state.free, variance) }
            }
            Loss::Huber { .. } | Loss::Cauchy { .. } => before.covariance.clone(),
        };
        Some(Calibration {
            camera: Camera::from_parameters(state.parameters.map(Number::to_f64)),
            cam_from_target: state.poses.iter().map(PoseNumbers::to_pose).collect(),
            rmse_px: root_mean(residuals.iter().map(Vec::len).sum::<usize>() as f64),
            sigma_px: root_mean(freedom),
            residuals,
            covariance,
            ..before.clone()
        })
    }

    /// The inverse of the normal matrix times `variance`, in blocks: with `L L^T` the reduced matrix, `P =
    /// L^-T L^-1` for the intrinsics, `-P Y^T` with a pose and `C^-1 + Y P Y^T` for it, where `C = L_c L_c^T`
    /// and `Y = L_c^-T W`.
    fn covariance(&self, free: FreeParameters, variance: Number) -> Covariance {
        let n = self.n;
        let inverse = inverse_of_lower(&self.reduced, n);
        let product = |i: usize, j: usize| (0..n).map(|k| inverse[k][i] * inverse[k][j]).sum::<Number>();
        let mut intrinsics = Square::default();
        for i in 0..n {
            for j in 0..n {
                intrinsics[i][j] = product(i.max(j), i.min(j));
            }
        }
        let mut result = Covariance {
            free,
            fy_per_fx: None,
            intrinsics: DMatrix::from_fn(n, n, |i, j| (variance * intrinsics[i][j]).to_f64()),
            poses: Vec::with_capacity(self.views.len()),
            cross: Vec::with_capacity(self.views.len()),
        };
        for view in &self.views {
            let inverse = inverse_of_lower(view, POSE);
            // Y[i][k], and (P Y^T)[k][i] as rows of a pose column.
            let y = |i: usize, k: usize| (i..POSE).map(|m| inverse[m][i] * view[POSE + k][m]).sum::<Number>();
            let y: [Vec<Number>; POSE] = std::array::from_fn(|i| (0..n).map(|k| y(i, k)).collect());
            let carried: [Vec<Number>; POSE] = std::array::from_fn(|i| {
                (0..n).map(|k| (0..n).map(|m| intrinsics[k][m] * y[i][m]).sum()).collect()
            });
            let own = |i: usize, j: usize| (0..POSE).map(|k| inverse[k][i] * inverse[k][j]).sum::<Number>();
            let both = |i: usize, j: usize| (0..n).map(|k| y[i][k] * carried[j][k]).sum::<Number>();
            let pose = |i: usize, j: usize| {
                let (i, j) = (i.max(j), i.min(j));
                (variance * (own(i, j) + both(i, j))).to_f64()
            };
            result.poses.push(SMatrix::from_fn(pose));
            result.cross.push(MatrixXx6::from_fn(n, |k, i| (-(variance * carried[i][k])).to_f64()));
        }
        result
    }
}

/// `sum w c c^T` over the rows of a view, `c` being pose columns, free intrinsics and residual. `None` where
/// a point is not in front of the camera.
fn view_square(state: &State, index: usize, view: &View, loss: Loss) -> Option<Square> {
    let size = POSE + state.free.len() + 1;
    let model = state.model(index);
    let mut square = Square::default();
    for (point, pixel) in view.pairs() {
        let at = kernel_rows(&model, point);
        if !at.depth.is_positive() {
            return None;
        }
        let [u, v] = residual(&at, pixel);
        let weight = Number::from(loss.at((u * u + v * v).to_f64()).1);
        for (shared, linear, residual) in [
            (&at.u, [at.distorted[0], Number::ZERO, Number::ONE, Number::ZERO, at.distorted[1]], u),
            (&at.v, [Number::ZERO, at.distorted[1], Number::ZERO, Number::ONE, Number::ZERO], v),
        ] {
            let mut row = [Number::ZERO; COLUMNS];
            row[..POSE].copy_from_slice(&shared[..POSE]);
            for (column, parameter) in row[POSE..].iter_mut().zip(state.free.iter()) {
                let place = parameter as usize;
                *column = linear.get(place).copied().unwrap_or_else(|| shared[POSE + place - linear.len()]);
                if let Some(ratio) = state.fy_per_fx.filter(|_| parameter == Parameter::Fx) {
                    *column += ratio * linear[Parameter::Fy as usize];
                }
            }
            row[size - 1] = residual;
            for i in 0..size {
                let weighted = weight * row[i];
                for j in 0..=i {
                    square[i][j] += weighted * row[j];
                }
            }
        }
    }
    Some(square)
}

fn kernel_rows(model: &Model<Number>, point: &Vec2) -> Rows<Number> {
    kernel::rows::<Number, false>(model, point.x.into(), point.y.into())
}

/// Predicted - observed.
fn residual(at: &Rows<Number>, pixel: &Vec2) -> [Number; 2] {
    [at.pixel[0] - Number::splat(pixel.x), at.pixel[1] - Number::splat(pixel.y)]
}

/// The first `pivots` columns of the Cholesky factor of a matrix of `size` rows, in its place; the rest
/// becomes the Schur complement. `None` if a pivot is not positive.
#[allow(clippy::needless_range_loop, reason = "indices are those of the equations")]
fn factor(square: &mut Square, pivots: usize, size: usize) -> Option<()> {
    for k in 0..pivots {
        if !square[k][k].is_positive() {
            return None;
        }
        let root = square[k][k].sqrt();
        square[k][k] = root;
        for i in k + 1..size {
            square[i][k] = square[i][k] / root;
        }
        for i in k + 1..size {
            for j in k + 1..=i {
                let product = square[i][k] * square[j][k];
                square[i][j] -= product;
            }
        }
    }
    Some(())
}

/// `L^-1` of the first `n` rows.
fn inverse_of_lower(lower: &Square, n: usize) -> Square {
    let mut inverse = Square::default();
    for j in 0..n {
        inverse[j][j] = Number::ONE / lower[j][j];
        for i in j + 1..n {
            let known: Number = (j..i).map(|k| lower[i][k] * inverse[k][j]).sum();
            inverse[i][j] = -known / lower[i][i];
        }
    }
    inverse
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::tests::four_views;
    use crate::calibrate::{Settings, calibrate};
    use crate::geometry::{Vec3, rotation};
    use nalgebra::Vector6;

    #[test]
    fn a_step_turns_a_pose_as_in_plain_numbers() {
        let pose = Pose {
            rotation: rotation::from_xyz_rad(0.3, -0.4, 0.2),
            translation: Vec3::new(5.0, -7.0, 150.0),
        };
        let step = [3e-4, -5e-4, 7e-4, 0.01, -0.02, 0.03];
        let mut numbers = PoseNumbers::of(&pose);
        assert!((numbers.to_pose().rotation - pose.rotation).norm() < 1e-15);
        numbers.take(&step.map(Number::from));
        let (own, expected) = (numbers.to_pose(), pose.perturbed(&Vector6::from(step)));
        assert!((own.rotation - expected.rotation).norm() < 1e-15);
        assert!((own.translation - expected.translation).norm() < 1e-13);
    }

    #[test]
    fn the_polished_minimum_is_the_same_with_more_digits() {
        let (views, standard) = (four_views(0.1), Settings::standard());
        for settings in [
            standard.clone(),
            standard.clone().tie_focal_lengths(1.01),
            standard.clone().with_prior(Parameter::K1, -0.17, 0.002),
            standard.with_loss(Loss::Huber { delta_px: 0.2 }),
        ] {
            let [plain, polished] =
                [settings.clone(), settings.polished()].map(|settings| calibrate(&views, &settings).unwrap());
            assert!(!polished.warnings.contains(&Warning::NotPolished));
            assert_ne!(polished.camera, plain.camera);
            for parameter in plain.free.iter() {
                let sd = plain.standard_deviation(parameter).unwrap();
                let moved = polished.camera.get(parameter) - plain.camera.get(parameter);
                assert!(moved.abs() < 1e-4 * sd, "{parameter} {moved} {sd}");
                let ratio = polished.standard_deviation(parameter).unwrap() / sd;
                assert!((ratio - 1.0).abs() < 1e-5, "{parameter} {ratio}");
            }
            for (own, expected) in [(polished.sigma_px, plain.sigma_px), (polished.rmse_px, plain.rmse_px)] {
                assert!((own / expected - 1.0).abs() < 1e-9, "{own} {expected}");
            }
        }
    }
}
