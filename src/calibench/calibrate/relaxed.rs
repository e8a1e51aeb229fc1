//! What do the points say before anybody asks for a camera? One lens for all views, and a free homography for
//! each.
//!
//! ```text
//! i = H_v X                      ideal point, in units of a gauge focal length f0
//! m = K0 distort(i)              K0 = [[f0, skew, cu], [0, a f0, cv], [0, 0, 1]]
//! ```
//! Every camera with every set of poses is one of these, so the least cost here is a floor of the
//! calibration's; and nothing here is ambiguous: no focal length, no distance, no tilt. With a free
//! homography the focal length is a gauge: `k1` is known as `k1 / f^2`, `k2` as `k2 / f^4`, and so on. What
//! the data do not fix (a centre without distortion) the damping leaves where it starts.
#![allow(clippy::needless_range_loop, reason = "indices are those of the equations")]

use super::Loss;
use super::minimise::Problem;
use super::normal::Observations;
use crate::camera::{Camera, FreeParameters, Parameter, intrinsics_columns};
use crate::geometry::{Homography, Mat3, Pose, Vec2, Vec3};
use nalgebra::{DMatrix, DVector, Matrix2, SMatrix, SVector};

/// Entries of a homography with the last held at 1.
pub(super) const ENTRIES: usize = 8;
pub(super) type Entries = SVector<f64, ENTRIES>;
pub(super) type EntriesBlock = SMatrix<f64, ENTRIES, ENTRIES>;

/// The relaxed model at its minimum.
#[derive(Debug, Clone)]
pub(super) struct Relaxed {
    /// The lens with its gauge focal length.
    pub lens: Camera,
    /// Ideal points in units of the gauge focal length from target points.
    pub homographies: Vec<Entries>,
    /// What a view says of its homography, the lens held: `J^T J`.
    pub information: Vec<EntriesBlock>,
    /// Sum of squared residuals under the loss.
    pub cost: f64,
}

/// Steps of a stage.
const ITERATIONS: usize = 60;
/// Steps of the last one: few marks leave narrow valleys.
const LAST_ITERATIONS: usize = 300;
/// A stage ends when a step gains less than this part of the cost: a hundredth of a variance in ten thousand
/// points.
const RELATIVE_GAIN: f64 = 1e-7;
const FIRST_DAMPING: f64 = 1e-3;
const SMALLEST_DAMPING: f64 = 1e-9;
const LARGEST_DAMPING: f64 = 1e8;

/// Fits the relaxed model from `start`, in stages: radial distortion about the given centre, then the centre,
/// then all that is free.
///
/// `homographies` are those of the views without distortion, pixels from target points. `None` if no view can
/// be linearised.
pub(super) fn relax(
    problem: &Problem<'_>,
    homographies: &[Homography],
    gauge: Camera,
    lens_parameters: FreeParameters,
) -> Option<Relaxed> {
    use Parameter::{Cx, Cy, K1, K2};
    let inverse = gauge.k().try_inverse()?;
    let views = homographies.iter().zip(problem.observations);
    let start: Vec<Entries> = views.map(|(h, pairs)| in_front(entries(&(inverse * h.0)), pairs)).collect();
    let fit = Fit { observations: problem.observations, loss: problem.loss };
    let stages = [
        FreeParameters::of(&[K1]),
        FreeParameters::of(&[K1, K2]),
        FreeParameters::of(&[K1, K2, Cx, Cy]),
        lens_parameters,
    ];
    let mut at = State { lens: gauge, homographies: start };
    let mut last = FreeParameters::NONE;
    for stage in stages {
        let free = of_both(stage, lens_parameters);
        if free == last && !free.is_empty() {
            continue;
        }
        let iterations = if free == lens_parameters { LAST_ITERATIONS } else { ITERATIONS };
        at = fit.minimise(at, free, iterations)?;
        last = free;
    }
    fit.relaxed(at, lens_parameters)
}

