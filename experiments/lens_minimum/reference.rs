//! Where does a search that starts at the truth end? An independent Levenberg-Marquardt minimisation for any
//! lens, the reference of every scene.
//!
//! It minimises what the solver minimises, the sum of squared pixel distances, and shares no search code with
//! it: the whole normal matrix, summed mark by mark from `Camera::pixel_with_derivatives`, scaled to a unit
//! diagonal and factored by Cholesky; damping in proportion to the diagonal (Marquardt 1963).

use super::scenes::Drawn;
use calibench::board::View;
use calibench::camera::{Camera, FreeParameters, Lens, Parameter};
use calibench::geometry::{Pose, Vec3};
use nalgebra::{DMatrix, DVector, Matrix2xX, Matrix3, Vector6};

/// A step that promises less than this part of the cost ends the search.
const GAIN: f64 = 1e-13;
/// Where nothing lowers the cost any more, a promise below this is rounding.
const ROUNDING: f64 = 1e-9;
/// Steps before the search gives up: numerator and denominator that nearly cancel make it creep.
const STEPS: usize = 1000;
const FIRST_DAMPING: f64 = 1e-6;
const LEAST_DAMPING: f64 = 1e-12;
const MOST_DAMPING: f64 = 1e12;

/// The minimum next to the truth.
#[derive(Debug, Clone)]
pub struct Reference {
    /// The camera there.
    pub camera: Camera<Lens>,
    /// Sum of squared pixel distances.
    pub cost: f64,
    /// Whether the search ended in a minimum.
    pub converged: bool,
    /// Cramer-Rao bound of sd(fx) over fx, at the truth; infinite where the marks determine nothing.
    pub bound: f64,
}

/// Minimises from the truth; `None` only if the lens has no image of a mark.
pub fn from_truth(drawn: &Drawn) -> Option<Reference> {
    let free = drawn.family.free();
    let views = &drawn.views;
    let mut state = State { camera: drawn.camera, poses: drawn.cam_from_target.clone() };
    let mut equations = Equations::of(&state, views, free)?;
    let bound = equations.deviation(free, Parameter::Fx) * drawn.noise_px / drawn.camera.fx;
    let (mut damping, mut converged) = (FIRST_DAMPING, false);
    for _ in 0..STEPS {
        let step = equations.step(damping);
        if damping <= FIRST_DAMPING
            && step.as_ref().is_some_and(|(_, promise)| *promise <= GAIN * equations.cost)
        {
            converged = true;
            break;
        }
        let lower = step.and_then(|(step, _)| {
            let next = state.stepped(free, &step)?;
            let there = Equations::of(&next, views, free)?;
            (there.cost < equations.cost).then_some((next, there))
        });
        if let Some((next, there)) = lower {
            (state, equations) = (next, there);
            damping = (damping / 10.0).max(LEAST_DAMPING);
        } else if damping > MOST_DAMPING {
            converged = equations
                .step(LEAST_DAMPING)
                .is_some_and(|(_, promise)| promise <= ROUNDING * equations.cost);
            break;
        } else {
            damping *= 10.0;
        }
    }
    Some(Reference { camera: state.camera, cost: equations.cost, converged, bound })
}

/// Camera and poses.
struct State {
    camera: Camera<Lens>,
    poses: Vec<Pose>,
}

impl State {
    fn stepped(&self, free: FreeParameters, step: &DVector<f64>) -> Option<State> {
        let mut camera = self.camera;
        for (parameter, change) in free.iter().zip(step.iter()) {
            camera = camera.with_value(parameter, camera.value(parameter)? + change)?;
        }
        let of_view = |view: usize| Vector6::from_fn(|i, _| step[free.len() + 6 * view + i]);
        let poses =
            self.poses.iter().enumerate().map(|(view, pose)| pose.perturbed(&of_view(view))).collect();
        (camera.fx > 0.0 && camera.fy > 0.0).then_some(State { camera, poses })
    }
}

/// `J^T J`, `J^T r` and `r^T r`: the free parameters first, then a pose a view.
struct Equations {
    normal: DMatrix<f64>,
    gradient: DVector<f64>,
    cost: f64,
}

