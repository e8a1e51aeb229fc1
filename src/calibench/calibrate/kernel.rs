//! What are the sums over the points of a view? The inner loop of the calibration, four points at a time.
//!
//! Of a point's Jacobian the row of u depends on (fx, cx, skew) and the row of v on (fy, cy), while pose and
//! lens move both. With `q = (pose, k1, k2, p1, p2, k3)` only the products that are not 0 are summed: `q_u
//! q_u^T + q_v q_v^T`, `q_u` and `q_v` times their own linear parameters, and a handful of scalars. Which of
//! them a problem needs is looked up afterwards.
#![allow(clippy::needless_range_loop, reason = "indices are those of the equations")]

mod strain;

pub(super) use strain::{Strain, view_strain};

use super::Loss;
use crate::camera::{Camera, Parameter};
use crate::geometry::Pose;
use crate::geometry::lanes::{Arithmetic, Kernel, LANES, Lanes, PairBlocks, dispatch};

/// Six pose columns, then k1, k2, p1, p2, k3, then one of zeros that makes whole blocks of lanes.
const SHARED: usize = 12;
/// Shared columns of the lens with k1, k2 alone.
const SHARED_RADIAL: usize = 8;

/// Sums over the points of a view, found by [`intrinsics_slot`] and its kin.
///
/// Rows 0 to 11: upper triangle of the shared columns' squares. Rows 12 to 16: shared columns times fx, cx,
/// skew (row u) and fy, cy (row v). Row 17: shared columns times the residual. Row 18: the scalars of
/// [`scalars`].
pub(super) type Sums = [[f64; SHARED]; 19];

/// Sums of nothing.
pub(super) const NO_SUMS: Sums = [[0.0; SHARED]; 19];

const FX: usize = 12;
const CX: usize = 13;
const SKEW: usize = 14;
const FY: usize = 15;
const CY: usize = 16;
const RESIDUAL: usize = 17;
const SCALARS: usize = 18;

/// Where the scalar sums stand in row 18.
mod scalars {
    pub const XX: usize = 0;
    pub const XY: usize = 1;
    pub const YY: usize = 2;
    pub const X: usize = 3;
    pub const Y: usize = 4;
    pub const ONE: usize = 5;
    pub const X_RU: usize = 6;
    pub const RU: usize = 7;
    pub const Y_RU: usize = 8;
    pub const Y_RV: usize = 9;
    pub const RV: usize = 10;
    pub const COST: usize = 11;
}

/// The place of the product of two intrinsics' columns.
pub(super) const INTRINSICS_SLOTS: [[(u8, u8); Parameter::COUNT]; Parameter::COUNT] = {
    let mut slots = [[(0, 0); Parameter::COUNT]; Parameter::COUNT];
    let mut a = 0;
    while a < Parameter::COUNT {
        let mut b = 0;
        while b < Parameter::COUNT {
            slots[a][b] = if a <= b { product_slot(a, b) } else { product_slot(b, a) };
            b += 1;
        }
        a += 1;
    }
    slots
};

const fn product_slot(a: usize, b: usize) -> (u8, u8) {
    const LENS: usize = Parameter::K1 as usize;
    // In the order of `Parameter`: fx, fy, cx, cy, skew.
    const ROWS: [usize; LENS] = [FX, FY, CX, CY, SKEW];
    // The last diagonal entry of the squares is that of the column of zeros.
    const NOTHING: (usize, usize) = (SHARED - 1, SHARED - 1);
    const LINEAR: [[usize; LENS]; LENS] = {
        use scalars::{ONE, X, XX, XY, Y, YY};
        const NO: usize = SHARED;
        [
            [XX, NO, X, NO, XY],
            [NO, YY, NO, Y, NO],
            [X, NO, ONE, NO, Y],
            [NO, Y, NO, ONE, NO],
            [XY, NO, Y, NO, YY],
        ]
    };
    let (row, column) = if a >= LENS {
        (a - LENS + 6, b - LENS + 6)
    } else if b >= LENS {
        (ROWS[a], b - LENS + 6)
    } else if LINEAR[a][b] == SHARED {
        NOTHING
    } else {
        (SCALARS, LINEAR[a][b])
    };
    (row as u8, column as u8)
}

