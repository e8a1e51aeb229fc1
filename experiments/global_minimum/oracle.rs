//! Where does a search that starts at the truth end? An independent Levenberg-Marquardt minimisation, the
//! reference of every scene.
//!
//! It minimises the same cost as the solver, the sum of squared pixel distances, and shares no search code
//! with it: normal equations summed point by point from `camera::project_with_jacobian`, poses eliminated
//! view by view (Schur complement), damping in proportion to the diagonal (Marquardt 1963). Its unknown poses
//! are those of the target's middle, so that a far origin costs no digits.

use calibench::board::View;
use calibench::camera::{Camera, FreeParameters, Parameter, project_with_jacobian};
use calibench::geometry::{Pose, Vec2, Vec3};
use calibench::synth::Truth;
use nalgebra::{DMatrix, DVector, Matrix6, MatrixXx6, Vector6};

/// Unknowns of one view: all intrinsics and a pose.
const MOST: usize = Parameter::COUNT + 6;
/// A step that promises less than this part of the cost ends the search.
const GAIN: f64 = 1e-13;
/// Where nothing lowers the cost any more, a promise below this is rounding.
const ROUNDING: f64 = 1e-9;
/// Steps before the search gives up.
const STEPS: usize = 1000;
const FIRST_DAMPING: f64 = 1e-6;
const LEAST_DAMPING: f64 = 1e-12;
const MOST_DAMPING: f64 = 1e12;

/// The minimum next to the truth.
#[derive(Debug, Clone)]
pub struct Reference {
    /// Intrinsics there.
    pub camera: Camera,
    /// Poses there.
    pub cam_from_target: Vec<Pose>,
    /// Sum of squared pixel distances.
    pub cost: f64,
    /// Whether the search ended in a minimum.
    pub converged: bool,
    /// Steps that lowered the cost.
    pub steps: usize,
}

/// Minimises from the truth. `None` only if a mark of the truth is behind the camera.
pub fn from_truth(truth: &Truth, views: &[View], free: FreeParameters) -> Option<Reference> {
    descend(&truth.camera, &truth.cam_from_target, views, free)
}

/// Minimises from any camera and poses.
pub fn descend(
    camera: &Camera,
    cam_from_target: &[Pose],
    views: &[View],
    free: FreeParameters,
) -> Option<Reference> {
    let middles: Vec<Vec2> = views.iter().map(middle).collect();
    let poses = cam_from_target.iter().zip(&middles).map(|(pose, m)| moved(pose, m)).collect();
    let mut state = State { camera: *camera, poses };
    let mut equations = Equations::of(&state, views, &middles, free)?;
    let (mut damping, mut steps, mut converged) = (FIRST_DAMPING, 0, false);
    while steps < STEPS {
        let (next, promise) = match equations.step(damping) {
            Some(step) => (Some(state.stepped(free, &step)), step.promise),
            None => (None, f64::INFINITY),
        };
        if damping <= FIRST_DAMPING && promise <= GAIN * equations.cost {
            converged = true;
            break;
        }
        let lower = next.and_then(|next| {
            let there = Equations::of(&next, views, &middles, free)?;
            (there.cost < equations.cost).then_some((next, there))
        });
        if let Some((next, there)) = lower {
            (state, equations) = (next, there);
            damping = (damping / 10.0).max(LEAST_DAMPING);
            steps += 1;
        } else if damping > MOST_DAMPING {
            converged =
                equations.step(LEAST_DAMPING).is_some_and(|step| step.promise <= ROUNDING * equations.cost);
            break;
        } else {
            damping *= 10.0;
        }
    }
    let back = |(pose, m): (&Pose, &Vec2)| moved(pose, &-m);
    let cam_from_target = state.poses.iter().zip(&middles).map(back).collect();
    Some(Reference { camera: state.camera, cam_from_target, cost: equations.cost, converged, steps })
}

