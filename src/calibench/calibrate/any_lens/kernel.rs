//! What are the sums over the marks of a view, for a lens of any model? Four marks at a time.
//!
//! Columns of a mark's Jacobian: six of the pose, then the unknowns that all views share, then the residual.
//! All products of two columns are summed; the sums are the blocks of the normal equations.
#![allow(clippy::needless_range_loop, reason = "indices are those of the equations")]

use super::super::Loss;
use super::super::blocks::{Intrinsics, ViewBlock};
use super::WIDTH;
use super::marks::{Block, Marks};
use crate::camera::{Camera, FreeParameters, Lens, LensModel, LensVisitor, Parameter, visit};
use crate::geometry::Pose;
use crate::geometry::lanes::{Kernel, LANES, Lanes, dispatch};
use nalgebra::{DMatrix, SMatrix, SVector};

/// Pose, shared unknowns, residual, in whole lanes.
const COLUMNS: usize = 32;
/// Derivatives that a mark has by all that views may share: five linear parameters, a lens's coefficients,
/// three deformations.
const LINEAR: usize = 5;
const DEFORMATIONS: usize = 3;
const MOST: usize = LINEAR + 14 + DEFORMATIONS;

/// Which of a mark's derivatives are columns, and in which order.
#[derive(Debug, Clone)]
pub(super) struct Columns {
    places: Vec<usize>,
    /// fy over fx, if fx is free and fy tied to it.
    fy_per_fx: Option<f64>,
}

impl Columns {
    /// No shared unknown.
    pub const NONE: Columns = Columns { places: Vec::new(), fy_per_fx: None };

    /// The free parameters in order, then so many deformations of the board.
    pub fn of(lens: &Lens, free: FreeParameters, fy_per_fx: Option<f64>, deformations: usize) -> Columns {
        let coefficients = lens.model().coefficients();
        let place = |parameter: Parameter| match coefficients.iter().position(|&p| p == parameter) {
            Some(k) => LINEAR + k,
            None => parameter as usize,
        };
        let behind = LINEAR + coefficients.len();
        let places = free.iter().map(place).chain(behind..behind + deformations).collect();
        Columns { places, fy_per_fx: fy_per_fx.filter(|_| free.contains(Parameter::Fx)) }
    }
}

/// The shared unknowns' part of some views.
pub(super) struct Share {
    pub square: Intrinsics<WIDTH>,
    pub gradient: SVector<f64, WIDTH>,
    pub cost: f64,
    products: Products,
}

impl Share {
    pub fn zero() -> Share {
        Share {
            square: Intrinsics::zeros(),
            gradient: SVector::zeros(),
            cost: 0.0,
            products: Products::default(),
        }
    }
}

/// Products of a view's columns, upper triangle, row by row: as large as the view needs, for it is cleared
/// for each.
#[derive(Default)]
struct Products {
    /// Length of a row, in whole lanes.
    stride: usize,
    lanes: Vec<[f64; LANES]>,
    sums: Vec<f64>,
}

impl Products {
    fn clear(&mut self, columns: usize) {
        self.stride = columns.next_multiple_of(LANES);
        let entries = columns * self.stride;
        self.lanes.clear();
        self.lanes.resize(entries, [0.0; LANES]);
        self.sums.resize(entries, 0.0);
    }

    /// Adds the products of four marks' columns of u and v: two rows at a time, which read a column once.
    #[inline(always)]
    fn add<L: Lanes>(&mut self, u: &[L], v: &[L]) {
        for (pair, rows) in self.lanes.chunks_mut(2 * self.stride).enumerate() {
            let i = 2 * pair;
            let (first, second) = rows.split_at_mut(self.stride);
            let length = u.len() - i;
            let (u, v, first) = (&u[i..][..length], &v[i..][..length], &mut first[i..][..length]);
            if second.is_empty() {
                for k in 0..length {
                    first[k] = (L::load(&first[k]) + (u[0] * u[k] + v[0] * v[k])).store();
                }
                continue;
            }
            let second = &mut second[i..][..length];
            let ([u0, u1], [v0, v1]) = ([u[0], u[1]], [v[0], v[1]]);
            for k in 0..length {
                first[k] = (L::load(&first[k]) + (u0 * u[k] + v0 * v[k])).store();
                second[k] = (L::load(&second[k]) + (u1 * u[k] + v1 * v[k])).store();
            }
        }
    }