/// The product of an intrinsic parameter's column with pose column `i`.
#[inline(always)]
pub(super) fn coupling(sums: &Sums, parameter: Parameter, i: usize) -> f64 {
    match parameter {
        Parameter::Fx => sums[FX][i],
        Parameter::Fy => sums[FY][i],
        Parameter::Cx => sums[CX][i],
        Parameter::Cy => sums[CY][i],
        Parameter::Skew => sums[SKEW][i],
        lens => sums[i][lens as usize - Parameter::K1 as usize + 6],
    }
}

/// The product of an intrinsic parameter's column with the residual.
pub(super) fn gradient(sums: &Sums, parameter: Parameter) -> f64 {
    match parameter {
        Parameter::Fx => sums[SCALARS][scalars::X_RU],
        Parameter::Fy => sums[SCALARS][scalars::Y_RV],
        Parameter::Cx => sums[SCALARS][scalars::RU],
        Parameter::Cy => sums[SCALARS][scalars::RV],
        Parameter::Skew => sums[SCALARS][scalars::Y_RU],
        lens => sums[RESIDUAL][lens as usize - Parameter::K1 as usize + 6],
    }
}

/// The product of pose column `i` with the residual.
#[inline(always)]
pub(super) fn pose_gradient(sums: &Sums, i: usize) -> f64 {
    sums[RESIDUAL][i]
}

/// The sum of the loss.
pub(super) fn cost(sums: &Sums) -> f64 {
    sums[SCALARS][scalars::COST]
}

/// Whether the lens and what is free of it are within k1 and k2, with no skew: then fewer columns are needed.
pub(super) fn is_radial(camera: &Camera, free: crate::camera::FreeParameters) -> bool {
    use Parameter::{K3, P1, P2, Skew};
    [Skew, P1, P2, K3].into_iter().all(|p| !free.contains(p) && camera.get(p) == 0.0)
}

/// Camera and pose in every lane.
pub(super) struct Model<L> {
    fx: L,
    fy: L,
    cx: L,
    cy: L,
    skew: L,
    k1: L,
    k2: L,
    p1: L,
    p2: L,
    k3: L,
    /// First two columns of `R`.
    r: [[L; 2]; 3],
    t: [L; 3],
}

impl<L: Arithmetic> Model<L> {
    #[inline(always)]
    pub fn new(camera: &Camera, cam_from_target: &Pose) -> Model<L> {
        let (r, t, lens) = (&cam_from_target.rotation, &cam_from_target.translation, &camera.distortion);
        let row = |i: usize| [L::splat(r[(i, 0)]), L::splat(r[(i, 1)])];
        Model {
            fx: L::splat(camera.fx),
            fy: L::splat(camera.fy),
            cx: L::splat(camera.cx),
            cy: L::splat(camera.cy),
            skew: L::splat(camera.skew),
            k1: L::splat(lens.k1),
            k2: L::splat(lens.k2),
            p1: L::splat(lens.p1),
            p2: L::splat(lens.p2),
            k3: L::splat(lens.k3),
            r: [row(0), row(1), row(2)],
            t: [L::splat(t.x), L::splat(t.y), L::splat(t.z)],
        }
    }

    /// From numbers of more digits than a [`Camera`] has: the parameters in their order, the first two
    /// columns of `R`, and `t`.
    pub fn of_numbers(parameters: &[L; Parameter::COUNT], r: [[L; 2]; 3], t: [L; 3]) -> Model<L> {
        let [fx, fy, cx, cy, skew, k1, k2, p1, p2, k3] = *parameters;
        Model { fx, fy, cx, cy, skew, k1, k2, p1, p2, k3, r, t }
    }
}

/// A predicted pixel and the rows of its Jacobian.
pub(super) struct Rows<L> {
    pub depth: L,
    pub pixel: [L; 2],
    /// Distorted normalised coordinates: the columns of fx, skew and fy.
    pub distorted: [L; 2],
    pub u: [L; SHARED],
    pub v: [L; SHARED],
}