/// Sum of squared pixel distances of a camera and its poses; `None` behind the camera.
pub fn cost(camera: &Camera, cam_from_target: &[Pose], views: &[View]) -> Option<f64> {
    let mut sum = 0.0;
    for (pose, view) in cam_from_target.iter().zip(views) {
        for (point, pixel) in view.pairs() {
            sum += (camera.project(&pose.apply(&Vec3::new(point.x, point.y, 0.0)))? - pixel).norm_squared();
        }
    }
    Some(sum)
}

fn middle(view: &View) -> Vec2 {
    view.points().iter().sum::<Vec2>() / view.len() as f64
}

/// The pose of the target whose origin is moved to `by`.
fn moved(pose: &Pose, by: &Vec2) -> Pose {
    Pose { rotation: pose.rotation, translation: pose.apply(&Vec3::new(by.x, by.y, 0.0)) }
}

struct State {
    camera: Camera,
    poses: Vec<Pose>,
}

struct Step {
    intrinsics: DVector<f64>,
    poses: Vec<Vector6<f64>>,
    /// Cost that the quadratic model loses.
    promise: f64,
}

impl State {
    fn stepped(&self, free: FreeParameters, step: &Step) -> State {
        State {
            camera: self.camera.stepped(free, step.intrinsics.as_slice()),
            poses: self.poses.iter().zip(&step.poses).map(|(pose, step)| pose.perturbed(step)).collect(),
        }
    }
}

/// Normal equations: `A` of the intrinsics, and for every view the coupling `B` and the pose's block `C`.
struct Equations {
    intrinsics: DMatrix<f64>,
    gradient: DVector<f64>,
    views: Vec<Block>,
    cost: f64,
}

struct Block {
    coupling: MatrixXx6<f64>,
    pose: Matrix6<f64>,
    gradient: Vector6<f64>,
}

impl Equations {
    fn of(state: &State, views: &[View], middles: &[Vec2], free: FreeParameters) -> Option<Equations> {
        if !state.camera.is_valid() {
            return None;
        }
        let n = free.len();
        let mut all = Equations {
            intrinsics: DMatrix::zeros(n, n),
            gradient: DVector::zeros(n),
            views: Vec::with_capacity(views.len()),
            cost: 0.0,
        };
        for ((view, pose), middle) in views.iter().zip(&state.poses).zip(middles) {
            let sums = Sums::of(&state.camera, pose, view, middle, free)?;
            for i in 0..n {
                for j in 0..n {
                    all.intrinsics[(i, j)] += sums.at(i, j);
                }
                all.gradient[i] += sums.gradient[i];
            }
            all.cost += sums.cost;
            all.views.push(Block {
                coupling: MatrixXx6::from_fn(n, |i, j| sums.at(i, n + j)),
                pose: Matrix6::from_fn(|i, j| sums.at(n + i, n + j)),
                gradient: Vector6::from_fn(|i, _| sums.gradient[n + i]),
            });
        }
        all.cost.is_finite().then_some(all)
    }

    /// The step of `(H + damping diag H) step = -gradient`; `None` if `H` is singular.
    fn step(&self, damping: f64) -> Option<Step> {
        let damped = |i: usize, j: usize, x: f64| if i == j { x * (1.0 + damping) } else { x };
        let n = self.gradient.len();
        let mut reduced = DMatrix::from_fn(n, n, |i, j| damped(i, j, self.intrinsics[(i, j)]));
        let mut right = -&self.gradient;
        let mut factors = Vec::with_capacity(self.views.len());
        for block in &self.views {
            let factor = Matrix6::from_fn(|i, j| damped(i, j, block.pose[(i, j)])).cholesky()?;
            let solved = factor.solve(&block.coupling.transpose());
            reduced -= &block.coupling * &solved;
            right += &block.coupling * factor.solve(&block.gradient);
            factors.push(factor);
        }
        let intrinsics = if n == 0 { right } else { reduced.cholesky()?.solve(&right) };
        let pose = |(block, factor): (&Block, &nalgebra::Cholesky<f64, nalgebra::U6>)| {
            -factor.solve(&(block.gradient + block.coupling.tr_mul(&intrinsics)))
        };
        let poses: Vec<Vector6<f64>> = self.views.iter().zip(&factors).map(pose).collect();
        let downhill =
            self.views.iter().zip(&poses).map(|(block, step)| block.gradient.dot(step)).sum::<f64>();
        let promise = -(self.gradient.dot(&intrinsics) + downhill);
        (promise.is_finite() && promise >= 0.0).then_some(Step { intrinsics, poses, promise })
    }
}

