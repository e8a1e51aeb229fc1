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
    use super::super::tests::{asked_of, with_fault};
    use super::*;
    use crate::plan::{Asked, Case, Plan, Purpose};
    use crate::protocol::{AnswerCovariance, Status};
    use calibench::synth::{Stream, StreamKey, Truth};

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

    /// One view of `target` from a distance of 1 by a pinhole of 600 px, each mark displaced as `by` says;
    /// and an answer that states the camera and the pose without error.
    fn facing(target: &[[f64; 2]], mut by: impl FnMut(usize) -> [f64; 2]) -> (Problem, Answer) {
        let pixel = |(i, [x, y]): (usize, &[f64; 2])| [600.0 * x + by(i)[0], 600.0 * y + by(i)[1]];
        let pixels = target.iter().enumerate().map(pixel).collect();
        let problem = Problem {
            id: "a".into(),
            image_size: [640, 480],
            model: "brown-conrady".into(),
            views: vec![ProblemView { target: target.to_vec(), pixels }],
            free: ["fx", "cx"].map(String::from).to_vec(),
            held: [].into(),
        };
        let rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mut answer = answer();
        answer.parameters.extend(["fx", "fy"].map(|name| (name.to_string(), 600.0)));
        answer.parameters.remove("k1");
        answer.poses = Some(vec![AnswerPose { rotation, translation: [0.0, 0.0, 1.0] }]);
        (problem, answer)
    }

    /// Marks whose x have the sum 0 and the squared sum 12.
    const SIX: [[f64; 2]; 6] = [[-2.0, 0.0], [2.0, 0.0], [-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]];
    /// Six marks of an RMSE of 0.1 px, of which two parameters and a pose leave four degrees of freedom.
    const VARIANCE: f64 = 6.0 * 0.01 / 4.0;

    fn is_near(found: f64, expected: f64) -> bool {
        (found - expected).abs() <= 1e-9 * expected.abs().max(1e-9)
    }

    #[test]
    fn with_known_poses_fx_and_cx_are_a_regression_on_x() {
        let (problem, mut answer) = facing(&SIX, |_| [0.0; 2]);
        answer.covariance.as_mut().unwrap().parameters = problem.free.clone();
        covariance_without_poses(&problem, &mut answer);
        let stated = answer.covariance.unwrap().matrix;
        for (i, j, expected) in [(0, 0, VARIANCE / 12.0), (1, 1, VARIANCE / 6.0), (0, 1, 0.0), (1, 0, 0.0)] {
            assert!(is_near(stated[i][j], expected), "{stated:?}");
        }
    }

    #[test]
    fn the_pose_covariance_of_a_known_camera_is_the_inverse_of_what_the_marks_tell() {
        let (problem, mut answer) = facing(&SIX, |_| [0.0; 2]);
        pose_covariances_of_a_known_camera(&problem, &mut answer);
        let stated = &answer.pose_covariances.unwrap()[0];
        // What a small turn of the target about its origin and a small way make of a mark's pixel.
        let along_u = |[x, y]: [f64; 2]| [-x * y, x * x, -y, 1.0, 0.0, -x].map(|d| 600.0 * d);
        let along_v = |[x, y]: [f64; 2]| [-y * y, x * y, x, 0.0, 1.0, -y].map(|d| 600.0 * d);
        let gradients = || SIX.into_iter().flat_map(|mark| [along_u(mark), along_v(mark)]);
        let information = Matrix6::from_fn(|i, j| gradients().map(|g| g[i] * g[j]).sum::<f64>());
        let product = information * Matrix6::from_fn(|i, j| stated[i][j]);
        assert!((product - VARIANCE * Matrix6::identity()).amax() < 1e-12, "{product}");
    }

    #[test]
    fn a_covariance_is_scaled_as_a_whole() {
        let mut answer = answer();
        scale_covariance(&mut answer, 2.0);
        assert_eq!(answer.covariance.unwrap().matrix, [[8.0, 2.0], [2.0, 18.0]]);
    }

    #[test]
    fn turned_pose_covariances_turn_rotations_and_leave_translations() {
        let (_, mut answer) = facing(&SIX, |_| [0.0; 2]);
        let stated = Matrix6::from_fn(|i, j| if i == j { (i + 1) as f64 } else { 0.1 });
        answer.pose_covariances = Some(vec![rows(&stated)]);
        // A quarter turn about z: the target's x is the camera's y, its y the camera's -x.
        answer.poses.as_mut().unwrap()[0].rotation = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        let mut in_degrees = answer.clone();
        turn_pose_covariances(&mut in_degrees, |_| Matrix3::from_diagonal_element(10.0));
        turn_pose_covariances(&mut answer, |pose| pose.rotation.transpose());
        let found = answer.pose_covariances.unwrap().remove(0);
        assert_eq!([found[0][0], found[1][1], found[2][2], found[5][5]], [2.0, 1.0, 3.0, 6.0]);
        assert_eq!([found[0][1], found[0][3], found[1][3], found[3][4]], [-0.1, 0.1, -0.1, 0.1]);
        let found = in_degrees.pose_covariances.unwrap().remove(0);
        assert_eq!([found[1][1], found[1][2], found[1][4], found[4][4]], [200.0, 10.0, 1.0, 5.0]);
    }

    #[test]
    fn outliers_do_not_widen_the_covariance_of_the_median() {
        // The median of a normal variable's size is 0.67449 of its deviation, here 1.
        let (problem, mut answer) =
            facing(&SIX, |i| if i == 0 { [9.0, -9.0] } else { [0.674_489_750_196_081_7; 2] });
        answer.warnings.push("far off".into());
        covariance_of_the_median(&problem, &mut answer);
        let mean_square = (2.0 * 81.0 + 10.0 * 0.454_936_423_119_573) / 12.0;
        let stated = answer.covariance.unwrap().matrix;
        assert!(is_near(stated[0][0], 4.0 / mean_square) && is_near(stated[0][1], 1.0 / mean_square));
        assert!(answer.warnings.is_empty());
    }

    /// The example's marks, each with a normal residual.
    fn noise(trial: u64) -> Vec<(Vec2, Vec2)> {
        let key = StreamKey { seed: 1, scenario: "contrast", trial, purpose: "noise" };
        let mut stream = Stream::open(key);
        let mut residual = |point| (point, 0.3 * Vec2::new(stream.normal(), stream.normal()));
        Truth::example_board().points().into_iter().map(&mut residual).collect()
    }

    const NAMES: [&str; 10] = ["fx", "fy", "cx", "cy", "p1", "p2", "k1", "k2", "k3", "skew"];

    #[test]
    fn contrasts_are_standard_normal_numbers() {
        for name in NAMES {
            let found: Vec<f64> = (0..400).map(|trial| contrast(&noise(trial), name)).collect();
            let mean = found.iter().sum::<f64>() / 400.0;
            let square = found.iter().map(|z| z * z).sum::<f64>() / 400.0;
            // Standard errors of 0.05 and 0.07.
            assert!(mean.abs() < 0.2 && (square - 1.0).abs() < 0.28, "{name}: {mean} {square}");
        }
        let exact: Vec<(Vec2, Vec2)> = noise(0).iter().map(|(x, _)| (*x, Vec2::zeros())).collect();
        assert!(contrast(&exact, "fx").is_nan());
    }

    #[test]
    fn contrasts_are_exchanged_with_the_axes_and_the_same_in_another_unit() {
        let residuals = noise(0);
        let exchanged: Vec<(Vec2, Vec2)> = residuals.iter().map(|(x, r)| (x.yx(), r.yx())).collect();
        let in_inches: Vec<(Vec2, Vec2)> = residuals.iter().map(|(x, r)| (x / 25.4, *r)).collect();
        let others = ["fy", "fx", "cy", "cx", "p2", "p1", "k1", "k2", "k3", "skew"];
        for (name, other) in NAMES.into_iter().zip(others) {
            let z = contrast(&residuals, name);
            assert!(is_near(contrast(&exchanged, other), z), "{name} {other}");
            assert!(is_near(contrast(&in_inches, name), z), "{name}");
        }
    }

    #[test]
    fn no_contrast_follows_what_a_camera_or_a_pose_could() {
        let smooth: [fn(f64, f64) -> f64; 6] =
            [|_, _| 1.0, |x, _| x, |_, y| y, |x, _| x * x, |x, y| x * y, |_, y| y * y];
        for name in NAMES {
            for (i, field) in smooth.iter().enumerate() {
                for axis in 0..2 {
                    let mut residuals = noise(0);
                    for (point, residual) in &mut residuals {
                        *residual = Vec2::zeros();
                        residual[axis] = field(point.x, point.y);
                    }
                    let z = contrast(&residuals, name);
                    // The squared cosine between residuals and weights.
                    let share = z * z / (2.0 * 63.0);
                    assert!(share < 0.1, "{name}, field {i} along axis {axis}: {share}");
                }
            }
        }
    }

    #[test]
    fn noise_is_added_by_the_symmetric_root_of_the_correlations() {
        let (problem, mut answer) = facing(&SIX, |i| [[0.3, -0.1], [-0.2, 0.4]][i % 2]);
        answer.covariance.as_mut().unwrap().parameters = problem.free.clone();
        answer.parameters.insert("cx".into(), 0.0);
        let z = ["fx", "cx"].map(|name| contrast(&residuals(&problem, &answer), name));
        add_noise(&problem, &mut answer, 0.04);
        // Of deviations 2 and 3 and a correlation of a sixth: the root of ((1, c), (c, 1)) has the sum of
        // sqrt(1 + c) and sqrt(1 - c) beside their difference.
        let (more, less) = ((7.0f64 / 6.0).sqrt(), (5.0f64 / 6.0).sqrt());
        let (same, other) = (0.5 * (more + less), 0.5 * (more - less));
        let fx = 600.0 + 0.2 * 2.0 * (same * z[0] + other * z[1]);
        let cx = 0.2 * 3.0 * (other * z[0] + same * z[1]);
        assert!((answer.parameters["fx"] - fx).abs() < 1e-9, "{:?}", answer.parameters);
        assert!((answer.parameters["cx"] - cx).abs() < 1e-9, "{:?}", answer.parameters);
        assert_eq!((answer.poses, answer.pose_covariances, answer.rmse), (None, None, None));
    }

    #[test]
    fn a_stated_covariance_is_changed_entry_by_entry_as_named() {
        let problem = asked_of("four-pose");
        let right = correct(&problem).covariance.unwrap().matrix;
        let stated = |fault: &str| with_fault(fault, &problem).covariance.unwrap().matrix;
        let check = |fault: &str, expected: &dyn Fn(usize, usize) -> f64| {
            for (i, row) in stated(fault).iter().enumerate() {
                for (j, found) in row.iter().enumerate() {
                    assert!((found - expected(i, j)).abs() <= 1e-12 * right[i][j].abs(), "{fault} {i} {j}");
                }
            }
        };
        let on_diagonal = |i: usize, j: usize| f64::from(u8::from(i == j));
        check("covariance-doubled", &|i, j| 2.0 * right[i][j]);
        // Four views of 63 marks, six parameters.
        check("covariance-per-2n", &|i, j| 474.0 / 504.0 * right[i][j]);
        check("correlations-dropped", &|i, j| on_diagonal(i, j) * right[i][j]);
        check("covariance-not-definite", &|i, j| (1.02 - 0.02 * on_diagonal(i, j)) * right[i][j]);
    }

    #[test]
    fn a_covariance_in_another_order_stands_beside_deviations_in_the_right_one() {
        let mut answer = answer();
        covariance_in_another_order(&mut answer);
        let stated = answer.covariance.unwrap();
        assert_eq!(
            (stated.parameters, stated.matrix),
            (vec!["fx".into(), "k1".into()], vec![vec![9.0, 1.0], vec![1.0, 4.0]])
        );
        let deviations = answer.standard_deviations.unwrap();
        assert_eq!((deviations["fx"], deviations["k1"]), (2.0, 3.0));
    }

    #[test]
    fn rotations_are_told_in_degrees_and_translations_as_they_were() {
        let problem = asked_of("four-pose");
        let last = |answer: Answer| answer.pose_covariances.unwrap().remove(3);
        let (right, found) =
            (last(correct(&problem)), last(with_fault("pose-covariance-in-degrees", &problem)));
        let degrees = 180.0 / std::f64::consts::PI;
        for (i, j, factor) in [(0, 0, degrees * degrees), (2, 4, degrees), (4, 4, 1.0)] {
            assert!((found[i][j] / right[i][j] / factor - 1.0).abs() < 1e-12, "{i} {j}");
        }
    }

    /// The squared distance of an answer's parameters from the right ones, in the stated covariance.
    fn moved(fault: &str, problem: &Problem) -> f64 {
        let (right, found) = (correct(problem), with_fault(fault, problem));
        assert_eq!((found.poses, found.rmse), (None, None));
        let step = |name: &String| found.parameters[name] - right.parameters[name];
        let step = DVector::from_iterator(6, problem.free.iter().map(step));
        let stated = found.covariance.unwrap();
        assert_eq!(stated.parameters, problem.free);
        let covariance = DMatrix::from_fn(6, 6, |i, j| stated.matrix[i][j]);
        step.dot(&covariance.cholesky().unwrap().solve(&step))
    }

    #[test]
    fn a_bias_that_is_followed_is_a_tenth_of_a_deviation_in_all() {
        assert!((moved("biased-fx-followed", &asked_of("four-pose")) - 0.01).abs() < 1e-9);
    }

    #[test]
    fn the_excess_is_a_twentieth_of_every_parameters_variance() {
        let asked = Asked { scenes: vec!["four-pose".into()], ..Asked::default() };
        let plan = Plan::of(1, 32, asked).unwrap();
        let samples = plan.cases.iter().filter(|case| case.purpose == Purpose::Sample);
        let sum: f64 = samples.map(|case| moved("excess-variance", &plan.problem(case))).sum();
        // Chi-squared on six over 32 samples, times 0.05: 9.6 +- 0.98, five standard deviations.
        assert!((4.7..14.5).contains(&sum), "{sum}");
    }
}