/// [`crate::camera::project_with_jacobian`], written out for points with Z = 0. With `RADIAL` skew, p1, p2
/// and k3 are taken to be 0 and have no columns.
#[inline(always)]
pub(super) fn rows<L: Arithmetic, const RADIAL: bool>(m: &Model<L>, px: L, py: L) -> Rows<L> {
    let (one, two, three) = (L::splat(1.0), L::splat(2.0), L::splat(3.0));
    let [qx, qy, qz] = rotated(m, px, py);
    let depth = qz + m.t[2];
    let inverse_depth = one / depth;
    let (x, y) = ((qx + m.t[0]) * inverse_depth, (qy + m.t[1]) * inverse_depth);
    let (xx, yy, xy) = (x * x, y * y, x * y);
    let s = xx + yy;
    let k2_s = m.k2 * s;
    let (g, slope) = if RADIAL {
        (one + s * (m.k1 + k2_s), m.k1 + (k2_s + k2_s))
    } else {
        let k3_ss = m.k3 * s * s;
        (one + s * (m.k1 + k2_s + k3_ss), m.k1 + (k2_s + k2_s) + three * k3_ss)
    };
    let twice_slope = slope + slope;
    let (mut xd, mut yd) = (x * g, y * g);
    let mut cross = twice_slope * xy;
    let (mut xd_by_x, mut yd_by_y) = (g + twice_slope * xx, g + twice_slope * yy);
    let (tx, ty, twice_xy) = (s + two * xx, s + two * yy, two * xy);
    if !RADIAL {
        let six = L::splat(6.0);
        xd = xd + m.p1 * twice_xy + m.p2 * tx;
        yd = yd + m.p1 * ty + m.p2 * twice_xy;
        cross = cross + two * (m.p1 * x + m.p2 * y);
        xd_by_x = xd_by_x + two * (m.p1 * y) + six * (m.p2 * x);
        yd_by_y = yd_by_y + six * (m.p1 * y) + two * (m.p2 * x);
    }

    // Derivatives of the pixel by the ideal point, then by the point in camera coordinates.
    let pu = by_point(
        [along_u::<L, RADIAL>(m, xd_by_x, cross), along_u::<L, RADIAL>(m, cross, yd_by_y)],
        [x, y],
        inverse_depth,
    );
    let pv = by_point([m.fy * cross, m.fy * yd_by_y], [x, y], inverse_depth);
    let (du, dv) = (by_rotation([qx, qy, qz], pu), by_rotation([qx, qy, qz], pv));

    let (k1u, k1v) = (along_u::<L, RADIAL>(m, x * s, y * s), m.fy * (y * s));
    let (k2u, k2v) = (k1u * s, k1v * s);
    let none = L::splat(0.0);
    let (p1, p2, k3) = if RADIAL {
        ([none; 2], [none; 2], [none; 2])
    } else {
        (
            [along_u::<L, RADIAL>(m, twice_xy, ty), m.fy * ty],
            [along_u::<L, RADIAL>(m, tx, twice_xy), m.fy * twice_xy],
            [k2u * s, k2v * s],
        )
    };
    Rows {
        depth,
        pixel: [along_u::<L, RADIAL>(m, xd, yd) + m.cx, m.fy * yd + m.cy],
        distorted: [xd, yd],
        u: [du[0], du[1], du[2], pu[0], pu[1], pu[2], k1u, k2u, p1[0], p2[0], k3[0], none],
        v: [dv[0], dv[1], dv[2], pv[0], pv[1], pv[2], k1v, k2v, p1[1], p2[1], k3[1], none],
    }
}

// Functions, not closures: only functions can be told to be inlined into code for wide registers.

/// `R [x y 0]^T`.
#[inline(always)]
fn rotated<L: Arithmetic>(m: &Model<L>, px: L, py: L) -> [L; 3] {
    [m.r[0][0] * px + m.r[0][1] * py, m.r[1][0] * px + m.r[1][1] * py, m.r[2][0] * px + m.r[2][1] * py]
}

/// What `(lx, ly)` on the plane Z = 1 moves u by.
#[inline(always)]
fn along_u<L: Arithmetic, const RADIAL: bool>(m: &Model<L>, lx: L, ly: L) -> L {
    if RADIAL { m.fx * lx } else { m.fx * lx + m.skew * ly }
}

