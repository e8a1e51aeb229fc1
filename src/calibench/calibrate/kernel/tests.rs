//! The kernel against its definition, and wide registers against plain code.

use super::*;
use crate::camera::{FreeParameters, project_with_jacobian};
use crate::geometry::lanes::run_portable;
use crate::geometry::{Vec2, Vec3, rotation};

fn pose() -> Pose {
    Pose { rotation: rotation::from_xyz_rad(0.3, -0.4, 0.2), translation: Vec3::new(5.0, -7.0, 150.0) }
}

fn full_camera() -> Camera {
    Camera::from_parameters([600.0, 580.0, 326.0, 243.0, 1.5, -0.2, 0.05, 1e-3, -2e-3, 0.01])
}

fn radial_camera() -> Camera {
    Camera::from_parameters([600.0, 580.0, 326.0, 243.0, 0.0, -0.2, 0.05, 0.0, 0.0, 0.0])
}

#[test]
fn the_kernel_agrees_with_the_readable_jacobian() {
    fn check<const RADIAL: bool>(camera: &Camera) {
        for point in [Vec2::new(-40.0, 30.0), Vec2::new(13.0, 0.0), Vec2::new(0.0, -21.0)] {
            let kernel = rows::<f64, RADIAL>(&Model::new(camera, &pose()), point.x, point.y);
            let plain = project_with_jacobian(camera, &pose(), &Vec3::new(point.x, point.y, 0.0)).unwrap();
            // Same formulas in another order: a few ulp of the largest entry, a focal length.
            assert!((Vec2::from(kernel.pixel) - plain.pixel).norm() < 1e-12);
            let mut columns: Vec<(Vec2, Vec2)> = Vec::new();
            for i in 0..6 {
                columns.push((Vec2::new(kernel.u[i], kernel.v[i]), plain.pose.column(i).into()));
            }
            let [x, y] = kernel.distorted;
            let linear = [[x, 0.0], [0.0, y], [1.0, 0.0], [0.0, 1.0], [y, 0.0]].map(Vec2::from);
            for i in 0..if RADIAL { 7 } else { 10 } {
                let own = if i < 5 { linear[i] } else { Vec2::new(kernel.u[i + 1], kernel.v[i + 1]) };
                columns.push((own, plain.intrinsics.column(i).into()));
            }
            for (own, expected) in columns {
                assert!((own - expected).amax() < 1e-11, "{own} for {expected}");
            }
        }
    }
    check::<true>(&radial_camera());
    check::<false>(&full_camera());
}

/// Pairs a fraction of a pixel from their prediction.
fn pairs(camera: &Camera, count: usize) -> PairBlocks {
    PairBlocks::new((0..count).map(|i| {
        let point = Vec2::new((i % 9) as f64 * 10.0 - 40.0, (i / 9) as f64 * 10.0 - 30.0);
        let seen = camera.project(&pose().apply(&Vec3::new(point.x, point.y, 0.0))).unwrap();
        let offset = Vec2::new(libm::sin(7.0 * i as f64), libm::cos(11.0 * i as f64)) * 0.3;
        (point, seen + offset)
    }))
}

/// The sums as they are defined: `sum w J^T J`, `sum w J^T r` and the cost over ten intrinsics and six pose
/// parameters.
fn plain_sums(camera: &Camera, pairs: &PairBlocks, loss: Loss) -> ([[f64; 16]; 16], [f64; 16], f64) {
    let (mut square, mut gradient, mut cost) = ([[0.0; 16]; 16], [0.0; 16], 0.0);
    for (point, pixel) in pairs.iter() {
        let at = project_with_jacobian(camera, &pose(), &Vec3::new(point.x, point.y, 0.0)).unwrap();
        let r = at.pixel - pixel;
        let (rho, weight) = loss.at(r.norm_squared());
        cost += rho;
        let column = |i: usize| -> Vec2 {
            if i < 10 { at.intrinsics.column(i).into() } else { at.pose.column(i - 10).into() }
        };
        for i in 0..16 {
            gradient[i] += weight * column(i).dot(&r);
            for j in 0..16 {
                square[i][j] += weight * column(i).dot(&column(j));
            }
        }
    }
    (square, gradient, cost)
}

