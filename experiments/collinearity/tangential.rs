//! The single-plane calibration with the two tangential terms of the chapter's output, and the centre held.
//!
//! The same sum of squares as [`calibrate_single_plane`], over the homography, k1, k2, p1 and p2:
//! Gauss-Newton from the fit without p1 and p2. Those two do nearly what a moved centre does, so that few
//! steps are left to do.

use super::*;
use calibench::camera::BrownConrady;
use calibench::geometry::{Homography, Mat3, Scatter, Vec3};
use nalgebra::{SMatrix, SVector};

/// `h11 ... h32` at `h33 = 1`, then `k1, k2, p1, p2`.
const PARAMETERS: usize = 12;
type Vector = SVector<f64, PARAMETERS>;

/// From a start that misses p1 and p2 it takes four to six steps.
const MAX_STEPS: usize = 50;
/// A step that promises to lower the sum of squares by a smaller share than this is lost in its rounding.
const RELATIVE_GAIN: f64 = 1e-14;

/// Target points with centroid 0 and RMS radius 1, pixels as offsets from the centre in units of the focal
/// length: numbers of order one.
struct Frames<'a> {
    view: &'a View,
    scatter: Scatter,
    focal_px: f64,
    centre_px: Vec2,
}

impl Frames<'_> {
    /// The point of the target, homogeneous, and what was seen of it.
    fn pairs(&self) -> impl Iterator<Item = (Vec3, Vec2)> + '_ {
        self.view.pairs().map(|(point, pixel)| {
            let p = (point - self.scatter.centroid) / self.scatter.rms_radius;
            (Vec3::new(p.x, p.y, 1.0), (pixel - self.centre_px) / self.focal_px)
        })
    }

    /// The homography between offsets as one from target points to ideal pixels.
    fn to_pixels(&self, h: &Mat3) -> Mat3 {
        let (s, c) = (1.0 / self.scatter.rms_radius, self.scatter.centroid);
        let from_target = Mat3::new(s, 0.0, -s * c.x, 0.0, s, -s * c.y, 0.0, 0.0, 1.0);
        let (f, o) = (self.focal_px, self.centre_px);
        Mat3::new(f, 0.0, o.x, 0.0, f, o.y, 0.0, 0.0, 1.0) * h * from_target
    }

    /// The inverse of [`Frames::to_pixels`].
    fn to_offsets(&self, h: &Mat3) -> Mat3 {
        let (r, c) = (self.scatter.rms_radius, self.scatter.centroid);
        let to_target = Mat3::new(r, 0.0, c.x, 0.0, r, c.y, 0.0, 0.0, 1.0);
        let (s, o) = (1.0 / self.focal_px, self.centre_px);
        Mat3::new(s, 0.0, -s * o.x, 0.0, s, -s * o.y, 0.0, 0.0, 1.0) * h * to_target
    }
}

fn homography(at: &Vector) -> Mat3 {
    Mat3::new(at[0], at[1], at[2], at[3], at[4], at[5], at[6], at[7], 1.0)
}

fn lens(at: &Vector) -> BrownConrady {
    BrownConrady { p1: at[10], p2: at[11], ..BrownConrady::radial(at[8], at[9]) }
}

/// Refines a calibration whose lens is radial to one with p1 and p2, its centre held where it is.
pub fn with_tangential(view: &View, start: SinglePlane) -> Result<SinglePlane, ExperimentError> {
    let (focal_px, centre_px) = (start.focal_px, start.centre_px);
    let frames = Frames { view, scatter: Scatter::of(view.points()), focal_px, centre_px };
    let h = frames.to_offsets(&start.ideal_from_target.0);
    let k = start.distortion;
    let mut at = Vector::from_fn(|i, _| if i < 8 { h[(i / 3, i % 3)] / h[(2, 2)] } else { 0.0 });
    (at[8], at[9]) = (k.k1, k.k2);
    let failed = |why: &str| ExperimentError::Input(format!("calibration with tangential terms: {why}"));
    for iterations in 1..=MAX_STEPS {
        let (matrix, gradient, cost) = normal_equations(&frames, &at);
        let inverse = matrix.cholesky().ok_or_else(|| failed("the points do not fix the parameters"))?;
        let step = -inverse.solve(&gradient);
        at += step;
        if -gradient.dot(&step) <= RELATIVE_GAIN * cost {
            return Ok(result(&frames, &at, start, iterations));
        }
    }
    Err(failed("no end after 50 steps"))
}

fn result(frames: &Frames, at: &Vector, start: SinglePlane, iterations: usize) -> SinglePlane {
    let focal_px = frames.focal_px;
    let residual = |(p, seen)| (lens(at).distort(&ideal(at, &p)) - seen) * focal_px;
    let mut found = start;
    found.ideal_from_target = Homography(frames.to_pixels(&homography(at)));
    found.distortion = lens(at);
    found.residuals_px = frames.pairs().map(residual).collect();
    found.rms_px = rms(&found.residuals_px);
    found.degrees_of_freedom = 2 * found.residuals_px.len() - PARAMETERS;
    found.spread = None;
    found.iterations += iterations;
    found
}

fn ideal(at: &Vector, point: &Vec3) -> Vec2 {
    let image = homography(at) * point;
    Vec2::new(image.x / image.z, image.y / image.z)
}

/// `J^T J`, `J^T r` and `|r|^2`. With `x` the ideal offset, `D` the lens's Jacobian there and `s = |x|^2`, a
/// pixel moves by `D dx/dh`, `x s`, `x s^2`, `(2 x y, s + 2 y^2)` and `(s + 2 x^2, 2 x y)` with the
/// parameters in turn.
fn normal_equations(frames: &Frames, at: &Vector) -> (SMatrix<f64, PARAMETERS, PARAMETERS>, Vector, f64) {
    let (mut matrix, mut gradient, mut cost) = (SMatrix::zeros(), Vector::zeros(), 0.0);
    for (point, seen) in frames.pairs() {
        let depth = (homography(at) * point).z;
        let x = ideal(at, &point);
        let by_ideal = lens(at).jacobian(&x);
        let mut jacobian = SMatrix::<f64, 2, PARAMETERS>::zeros();
        for i in 0..3 {
            let entry = point[i] / depth;
            jacobian.set_column(i, &(by_ideal.column(0) * entry));
            jacobian.set_column(i + 3, &(by_ideal.column(1) * entry));
            if i < 2 {
                jacobian.set_column(i + 6, &(by_ideal * x * -entry));
            }
        }
        let s = x.norm_squared();
        let twice_xy = 2.0 * x.x * x.y;
        jacobian.set_column(8, &(x * s));
        jacobian.set_column(9, &(x * (s * s)));
        jacobian.set_column(10, &Vec2::new(twice_xy, s + 2.0 * x.y * x.y));
        jacobian.set_column(11, &Vec2::new(s + 2.0 * x.x * x.x, twice_xy));
        let residual = lens(at).distort(&x) - seen;
        matrix += jacobian.transpose() * jacobian;
        gradient += jacobian.transpose() * residual;
        cost += residual.norm_squared();
    }
    (matrix, gradient, cost)
}