    /// Adds up the lanes.
    #[inline(always)]
    fn add_up<L: Lanes>(&mut self) {
        let rows = self.lanes.chunks_exact(self.stride).zip(self.sums.chunks_exact_mut(self.stride));
        for (i, (lanes, sums)) in rows.enumerate() {
            let from = i / LANES * LANES;
            for (four, sums) in lanes[from..].chunks_exact(LANES).zip(sums[from..].chunks_exact_mut(LANES)) {
                sums.copy_from_slice(&L::sums(std::array::from_fn(|k| L::load(&four[k]))));
            }
        }
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        self.sums[i * self.stride + j]
    }
}

/// A view and what is asked of it.
pub(super) struct View<'a> {
    pub camera: &'a Camera<Lens>,
    pub cam_from_target: &'a Pose,
    pub shape: &'a [f64; 3],
    pub marks: &'a Marks,
    pub loss: Loss,
    pub columns: &'a Columns,
}

/// The weighted rows of a view's Jacobian: pose, then what views share. `None` where the lens has no image of
/// a mark.
pub(super) fn rows_of_view(view: &View<'_>) -> Option<DMatrix<f64>> {
    visit(&view.camera.distortion, RowsOfModel { view })
}

struct RowsOfModel<'a, 'b> {
    view: &'a View<'b>,
}

impl LensVisitor for RowsOfModel<'_, '_> {
    type Output = Option<DMatrix<f64>>;

    fn run<M: LensModel<P>, const P: usize>(self, coefficients: [f64; P]) -> Self::Output {
        dispatch(Jacobian::<M, P> { view: self.view, coefficients, model: std::marker::PhantomData })
    }
}

struct Jacobian<'a, 'b, M, const P: usize> {
    view: &'a View<'b>,
    coefficients: [f64; P],
    model: std::marker::PhantomData<M>,
}

impl<M: LensModel<P>, const P: usize> Kernel for Jacobian<'_, '_, M, P> {
    type Output = Option<DMatrix<f64>>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let View { marks, columns, .. } = *self.view;
        let constants = M::constants(self.coefficients.map(L::splat));
        let count = 6 + columns.places.len();
        let mut jacobian = DMatrix::zeros(2 * LANES * marks.blocks.len(), count);
        let mut rows = Rows::zero();
        for (place, block) in marks.blocks.iter().enumerate() {
            fill_rows::<L, M, P>(self.view, &constants, block, &mut rows);
            weigh(self.view, block, &mut rows, count)?;
            for (half, row) in rows.columns.iter().enumerate() {
                for (column, lanes) in row[..count].iter().enumerate() {
                    let first = LANES * (2 * place + half);
                    jacobian.view_mut((first, column), (LANES, 1)).copy_from_slice(&lanes.store());
                }
            }
        }
        Some(jacobian)
    }
}

/// Adds the sums of a view. `None` where the lens has no image of a mark.
pub(super) fn add_view(view: &View<'_>, share: &mut Share, block: &mut ViewBlock<WIDTH>) -> Option<()> {
    visit(&view.camera.distortion, OfModel { view, share, block })
}

struct OfModel<'a, 'b> {
    view: &'a View<'b>,
    share: &'a mut Share,
    block: &'a mut ViewBlock<WIDTH>,
}

impl LensVisitor for OfModel<'_, '_> {
    type Output = Option<()>;

    fn run<M: LensModel<P>, const P: usize>(self, coefficients: [f64; P]) -> Option<()> {
        let OfModel { view, share, block } = self;
        let Share { products, .. } = share;
        let sums = Sums::<M, P> { view, coefficients, products, model: std::marker::PhantomData };
        share.cost += dispatch(sums)?;
        spread(view.columns.places.len(), share, block);
        Some(())
    }
}