/// `J^T J`, `J^T r` and `r^T r` of one view, free intrinsics first, then the pose.
struct Sums {
    square: [[f64; MOST]; MOST],
    gradient: [f64; MOST],
    cost: f64,
}

impl Sums {
    fn of(camera: &Camera, pose: &Pose, view: &View, middle: &Vec2, free: FreeParameters) -> Option<Sums> {
        let mut sums = Sums { square: [[0.0; MOST]; MOST], gradient: [0.0; MOST], cost: 0.0 };
        let used = free.len() + 6;
        for (point, pixel) in view.pairs() {
            let seen =
                project_with_jacobian(camera, pose, &Vec3::new(point.x - middle.x, point.y - middle.y, 0.0))
                    .ok()?;
            let residual = seen.pixel - pixel;
            let mut rows = [[0.0; MOST]; 2];
            for (axis, row) in rows.iter_mut().enumerate() {
                for (slot, parameter) in row.iter_mut().zip(free.iter()) {
                    *slot = seen.intrinsics[(axis, parameter as usize)];
                }
                for k in 0..6 {
                    row[free.len() + k] = seen.pose[(axis, k)];
                }
            }
            for i in 0..used {
                for j in i..used {
                    sums.square[i][j] += rows[0][i] * rows[0][j] + rows[1][i] * rows[1][j];
                }
                sums.gradient[i] += rows[0][i] * residual.x + rows[1][i] * residual.y;
            }
            sums.cost += residual.norm_squared();
        }
        Some(sums)
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        self.square[i.min(j)][i.max(j)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench::synth::{Scene, Stream, StreamKey};

    #[test]
    fn exact_views_lead_back_to_the_truth() {
        let scene = Scene::example();
        let truth = &scene.truth;
        let start = Camera { fx: 640.0, fy: 560.0, cx: 310.0, ..truth.camera };
        let found =
            descend(&start, &truth.cam_from_target, &scene.exact(), FreeParameters::STANDARD).unwrap();
        assert!((found.camera.fx - 600.0).abs() < 1e-6 && (found.camera.distortion.k2 - 0.05).abs() < 1e-7);
        // 504 coordinates near 600 px, each with some roundings: 504 (600 eps)^2 is 1e-23.
        assert!(found.cost < 1e-20, "{}", found.cost);
    }

    #[test]
    fn the_minimum_is_lower_than_anything_next_to_it() {
        let scene = Scene::example();
        let key = StreamKey { seed: 1, scenario: "oracle", trial: 0, purpose: "noise" };
        let views = scene.observe(0.1, &mut Stream::open(key));
        let found = from_truth(&scene.truth, &views, FreeParameters::STANDARD).unwrap();
        assert!(found.converged);
        let least = cost(&found.camera, &found.cam_from_target, &views).unwrap();
        assert!((least - found.cost).abs() < 1e-12 * least);
        for parameter in FreeParameters::STANDARD.iter() {
            for side in [-1.0, 1.0] {
                let moved = found.camera.with(parameter, found.camera.get(parameter) * (1.0 + 1e-4 * side));
                assert!(cost(&moved, &found.cam_from_target, &views).unwrap() > least, "{parameter}");
            }
        }
        // Its poses are those of the target itself, not of its middle: a moved origin changes only them.
        let shift = Vec2::new(500.0, -300.0);
        let far: Vec<View> = views
            .iter()
            .map(|v| View::new(v.points().iter().map(|p| p + shift).collect(), v.pixels().to_vec()).unwrap())
            .collect();
        let poses: Vec<Pose> = scene.truth.cam_from_target.iter().map(|pose| moved(pose, &-shift)).collect();
        let again = descend(&scene.truth.camera, &poses, &far, FreeParameters::STANDARD).unwrap();
        assert!((again.cost - found.cost).abs() < 1e-10 * found.cost);
    }
}