/// The row of the point in camera coordinates from that of the ideal point.
#[inline(always)]
fn by_point<L: Arithmetic>([dx, dy]: [L; 2], [x, y]: [L; 2], inverse_depth: L) -> [L; 3] {
    let (a, b) = (dx * inverse_depth, dy * inverse_depth);
    [a, b, -(a * x + b * y)]
}

/// The row of the rotation from that of the point: `d X_c / d delta = -[q]x`, so a row p becomes `-(p^T [q]x)
/// = (q x p)^T`.
#[inline(always)]
fn by_rotation<L: Arithmetic>([qx, qy, qz]: [L; 3], p: [L; 3]) -> [L; 3] {
    [qy * p[2] - qz * p[1], qz * p[0] - qx * p[2], qx * p[1] - qy * p[0]]
}

/// The sums of one view, or `None` where a point is not in front of the camera.
pub(super) fn view_sums(
    camera: &Camera,
    cam_from_target: &Pose,
    pairs: &PairBlocks,
    loss: Loss,
    radial: bool,
    sums: &mut Sums,
) -> Option<()> {
    let view = View { camera, cam_from_target, pairs, loss };
    match (loss, radial) {
        (Loss::Squares, true) => dispatch(ViewSums::<SHARED_RADIAL, true, false>(view, sums)),
        (Loss::Squares, false) => dispatch(ViewSums::<SHARED, false, false>(view, sums)),
        _ => dispatch(ViewSums::<SHARED, false, true>(view, sums)),
    }
}

/// What the kernels read.
#[derive(Clone, Copy)]
struct View<'a> {
    camera: &'a Camera,
    cam_from_target: &'a Pose,
    pairs: &'a PairBlocks,
    loss: Loss,
}

/// The kernel for `Q` shared columns; with `ROBUST` every point has the weight of the loss.
struct ViewSums<'a, const Q: usize, const RADIAL: bool, const ROBUST: bool>(View<'a>, &'a mut Sums);

impl<const Q: usize, const RADIAL: bool, const ROBUST: bool> Kernel for ViewSums<'_, Q, RADIAL, ROBUST> {
    type Output = Option<()>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Option<()> {
        let View { camera, cam_from_target, pairs, loss } = self.0;
        let model = Model::<L>::new(camera, cam_from_target);
        let mut sums = Accumulators::<L, Q>::zero();
        for (index, block) in pairs.blocks.iter().enumerate() {
            let mut at = rows::<L, RADIAL>(&model, L::load(&block.x), L::load(&block.y));
            if !at.depth.all_positive() {
                return None;
            }
            let mut residual = [at.pixel[0] - L::load(&block.u), at.pixel[1] - L::load(&block.v)];
            // The root of the weight: it scales the rows and the residual.
            let mut root = L::splat(1.0);
            let mask = pairs.mask(index);
            let mut cost = residual[0] * residual[0] + residual[1] * residual[1];
            if ROBUST || mask.is_some() {
                let mask = mask.unwrap_or([1.0; LANES]);
                root = L::load(&mask);
                if ROBUST {
                    let (losses, weights) = lane_losses(loss, cost.store());
                    cost = L::load(&losses);
                    root = root * L::load(&weights).sqrt();
                }
                cost = cost * L::load(&mask);
                for i in 0..Q {
                    at.u[i] = at.u[i] * root;
                    at.v[i] = at.v[i] * root;
                }
                residual = residual.map(|r| r * root);
                at.distorted = at.distorted.map(|d| d * root);
            }
            sums.add::<RADIAL, ROBUST>(&at, residual, root, cost);
        }
        sums.reduce_into::<RADIAL>(self.1);
        Some(())
    }
}

fn lane_losses(loss: Loss, squares: [f64; LANES]) -> ([f64; LANES], [f64; LANES]) {
    let at = squares.map(|s| loss.at(s));
    (at.map(|(rho, _)| rho), at.map(|(_, weight)| weight))
}

/// [`Sums`] lane by lane.
struct Accumulators<L, const Q: usize> {
    squares: [[L; Q]; Q],
    linear: [[L; Q]; 5],
    residual: [L; Q],
    scalars: [L; SHARED],
}