/// The parameters of the relaxed lens for a calibration; `is_distorting` tells which coefficients are held at
/// a value other than 0. The shape of the cells, fy over fx, is one of them unless it is known.
pub(super) fn parameters(problem: &Problem<'_>, is_distorting: impl Fn(Parameter) -> bool) -> FreeParameters {
    use Parameter::{Cx, Cy, Fx, Fy, K1, K2, K3, P1, P2, Skew};
    let free = problem.free;
    let focal_free = free.contains(Fx) || free.contains(Fy);
    let lens = [K1, K2, P1, P2, K3];
    // A coefficient held at a value is no number of the relaxed model's unless the focal length is held too.
    let is_sought = |p: &Parameter| free.contains(*p) || (focal_free && is_distorting(*p));
    let sought = lens.into_iter().filter(is_sought).fold(FreeParameters::NONE, FreeParameters::with);
    if sought.is_empty() && !lens.into_iter().any(is_distorting) {
        return sought;
    }
    let shape = [Cx, Cy, Skew].into_iter().filter(|&p| free.contains(p));
    let sought = shape.fold(sought, FreeParameters::with);
    if focal_free && problem.fy_per_fx.is_none() { sought.with(Fy) } else { sought }
}

/// The minimum of the relaxed model next to a calibration.
pub(super) fn beside(problem: &Problem<'_>, camera: &Camera, cam_from_target: &[Pose]) -> Option<Relaxed> {
    let homography = |pose: &Pose| {
        let r = &pose.rotation;
        let columns = Mat3::from_columns(&[r.column(0).into(), r.column(1).into(), pose.translation]);
        entries(&columns)
    };
    let state = State { lens: *camera, homographies: cam_from_target.iter().map(homography).collect() };
    let free = parameters(problem, |p| camera.get(p) != 0.0);
    let fit = Fit { observations: problem.observations, loss: problem.loss };
    fit.relaxed(fit.minimise(state, free, LAST_ITERATIONS)?, free)
}

/// A homography under which every point lies in front of the camera: where noise has bent one of few points
/// beyond that, its affine part.
fn in_front(mut h: Entries, pairs: &Observations) -> Entries {
    let is_in_front = |p: Vec2| h[6] * p.x + h[7] * p.y + 1.0 > SMALLEST_DENOMINATOR;
    if !pairs.iter().all(|(p, _)| is_in_front(p)) {
        (h[6], h[7]) = (0.0, 0.0);
    }
    h
}

fn of_both(a: FreeParameters, b: FreeParameters) -> FreeParameters {
    a.iter().filter(|&p| b.contains(p)).fold(FreeParameters::NONE, FreeParameters::with)
}

/// `h11 ... h32` at the scale `h33 = 1`.
fn entries(h: &Mat3) -> Entries {
    Entries::from_fn(|i, _| h[(i / 3, i % 3)] / h[(2, 2)])
}

/// The homography with these entries.
pub(super) fn matrix(h: &Entries) -> Mat3 {
    Mat3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0)
}

#[derive(Debug, Clone)]
struct State {
    lens: Camera,
    homographies: Vec<Entries>,
}

/// Room for every parameter of the lens; rows beyond the free ones are not used.
const L: usize = Parameter::COUNT;

struct ViewEquations {
    square: EntriesBlock,
    coupling: SMatrix<f64, L, ENTRIES>,
    gradient: Entries,
}

struct Equations {
    lens: SMatrix<f64, L, L>,
    lens_gradient: SVector<f64, L>,
    views: Vec<ViewEquations>,
    cost: f64,
}

struct Fit<'a> {
    observations: &'a [Observations],
    loss: Loss,
}

