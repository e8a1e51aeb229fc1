//! Faults between a good estimate and its user: layout, units, definitions, uncertainty.

use super::{Planted, chosen, fingerprint, gross, spoilt, subtle};
use crate::camera::{Camera, Parameter, project_with_jacobian};
use crate::geometry::{Mat3, Pose, Vec3};
use crate::harness::gate::accept::free_of;
use crate::harness::gate::protocol::{Answer, Problem};
use crate::synth::{Stream, StreamKey};
use nalgebra::DMatrix;

pub(super) const FAULTS: &[Planted] = &[
    gross("fy-cx-swapped", "fy and cx exchanged in the output layout", |p, _| exchanged(p, "fy", "cx")),
    gross("p1-p2-swapped", "p1 and p2 exchanged", |p, _| exchanged(p, "p1", "p2")),
    gross("tangential-sign", "p1 and p2 with the other sign", |p, _| {
        spoilt(p, |a| ["p1", "p2"].into_iter().for_each(|name| change(a, name, |x| -x)))
    }),
    gross("half-pixel-shift", "pixel (0, 0) taken as a corner: principal point half a pixel off", |p, _| {
        spoilt(p, |a| {
            ["cx", "cy"].into_iter().filter(|n| is_free(p, n)).for_each(|name| change(a, name, |x| x + 0.5))
        })
    }),
    gross("inverse-distortion", "k1, k2 of the model that undistorts", |p, _| spoilt(p, inverse_distortion)),
    gross("rmse-per-coordinate", "RMSE divided by 2N", |p, _| {
        spoilt(p, |a| a.rmse = a.rmse.map(|x| x * std::f64::consts::FRAC_1_SQRT_2))
    }),
    gross("rmse-by-freedom", "RMSE divided by degrees of freedom", |p, _| {
        spoilt(p, |a| a.rmse = a.rmse.map(|x| x * (p.points() as f64 / freedom(p)).sqrt()))
    }),
    gross("covariance-doubled", "covariance too large by 2", |p, _| spoilt(p, |a| scale_covariance(a, 2.0))),
    gross("covariance-without-poses", "covariance as if the poses were known", |p, _| {
        spoilt(p, |a| covariance_without_poses(p, a))
    }),
    gross("covariance-per-2n", "residual variance divided by 2N, not by degrees of freedom", |p, _| {
        spoilt(p, |a| scale_covariance(a, freedom(p) / (2.0 * p.points() as f64)))
    }),
    gross("translation-in-metres", "translations a thousand times too small", |p, _| {
        spoilt(p, |a| {
            a.poses.iter_mut().flatten().flat_map(|pose| &mut pose.translation).for_each(|x| *x /= 1000.0)
        })
    }),
    gross("rotation-transposed", "rotation matrices transposed", |p, _| {
        spoilt(p, |a| {
            for pose in a.poses.iter_mut().flatten() {
                let r = pose.rotation;
                pose.rotation = std::array::from_fn(|i| std::array::from_fn(|j| r[j][i]));
            }
        })
    }),
    subtle("biased-fx", "fx too large by a tenth of its standard deviation", |p, _| {
        spoilt(p, |a| {
            let shift = 0.1 * deviation(a, "fx");
            change(a, "fx", |x| x + shift);
        })
    }),
    subtle(
        "biased-fx-followed",
        "the same bias, followed by all other parameters; neither poses nor RMSE stated",
        |p, _| spoilt(p, |a| biased_together(a, 0.1)),
    ),
    subtle("excess-variance", "variance 5 % above the bound; neither poses nor RMSE stated", |p, _| {
        spoilt(p, |a| add_noise(p, a, 0.05))
    }),
    gross("last-bits", "the last bit of fx depends on the call", |p, call| {
        spoilt(p, |a| change(a, "fx", |x| f64::from_bits(x.to_bits() ^ (call & 1))))
    }),
    subtle("silent-failure", "one answer in a hundred has fx 10 % too large", |p, _| {
        spoilt(p, |a| change(a, "fx", |x| if chosen(p, 100) { 1.1 * x } else { x }))
    }),
];

fn is_free(problem: &Problem, name: &str) -> bool {
    problem.free.iter().any(|free| free == name)
}

fn change(answer: &mut Answer, name: &str, how: impl Fn(f64) -> f64) {
    if let Some(value) = answer.parameters.get_mut(name) {
        *value = how(*value);
    }
}

