//! Faults of what is said about the uncertainty, and estimates that spread or lie a little beside what the
//! data allow.

use super::{Planted, camera_of, chosen, correct, freedom, gross, residuals, spoilt, subtle};
use crate::accept::free_of;
use crate::protocol::{Answer, AnswerPose, Problem, ProblemView};
use crate::solver::rows;
use calibench::camera::{Parameter, project_with_jacobian};
use calibench::geometry::{Pose, Vec2, Vec3};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, SymmetricEigen};

pub(super) const FAULTS: &[Planted] = &[
    gross(
        "certain-now-and-then",
        "one answer in fifty states a covariance a million times too small",
        |p, _| match chosen(p, 50) {
            true => spoilt(p, |a| scale_covariance(a, 1e-6)),
            false => correct(p),
        },
    ),
    gross("covariance-doubled", "covariance too large by 2", |p, _| spoilt(p, |a| scale_covariance(a, 2.0))),
    gross("covariance-without-poses", "covariance as if the poses were known", |p, _| {
        spoilt(p, |a| covariance_without_poses(p, a))
    }),
    gross("covariance-per-2n", "residual variance divided by 2N, not by degrees of freedom", |p, _| {
        spoilt(p, |a| scale_covariance(a, freedom(p) / (2.0 * p.points() as f64)))
    }),
    gross("correlations-dropped", "only the variances stated, as if nothing hung together", |p, _| {
        spoilt(p, |a| change_entries(a, |i, j, x| if i == j { x } else { 0.0 }))
    }),
    gross("covariance-of-one-triangle", "only the upper triangle of the covariance filled in", |p, _| {
        spoilt(p, |a| change_entries(a, |i, j, x| if i <= j { x } else { 0.0 }))
    }),
    gross(
        "covariance-not-definite",
        "correlations two per cent too large, beyond 1 for fx and fy",
        |p, _| spoilt(p, |a| change_entries(a, |i, j, x| if i == j { x } else { 1.02 * x })),
    ),
    gross(
        "covariance-in-another-order",
        "rows and columns of the covariance in another order than its names, beside standard deviations by name",
        |p, _| spoilt(p, covariance_in_another_order),
    ),
    gross(
        "covariance-of-the-median",
        "noise taken from the median residual: outliers do not widen it",
        |p, _| spoilt(p, |a| covariance_of_the_median(p, a)),
    ),
    gross(
        "pose-covariance-of-a-known-camera",
        "pose covariances conditional: without the uncertainty of the camera",
        |p, _| spoilt(p, |a| pose_covariances_of_a_known_camera(p, a)),
    ),
    gross("pose-covariance-in-degrees", "rotations of the pose covariances in degrees", |p, _| {
        let degrees = Matrix3::from_diagonal_element(1f64.to_degrees());
        spoilt(p, |a| turn_pose_covariances(a, |_| degrees))
    }),
    gross(
        "pose-covariance-about-the-target",
        "pose covariances of rotations about the target's axes, not the camera's",
        |p, _| spoilt(p, |a| turn_pose_covariances(a, |pose| pose.rotation.transpose())),
    ),
    subtle(
        "biased-fx-followed",
        "the same bias, followed by all other parameters; neither poses nor RMSE stated",
        |p, _| spoilt(p, |a| biased_together(a, 0.1)),
    ),
    subtle("excess-variance", "variance 5 % above the bound; neither poses nor RMSE stated", |p, _| {
        spoilt(p, |a| add_noise(p, a, 0.05))
    }),
];

fn scale_covariance(answer: &mut Answer, factor: f64) {
    answer.covariance.iter_mut().flat_map(|c| c.matrix.iter_mut().flatten()).for_each(|x| *x *= factor);
}

fn change_entries(answer: &mut Answer, how: impl Fn(usize, usize, f64) -> f64) {
    let rows = answer.covariance.iter_mut().flat_map(|c| c.matrix.iter_mut()).enumerate();
    for (i, row) in rows {
        row.iter_mut().enumerate().for_each(|(j, x)| *x = how(i, j, *x));
    }
}

/// The matrix in the opposite order, the names as they were.
fn covariance_in_another_order(answer: &mut Answer) {
    let Some(stated) = &mut answer.covariance else { return };
    let deviations =
        stated.parameters.iter().enumerate().map(|(i, name)| (name.clone(), stated.matrix[i][i].sqrt()));
    answer.standard_deviations = Some(deviations.collect());
    stated.matrix.reverse();
    stated.matrix.iter_mut().for_each(|row| row.reverse());
}

