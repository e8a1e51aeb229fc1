//! In which frame is a target refined? Centred on its points and of unit size, whatever its own unit and
//! origin.

use super::Covariance;
use super::normal::Observations;
use crate::board::View;
use crate::geometry::{Mat3, Pose, Vec2, Vec3, rotation};

/// The frame in which targets are refined: centred on the points, scaled to unit size, so that neither the
/// unit nor a far origin of the target costs digits.
pub(super) struct TargetFrame {
    centre: Vec2,
    scale: f64,
}

/// Sums over some points `p`, relative to an origin among them: their distances from the centroid are then of
/// the points' own size.
#[derive(Clone, Copy)]
struct Moments {
    count: f64,
    /// `sum (p - origin)`.
    sum: Vec2,
    /// `sum |p - origin|^2`.
    square: f64,
}

impl Moments {
    fn of(points: &[Vec2], origin: Vec2) -> Moments {
        let (mut x, mut y, mut square) = (0.0, 0.0, 0.0);
        for point in points {
            let (dx, dy) = (point.x - origin.x, point.y - origin.y);
            (x, y, square) = (x + dx, y + dy, square + (dx * dx + dy * dy));
        }
        Moments { count: points.len() as f64, sum: Vec2::new(x, y), square }
    }

    fn plus(self, other: &Moments) -> Moments {
        Moments {
            count: self.count + other.count,
            sum: self.sum + other.sum,
            square: self.square + other.square,
        }
    }

    /// Mean squared distance from the centroid.
    fn mean_square(&self) -> f64 {
        self.square / self.count - (self.sum / self.count).norm_squared()
    }
}

impl TargetFrame {
    fn of(moments: &Moments, origin: Vec2) -> TargetFrame {
        let mean_square = moments.mean_square();
        // Coincident points have no size; their homography refuses them.
        let scale = if mean_square > 0.0 { mean_square.sqrt() } else { 1.0 };
        TargetFrame { centre: origin + moments.sum / moments.count, scale }
    }

    pub fn observations(&self, view: &View) -> Observations {
        Observations::new(view.pairs().map(|(p, pixel)| ((p - self.centre) / self.scale, *pixel)))
    }

    /// A point of the target in this frame.
    pub fn of_point(&self, point: &Vec2) -> Vec2 {
        (point - self.centre) / self.scale
    }

    /// The target's unit in this frame's.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// `t' = (t + R c) / s`: the inverse of [`TargetFrame::cam_from_target`].
    pub fn of_pose(&self, pose: &Pose) -> Pose {
        Pose {
            rotation: pose.rotation,
            translation: (pose.translation + self.rotated_centre(pose)) / self.scale,
        }
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

/// A view whose points' root mean square distance from their centroid is below this part of that of all
/// points sees a patch of a large target.
const PATCH: f64 = 0.1;

/// The frames of all views: one and the same, or each its own where views see patches of a large target, of
/// which the whole would make rounding.
pub(super) enum TargetFrames {
    Common(TargetFrame),
    Own(Vec<TargetFrame>),
}

impl TargetFrames {
    pub fn of(views: &[View]) -> TargetFrames {
        let Some(&origin) = views.iter().flat_map(|view| view.points()).next() else {
            return TargetFrames::Own(Vec::new());
        };
        let each: Vec<Moments> = views.iter().map(|view| Moments::of(view.points(), origin)).collect();
        let nothing = Moments { count: 0.0, sum: Vec2::zeros(), square: 0.0 };
        let all = each.iter().fold(nothing, Moments::plus);
        let smallest = PATCH * PATCH * all.mean_square();
        if each.iter().all(|view| view.mean_square() > smallest) {
            return TargetFrames::Common(TargetFrame::of(&all, origin));
        }
        // A view without points has no frame either; its homography refuses it.
        let own = |view: &View| {
            let origin = view.points().first().copied().unwrap_or(origin);
            TargetFrame::of(&Moments::of(view.points(), origin), origin)
        };
        TargetFrames::Own(views.iter().map(own).collect())
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
            // With the change [[I, 0], [K, s I]]: the lower rows K P_rr + s P_tr and K P_rt + s P_tt, then
            // the columns alike.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn view(points: impl Iterator<Item = (f64, f64)>) -> View {
        let points: Vec<Vec2> = points.map(|(x, y)| Vec2::new(x, y)).collect();
        View::new(points.clone(), points).unwrap()
    }

    fn grid(size: f64, at: f64) -> View {
        view((0..9).map(|i| (at + size * f64::from(i % 3), at + size * f64::from(i / 3))))
    }

    #[test]
    fn views_of_a_patch_have_frames_of_their_own() {
        let is_common = |views: &[View]| matches!(TargetFrames::of(views), TargetFrames::Common(_));
        assert!(is_common(&[grid(1.0, 0.0), grid(0.2, 0.0)]));
        assert!(!is_common(&[grid(1.0, 0.0), grid(0.01, 0.0)]));
        let frames = TargetFrames::of(&[grid(1.0, 0.0), grid(0.01, 0.5)]);
        assert!((frames.at(1).centre - Vec2::repeat(0.51)).norm() < 1e-12);
        assert!((frames.at(1).scale - 0.01 * (4.0_f64 / 3.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn a_view_without_points_is_left_to_its_homography() {
        let nothing = || view(std::iter::empty());
        assert!(
            matches!(TargetFrames::of(&[nothing(), grid(1.0, 0.0)]), TargetFrames::Own(frames) if frames.len() == 2)
        );
        assert!(matches!(TargetFrames::of(&[nothing()]), TargetFrames::Own(_)));
    }

    #[test]
    fn a_pose_in_the_frame_shows_the_same_points_and_leads_back() {
        let frame = TargetFrame { centre: Vec2::new(50.0, -30.0), scale: 4.0 };
        let pose = Pose {
            rotation: rotation::from_xyz_rad(0.3, -0.4, 0.2),
            translation: Vec3::new(5.0, -7.0, 150.0),
        };
        let own = frame.of_pose(&pose);
        let point = Vec2::new(61.0, -12.0);
        let in_frame = frame.of_point(&point);
        let seen = 4.0 * own.apply(&Vec3::new(in_frame.x, in_frame.y, 0.0));
        assert!((seen - pose.apply(&Vec3::new(point.x, point.y, 0.0))).norm() < 1e-12);
        assert!((frame.cam_from_target(&own).translation - pose.translation).norm() < 1e-12);
    }
}