impl Equations {
    fn of(state: &State, views: &[View], free: FreeParameters) -> Option<Equations> {
        let n = free.len();
        let unknowns = n + 6 * views.len();
        let mut all = Equations {
            normal: DMatrix::zeros(unknowns, unknowns),
            gradient: DVector::zeros(unknowns),
            cost: 0.0,
        };
        for (view, (marks, pose)) in views.iter().zip(&state.poses).enumerate() {
            let place = |i: usize| if i < n { i } else { i + 6 * view };
            for (point, pixel) in marks.pairs() {
                let turned = pose.rotation * Vec3::new(point.x, point.y, 0.0);
                let seen = state.camera.pixel_with_derivatives(&(turned + pose.translation))?;
                let mut jacobian = Matrix2xX::zeros(n + 6);
                for (column, parameter) in free.iter().enumerate() {
                    let (_, slope) = seen.by_parameters.iter().find(|(p, _)| *p == parameter)?;
                    jacobian.set_column(column, slope);
                }
                // A turn by w moves the point by w x (R X).
                let by_turn = -Matrix3::new(
                    0.0, -turned.z, turned.y, turned.z, 0.0, -turned.x, -turned.y, turned.x, 0.0,
                );
                jacobian.fixed_columns_mut::<3>(n).copy_from(&(seen.by_point * by_turn));
                jacobian.fixed_columns_mut::<3>(n + 3).copy_from(&seen.by_point);
                let residual = seen.pixel - pixel;
                for i in 0..n + 6 {
                    for j in 0..n + 6 {
                        all.normal[(place(i), place(j))] += jacobian.column(i).dot(&jacobian.column(j));
                    }
                    all.gradient[place(i)] += jacobian.column(i).dot(&residual);
                }
                all.cost += residual.norm_squared();
            }
        }
        all.cost.is_finite().then_some(all)
    }

    /// The factor of the normal matrix, scaled to a unit diagonal and damped, with the scale.
    fn factor(&self, damping: f64) -> Option<(nalgebra::Cholesky<f64, nalgebra::Dyn>, DVector<f64>)> {
        let scale = self.normal.diagonal().map(|d| 1.0 / d.sqrt());
        let mut scaled = self.normal.map_with_location(|i, j, x| x * scale[i] * scale[j]);
        for i in 0..scaled.nrows() {
            scaled[(i, i)] += damping;
        }
        Some((scaled.cholesky()?, scale))
    }

    /// The step of `(H + damping diag H) step = -gradient` with what the cost loses by it to second order;
    /// `None` if `H` is singular.
    fn step(&self, damping: f64) -> Option<(DVector<f64>, f64)> {
        let (factor, scale) = self.factor(damping)?;
        let step = -factor.solve(&self.gradient.component_mul(&scale)).component_mul(&scale);
        let promise = -self.gradient.dot(&step);
        (promise.is_finite() && promise >= 0.0).then_some((step, promise))
    }

    /// Standard deviation of a parameter for noise of 1 px; infinite where `H` is singular.
    fn deviation(&self, free: FreeParameters, parameter: Parameter) -> f64 {
        let of = |place: usize| {
            let (factor, scale) = self.factor(0.0)?;
            let mut unit = DVector::zeros(scale.len());
            unit[place] = scale[place];
            Some((factor.solve(&unit)[place] * scale[place]).sqrt())
        };
        free.position(parameter).and_then(of).unwrap_or(f64::INFINITY)
    }
}

#[cfg(test)]
mod tests {
    use super::super::families::FAMILIES;
    use super::*;

    #[test]
    fn the_reference_is_lower_than_the_truth_and_than_anything_next_to_it() {
        for family in &FAMILIES {
            let drawn = Drawn::new(family, 3, 2).unwrap();
            let truth = State { camera: drawn.camera, poses: drawn.cam_from_target.clone() };
            let free = family.free();
            let at = |state: &State| Equations::of(state, &drawn.views, free).unwrap();
            let reference = from_truth(&drawn).unwrap();
            assert!(reference.cost < at(&truth).cost, "{}", family.name());
            // The gradient against differences of the cost.
            let equations = at(&truth);
            for i in 0..free.len() + 6 {
                let h = 1e-4 / equations.normal[(i, i)].sqrt();
                let moved = |h: f64| {
                    let mut step = DVector::zeros(equations.gradient.len());
                    step[i] = h;
                    at(&truth.stepped(free, &step).unwrap()).cost
                };
                let slope = 0.5 * (moved(h) - moved(-h)) / (2.0 * h);
                let size = equations.normal[(i, i)].sqrt() * equations.cost.sqrt();
                assert!((slope - equations.gradient[i]).abs() < 1e-5 * size, "{} {i}", family.name());
            }
        }
    }
}