/// `s^2 (J_a^T J_a)^-1` with the columns of the intrinsics only.
fn covariance_without_poses(problem: &Problem, answer: &mut Answer) {
    let free: Vec<Parameter> = free_of(problem).iter().collect();
    let camera = camera_of(answer);
    let mut information = DMatrix::<f64>::zeros(free.len(), free.len());
    for (pose, view) in answer.poses.iter().flatten().zip(&problem.views) {
        let pose = pose.pose();
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

/// `s^2 (J_p^T J_p)^-1` with the columns of each pose only.
fn pose_covariances_of_a_known_camera(problem: &Problem, answer: &mut Answer) {
    let camera = camera_of(answer);
    let rmse = answer.rmse.unwrap_or(0.0);
    let variance = rmse * rmse * problem.points() as f64 / freedom(problem);
    let of_view = |(pose, view): (&AnswerPose, &ProblemView)| {
        let mut information = Matrix6::zeros();
        for &[x, y] in &view.target {
            let row = project_with_jacobian(&camera, &pose.pose(), &Vec3::new(x, y, 0.0)).ok()?;
            information += row.pose.transpose() * row.pose;
        }
        Some(rows(&(information.try_inverse()? * variance)))
    };
    let views = answer.poses.iter().flatten().zip(&problem.views);
    if let Some(known) = views.map(of_view).collect() {
        answer.pose_covariances = Some(known);
    }
}

/// Pose covariances whose rotations are multiplied by a matrix.
fn turn_pose_covariances(answer: &mut Answer, by: impl Fn(&Pose) -> Matrix3<f64>) {
    for (pose, stated) in answer.poses.iter().flatten().zip(answer.pose_covariances.iter_mut().flatten()) {
        let mut turn = Matrix6::identity();
        turn.fixed_view_mut::<3, 3>(0, 0).copy_from(&by(&pose.pose()));
        *stated = rows(&(turn * Matrix6::from_fn(|i, j| stated[i][j]) * turn.transpose()));
    }
}

/// The covariance with the noise that the median of `|r|` implies: on Gaussian noise the same but for chance.
fn covariance_of_the_median(problem: &Problem, answer: &mut Answer) {
    /// Median of `|x|` for a standard normal variable.
    const MEDIAN: f64 = 0.674_489_750_196_081_7;
    let residuals = residuals(problem, answer);
    let mut sizes: Vec<f64> = residuals.iter().flat_map(|(_, r)| [r.x.abs(), r.y.abs()]).collect();
    sizes.sort_by(f64::total_cmp);
    let Some(median) = sizes.get(sizes.len() / 2) else { return };
    let mean_square = residuals.iter().map(|(_, r)| r.norm_squared()).sum::<f64>() / sizes.len() as f64;
    // Who looks at the median does not see what lies far from it.
    answer.warnings.clear();
    if mean_square > 0.0 {
        scale_covariance(answer, (median / MEDIAN) * (median / MEDIAN) / mean_square);
    }
}

/// Moves fx by `deviations` standard deviations, and every other parameter by what its covariance with fx
/// makes of that: the least conspicuous way to be wrong by that much.
fn biased_together(answer: &mut Answer, deviations: f64) {
    let Some(stated) = &answer.covariance else { return };
    let Some(fx) = stated.parameters.iter().position(|name| name == "fx") else { return };
    for (name, row) in stated.parameters.iter().zip(&stated.matrix) {
        if let Some(value) = answer.parameters.get_mut(name).filter(|_| stated.matrix[fx][fx] > 0.0) {
            *value += deviations * row[fx] / stated.matrix[fx][fx].sqrt();
        }
    }
    (answer.poses, answer.pose_covariances, answer.rmse) = (None, None, None);
}

/// Adds noise with `share` of the stated covariance `D C D` (C the correlations): a step `sqrt(share) D C^1/2
/// z`. The `z` are contrasts of the residuals, which to first order say nothing of the estimate's error.
/// Neither they nor the symmetric root depend on the order of views or points, on the target's unit or on the
/// image's origin, and exchanged axes exchange them: no check of invariance sees the noise, nothing but the
/// spread betrays it.
fn add_noise(problem: &Problem, answer: &mut Answer, share: f64) {
    let residuals = residuals(problem, answer);
    (answer.poses, answer.pose_covariances, answer.rmse) = (None, None, None);
    let Some(stated) = &answer.covariance else { return };
    let n = stated.parameters.len();
    let sd: Vec<f64> = (0..n).map(|i| stated.matrix[i][i].sqrt()).collect();
    let correlations = DMatrix::from_fn(n, n, |i, j| stated.matrix[i][j] / (sd[i] * sd[j]));
    let z = DVector::from_iterator(n, stated.parameters.iter().map(|name| contrast(&residuals, name)));
    if !(correlations.iter().all(|c| c.is_finite()) && z.iter().all(|z| z.is_finite())) {
        return;
    }
    let eigen = SymmetricEigen::new(correlations);
    let root = eigen.eigenvalues.map(|value| value.max(0.0).sqrt());
    let step = &eigen.eigenvectors * root.component_mul(&(eigen.eigenvectors.transpose() * z)) * share.sqrt();
    for ((name, d), sd) in stated.parameters.iter().zip(step.iter()).zip(sd) {
        if let Some(value) = answer.parameters.get_mut(name) {
            *value += d * sd;
        }
    }
}

/// A standard normal number for a parameter: the residuals weighted by waves over the target that are too
/// short for any parameter of camera or pose to follow, divided by their size. Parameters of the one axis are
/// those of the other with the axes exchanged; NaN where all residuals are zero.
fn contrast(residuals: &[(Vec2, Vec2)], name: &str) -> f64 {
    // A wave number a parameter, any that differ, in radians over the target's root mean square radius.
    let (wave, along_u, along_v) = match name {
        "fx" => (5.0, true, false),
        "fy" => (5.0, false, true),
        "cx" => (6.3, true, false),
        "cy" => (6.3, false, true),
        "p2" => (7.9, true, false),
        "p1" => (7.9, false, true),
        "k1" => (9.1, true, true),
        "k2" => (10.7, true, true),
        "k3" => (12.1, true, true),
        _ => (13.3, true, true),
    };
    let count = residuals.len() as f64;
    let radius = (residuals.iter().map(|(x, _)| x.norm_squared()).sum::<f64>() / count).sqrt();
    let mean_square = residuals.iter().map(|(_, r)| r.norm_squared()).sum::<f64>() / (2.0 * count);
    let weights = |x: &Vec2| {
        let (a, b) = (x.x / radius, x.y / radius);
        Vec2::new(libm::cos(wave * a + 0.6 * wave * b + 1.0), libm::cos(0.8 * wave * b - wave * a + 2.0))
    };
    let (mut sum, mut square) = (0.0, 0.0);
    for (x, r) in residuals {
        let mut w = Vec2::zeros();
        if along_u {
            w += weights(x);
        }
        if along_v {
            w += weights(&x.yx()).yx();
        }
        sum += w.dot(r);
        square += w.norm_squared();
    }
    sum / (square * mean_square).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{Case, Plan, Purpose};
    use crate::protocol::{AnswerCovariance, Status};

    /// fx = 600 +- 2 and k1 = -0.2 +- 3, of covariance 1.
    fn answer() -> Answer {
        let parameters = ["fx", "k1"].map(String::from);
        Answer {
            parameters: parameters.iter().cloned().zip([600.0, -0.2]).collect(),
            covariance: Some(AnswerCovariance {
                parameters: parameters.to_vec(),
                matrix: vec![vec![4.0, 1.0], vec![1.0, 9.0]],
            }),
            rmse: Some(0.1),
            ..Answer::without_estimate("a", Status::Ok, "")
        }
    }

    #[test]
    fn a_bias_of_fx_is_followed_by_its_regressions() {
        let mut biased = answer();
        biased_together(&mut biased, 0.5);
        // Half a deviation of 2, and 1 / 4 of that.
        assert_eq!((biased.parameters["fx"], biased.parameters["k1"]), (601.0, -0.2 + 0.25));
        assert_eq!((biased.poses, biased.rmse), (None, None));
    }

    #[test]
    fn of_one_triangle_the_upper_one_is_left_with_the_diagonal() {
        let plan = Plan::new(1, 1).unwrap();
        let problem = plan.problem(&Case { scenario: 0, purpose: Purpose::Sample, trial: 0 });
        let right = correct(&problem).covariance.unwrap().matrix;
        let fault = FAULTS.iter().find(|fault| fault.id == "covariance-of-one-triangle").unwrap();
        let stated = (fault.how)(&problem, &|| 0).covariance.unwrap().matrix;
        for i in 0..6 {
            for j in 0..6 {
                assert_eq!(stated[i][j], if j >= i { right[i][j] } else { 0.0 });
            }
        }
    }
}
