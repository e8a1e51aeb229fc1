//! What is minimised? Squared, weighted pixel distances, and squared departures from what was measured.

use super::data::Data;
use super::equations::{Equations, Step, ViewEquations};
use crate::calibrate::Prior;
use crate::camera::{Camera, FreeParameters, Lens, Parameter, PixelDerivatives};
use crate::geometry::{Pose, Vec2, Vec3, rotation};
use nalgebra::{DMatrix, Matrix2x3, Matrix2x6, Matrix6, Vector6};

/// The unknowns.
#[derive(Debug, Clone)]
pub(super) struct State {
    pub camera: Camera<Lens>,
    /// From the marks' centre.
    pub cam_from_target: Vec<Pose>,
    /// How far each unknown coordinate lies from where it was measured.
    pub offsets: Vec<f64>,
}

/// What is minimised, in px^2.
#[derive(Clone, Copy)]
pub(super) struct Problem<'a> {
    pub data: &'a Data,
    pub free: FreeParameters,
    pub fy_per_fx: Option<f64>,
    pub priors: &'a [Prior],
    /// Variance of a coordinate of weight 1, which weighs what is known beforehand, px^2.
    pub variance: f64,
    /// Whether positions of marks are estimated: held where the state has them otherwise.
    pub moves_marks: bool,
    /// Whether poses are.
    pub moves_poses: bool,
    pub max_iterations: usize,
}

/// Residuals of pixels near `p` cannot be known better than this many roundings of `p`.
const ROUNDINGS: f64 = 8.0;