#[test]
fn the_sums_are_those_of_the_definition_for_every_model_and_loss() {
    let standard = FreeParameters::STANDARD;
    let all = FreeParameters::of(&Parameter::ALL);
    let losses = [Loss::Squares, Loss::Huber { delta_px: 0.2 }, Loss::Cauchy { scale_px: 0.2 }];
    for (camera, free) in [(radial_camera(), standard), (full_camera(), all)] {
        for loss in losses {
            let pairs = pairs(&camera, 63);
            let mut sums = NO_SUMS;
            view_sums(&camera, &pose(), &pairs, loss, is_radial(&camera, free), &mut sums).unwrap();
            let (square, slope, expected_cost) = plain_sums(&camera, &pairs, loss);
            // A sum of 126 products errs by at most 126 roundings of the sum of sizes, here by
            // Cauchy-Schwarz.
            let close = |own: f64, i: usize, j: usize| {
                let scale = (square[i][i] * square[j][j]).sqrt();
                assert!((own - square[i][j]).abs() <= 126.0 * f64::EPSILON * scale, "{loss:?} ({i}, {j})");
            };
            let slope_close = |own: f64, i: usize| {
                let scale = (square[i][i] * expected_cost).sqrt();
                assert!(
                    (own - slope[i]).abs() <= 126.0 * f64::EPSILON * (scale + slope[i].abs()) + 1e-9 * scale
                );
            };
            for a in free.iter() {
                for b in free.iter() {
                    let (row, column) = INTRINSICS_SLOTS[a as usize][b as usize];
                    close(sums[usize::from(row)][usize::from(column)], a as usize, b as usize);
                }
                slope_close(gradient(&sums, a), a as usize);
                for i in 0..6 {
                    close(coupling(&sums, a, i), a as usize, 10 + i);
                }
            }
            for i in 0..6 {
                slope_close(pose_gradient(&sums, i), 10 + i);
                for j in i..6 {
                    close(sums[i][j], 10 + i, 10 + j);
                }
            }
            assert!((cost(&sums) - expected_cost).abs() <= 1e-9 * expected_cost);
        }
    }
}

#[test]
fn wide_registers_give_the_bits_of_plain_code() {
    let bits = |sums: Sums| sums.map(|row| row.map(f64::to_bits));
    fn compare<const Q: usize, const RADIAL: bool, const ROBUST: bool>(view: View<'_>) -> [Sums; 2] {
        let (mut wide, mut plain) = (NO_SUMS, NO_SUMS);
        dispatch(ViewSums::<Q, RADIAL, ROBUST>(view, &mut wide)).unwrap();
        run_portable(ViewSums::<Q, RADIAL, ROBUST>(view, &mut plain)).unwrap();
        [wide, plain]
    }
    for count in [60, 61, 62, 63] {
        let (radial, full) = (radial_camera(), full_camera());
        let pose = pose();
        let view = |camera, pairs, loss| View { camera, cam_from_target: &pose, pairs, loss };
        let (near, far) = (pairs(&radial, count), pairs(&full, count));
        for [wide, plain] in [
            compare::<SHARED_RADIAL, true, false>(view(&radial, &near, Loss::Squares)),
            compare::<SHARED, false, false>(view(&full, &far, Loss::Squares)),
            compare::<SHARED, false, true>(view(&full, &far, Loss::Cauchy { scale_px: 0.1 })),
        ] {
            assert_eq!(bits(wide), bits(plain));
        }
        let (wide, plain) = (
            dispatch(Residuals(view(&full, &far, Loss::Squares))),
            run_portable(Residuals(view(&full, &far, Loss::Squares))),
        );
        assert_eq!(wide.residuals, plain.residuals);
        assert_eq!(wide.square.to_bits(), plain.square.to_bits());
    }
}

