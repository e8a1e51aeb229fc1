//! By how much would the pixels of a view like to deform its plane? The two directions in which a homography
//! leaves the poses.
//!
//! A pose moves target points by `M = [r1 r2 t]`, six numbers; a homography has eight. The two that no pose
//! has stretch the plane within itself, `M + R S` with `S = [[a, b], [b, -a], [0, 0]]`:
//!
//! ```text
//! d X_c / d a = r1 x - r2 y,   d X_c / d b = r2 x + r1 y
//! ```
//! (the trace of `S` is a change of distance). At a minimum of a calibration the gradient vanishes for all of
//! its unknowns; where it does not vanish for these, free homographies would explain the pixels better.

use super::{Model, Rows, SHARED, View, lane_losses, rows};
use crate::calibrate::Loss;
use crate::camera::{Camera, Parameter};
use crate::geometry::Pose;
use crate::geometry::lanes::{Kernel, LANES, Lanes, PairBlocks, dispatch};

/// Sums over the points of a view, for columns `a` and `b` of the strain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::calibrate) struct Strain {
    /// `aa, ab, bb`.
    pub square: [f64; 3],
    /// Each column times the six of the pose.
    pub pose: [[f64; 6]; 2],
    /// Each column times those of the intrinsics, in the order of [`Parameter`].
    pub intrinsics: [[f64; Parameter::COUNT]; 2],
    /// Each column times the residual.
    pub gradient: [f64; 2],
}

impl Strain {
    /// With the column of fx turned into `d/dfx + a d/dfy`.
    pub fn with_tie(mut self, fy_per_fx: f64) -> Strain {
        for column in &mut self.intrinsics {
            column[Parameter::Fx as usize] += fy_per_fx * column[Parameter::Fy as usize];
        }
        self
    }
}

/// The sums of a view at the given camera and pose; points behind the camera make them meaningless.
pub(in crate::calibrate) fn view_strain(
    camera: &Camera,
    cam_from_target: &Pose,
    pairs: &PairBlocks,
    loss: Loss,
    radial: bool,
) -> Strain {
    let view = View { camera, cam_from_target, pairs, loss };
    match (loss, radial) {
        (Loss::Squares, true) => dispatch(StrainSums::<true, false>(view)),
        (Loss::Squares, false) => dispatch(StrainSums::<false, false>(view)),
        _ => dispatch(StrainSums::<false, true>(view)),
    }
}

/// Three squares, two of the gradient, one of nothing; then for each column the twelve shared ones, and five
/// linear ones.
const SUMS: usize = 40;
/// First of column `a`: shared, then fx, fy, cx, cy, skew.
const A: usize = 6;
/// First of column `b`.
const B: usize = A + SHARED + 5;

struct StrainSums<'a, const RADIAL: bool, const ROBUST: bool>(View<'a>);

impl<const RADIAL: bool, const ROBUST: bool> Kernel for StrainSums<'_, RADIAL, ROBUST> {
    type Output = Strain;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Strain {
        let View { camera, cam_from_target, pairs, loss } = self.0;
        let m = Model::<L>::new(camera, cam_from_target);
        let mut sums = [L::zero(); SUMS];
        for (index, block) in pairs.blocks.iter().enumerate() {
            let (px, py) = (L::load(&block.x), L::load(&block.y));
            let at = rows::<L, RADIAL>(&m, px, py);
            let residual = [at.pixel[0] - L::load(&block.u), at.pixel[1] - L::load(&block.v)];
            let mut weight = None;
            if ROBUST {
                let square = residual[0] * residual[0] + residual[1] * residual[1];
                let (_, weights) = lane_losses(loss, square.store());
                weight = Some(L::load(&weights));
            }
            if let Some(mask) = pairs.mask(index) {
                let mask = L::load(&mask);
                weight = Some(weight.map_or(mask, |weight| weight * mask));
            }
            add::<L, RADIAL>(&mut sums, &m, [px, py], &at, residual, weight);
        }
        let mut flat = [0.0; SUMS];
        for (target, four) in flat.chunks_exact_mut(LANES).zip(sums.chunks_exact(LANES)) {
            target.copy_from_slice(&L::sums([four[0], four[1], four[2], four[3]]));
        }
        let intrinsics = |first: usize| {
            let linear = &flat[first + SHARED..];
            let lens = &flat[first + 6..];
            [
                linear[0], linear[1], linear[2], linear[3], linear[4], lens[0], lens[1], lens[2], lens[3],
                lens[4],
            ]
        };
        Strain {
            square: [flat[0], flat[1], flat[2]],
            gradient: [flat[3], flat[4]],
            pose: [A, B].map(|first| std::array::from_fn(|i| flat[first + i])),
            intrinsics: [A, B].map(intrinsics),
        }
    }
}

/// Adds a block.
#[inline(always)]
fn add<L: Lanes, const RADIAL: bool>(
    sums: &mut [L; SUMS],
    m: &Model<L>,
    [px, py]: [L; 2],
    at: &Rows<L>,
    residual: [L; 2],
    weight: Option<L>,
) {
    let (mut a, mut b) = ([L::zero(); 3], [L::zero(); 3]);
    for i in 0..3 {
        a[i] = m.r[i][0] * px - m.r[i][1] * py;
        b[i] = m.r[i][1] * px + m.r[i][0] * py;
    }
    // The translation's columns are the derivatives by the point in camera coordinates.
    let (au, av, bu, bv) = (dot(&at.u, &a), dot(&at.v, &a), dot(&at.u, &b), dot(&at.v, &b));
    let weighted = |x: L| match weight {
        Some(weight) => x * weight,
        None => x,
    };
    let (wau, wav, wbu, wbv) = (weighted(au), weighted(av), weighted(bu), weighted(bv));
    sums[0] = sums[0] + (wau * au + wav * av);
    sums[1] = sums[1] + (wau * bu + wav * bv);
    sums[2] = sums[2] + (wbu * bu + wbv * bv);
    sums[3] = sums[3] + (wau * residual[0] + wav * residual[1]);
    sums[4] = sums[4] + (wbu * residual[0] + wbv * residual[1]);
    let shared = if RADIAL { super::SHARED_RADIAL } else { SHARED - 1 };
    for (first, u, v) in [(A, wau, wav), (B, wbu, wbv)] {
        for i in 0..shared {
            sums[first + i] = sums[first + i] + (u * at.u[i] + v * at.v[i]);
        }
        // fx and cx move u alone, fy and cy v alone, skew u by the distorted y.
        let linear = first + SHARED;
        sums[linear] = sums[linear] + u * at.distorted[0];
        sums[linear + 1] = sums[linear + 1] + v * at.distorted[1];
        sums[linear + 2] = sums[linear + 2] + u;
        sums[linear + 3] = sums[linear + 3] + v;
        if !RADIAL {
            sums[linear + 4] = sums[linear + 4] + u * at.distorted[1];
        }
    }
}

#[inline(always)]
fn dot<L: Lanes>(row: &[L; SHARED], x: &[L; 3]) -> L {
    row[3] * x[0] + row[4] * x[1] + row[5] * x[2]
}