impl Problem<'_> {
    /// Unknowns that all views share: free parameters, then coordinates of marks.
    pub fn shared(&self) -> usize {
        self.free.len() + self.moved_coordinates()
    }

    fn moved_coordinates(&self) -> usize {
        if self.moves_marks { self.data.unknown_deviations.len() } else { 0 }
    }

    /// Where a mark is, from the marks' centre.
    pub fn position(&self, state: &State, mark: usize) -> Vec3 {
        let offset = |axis: usize| self.data.unknown[mark][axis].map_or(0.0, |k| state.offsets[k]);
        self.data.positions[mark] + Vec3::new(offset(0), offset(1), offset(2))
    }

    /// Predicted - observed of every mark of a view, px; `None` where the lens has no image of one.
    pub fn residuals(&self, state: &State, view: usize) -> Option<Vec<Vec2>> {
        let residual = |seen: &super::data::Seen| {
            let point = state.cam_from_target[view].apply(&self.position(state, seen.mark));
            Some(state.camera.pixel(&point)? - seen.pixel)
        };
        self.data.views[view].iter().map(residual).collect()
    }

    /// The cost that rounding alone makes.
    pub fn rounding_cost(&self) -> f64 {
        let unit = |p: f64| (ROUNDINGS * f64::EPSILON * p) * (ROUNDINGS * f64::EPSILON * p);
        let seen = self.data.views.iter().flatten();
        seen.map(|s| (unit(s.pixel.x) + unit(s.pixel.y)) * s.weight * s.weight).sum()
    }

    /// Normal equations at a state; `None` where the lens has no image of a mark, or the camera is none.
    pub fn equations(&self, state: &State) -> Option<Equations> {
        if !state.camera.is_possible() {
            return None;
        }
        let mut equations = Equations::new(self.shared());
        for view in 0..self.data.views.len() {
            self.add_view(state, view, &mut equations)?;
        }
        self.add_known(state, &mut equations);
        equations.mirror();
        equations.cost.is_finite().then_some(equations)
    }

    fn add_view(&self, state: &State, view: usize, equations: &mut Equations) -> Option<()> {
        let n = self.free.len();
        let pose = &state.cam_from_target[view];
        let mut columns: Vec<usize> = (0..n).collect();
        let mut coupling: Vec<Vector6<f64>> = vec![Vector6::zeros(); n];
        let (mut square, mut gradient) = (Matrix6::zeros(), Vector6::zeros());
        let mut of_camera = vec![Vec2::zeros(); n];
        for seen in &self.data.views[view] {
            let turned = pose.rotation * self.position(state, seen.mark);
            let found = state.camera.pixel_with_derivatives(&(turned + pose.translation))?;
            let weight = seen.weight;
            let residual = weight * (found.pixel - seen.pixel);
            let by_point = weight * found.by_point;
            let by_pose = of_pose(&by_point, &turned);
            self.camera_columns(&found, weight, &mut of_camera);
            equations.cost += residual.norm_squared();
            if self.moves_poses {
                square += by_pose.transpose() * by_pose;
                gradient += by_pose.transpose() * residual;
            }
            for (i, a) in of_camera.iter().enumerate() {
                equations.gradient[i] += a.dot(&residual);
                for (j, b) in of_camera.iter().enumerate().take(i + 1) {
                    equations.matrix[(i, j)] += a.dot(b);
                }
                coupling[i] += by_pose.transpose() * a;
            }
            if self.moves_marks {
                let by_mark = by_point * pose.rotation;
                let unknown = self.data.unknown[seen.mark];
                let coordinates = || unknown.into_iter().enumerate().filter_map(|(axis, k)| Some((axis, k?)));
                for (axis, k) in coordinates() {
                    let (row, column) = (n + k, by_mark.column(axis));
                    equations.gradient[row] += column.dot(&residual);
                    for (j, b) in of_camera.iter().enumerate() {
                        equations.matrix[(row, j)] += column.dot(b);
                    }
                    for (other, l) in coordinates().take_while(|(other, _)| *other <= axis) {
                        equations.matrix[(row, n + l)] += column.dot(&by_mark.column(other));
                    }
                    columns.push(row);
                    coupling.push(by_pose.transpose() * column);
                }
            }
        }
        if self.moves_poses {
            let coupling = DMatrix::from_fn(6, columns.len(), |i, k| coupling[k][i]);
            equations.views.push(ViewEquations { square, gradient, columns, coupling });
        }
        Some(())
    }

    /// Derivatives by the free parameters; to that of fx an fy that is tied to it adds its share.
    fn camera_columns(&self, found: &PixelDerivatives, weight: f64, columns: &mut [Vec2]) {
        let mut next = 0;
        let mut of_fx = None;
        for (parameter, slope) in &found.by_parameters {
            if self.free.contains(*parameter) {
                columns[next] = weight * slope;
                if *parameter == Parameter::Fx {
                    of_fx = Some(next);
                }
                next += 1;
            }
            if *parameter == Parameter::Fy
                && let (Some(ratio), Some(fx)) = (self.fy_per_fx, of_fx)
            {
                columns[fx] += weight * ratio * slope;
            }
        }
    }

    /// The rows of what is known beforehand: their number, how far the state is off, and their standard
    /// deviation.
    pub fn known<'s>(&'s self, state: &'s State) -> impl Iterator<Item = (usize, f64, f64)> + 's {
        let of_prior = |prior: &Prior| {
            let row = self.free.position(prior.parameter)?;
            Some((row, state.camera.value(prior.parameter)? - prior.mean, prior.standard_deviation))
        };
        let n = self.free.len();
        let marks = self.data.unknown_deviations.iter().take(self.moved_coordinates()).enumerate();
        let of_marks = marks.map(move |(k, sd)| (n + k, state.offsets[k], *sd));
        self.priors.iter().filter_map(of_prior).chain(of_marks)
    }

    fn add_known(&self, state: &State, equations: &mut Equations) {
        for (row, off, sd) in self.known(state) {
            let weight = self.variance / (sd * sd);
            equations.cost += weight * off * off;
            equations.matrix[(row, row)] += weight;
            equations.gradient[row] += weight * off;
        }
    }

    /// A state moved by a step.
    pub fn stepped(&self, from: &State, step: &Step) -> State {
        let n = self.free.len();
        let mut state = from.clone();
        state.camera = state.camera.moved(self.free, &step.shared.as_slice()[..n]);
        if let Some(ratio) = self.fy_per_fx {
            state.camera.fy = ratio * state.camera.fx;
        }
        for (offset, moved) in state.offsets.iter_mut().zip(step.shared.iter().skip(n)) {
            *offset += moved;
        }
        for (pose, moved) in state.cam_from_target.iter_mut().zip(&step.poses) {
            *pose = pose.perturbed(moved);
        }
        state
    }
}

/// By the pose, of a mark that is turned into the camera's axes: `R <- exp(delta) R` moves it by `delta x
/// turned`.
fn of_pose(by_point: &Matrix2x3<f64>, turned: &Vec3) -> Matrix2x6<f64> {
    let by_rotation = -(by_point * rotation::skew(turned));
    let mut both = Matrix2x6::zeros();
    both.fixed_view_mut::<2, 3>(0, 0).copy_from(&by_rotation);
    both.fixed_view_mut::<2, 3>(0, 3).copy_from(by_point);
    both
}
