//! In which frame is a target refined? Centred on its points and of unit size, whatever its own unit and origin.

use super::Covariance;
use super::normal::Observations;
use crate::board::View;
use crate::geometry::{Mat3, Pose, Vec2, Vec3, rotation};

/// The frame in which targets are refined: centred on the points, scaled to unit size, so that neither the unit nor a far
/// origin of the target costs digits.
pub(super) struct TargetFrame {
    centre: Vec2,
    scale: f64,
}

impl TargetFrame {
    pub fn of(views: &[View]) -> TargetFrame {
        let points = || views.iter().flat_map(|view| view.points().iter());
        // Moments about one of the points: its distance from the centroid is of the points' own size.
        let Some(&origin) = points().next() else { return TargetFrame { centre: Vec2::zeros(), scale: 1.0 } };
        let (mut count, mut sum, mut square) = (0.0, Vec2::zeros(), 0.0);
        for view in views {
            let (mut x, mut y, mut squares) = (0.0, 0.0, 0.0);
            for point in view.points() {
                let (dx, dy) = (point.x - origin.x, point.y - origin.y);
                (x, y, squares) = (x + dx, y + dy, squares + (dx * dx + dy * dy));
            }
            count += view.len() as f64;
            sum += Vec2::new(x, y);
            square += squares;
        }
        let offset = sum / count;
        let centre = origin + offset;
        let mean_square = square / count - offset.norm_squared();
        // Coincident points have no size; their homography refuses them.
        let scale = if mean_square > 0.0 { mean_square.sqrt() } else { 1.0 };
        TargetFrame { centre, scale }
    }

    /// Whether a view's points are of the frame's size: not a small patch of it.
    fn is_of_size(&self, view: &View) -> bool {
        let outside = (Vec2::repeat(f64::INFINITY), Vec2::repeat(f64::NEG_INFINITY));
        let grown = |(low, high): (Vec2, Vec2), p: &Vec2| (low.inf(p), high.sup(p));
        let (low, high) = view.points().iter().fold(outside, grown);
        (high - low).max() > PATCH * self.scale
    }

    pub fn observations(&self, view: &View) -> Observations {
        Observations::new(view.pairs().map(|(p, pixel)| ((p - self.centre) / self.scale, *pixel)))
    }

    /// `t = s t' - R c` for a pose of the centred, scaled target.
    pub fn cam_from_target(&self, pose: &Pose) -> Pose {
        Pose {
            rotation: pose.rotation,
            translation: pose.translation * self.scale - self.rotated_centre(pose),
        }
    }

    fn rotated_centre(&self, pose: &Pose) -> Vec3 {
        pose.rotation * Vec3::new(self.centre.x, self.centre.y, 0.0)
    }
}

/// A view narrower than this part of the size of all points sees a patch of a large target.
const PATCH: f64 = 0.3;

/// The frames of all views: one and the same, or each its own where views see patches of a large target, of which the whole would make rounding.
pub(super) enum TargetFrames {
    Common(TargetFrame),
    Own(Vec<TargetFrame>),
}

impl TargetFrames {
    pub fn of(views: &[View]) -> TargetFrames {
        let common = TargetFrame::of(views);
        if views.iter().all(|view| common.is_of_size(view)) {
            return TargetFrames::Common(common);
        }
        TargetFrames::Own(views.iter().map(|view| TargetFrame::of(std::slice::from_ref(view))).collect())
    }

    /// That of a view.
    pub fn at(&self, view: usize) -> &TargetFrame {
        match self {
            TargetFrames::Common(frame) => frame,
            TargetFrames::Own(frames) => &frames[view],
        }
    }

    /// Carries pose blocks over, `d t = s d t' + [R c]x delta`, for noise of variance `variance`.
    pub fn covariance(&self, mut covariance: Covariance, poses: &[Pose], variance: f64) -> Covariance {
        let blocks = covariance.poses.iter_mut().zip(&mut covariance.cross);
        for (view, (pose, (block, cross))) in poses.iter().zip(blocks).enumerate() {
            let TargetFrame { scale, .. } = *self.at(view);
            let lever = rotation::skew(&self.at(view).rotated_centre(pose));
            let turned = |rr: &Mat3, rt: &Mat3| lever * rr + scale * rt.transpose();
            let (rr, rt): (Mat3, Mat3) =
                (block.fixed_view::<3, 3>(0, 0).into(), block.fixed_view::<3, 3>(0, 3).into());
            let tt: Mat3 = block.fixed_view::<3, 3>(3, 3).into();
            // With the change [[I, 0], [K, s I]]: the lower rows K P_rr + s P_tr and K P_rt + s P_tt, then the columns alike.
            let lower = turned(&rr, &rt);
            let corner = lower * lever.transpose() + scale * (lever * rt + scale * tt);
            let symmetric = 0.5 * (corner + corner.transpose());
            block.fixed_view_mut::<3, 3>(0, 0).copy_from(&(variance * rr));
            block.fixed_view_mut::<3, 3>(3, 0).copy_from(&(variance * lower));
            block.fixed_view_mut::<3, 3>(0, 3).copy_from(&(variance * lower.transpose()));
            block.fixed_view_mut::<3, 3>(3, 3).copy_from(&(variance * symmetric));
            for mut row in cross.row_iter_mut() {
                let (r, t) = (Vec3::new(row[0], row[1], row[2]), Vec3::new(row[3], row[4], row[5]));
                let moved = (lever * r + scale * t) * variance;
                let scaled = r * variance;
                for i in 0..3 {
                    (row[i], row[3 + i]) = (scaled[i], moved[i]);
                }
            }
        }
        covariance.intrinsics *= variance;
        covariance
    }
}
