//! Where does the model put a target point, and how does that move with the parameters? All in units of the
//! gauge length.

use crate::board::View;
use crate::camera::BrownConrady;
use crate::geometry::{Homography, Mat3, Scatter, Vec2, Vec3};
use nalgebra::{Matrix2, SMatrix, SVector};

/// `h11 ... h32` of the local homography (`h33 = 1`), `k1`, `k2`, and the centre's shift in units of the
/// gauge length.
pub(super) const PARAMETERS: usize = 12;
pub(super) type ParameterVector = SVector<f64, PARAMETERS>;
pub(super) type PointJacobian = SMatrix<f64, 2, PARAMETERS>;

/// Target points reduced to centroid 0 and RMS radius 1, pixels to offsets from the given centre in units of
/// the gauge length.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frames {
    target_centroid: Vec2,
    target_radius: f64,
    pub focal_px: f64,
    given_centre: Vec2,
}

impl Frames {
    pub fn of(view: &View, focal_px: f64, given_centre: Vec2) -> Frames {
        let scatter = Scatter::of(view.points());
        Frames {
            target_centroid: scatter.centroid,
            target_radius: scatter.rms_radius,
            focal_px,
            given_centre,
        }
    }

    pub fn target_offset(&self, point: &Vec2) -> Vec2 {
        (point - self.target_centroid) / self.target_radius
    }

    pub fn pixel_offset(&self, pixel: &Vec2) -> Vec2 {
        (pixel - self.given_centre) / self.focal_px
    }

    /// `target_offset` as a homography.
    pub fn offset_from_target(&self) -> Mat3 {
        let (s, c) = (1.0 / self.target_radius, self.target_centroid);
        Mat3::new(s, 0.0, -s * c.x, 0.0, s, -s * c.y, 0.0, 0.0, 1.0)
    }

    /// The inverse of `pixel_offset` as a homography.
    pub fn ideal_from_offset(&self) -> Mat3 {
        let (f, c) = (self.focal_px, self.given_centre);
        Mat3::new(f, 0.0, c.x, 0.0, f, c.y, 0.0, 0.0, 1.0)
    }

    /// Parameters of a homography between offsets, without distortion.
    pub fn start(&self, h: &Homography) -> ParameterVector {
        ParameterVector::from_fn(|i, _| if i < 8 { h.0[(i / 3, i % 3)] / h.0[(2, 2)] } else { 0.0 })
    }

    pub fn local(&self, at: &ParameterVector) -> Mat3 {
        Mat3::new(at[0], at[1], at[2], at[3], at[4], at[5], at[6], at[7], 1.0)
    }

    pub fn homography(&self, at: &ParameterVector) -> Homography {
        let h = self.ideal_from_offset() * self.local(at) * self.offset_from_target();
        Homography(if h[(2, 2)] != 0.0 { h / h[(2, 2)] } else { h })
    }

    pub fn lens(&self, at: &ParameterVector) -> BrownConrady {
        BrownConrady::radial(at[8], at[9])
    }

    pub fn centre(&self, at: &ParameterVector) -> Vec2 {
        self.given_centre + Vec2::new(at[10], at[11]) * self.focal_px
    }

    /// Predicted minus observed pixels; NaN for a point behind the horizon.
    pub fn residuals<'a>(
        &'a self,
        view: &'a View,
        at: &'a ParameterVector,
    ) -> impl Iterator<Item = Vec2> + 'a {
        view.pairs().map(|(point, pixel)| {
            let predicted = predict(self, at, point);
            (predicted - self.pixel_offset(pixel)) * self.focal_px
        })
    }
}

/// The observed offset of a target point; NaN behind the horizon.
pub(super) fn predict(frames: &Frames, at: &ParameterVector, point: &Vec2) -> Vec2 {
    let centre = Vec2::new(at[10], at[11]);
    let Some((ideal, _, _)) = ideal_offset(frames, at, point) else { return Vec2::repeat(f64::NAN) };
    centre + frames.lens(at).distort(&(ideal - centre))
}

/// The predicted offset and its derivatives; `None` behind the horizon.
///
/// With `x = i - c` and `D` the distortion's Jacobian at `x`: `dm/di = D`, `dm/dc = I - D`, `dm/dk1 = x r^2`,
/// `dm/dk2 = x r^4`.
pub(super) fn predict_with_jacobian(
    frames: &Frames,
    at: &ParameterVector,
    point: &Vec2,
) -> Option<(Vec2, PointJacobian)> {
    let centre = Vec2::new(at[10], at[11]);
    let (ideal, a, depth) = ideal_offset(frames, at, point)?;
    let lens = frames.lens(at);
    let x = ideal - centre;
    let by_ideal = lens.jacobian(&x);
    let mut jacobian = PointJacobian::zeros();
    for i in 0..3 {
        let entry = a[i] / depth;
        jacobian.set_column(i, &(by_ideal.column(0) * entry));
        jacobian.set_column(i + 3, &(by_ideal.column(1) * entry));
        if i < 2 {
            jacobian.set_column(i + 6, &(by_ideal * ideal * -entry));
        }
    }
    let s = x.norm_squared();
    jacobian.set_column(8, &(x * s));
    jacobian.set_column(9, &(x * (s * s)));
    jacobian.fixed_columns_mut::<2>(10).copy_from(&(Matrix2::identity() - by_ideal));
    Some((centre + lens.distort(&x), jacobian))
}

/// The ideal offset, the homogeneous target offset and its depth.
fn ideal_offset(frames: &Frames, at: &ParameterVector, point: &Vec2) -> Option<(Vec2, Vec3, f64)> {
    let q = frames.target_offset(point);
    let a = Vec3::new(q.x, q.y, 1.0);
    let image = frames.local(at) * a;
    (image.z > 0.0).then(|| (Vec2::new(image.x / image.z, image.y / image.z), a, image.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn derivatives_agree_with_central_differences(p in prop::array::uniform12(-1.0f64..1.0), q in prop::array::uniform2(-30.0f64..30.0)) {
            let points = [(-30.0, -30.0), (30.0, -30.0), (30.0, 30.0), (-30.0, 30.0)].map(|(x, y)| Vec2::new(x, y));
            let view = View::new(points.to_vec(), points.to_vec()).unwrap();
            let frames = Frames::of(&view, 600.0, Vec2::new(320.0, 240.0));
            let at = ParameterVector::from_column_slice(&[
                0.3 + 0.1 * p[0], 0.1 * p[1], 0.1 * p[2], 0.1 * p[3], 0.3 + 0.1 * p[4], 0.1 * p[5], 0.2 * p[6], 0.2 * p[7],
                0.3 * p[8], 0.2 * p[9], 0.05 * p[10], 0.05 * p[11],
            ]);
            let point = Vec2::from(q);
            let (predicted, jacobian) = predict_with_jacobian(&frames, &at, &point).unwrap();
            prop_assert_eq!(predicted, predict(&frames, &at, &point));
            for i in 0..PARAMETERS {
                let step = ParameterVector::ith(i, 1e-5);
                let difference = (predict(&frames, &(at + step), &point) - predict(&frames, &(at - step), &point)) / 2e-5;
                // Numbers of order one: h^2 = 1e-10 of the third derivative, 1e-11 of rounding.
                prop_assert!((difference - jacobian.column(i)).norm() < 1e-8, "parameter {i}");
            }
        }
    }
}