/// Exchanges two parameters that are both estimated.
fn exchanged(problem: &Problem, a: &str, b: &str) -> Answer {
    spoilt(problem, |answer| {
        if !(is_free(problem, a) && is_free(problem, b)) {
            return;
        }
        let value = |name: &str| answer.parameters.get(name).copied();
        if let (Some(x), Some(y)) = (value(a), value(b)) {
            answer.parameters.insert(a.to_string(), y);
            answer.parameters.insert(b.to_string(), x);
        }
    })
}

/// To second order the inverse of `r (1 + k1 r^2 + k2 r^4)` has the coefficients `-k1` and `3 k1^2 - k2`.
fn inverse_distortion(answer: &mut Answer) {
    let value = |name: &str| answer.parameters.get(name).copied().unwrap_or(0.0);
    let (k1, k2) = (value("k1"), value("k2"));
    answer.parameters.insert("k1".into(), -k1);
    answer.parameters.insert("k2".into(), 3.0 * k1 * k1 - k2);
}

fn freedom(problem: &Problem) -> f64 {
    (2 * problem.points() - problem.free.len() - 6 * problem.views.len()) as f64
}

fn scale_covariance(answer: &mut Answer, factor: f64) {
    answer.covariance.iter_mut().flat_map(|c| c.matrix.iter_mut().flatten()).for_each(|x| *x *= factor);
}

fn deviation(answer: &Answer, name: &str) -> f64 {
    answer
        .covariance
        .as_ref()
        .and_then(|c| {
            let i = c.parameters.iter().position(|p| p == name)?;
            Some(c.matrix[i][i].sqrt())
        })
        .unwrap_or(0.0)
}

/// `s^2 (J_a^T J_a)^-1` with the columns of the intrinsics only.
fn covariance_without_poses(problem: &Problem, answer: &mut Answer) {
    let free: Vec<Parameter> = free_of(problem).iter().collect();
    let values = Parameter::ALL.map(|p| answer.parameters.get(p.name()).copied().unwrap_or(0.0));
    let camera = Camera::from_parameters(values);
    let mut information = DMatrix::<f64>::zeros(free.len(), free.len());
    for (pose, view) in answer.poses.iter().flatten().zip(&problem.views) {
        let pose = Pose {
            rotation: Mat3::from_fn(|r, c| pose.rotation[r][c]),
            translation: Vec3::from(pose.translation),
        };
        for &[x, y] in &view.target {
            let Ok(row) = project_with_jacobian(&camera, &pose, &Vec3::new(x, y, 0.0)) else { continue };
            for (i, &a) in free.iter().enumerate() {
                for (j, &b) in free.iter().enumerate() {
                    let (a, b) = (row.intrinsics.column(a as usize), row.intrinsics.column(b as usize));
                    information[(i, j)] += a.dot(&b);
                }
            }
        }
    }
    let rmse = answer.rmse.unwrap_or(0.0);
    let variance = rmse * rmse * problem.points() as f64 / freedom(problem);
    if let (Some(stated), Some(inverse)) = (&mut answer.covariance, information.try_inverse()) {
        stated.matrix = inverse.row_iter().map(|row| row.iter().map(|x| x * variance).collect()).collect();
    }
}

/// Moves fx by `deviations` standard deviations, and every other parameter by what its covariance with fx makes of that: the
/// least conspicuous way to be wrong by that much.
fn biased_together(answer: &mut Answer, deviations: f64) {
    let Some(stated) = &answer.covariance else { return };
    let Some(fx) = stated.parameters.iter().position(|name| name == "fx") else { return };
    for (name, row) in stated.parameters.iter().zip(&stated.matrix) {
        if let Some(value) = answer.parameters.get_mut(name).filter(|_| stated.matrix[fx][fx] > 0.0) {
            *value += deviations * row[fx] / stated.matrix[fx][fx].sqrt();
        }
    }
    (answer.poses, answer.rmse) = (None, None);
}

/// Adds normal noise with `share` of the stated covariance.
fn add_noise(problem: &Problem, answer: &mut Answer, share: f64) {
    (answer.poses, answer.rmse) = (None, None);
    let Some(stated) = &answer.covariance else { return };
    let n = stated.parameters.len();
    let Some(factor) = DMatrix::from_fn(n, n, |i, j| stated.matrix[i][j]).cholesky() else { return };
    let mut stream = Stream::open(StreamKey {
        seed: 0,
        scenario: "",
        trial: fingerprint(problem),
        purpose: "excess variance",
    });
    let white = nalgebra::DVector::from_fn(n, |_, _| stream.normal());
    let step = factor.l() * white * share.sqrt();
    for (name, d) in stated.parameters.iter().zip(step.iter()) {
        if let Some(value) = answer.parameters.get_mut(name) {
            *value += d;
        }
    }
}
