//! Does a minimum explain the marks as well as homographies of their own would, behind the same lens?
//!
//! The certificate of Brown-Conrady's lens (`calibrate/certificate.rs`) for any lens: a board that may also
//! be strained in its plane has a free homography in place of a pose, and nothing in that model is ambiguous
//! but the lens itself. At a minimum its gradient is left in the two strains of each board. With poses and
//! shared unknowns eliminated from the strains' columns, `T = g^T (E^T E)^-1 g` is what the cost would fall
//! by to first order (Rao's score test), and `(T / d1) / (F / d2)` with `F = cost - T` follows Fisher's
//! distribution where the minimum is the right one and the model holds.
//!
//! It spares starts, and says nothing to the user: what it does not see is another minimum of the lens's own
//! coefficients.

use super::super::Loss;
use super::super::certificate::FALSE_ALARM;
use super::super::chance::fisher_tail;
use super::super::elimination::Eliminated;
use super::super::minimise::Minimum;
use super::super::system::Reduction;
use super::WIDTH;
use super::kernel;
use super::marks::Marks;
use super::problem::{Problem, State};
use crate::camera::{Model, Parameter};
use crate::geometry::lanes::LANES;
use crate::geometry::{Pose, Vec3};
use nalgebra::{DMatrix, DVector};

/// With fewer degrees of freedom the excess tells too little.
const TELLING: usize = 4;
/// Where the focal length is known worse than this part of itself, another minimum may be as good within
/// noise.
const WELL_KNOWN: f64 = 0.01;
/// A strain of which less than this part is left once the pose follows is rounding.
const SMALLEST_SHARE: f64 = 1e-11;
/// Homographies leave some shared unknowns undetermined; this part of their information stands for none.
const UNTOLD: f64 = 1e-9;

/// For which models a certified minimum spares starts, and poses are refined alone ([`super::resection`]): a
/// polynomial of the angle, and a division by one term, whose picture tells the coefficients.
///
/// Beside a fraction's minimum and that of two spheres there are others of the same lens, of which the
/// certificate says nothing, and other starts lead to others of them. Measured with the experiment
/// lens-minimum: 11 of 700 rational scenes ended higher by more than a hundredth of a noise variance, and 5
/// of 2000 double spheres, where 3 ended lower. So these models, prisms and tilted sensors among them, start
/// as if there were no certificate, to the same bits. Brown-Conrady's lens has a certificate of its own.
pub(super) fn counts_for(model: Model) -> bool {
    matches!(model, Model::KannalaBrandt | Model::Division | Model::HalconPolynomial)
}

/// Whether a minimum of least squares without priors explains the marks as well as free homographies would,
/// behind a lens that it [`counts_for`].
pub(super) fn holds(problem: &Problem<'_>, minimum: &Minimum<State, WIDTH>) -> bool {
    use Parameter::{Cx, Cy, Fx, Fy, Skew};
    if !problem.is_certifiable
        || problem.loss != Loss::Squares
        || !problem.priors.is_empty()
        || problem.bend.is_some()
    {
        return false;
    }
    let views = problem.views.len();
    let coordinates = 2 * problem.views.iter().map(Marks::len).sum::<usize>();
    // Homographies may leave all of these undetermined: to count them so certifies less.
    let untold = [Fx, Fy, Cx, Cy, Skew].into_iter().filter(|&p| problem.free.contains(p)).count();
    let freedom = (2 * views).saturating_sub(untold);
    let floor_freedom = coordinates.saturating_sub(8 * views + problem.free.len());
    if freedom < TELLING || floor_freedom == 0 {
        return false;
    }
    let Some(reduction) = minimum.system.reduction() else { return false };
    let Some(gain) = score(problem, &minimum.state, &reduction) else { return false };
    let cost = minimum.system.cost;
    let floor = (cost - gain).max(problem.rounding_cost).min(cost);
    let ratio = ((cost - floor) / freedom as f64) / (floor / floor_freedom as f64);
    let variance = floor / floor_freedom as f64;
    fisher_tail(ratio, freedom, floor_freedom) >= FALSE_ALARM
        && is_well_known(problem, &minimum.state, &reduction, variance)
}