/// Hands the sums to the blocks.
fn spread(shared: usize, share: &mut Share, block: &mut ViewBlock<WIDTH>) {
    let Share { square, gradient, products, .. } = share;
    let residual = 6 + shared;
    for i in 0..6 {
        for j in i..6 {
            block.pose[(i, j)] = products.at(i, j);
            block.pose[(j, i)] = products.at(i, j);
        }
        for k in 0..shared {
            block.coupling[(k, i)] = products.at(i, 6 + k);
        }
        block.gradient[i] = products.at(i, residual);
    }
    for k in 0..shared {
        for l in k..shared {
            square[(k, l)] += products.at(6 + k, 6 + l);
        }
        gradient[k] += products.at(6 + k, residual);
    }
}

struct Sums<'a, 'b, M, const P: usize> {
    view: &'a View<'b>,
    coefficients: [f64; P],
    products: &'a mut Products,
    model: std::marker::PhantomData<M>,
}

/// The rows of four marks' Jacobian, and their residual.
struct Rows<L> {
    columns: [[L; COLUMNS]; 2],
    /// All derivatives of u and of v by what views share; those that the model does not have stay 0.
    all: [[L; MOST]; 2],
    residual: [L; 2],
    inside: L,
}

impl<L: Lanes> Rows<L> {
    #[inline(always)]
    fn zero() -> Rows<L> {
        let zero = L::zero();
        Rows { columns: [[zero; COLUMNS]; 2], all: [[zero; MOST]; 2], residual: [zero; 2], inside: zero }
    }
}

impl<M: LensModel<P>, const P: usize> Kernel for Sums<'_, '_, M, P> {
    /// The cost.
    type Output = Option<f64>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let View { marks, columns, .. } = *self.view;
        let constants = M::constants(self.coefficients.map(L::splat));
        let count = 6 + columns.places.len() + 1;
        let mut rows = Rows::zero();
        let mut cost = L::zero();
        self.products.clear(count);
        for block in &marks.blocks {
            fill_rows::<L, M, P>(self.view, &constants, block, &mut rows);
            cost = cost + weigh(self.view, block, &mut rows, count)?;
            let [u, v] = &rows.columns;
            self.products.add(&u[..count], &v[..count]);
        }
        self.products.add_up::<L>();
        let [cost, ..] = L::sums([cost; 4]);
        Some(cost)
    }
}

/// Multiplies the first `count` columns with the roots of the marks' weights, those of the loss among them:
/// their cost. `None` where the lens has no image of a mark.
#[inline(always)]
fn weigh<L: Lanes>(view: &View<'_>, block: &Block, rows: &mut Rows<L>, count: usize) -> Option<L> {
    if !rows.inside.all_positive() {
        return None;
    }
    let (cost, root) = cost_and_root(view, block, &rows.residual);
    for row in &mut rows.columns {
        for column in &mut row[..count] {
            *column = *column * root;
        }
    }
    Some(cost)
}

/// The cost of four marks, and the roots of their weights, those of the loss among them.
#[inline(always)]
fn cost_and_root<L: Lanes>(view: &View<'_>, block: &Block, [ru, rv]: &[L; 2]) -> (L, L) {
    let root = L::load(&block.weight);
    let cost = (*ru * *ru + *rv * *rv) * root * root;
    if view.loss == Loss::Squares {
        return (cost, root);
    }
    let at = cost.store().map(|square| view.loss.at(square));
    let weight = L::load(&at.map(|(_, weight)| weight));
    (L::load(&at.map(|(rho, _)| rho)), root * weight.sqrt())
}

/// Four marks in camera coordinates.
struct Placed<L> {
    /// `R X`, from the target's origin.
    arm: [L; 3],
    point: [L; 3],
    /// Per unit of each deformation.
    heights: [L; DEFORMATIONS],
}

#[inline(always)]
fn placed<L: Lanes>(view: &View<'_>, block: &Block) -> Placed<L> {
    let (r, t) = (&view.cam_from_target.rotation, &view.cam_from_target.translation);
    let mut heights = [L::zero(); DEFORMATIONS];
    let mut z = L::zero();
    for k in 0..DEFORMATIONS {
        heights[k] = L::load(&block.height[k]);
        z = z + L::splat(view.shape[k]) * heights[k];
    }
    let (x, y) = (L::load(&block.x), L::load(&block.y));
    let mut arm = [L::zero(); 3];
    let mut point = [L::zero(); 3];
    for i in 0..3 {
        arm[i] = L::splat(r[(i, 0)]) * x + L::splat(r[(i, 1)]) * y + L::splat(r[(i, 2)]) * z;
        point[i] = arm[i] + L::splat(t[i]);
    }
    Placed { arm, point, heights }
}

