//! By how much would the pixels of a view like to deform its plane? The two directions in which a homography leaves the poses.
//!
//! A pose moves target points by `M = [r1 r2 t]`, six numbers; a homography has eight. The two that no pose has stretch the plane
//! within itself, `M + R S` with `S = [[a, b], [b, -a], [0, 0]]`:
//!
//! ```text
//! d X_c / d a = r1 x - r2 y,   d X_c / d b = r2 x + r1 y
//! ```
//! (the trace of `S` is a change of distance). At a minimum of a calibration the gradient vanishes for all of its unknowns; where it does
//! not vanish for these, free homographies would explain the pixels better.

use super::{Model, View, lane_losses, rows};
use crate::calibrate::Loss;
use crate::camera::Camera;
use crate::geometry::Pose;
use crate::geometry::lanes::{Kernel, LANES, Lanes, PairBlocks, dispatch};

/// Sums over the points of a view, for columns `a` and `b` of the strain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::calibrate) struct Strain {
    /// `aa, ab, bb`.
    pub square: [f64; 3],
    /// Each column times the six of the pose.
    pub pose: [[f64; 6]; 2],
    /// Each column times the residual.
    pub gradient: [f64; 2],
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

/// Three squares, twelve couplings, two of the gradient, and room to whole lanes.
const SUMS: usize = 20;

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
            let mask = pairs.mask(index);
            let mut weight = None;
            if ROBUST {
                let square = residual[0] * residual[0] + residual[1] * residual[1];
                let (_, weights) = lane_losses(loss, square.store());
                weight = Some(L::load(&weights));
            }
            if let Some(mask) = mask {
                let mask = L::load(&mask);
                weight = Some(weight.map_or(mask, |weight| weight * mask));
            }
            add::<L>(&mut sums, &m, [px, py], [&at.u, &at.v], residual, weight);
        }
        let mut flat = [0.0; SUMS];
        for (target, four) in flat.chunks_exact_mut(LANES).zip(sums.chunks_exact(LANES)) {
            target.copy_from_slice(&L::sums([four[0], four[1], four[2], four[3]]));
        }
        Strain {
            square: [flat[0], flat[1], flat[2]],
            gradient: [flat[3], flat[4]],
            pose: [std::array::from_fn(|i| flat[5 + i]), std::array::from_fn(|i| flat[11 + i])],
        }
    }
}

/// Adds a block: row u, then row v.
#[inline(always)]
fn add<L: Lanes>(
    sums: &mut [L; SUMS],
    m: &Model<L>,
    [px, py]: [L; 2],
    rows: [&[L; super::SHARED]; 2],
    residual: [L; 2],
    weight: Option<L>,
) {
    let (mut a, mut b) = ([L::zero(); 3], [L::zero(); 3]);
    for i in 0..3 {
        a[i] = m.r[i][0] * px - m.r[i][1] * py;
        b[i] = m.r[i][1] * px + m.r[i][0] * py;
    }
    for (row, r) in rows.into_iter().zip(residual) {
        // The translation's columns are the derivatives by the point in camera coordinates.
        let (along_a, along_b) = (dot(row, &a), dot(row, &b));
        let (weighted_a, weighted_b) = match weight {
            Some(weight) => (along_a * weight, along_b * weight),
            None => (along_a, along_b),
        };
        sums[0] = sums[0] + weighted_a * along_a;
        sums[1] = sums[1] + weighted_a * along_b;
        sums[2] = sums[2] + weighted_b * along_b;
        sums[3] = sums[3] + weighted_a * r;
        sums[4] = sums[4] + weighted_b * r;
        for i in 0..6 {
            sums[5 + i] = sums[5 + i] + weighted_a * row[i];
            sums[11 + i] = sums[11 + i] + weighted_b * row[i];
        }
    }
}

#[inline(always)]
fn dot<L: Lanes>(row: &[L; super::SHARED], x: &[L; 3]) -> L {
    row[3] * x[0] + row[4] * x[1] + row[5] * x[2]
}