fn is_well_known(problem: &Problem<'_>, state: &State, reduction: &Reduction<WIDTH>, variance: f64) -> bool {
    let Some(row) = problem.free.position(Parameter::Fx) else { return true };
    reduction
        .intrinsics_covariance()
        .is_some_and(|unit| (unit[(row, row)] * variance).sqrt() <= WELL_KNOWN * state.camera.fx)
}

/// `T`; `None` where the lens has no image of a mark, or what is left of the shared unknowns is no
/// information.
fn score(problem: &Problem<'_>, state: &State, reduction: &Reduction<WIDTH>) -> Option<f64> {
    let columns = problem.columns(state);
    let n = reduction.schur.nrows();
    let mut matrix = reduction.schur.clone();
    for i in 0..n {
        matrix[(i, i)] *= 1.0 + UNTOLD;
    }
    let mut right = DVector::zeros(n);
    let mut gain = 0.0;
    for (view, marks) in problem.views.iter().enumerate() {
        let rows = kernel::rows_of_view(&problem.view(state, &columns, view))?;
        let residuals = residuals(state, view, marks)?;
        let strains = strains(&rows, marks, &state.cam_from_target[view]);
        for Left { coupling, gradient } in left(&rows, &residuals, strains, &reduction.eliminated[view], n) {
            matrix.ger(-1.0, &coupling, &coupling, 1.0);
            right.axpy(gradient, &coupling, 1.0);
            gain += gradient * gradient;
        }
    }
    if n == 0 {
        return Some(gain);
    }
    let through_lens = matrix.cholesky()?.solve(&right);
    Some(gain + right.dot(&through_lens))
}

/// The row of a mark's u in [`kernel::rows_of_view`]; that of v is [`LANES`] further.
fn row_of_u(mark: usize) -> usize {
    2 * LANES * (mark / LANES) + mark % LANES
}

/// The weighted residuals, in the places of [`kernel::rows_of_view`].
fn residuals(state: &State, view: usize, marks: &Marks) -> Option<DVector<f64>> {
    let mut residuals = DVector::zeros(2 * LANES * marks.blocks.len());
    for (i, mark) in marks.list.iter().enumerate() {
        let residual = mark.weight * (state.pixel(view, mark)? - mark.pixel);
        residuals[row_of_u(i)] = residual.x;
        residuals[row_of_u(i) + LANES] = residual.y;
    }
    Some(residuals)
}

/// The columns of a board's two strains, `X` longer and `Y` shorter, and the right angle between them bent:
/// the points move by `R (X, -Y, 0)` and `R (Y, X, 0)`, the pixels as with a translation by that.
fn strains(rows: &DMatrix<f64>, marks: &Marks, pose: &Pose) -> [DVector<f64>; 2] {
    let (right, down): (Vec3, Vec3) = (pose.rotation.column(0).into(), pose.rotation.column(1).into());
    let mut columns = [DVector::zeros(rows.nrows()), DVector::zeros(rows.nrows())];
    for (i, mark) in marks.list.iter().enumerate() {
        let (x, y) = (mark.point.x, mark.point.y);
        for (column, moved) in columns.iter_mut().zip([x * right - y * down, y * right + x * down]) {
            for row in [row_of_u(i), row_of_u(i) + LANES] {
                column[row] = (0..3).map(|k| rows[(row, 3 + k)] * moved[k]).sum();
            }
        }
    }
    columns
}

/// A combination of a view's strains of unit length once the pose is eliminated: its products with the shared
/// unknowns and with the residuals.
struct Left {
    coupling: DVector<f64>,
    gradient: f64,
}