/// Predicted - observed of four marks that the lens sees there.
#[inline(always)]
fn residual<L: Lanes>(camera: &Camera<Lens>, block: &Block, [xd, yd]: &[L; 2]) -> [L; 2] {
    let [fx, fy, skew] = [L::splat(camera.fx), L::splat(camera.fy), L::splat(camera.skew)];
    [
        fx * *xd + skew * *yd + L::splat(camera.cx) - L::load(&block.u),
        fy * *yd + L::splat(camera.cy) - L::load(&block.v),
    ]
}

/// Derivatives of pixels by the points in camera coordinates, from those of the lens.
#[inline(always)]
fn by_point<L: Lanes>(camera: &Camera<Lens>, by_lens: &[[L; 3]; 2]) -> [[L; 3]; 2] {
    let [fx, fy, skew] = [L::splat(camera.fx), L::splat(camera.fy), L::splat(camera.skew)];
    let mut slopes = [[L::zero(); 3]; 2];
    for i in 0..3 {
        let (dx, dy) = (by_lens[0][i], by_lens[1][i]);
        slopes[0][i] = fx * dx + skew * dy;
        slopes[1][i] = fy * dy;
    }
    slopes
}

/// Derivatives by the pose: `d X_c / d delta = -[q]x` with `q = R X`, `d X_c / d t = I`.
#[inline(always)]
fn by_pose<L: Lanes>(q: &[L; 3], p: &[L; 3]) -> [L; 6] {
    [q[1] * p[2] - q[2] * p[1], q[2] * p[0] - q[0] * p[2], q[0] * p[1] - q[1] * p[0], p[0], p[1], p[2]]
}

/// The Jacobian of four marks, with `d X_c / d height = r3`.
#[inline(always)]
fn fill_rows<L: Lanes, M: LensModel<P>, const P: usize>(
    view: &View<'_>,
    constants: &M::Constants<L>,
    block: &Block,
    rows: &mut Rows<L>,
) {
    let (camera, r) = (view.camera, &view.cam_from_target.rotation);
    let Placed { arm, point, heights } = placed::<L>(view, block);
    let at = M::project(constants, point);
    let [fx, fy, skew] = [L::splat(camera.fx), L::splat(camera.fy), L::splat(camera.skew)];
    let [xd, yd] = at.at;
    rows.inside = at.inside;
    rows.residual = residual(camera, block, &at.at);
    let one = L::splat(1.0);
    let Rows { columns, all, residual, .. } = rows;
    (all[0][Parameter::Fx as usize], all[0][Parameter::Cx as usize]) = (xd, one);
    all[0][Parameter::Skew as usize] = yd;
    (all[1][Parameter::Fy as usize], all[1][Parameter::Cy as usize]) = (yd, one);
    for k in 0..P {
        let [dx, dy] = at.by_lens[k];
        all[0][LINEAR + k] = fx * dx + skew * dy;
        all[1][LINEAR + k] = fy * dy;
    }
    let slopes = by_point(camera, &at.by_point);
    for row in 0..2 {
        let p = slopes[row];
        columns[row][..6].copy_from_slice(&by_pose(&arm, &p));
        let along = p[0] * L::splat(r[(0, 2)]) + p[1] * L::splat(r[(1, 2)]) + p[2] * L::splat(r[(2, 2)]);
        for k in 0..DEFORMATIONS {
            all[row][LINEAR + P + k] = along * heights[k];
        }
        for (k, &place) in view.columns.places.iter().enumerate() {
            columns[row][6 + k] = all[row][place];
        }
        if let (Some(ratio), Some(&place)) = (view.columns.fy_per_fx, view.columns.places.first()) {
            columns[row][6] = all[row][place] + L::splat(ratio) * all[row][Parameter::Fy as usize];
        }
        columns[row][6 + view.columns.places.len()] = residual[row];
    }
}