impl<L: Lanes, const Q: usize> Accumulators<L, Q> {
    #[inline(always)]
    fn zero() -> Accumulators<L, Q> {
        let zero = L::zero();
        Accumulators {
            squares: [[zero; Q]; Q],
            linear: [[zero; Q]; 5],
            residual: [zero; Q],
            scalars: [zero; SHARED],
        }
    }

    /// Adds a block. `one` is the column of cx and cy: the root of the weight.
    #[inline(always)]
    fn add<const RADIAL: bool, const ROBUST: bool>(
        &mut self,
        rows: &Rows<L>,
        [ru, rv]: [L; 2],
        one: L,
        cost: L,
    ) {
        let (u, v, [x, y]) = (&rows.u, &rows.v, rows.distorted);
        let columns = if RADIAL { SHARED_RADIAL } else { SHARED - 1 };
        for i in 0..columns {
            for j in i..columns {
                self.squares[i][j] = self.squares[i][j] + (u[i] * u[j] + v[i] * v[j]);
            }
        }
        for i in 0..columns {
            self.linear[0][i] = self.linear[0][i] + x * u[i];
            self.linear[1][i] = self.linear[1][i] + times_one::<L, ROBUST>(u[i], one);
            if !RADIAL {
                self.linear[2][i] = self.linear[2][i] + y * u[i];
            }
            self.linear[3][i] = self.linear[3][i] + y * v[i];
            self.linear[4][i] = self.linear[4][i] + times_one::<L, ROBUST>(v[i], one);
            self.residual[i] = self.residual[i] + (ru * u[i] + rv * v[i]);
        }
        let zero = L::zero();
        let terms = [
            x * x,
            if RADIAL { zero } else { x * y },
            y * y,
            times_one::<L, ROBUST>(x, one),
            times_one::<L, ROBUST>(y, one),
            times_one::<L, ROBUST>(one, one),
            x * ru,
            times_one::<L, ROBUST>(ru, one),
            if RADIAL { zero } else { y * ru },
            y * rv,
            times_one::<L, ROBUST>(rv, one),
            cost,
        ];
        for (sum, term) in self.scalars.iter_mut().zip(terms) {
            *sum = *sum + term;
        }
    }

    #[inline(always)]
    // Entries that the model has no use for are left as they are: 0.
    fn reduce_into<const RADIAL: bool>(&self, sums: &mut Sums) {
        let columns = if RADIAL { SHARED_RADIAL } else { SHARED - 1 };
        for i in 0..columns {
            reduce_row(&self.squares[i], i / LANES * LANES, &mut sums[i]);
        }
        for (row, target) in self.linear.iter().zip(&mut sums[FX..=CY]) {
            reduce_row(row, 0, target);
        }
        reduce_row(&self.residual, 0, &mut sums[RESIDUAL]);
        reduce_row(&self.scalars, 0, &mut sums[SCALARS]);
    }
}

/// The product with the column of the principal point. A mask of 0 and 1 is its own square: only other
/// weights need it.
#[inline(always)]
fn times_one<L: Arithmetic, const ROBUST: bool>(value: L, one: L) -> L {
    if ROBUST { value * one } else { value }
}

/// Sums lanes of entries `from` and on.
#[inline(always)]
fn reduce_row<L: Lanes, const Q: usize>(row: &[L; Q], from: usize, target: &mut [f64; SHARED]) {
    let mut i = from;
    while i < Q {
        let [a, b, c, d] = L::sums([row[i], row[i + 1], row[i + 2], row[i + 3]]);
        (target[i], target[i + 1], target[i + 2], target[i + 3]) = (a, b, c, d);
        i += LANES;
    }
}

/// Residuals of a view and what the report needs of them.
pub(super) struct ViewResiduals {
    /// Predicted - observed, px; infinite behind the camera.
    pub residuals: Vec<crate::geometry::Vec2>,
    /// Sum of squares.
    pub square: f64,
    /// Sum of the squares' squares.
    pub fourth: f64,
    /// Largest square.
    pub largest_square: f64,
    /// Largest squared distance of an ideal point from the axis, in normalised coordinates.
    pub largest_radius_sq: f64,
}