impl Fit<'_> {
    /// The relaxed model at a minimum, with what its views say; `None` where a point is behind the camera.
    fn relaxed(&self, at: State, free: FreeParameters) -> Option<Relaxed> {
        let equations = self.equations(&at, free);
        equations.cost.is_finite().then(|| Relaxed {
            lens: at.lens,
            homographies: at.homographies,
            information: equations.views.iter().map(|view| view.square).collect(),
            cost: equations.cost,
        })
    }

    fn minimise(&self, start: State, free: FreeParameters, iterations: usize) -> Option<State> {
        let mut state = start;
        let mut equations = self.equations(&state, free);
        if !equations.cost.is_finite() {
            return None;
        }
        let mut damping = FIRST_DAMPING;
        for _ in 0..iterations {
            let Some((step, gain)) = equations.solve(damping, free.len()) else {
                damping *= 10.0;
                if damping > LARGEST_DAMPING {
                    break;
                }
                continue;
            };
            let trial = state.stepped(free, &step);
            let trial_equations = self.equations(&trial, free);
            if trial_equations.cost < equations.cost {
                let fell = equations.cost - trial_equations.cost;
                (state, equations) = (trial, trial_equations);
                damping = (0.1 * damping).max(SMALLEST_DAMPING);
                if fell.max(gain) <= RELATIVE_GAIN * equations.cost {
                    break;
                }
            } else {
                if gain <= RELATIVE_GAIN * equations.cost || damping > LARGEST_DAMPING {
                    break;
                }
                damping *= 10.0;
            }
        }
        Some(state)
    }

    fn equations(&self, at: &State, free: FreeParameters) -> Equations {
        let parameters: Vec<usize> = free.iter().map(|p| p as usize).collect();
        let mut sum = Equations {
            lens: SMatrix::zeros(),
            lens_gradient: SVector::zeros(),
            views: Vec::with_capacity(self.observations.len()),
            cost: 0.0,
        };
        for (pairs, h) in self.observations.iter().zip(&at.homographies) {
            let view = self.add_view(&at.lens, h, pairs, &parameters, &mut sum);
            sum.views.push(view);
        }
        sum
    }

    /// The equations of one view; adds the lens's share to `sum`. A point on or behind the horizon makes the
    /// cost infinite.
    fn add_view(
        &self,
        lens: &Camera,
        h: &Entries,
        pairs: &Observations,
        parameters: &[usize],
        sum: &mut Equations,
    ) -> ViewEquations {
        let linear = Matrix2::new(lens.fx, lens.skew, 0.0, lens.fy);
        let mut view = ViewEquations {
            square: EntriesBlock::zeros(),
            coupling: SMatrix::zeros(),
            gradient: Entries::zeros(),
        };
        for (p, pixel) in pairs.iter() {
            let w = h[6] * p.x + h[7] * p.y + 1.0;
            if w.is_nan() || w <= SMALLEST_DENOMINATOR {
                sum.cost = f64::INFINITY;
                return view;
            }
            let inverse = 1.0 / w;
            let ideal = Vec2::new(h[0] * p.x + h[1] * p.y + h[2], h[3] * p.x + h[4] * p.y + h[5]) * inverse;
            let distorted = lens.distortion.distort(&ideal);
            let residual = lens.pixel_from_normalised(&distorted) - pixel;
            let (rho, weight) = self.loss.at(residual.norm_squared());
            sum.cost += rho;
            let by_ideal = linear * lens.distortion.jacobian(&ideal);
            let a = Vec3::new(p.x, p.y, 1.0) * inverse;
            let mut rows = [[0.0; ENTRIES]; 2];
            let mut lens_rows = [[0.0; L]; 2];
            let columns = intrinsics_columns(lens, &ideal, &distorted);
            for i in 0..2 {
                for k in 0..3 {
                    rows[i][k] = by_ideal[(i, 0)] * a[k];
                    rows[i][3 + k] = by_ideal[(i, 1)] * a[k];
                }
                let along = by_ideal[(i, 0)] * ideal.x + by_ideal[(i, 1)] * ideal.y;
                rows[i][6] = -along * a.x;
                rows[i][7] = -along * a.y;
                for (k, &parameter) in parameters.iter().enumerate() {
                    lens_rows[i][k] = columns[(i, parameter)];
                }
            }
            accumulate(&rows, &lens_rows, parameters.len(), [residual.x, residual.y], weight, &mut view, sum);
        }
        for i in 0..ENTRIES {
            for j in 0..i {
                view.square[(i, j)] = view.square[(j, i)];
            }
        }
        view
    }
}

/// A denominator below this lies at the horizon of its target: no point that was seen does.
const SMALLEST_DENOMINATOR: f64 = 1e-3;

fn accumulate(
    rows: &[[f64; ENTRIES]; 2],
    lens_rows: &[[f64; L]; 2],
    n: usize,
    residual: [f64; 2],
    weight: f64,
    view: &mut ViewEquations,
    sum: &mut Equations,
) {
    for (row, (lens_row, r)) in rows.iter().zip(lens_rows.iter().zip(residual)) {
        for i in 0..ENTRIES {
            let weighted = weight * row[i];
            for j in i..ENTRIES {
                view.square[(i, j)] += weighted * row[j];
            }
            view.gradient[i] += weighted * r;
            for k in 0..n {
                view.coupling[(k, i)] += weighted * lens_row[k];
            }
        }
        for k in 0..n {
            let weighted = weight * lens_row[k];
            for j in k..n {
                sum.lens[(k, j)] += weighted * lens_row[j];
            }
            sum.lens_gradient[k] += weighted * r;
        }
    }
}