/// What a view says of its pose alone.
pub(super) struct OfPose {
    pub square: SMatrix<f64, 6, 6>,
    pub gradient: SVector<f64, 6>,
    pub cost: f64,
}

/// The normal equations of a view's pose. `None` where the lens has no image of a mark.
pub(super) fn of_pose(view: &View<'_>) -> Option<OfPose> {
    visit(&view.camera.distortion, PoseOfModel { view })
}

struct PoseOfModel<'a, 'b> {
    view: &'a View<'b>,
}

impl LensVisitor for PoseOfModel<'_, '_> {
    type Output = Option<OfPose>;

    fn run<M: LensModel<P>, const P: usize>(self, coefficients: [f64; P]) -> Self::Output {
        dispatch(PoseSums::<M, P> { view: self.view, coefficients, model: std::marker::PhantomData })
    }
}

struct PoseSums<'a, 'b, M, const P: usize> {
    view: &'a View<'b>,
    coefficients: [f64; P],
    model: std::marker::PhantomData<M>,
}

impl<M: LensModel<P>, const P: usize> Kernel for PoseSums<'_, '_, M, P> {
    type Output = Option<OfPose>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        const RESIDUAL: usize = 6;
        let view = self.view;
        let constants = M::constants(self.coefficients.map(L::splat));
        let mut sums = [[L::zero(); 8]; 6];
        let mut cost = L::zero();
        for block in &view.marks.blocks {
            let Placed { arm, point, .. } = placed::<L>(view, block);
            let at = M::project(&constants, point);
            if !at.inside.all_positive() {
                return None;
            }
            let off = residual(view.camera, block, &at.at);
            let (square, root) = cost_and_root(view, block, &off);
            cost = cost + square;
            let slopes = by_point(view.camera, &at.by_point);
            for row in 0..2 {
                let mut columns = [L::zero(); 7];
                columns[..6].copy_from_slice(&by_pose(&arm, &slopes[row]));
                columns[RESIDUAL] = off[row];
                for column in &mut columns {
                    *column = *column * root;
                }
                for i in 0..6 {
                    for j in i..7 {
                        sums[i][j] = sums[i][j] + columns[i] * columns[j];
                    }
                }
            }
        }
        let mut found = OfPose { square: SMatrix::zeros(), gradient: SVector::zeros(), cost: 0.0 };
        for i in 0..6 {
            let [a, b, c, d, e, f, g, h] = sums[i];
            let (low, high) = (L::sums([a, b, c, d]), L::sums([e, f, g, h]));
            for j in i..6 {
                let sum = if j < 4 { low[j] } else { high[j - 4] };
                (found.square[(i, j)], found.square[(j, i)]) = (sum, sum);
            }
            found.gradient[i] = high[RESIDUAL - 4];
        }
        [found.cost, ..] = L::sums([cost; 4]);
        Some(found)
    }
}

/// The cost of a view, without derivatives. `None` where the lens has no image of a mark.
pub(super) fn cost(view: &View<'_>) -> Option<f64> {
    visit(&view.camera.distortion, CostOfModel { view })
}

struct CostOfModel<'a, 'b> {
    view: &'a View<'b>,
}

impl LensVisitor for CostOfModel<'_, '_> {
    type Output = Option<f64>;

    fn run<M: LensModel<P>, const P: usize>(self, coefficients: [f64; P]) -> Self::Output {
        dispatch(Costs::<M, P> { view: self.view, coefficients, model: std::marker::PhantomData })
    }
}

struct Costs<'a, 'b, M, const P: usize> {
    view: &'a View<'b>,
    coefficients: [f64; P],
    model: std::marker::PhantomData<M>,
}