/// Predicts every pixel of a view.
pub(super) fn view_residuals(camera: &Camera, cam_from_target: &Pose, pairs: &PairBlocks) -> ViewResiduals {
    let view = View { camera, cam_from_target, pairs, loss: Loss::Squares };
    dispatch(Residuals(view))
}

struct Residuals<'a>(View<'a>);

impl Kernel for Residuals<'_> {
    type Output = ViewResiduals;

    #[inline(always)]
    fn run<L: Lanes>(self) -> ViewResiduals {
        use crate::geometry::Vec2;
        let View { camera, cam_from_target, pairs, .. } = self.0;
        let m = Model::<L>::new(camera, cam_from_target);
        let mut residuals = Vec::with_capacity(pairs.blocks.len() * LANES);
        let (mut square, mut fourth, mut largest_square, mut largest) =
            (L::zero(), L::zero(), L::zero(), L::zero());
        for (index, block) in pairs.blocks.iter().enumerate() {
            let [x, y, depth] = ideal_point(&m, L::load(&block.x), L::load(&block.y));
            let s = x * x + y * y;
            largest = s.max(largest);
            let [xd, yd] = distorted_point(&m, x, y, s);
            let mut ru = m.fx * xd + m.skew * yd + m.cx - L::load(&block.u);
            let mut rv = m.fy * yd + m.cy - L::load(&block.v);
            if !depth.all_positive() {
                // Not in front of the camera: no prediction. The search never ends there unless it started
                // there.
                let unseen = hidden(depth.store(), pairs.len() - index * LANES);
                (ru, rv) = (behind(ru, unseen), behind(rv, unseen));
            }
            let mut sum = ru * ru + rv * rv;
            if let Some(mask) = pairs.mask(index) {
                sum = sum * L::load(&mask);
            }
            square = square + sum;
            fourth = fourth + sum * sum;
            largest_square = sum.max(largest_square);
            let (ru, rv) = (ru.store(), rv.store());
            for i in 0..LANES {
                residuals.push(Vec2::new(ru[i], rv[i]));
            }
        }
        residuals.truncate(pairs.len());
        let greatest = |lanes: L| lanes.store().into_iter().fold(0.0, f64::max);
        let [square, fourth, ..] = L::sums([square, fourth, square, fourth]);
        let (largest_square, largest_radius_sq) = (greatest(largest_square), greatest(largest));
        ViewResiduals { residuals, square, fourth, largest_square, largest_radius_sq }
    }
}

/// Which lanes hold a point that is not in front of the camera.
fn hidden(depth: [f64; LANES], used: usize) -> [bool; LANES] {
    std::array::from_fn(|i| i < used && (depth[i].is_nan() || depth[i] <= 0.0))
}

/// Infinity in the lanes `unseen`.
#[inline(always)]
fn behind<L: Lanes>(residual: L, unseen: [bool; LANES]) -> L {
    let values = residual.store();
    L::load(&std::array::from_fn(|i| if unseen[i] { f64::INFINITY } else { values[i] }))
}

/// Normalised coordinates and depth.
#[inline(always)]
fn ideal_point<L: Arithmetic>(m: &Model<L>, px: L, py: L) -> [L; 3] {
    let [qx, qy, qz] = rotated(m, px, py);
    let depth = qz + m.t[2];
    let inverse_depth = L::splat(1.0) / depth;
    [(qx + m.t[0]) * inverse_depth, (qy + m.t[1]) * inverse_depth, depth]
}

/// [`crate::camera::BrownConrady::distort`].
#[inline(always)]
fn distorted_point<L: Arithmetic>(m: &Model<L>, x: L, y: L, s: L) -> [L; 2] {
    let two = L::splat(2.0);
    let g = L::splat(1.0) + s * (m.k1 + s * (m.k2 + s * m.k3));
    let twice_xy = two * (x * y);
    [
        x * g + m.p1 * twice_xy + m.p2 * (s + two * (x * x)),
        y * g + m.p1 * (s + two * (y * y)) + m.p2 * twice_xy,
    ]
}

#[cfg(test)]
mod tests;