/// A step of lens and homographies.
struct Step {
    lens: DVector<f64>,
    homographies: Vec<Entries>,
}

impl Equations {
    /// Levenberg-Marquardt's step and the gain it promises; `None` where the damped matrix is not positive
    /// definite.
    fn solve(&self, damping: f64, n: usize) -> Option<(Step, f64)> {
        let mut schur = DMatrix::from_fn(n, n, |i, j| self.lens[(i.min(j), i.max(j))]);
        for i in 0..n {
            schur[(i, i)] += damping * self.lens[(i, i)].max(f64::MIN_POSITIVE);
        }
        let mut right = DVector::from_fn(n, |i, _| -self.lens_gradient[i]);
        let mut factors = Vec::with_capacity(self.views.len());
        for view in &self.views {
            let mut damped = view.square;
            for i in 0..ENTRIES {
                damped[(i, i)] *= 1.0 + damping;
            }
            let factor = damped.cholesky()?;
            // C^-1 B^T and C^-1 g.
            let response = factor.solve(&view.coupling.transpose());
            let own = factor.solve(&view.gradient);
            for i in 0..n {
                for j in 0..n {
                    schur[(i, j)] -= view.coupling.row(i).dot(&response.column(j).transpose());
                }
                right[i] += view.coupling.row(i).dot(&own.transpose());
            }
            factors.push((response, own));
        }
        let lens = if n > 0 { schur.cholesky()?.solve(&right) } else { DVector::zeros(0) };
        let mut gain = 0.0;
        for i in 0..n {
            gain += lens[i] * (damping * self.lens[(i, i)] * lens[i] - self.lens_gradient[i]);
        }
        let mut homographies = Vec::with_capacity(self.views.len());
        for (view, (response, own)) in self.views.iter().zip(&factors) {
            let mut step = -own;
            for i in 0..n {
                step -= response.column(i) * lens[i];
            }
            for i in 0..ENTRIES {
                gain += step[i] * (damping * view.square[(i, i)] * step[i] - view.gradient[i]);
            }
            homographies.push(step);
        }
        Some((Step { lens, homographies }, gain))
    }
}