#[test]
fn a_point_behind_the_camera_has_no_sums_and_an_infinite_residual() {
    let camera = radial_camera();
    let pairs = pairs(&camera, 6);
    let behind = Pose { translation: Vec3::new(0.0, 0.0, -1.0), ..pose() };
    assert!(view_sums(&camera, &behind, &pairs, Loss::Squares, true, &mut NO_SUMS.clone()).is_none());
    let found = view_residuals(&camera, &behind, &pairs);
    assert_eq!(found.residuals.len(), 6);
    assert!(found.residuals.iter().any(|r| r.x == f64::INFINITY) && found.square == f64::INFINITY);
}

#[test]
fn strains_are_those_of_the_definition_for_every_model_and_loss() {
    let losses = [Loss::Squares, Loss::Huber { delta_px: 0.2 }, Loss::Cauchy { scale_px: 0.2 }];
    for (camera, free) in
        [(radial_camera(), FreeParameters::STANDARD), (full_camera(), FreeParameters::of(&Parameter::ALL))]
    {
        for loss in losses {
            let pairs = pairs(&camera, 63);
            let found = view_strain(&camera, &pose(), &pairs, loss, is_radial(&camera, free));
            let r = pose().rotation;
            let (mut square, mut gradient) = ([0.0; 3], [0.0; 2]);
            let (mut of_pose, mut intrinsics) = ([[0.0; 6]; 2], [[0.0; Parameter::COUNT]; 2]);
            for (point, pixel) in pairs.iter() {
                let at = project_with_jacobian(&camera, &pose(), &Vec3::new(point.x, point.y, 0.0)).unwrap();
                // d X_c / d a = r1 x - r2 y, d X_c / d b = r2 x + r1 y; the last three columns are by X_c.
                let by_point = at.pose.fixed_columns::<3>(3);
                let columns: [Vec2; 2] = [
                    by_point * (r.column(0) * point.x - r.column(1) * point.y),
                    by_point * (r.column(1) * point.x + r.column(0) * point.y),
                ];
                let residual = at.pixel - pixel;
                let weight = loss.at(residual.norm_squared()).1;
                for (sum, (i, j)) in square.iter_mut().zip([(0, 0), (0, 1), (1, 1)]) {
                    *sum += weight * columns[i].dot(&columns[j]);
                }
                for k in 0..2 {
                    gradient[k] += weight * columns[k].dot(&residual);
                    (0..6).for_each(|i| of_pose[k][i] += weight * columns[k].dot(&at.pose.column(i)));
                    for p in free.iter().map(|p| p as usize) {
                        intrinsics[k][p] += weight * columns[k].dot(&at.intrinsics.column(p));
                    }
                }
            }
            // Products of columns of size about 100 to 10000, summed over 63 marks.
            let close = |own: f64, expected: f64| {
                assert!((own - expected).abs() < 1e-9 * (1.0 + expected.abs()), "{loss:?}: {own} {expected}");
            };
            (0..3).for_each(|i| close(found.square[i], square[i]));
            for k in 0..2 {
                close(found.gradient[k], gradient[k]);
                (0..6).for_each(|i| close(found.pose[k][i], of_pose[k][i]));
                free.iter().for_each(|p| close(found.intrinsics[k][p as usize], intrinsics[k][p as usize]));
            }
        }
    }
}

#[test]
fn residuals_are_those_of_the_readable_projection() {
    let (camera, blocks) = (full_camera(), pairs(&full_camera(), 63));
    let found = view_residuals(&camera, &pose(), &blocks).residuals;
    for ((point, pixel), own) in blocks.iter().zip(found) {
        let expected = camera.project(&pose().apply(&Vec3::new(point.x, point.y, 0.0))).unwrap() - pixel;
        assert!((own - expected).norm() < 1e-11, "{own} {expected}");
    }
}

#[test]
fn a_camera_is_radial_where_all_other_terms_are_held_at_none() {
    let free = FreeParameters::STANDARD;
    assert!(is_radial(&radial_camera(), free) && !is_radial(&full_camera(), free));
    assert!(!is_radial(&radial_camera(), free.with(Parameter::P1)));
}