impl<M: LensModel<P>, const P: usize> Kernel for Costs<'_, '_, M, P> {
    type Output = Option<f64>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let view = self.view;
        let constants = M::constants(self.coefficients.map(L::splat));
        let mut sum = L::zero();
        for block in &view.marks.blocks {
            let at = M::project(&constants, placed::<L>(view, block).point);
            if !at.inside.all_positive() {
                return None;
            }
            let (cost, _) = cost_and_root(view, block, &residual(view.camera, block, &at.at));
            sum = sum + cost;
        }
        let [cost, ..] = L::sums([sum; 4]);
        Some(cost)
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::minimise::Descent;
    use super::super::super::settings::Bend;
    use super::super::super::system::Step;
    use super::super::fixture::{FREE, at_minimum};
    use super::super::problem::{Problem, State};
    use super::*;

    /// Of a bent board, with a loss that weighs, away from the minimum.
    fn with_problem(then: impl Fn(&Problem<'_>, &State)) {
        at_minimum(FreeParameters::of(&FREE), 1.0, |flat, minimum| {
            let bend = Some(Bend { deformations: DEFORMATIONS, standard_deviation: f64::INFINITY });
            let problem = Problem { bend, loss: Loss::Cauchy { scale_px: 0.1 }, ..*flat };
            then(&problem, &State { shape: [0.05, -0.03, 0.04], ..minimum.state.clone() });
        });
    }

    /// Half the slope of the cost along a step, from costs on either side of a state.
    fn half_slope(problem: &Problem<'_>, state: &State, size: f64, set: impl Fn(&mut Step<WIDTH>)) -> f64 {
        let cost_at = |size: f64| {
            let mut step = Step::default();
            step.poses.resize(problem.views.len(), SVector::zeros());
            set(&mut step);
            step.intrinsics *= size;
            step.poses.iter_mut().for_each(|pose| *pose *= size);
            problem.cost(&problem.stepped(state, step))
        };
        (cost_at(size) - cost_at(-size)) / (4.0 * size)
    }

    /// A difference of this many px in the largest residual loses some 1e-7 of the slope to curvature, and as
    /// much to rounding.
    const MOVED_PX: f64 = 1e-4;

    #[test]
    fn the_gradient_is_half_the_slope_of_the_cost() {
        with_problem(|problem, state| {
            let mut system = problem.system();
            problem.linearise_into(state, &mut system);
            let is_slope = |gradient: f64, square: f64, set: &dyn Fn(&mut Step<WIDTH>)| {
                // `square` is the information of the unknown, so that this is what the gradient's terms come
                // to.
                let unit = (square * system.cost).sqrt();
                let slope = half_slope(problem, state, MOVED_PX / square.sqrt(), set);
                assert!((gradient - slope).abs() < 1e-5 * unit, "{gradient} {slope} {unit}");
            };
            for k in 0..FREE.len() + DEFORMATIONS {
                is_slope(system.gradient[k], system.intrinsics[(k, k)], &|step| step.intrinsics[k] = 1.0);
            }
            for (view, block) in system.views.iter().enumerate() {
                for k in 0..6 {
                    is_slope(block.gradient[k], block.pose[(k, k)], &|step| step.poses[view][k] = 1.0);
                }
            }
        });
    }

    #[test]
    fn the_rows_of_coefficients_agree_with_central_differences_where_axes_are_slanted() {
        at_minimum(FreeParameters::of(&FREE), 1.0, |problem, minimum| {
            let mut state = minimum.state.clone();
            state.camera.skew = 30.0;
            let columns = problem.columns(&state);
            let rows = rows_of_view(&problem.view(&state, &columns, 1)).unwrap();
            for (i, mark) in problem.views[1].list.iter().enumerate() {
                for (k, parameter) in [(4, Parameter::K1), (5, Parameter::K2)] {
                    let pixel = |step: f64| {
                        let value = state.camera.value(parameter).unwrap() + step;
                        let camera = state.camera.with_value(parameter, value).unwrap();
                        State { camera, ..state.clone() }.pixel(1, mark).unwrap()
                    };
                    let expected = (pixel(1e-5) - pixel(-1e-5)) / 2e-5;
                    let row = 2 * LANES * (i / LANES) + i % LANES;
                    let own = [rows[(row, 6 + k)], rows[(row + LANES, 6 + k)]];
                    assert!(
                        (own[0] - expected.x).abs() + (own[1] - expected.y).abs() < 1e-6,
                        "{own:?} {expected}"
                    );
                }
            }
        });
    }
}