/// What is left of the strains of a view, by Gram and Schmidt; one that the pose or the other strain follows
/// says nothing.
fn left(
    rows: &DMatrix<f64>,
    residuals: &DVector<f64>,
    strains: [DVector<f64>; 2],
    pose: &Eliminated<WIDTH>,
    n: usize,
) -> Vec<Left> {
    let mut found: Vec<(DVector<f64>, [f64; 6], Left)> = Vec::new();
    for strain in strains {
        let whole = strain.norm_squared();
        let whitened = pose.whiten(std::array::from_fn(|k| rows.column(k).dot(&strain)));
        let through_pose = pose.coupled(&whitened, n);
        let mut square = whole - whitened.iter().map(|w| w * w).sum::<f64>();
        let mut coupling = DVector::from_fn(n, |k, _| rows.column(6 + k).dot(&strain) - through_pose[k]);
        let mut gradient = strain.dot(residuals);
        for (other, other_whitened, Left { coupling: others, gradient: of_other }) in &found {
            let in_common = whitened.iter().zip(other_whitened).map(|(a, b)| a * b).sum::<f64>();
            let along = strain.dot(other) - in_common;
            coupling.axpy(-along, others, 1.0);
            gradient -= along * of_other;
            square -= along * along;
        }
        if square > SMALLEST_SHARE * whole {
            let unit = 1.0 / square.sqrt();
            let left = Left { coupling: unit * coupling, gradient: unit * gradient };
            found.push((unit * strain, whitened.map(|w| unit * w), left));
        }
    }
    found.into_iter().map(|(.., left)| left).collect()
}

#[cfg(test)]
mod tests {
    use super::super::super::minimise::descend;
    use super::super::super::settings::Bend;
    use super::super::fixture::{FREE, at_minimum};
    use super::*;
    use crate::camera::FreeParameters;

    #[test]
    fn a_right_minimum_is_certified_and_one_with_a_wrong_focal_length_is_not() {
        let free = FreeParameters::of(&FREE);
        assert!(at_minimum(free, 1.0, holds));
        let held = free.without(Parameter::Fx).without(Parameter::Fy);
        assert!(at_minimum(held, 1.0, holds));
        assert!(!at_minimum(held, 1.01, holds));
    }

    #[test]
    fn the_score_is_what_the_whole_relaxed_model_promises() {
        at_minimum(FreeParameters::of(&FREE), 1.0, |problem, minimum| {
            let State { cam_from_target, .. } = &minimum.state;
            let columns = problem.columns(&minimum.state);
            let (n, count) = (FREE.len(), problem.views.len());
            // All columns beside each other: shared, poses, strains.
            let mut jacobian = DMatrix::zeros(0, n + 8 * count);
            let mut residual = DVector::zeros(0);
            for (view, marks) in problem.views.iter().enumerate() {
                let rows = kernel::rows_of_view(&problem.view(&minimum.state, &columns, view)).unwrap();
                let at = jacobian.nrows();
                jacobian = jacobian.resize_vertically(at + rows.nrows(), 0.0);
                residual = residual.resize_vertically(at + rows.nrows(), 0.0);
                jacobian.view_mut((at, 0), (rows.nrows(), n)).copy_from(&rows.columns(6, n));
                jacobian.view_mut((at, n + 8 * view), (rows.nrows(), 6)).copy_from(&rows.columns(0, 6));
                for (k, strain) in strains(&rows, marks, &cam_from_target[view]).iter().enumerate() {
                    jacobian.view_mut((at, n + 8 * view + 6 + k), (rows.nrows(), 1)).copy_from(strain);
                }
                residual
                    .rows_mut(at, rows.nrows())
                    .copy_from(&residuals(&minimum.state, view, marks).unwrap());
            }
            let decomposed = jacobian.clone().svd(true, true);
            let step = decomposed.solve(&residual, 1e-9 * decomposed.singular_values.max()).unwrap();
            let promised = (jacobian * step).norm_squared();
            let score = score(problem, &minimum.state, &minimum.system.reduction().unwrap()).unwrap();
            // What homographies leave undetermined is damped there and left out here.
            assert!((score / promised - 1.0).abs() < 1e-2, "{score} {promised}");
            // Four degrees of freedom at the least, ten at the most, each worth 0.01 px^2.
            assert!((0.005..0.4).contains(&score), "{score}");
        });
    }