impl State {
    fn stepped(&self, free: FreeParameters, step: &Step) -> State {
        let homographies = self.homographies.iter().zip(&step.homographies).map(|(h, d)| h + d).collect();
        State { lens: self.lens.stepped(free, step.lens.as_slice()), homographies }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::tests::plain_problem;
    use crate::camera::BrownConrady;

    const FREE: [Parameter; 6] =
        [Parameter::Fy, Parameter::Cx, Parameter::Skew, Parameter::K1, Parameter::K2, Parameter::P1];

    fn state() -> State {
        let distortion = BrownConrady { k1: -0.2, k2: 0.05, p1: 1e-3, p2: -2e-3, k3: 0.01 };
        let lens = Camera { skew: 1.5, ..Camera::pinhole(600.0, 580.0, 326.0, 243.0) };
        let homographies = [
            [0.3, 0.02, 0.03, -0.01, 0.28, -0.02, 0.05, -0.04],
            [0.25, -0.03, 0.01, 0.02, 0.3, 0.02, -0.06, 0.08],
        ];
        State {
            lens: lens.with_distortion(distortion),
            homographies: homographies.map(|h| Entries::from_column_slice(&h)).to_vec(),
        }
    }

    /// What the state predicts, off by so many pixels at most.
    fn observations(state: &State, off_px: f64) -> Vec<Observations> {
        let of_view = |h: &Entries| {
            let seen = |i: usize| {
                let p = Vec2::new((i % 5) as f64 - 2.0, (i / 5) as f64 - 2.0) * 0.6;
                let ideal = matrix(h) * Vec3::new(p.x, p.y, 1.0);
                let wave = Vec2::new(libm::sin(7.0 * i as f64), libm::cos(11.0 * i as f64));
                (p, state.lens.project(&ideal).unwrap() + wave * off_px)
            };
            Observations::new((0..25).map(seen))
        };
        state.homographies.iter().map(of_view).collect()
    }

    #[test]
    fn gradients_are_half_the_slope_of_the_cost() {
        let (at, free) = (state(), FreeParameters::of(&FREE));
        let observations = observations(&at, 2.0);
        let fit = Fit { observations: &observations, loss: Loss::Cauchy { scale_px: 1.5 } };
        let cost = |state: &State| fit.equations(state, free).cost;
        let equations = fit.equations(&at, free);
        let agree = |analytic: f64, ahead: State, behind: State, h: f64| {
            let difference = 0.5 * (cost(&ahead) - cost(&behind)) / (2.0 * h);
            assert!((difference - analytic).abs() < 1e-5 * (1.0 + analytic.abs()), "{difference} {analytic}");
        };
        for (k, parameter) in FREE.into_iter().enumerate() {
            let h = 1e-6 * (1.0 + at.lens.get(parameter).abs());
            let moved =
                |h: f64| State { lens: at.lens.with(parameter, at.lens.get(parameter) + h), ..at.clone() };
            agree(equations.lens_gradient[k], moved(h), moved(-h), h);
        }
        for view in 0..2 {
            for entry in 0..ENTRIES {
                let moved = |h: f64| {
                    let mut state = at.clone();
                    state.homographies[view][entry] += h;
                    state
                };
                agree(equations.views[view].gradient[entry], moved(1e-6), moved(-1e-6), 1e-6);
            }
        }
    }

    #[test]
    fn a_short_step_gains_what_it_promises() {
        let (truth, free) = (state(), FreeParameters::of(&FREE));
        let observations = observations(&truth, 0.1);
        let fit = Fit { observations: &observations, loss: Loss::Squares };
        let start = State {
            lens: truth.lens.with(Parameter::Cx, truth.lens.cx + 0.3),
            homographies: truth.homographies.iter().map(|h| h.map(|x| x + 1e-4)).collect(),
        };
        let equations = fit.equations(&start, free);
        for damping in [0.0, 0.5] {
            let (step, promised) = equations.solve(damping, free.len()).unwrap();
            let gained = equations.cost - fit.equations(&start.stepped(free, &step), free).cost;
            assert!((gained / promised - 1.0).abs() < 0.01, "{gained} {promised}");
        }
    }

    #[test]
    fn a_homography_with_a_point_beyond_its_horizon_keeps_its_affine_part_only() {
        let pairs =
            Observations::new([Vec2::new(1.0, 1.0), Vec2::new(-1.0, 0.5)].map(|p| (p, p)).into_iter());
        let with = |tilt: f64| Entries::from_column_slice(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, tilt, tilt]);
        assert_eq!(in_front(with(-0.4), &pairs), with(-0.4));
        assert_eq!(in_front(with(-0.6), &pairs), with(0.0));
    }

    #[test]
    fn the_relaxed_model_has_the_parameters_that_homographies_do_not_take_up() {
        use Parameter::{Cx, Cy, Fy, K1, K2, K3};
        let sought = |free: FreeParameters, fy_per_fx: Option<f64>, held: &[Parameter]| {
            let problem = Problem { fy_per_fx, ..plain_problem(&[], free) };
            parameters(&problem, |p| held.contains(&p))
        };
        let (standard, of) = (FreeParameters::STANDARD, FreeParameters::of);
        assert_eq!(sought(standard, None, &[]), of(&[Fy, Cx, Cy, K1, K2]));
        // The shape of the cells is known.
        assert_eq!(sought(standard, Some(1.0), &[]), of(&[Cx, Cy, K1, K2]));
        // A coefficient that is held belongs to a focal length.
        assert_eq!(sought(standard, None, &[K3]), of(&[Fy, Cx, Cy, K1, K2, K3]));
        assert_eq!(sought(of(&[Cx, Cy, K1]), None, &[K3]), of(&[Cx, Cy, K1]));
        // Without distortion homographies take up all.
        assert_eq!(sought(of(&[Parameter::Fx, Fy, Cx, Cy]), None, &[]), FreeParameters::NONE);
    }
}