    #[test]
    fn the_columns_of_the_strains_agree_with_central_differences() {
        at_minimum(FreeParameters::of(&FREE), 1.0, |problem, minimum| {
            let state = &minimum.state;
            let columns = problem.columns(state);
            for (view, marks) in problem.views.iter().enumerate() {
                let rows = kernel::rows_of_view(&problem.view(state, &columns, view)).unwrap();
                let found = strains(&rows, marks, &state.cam_from_target[view]);
                for (i, mark) in marks.list.iter().enumerate() {
                    let h = 1e-6;
                    // Longer in X and shorter in Y, and the right angle bent.
                    let [x, y] = [mark.point.x, mark.point.y];
                    for (column, by) in found.iter().zip([[x, -y], [y, x]]) {
                        let pixel = |step: f64| {
                            let mut moved = *mark;
                            (moved.point.x, moved.point.y) = (x + step * by[0], y + step * by[1]);
                            state.pixel(view, &moved).unwrap()
                        };
                        let expected = (pixel(h) - pixel(-h)) / (2.0 * h);
                        let own = [column[row_of_u(i)], column[row_of_u(i) + LANES]];
                        assert!(
                            (own[0] - expected.x).abs() + (own[1] - expected.y).abs() < 1e-5,
                            "{own:?} {expected}"
                        );
                    }
                }
            }
        });
    }

    #[test]
    fn a_minimum_is_certified_as_long_as_chance_explains_its_excess() {
        let held = FreeParameters::of(&FREE).without(Parameter::Fx).without(Parameter::Fy);
        let cost =
            |factor: f64, free: FreeParameters| at_minimum(free, factor, |_, minimum| minimum.system.cost);
        // The least of all, up to the excess of a few degrees of freedom.
        let least = cost(1.0, FreeParameters::of(&FREE));
        let mut seen = [0; 2];
        for k in 0..40 {
            let factor = 1.0 + 2.5e-4 * f64::from(k);
            let excess = (cost(factor, held) - least) / 0.01;
            // With eight degrees of freedom chi-squared is 43 with a probability of one in a million.
            if !(30.0..65.0).contains(&excess) && excess < 95.0 {
                assert_eq!(at_minimum(held, factor, holds), excess < 30.0, "{factor}: {excess}");
                seen[usize::from(excess < 30.0)] += 1;
            }
        }
        assert!(seen[0] > 0 && seen[1] > 0, "{seen:?}");
    }

    #[test]
    fn a_board_that_is_not_flat_is_not_certified() {
        at_minimum(FreeParameters::of(&FREE), 1.0, |problem, minimum| {
            let bend = Some(Bend { deformations: 2, standard_deviation: f64::INFINITY });
            assert!(!holds(&Problem { bend, ..*problem }, minimum));
        });
    }

    #[test]
    fn a_focal_length_is_well_known_to_a_hundredth_of_itself() {
        at_minimum(FreeParameters::of(&FREE), 1.0, |problem, minimum| {
            let reduction = minimum.system.reduction().unwrap();
            let unit = reduction.intrinsics_covariance().unwrap()[(0, 0)];
            for (relative, is_known) in [(0.0098, true), (0.0102, false)] {
                let deviation = relative * minimum.state.camera.fx;
                let variance = deviation * deviation / unit;
                assert_eq!(is_well_known(problem, &minimum.state, &reduction, variance), is_known);
            }
        });
    }

    #[test]
    fn few_views_certify_nothing() {
        at_minimum(FreeParameters::of(&FREE), 1.0, |problem, minimum| {
            // Six strains, of which four parameters may take up as many.
            let three = Problem { views: &problem.views[..3], ..*problem };
            let mut state = minimum.state.clone();
            state.cam_from_target.truncate(3);
            assert!(!holds(&three, &descend(&three, state)));
        });
    }
}
