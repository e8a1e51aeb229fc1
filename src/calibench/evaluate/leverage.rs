//! How much of its own noise does a point pull into the fit? Leverages, which say how large each residual
//! should be.

use crate::board::View;
use crate::calibrate::Calibration;
use crate::camera::project_with_jacobian;
use crate::geometry::{Vec2, Vec3};
use nalgebra::{DVector, SMatrix};

/// The leverage of u and of v of every point, view by view: the diagonal of the hat matrix `J (J^T J)^-1
/// J^T`.
///
/// To first order the residuals are `(I - H)` times the noise, so a coordinate with leverage `h` has a
/// residual of variance `sigma^2 (1 - h)`, and the leverages sum to the number of unknowns (Hoaglin & Welsch
/// 1978), less what priors settle of them. `J` is taken at the estimate.
///
/// `None` if `views` are not those of the calibration, or if it has no residual degrees of freedom. Under a
/// robust loss the matrix is another; then the result is only indicative.
///
/// ```
/// use calibench::calibrate::{Settings, calibrate};
/// use calibench::evaluate::leverages;
/// use calibench::synth::{Scene, Stream, StreamKey};
///
/// let mut stream = Stream::open(StreamKey { seed: 1, scenario: "leverage", trial: 0, purpose: "noise" });
/// let views = Scene::example().observe(0.1, &mut stream);
/// let result = calibrate(&views, &Settings::standard())?;
/// let all = leverages(&result, &views).expect("these are its views");
/// // They sum to the number of unknowns: six of the camera, six of each view.
/// let sum: f64 = all.iter().flatten().map(|h| h.x + h.y).sum();
/// assert!((sum - 30.0).abs() < 1e-6);
/// # Ok::<(), calibench::calibrate::CalibrationError>(())
/// ```
pub fn leverages(calibration: &Calibration, views: &[View]) -> Option<Vec<Vec<Vec2>>> {
    let covariance = &calibration.covariance;
    let variance = calibration.sigma_px * calibration.sigma_px;
    if views.len() != calibration.cam_from_target.len() || variance.is_nan() || variance <= 0.0 {
        return None;
    }
    let of_point = |view: usize, point: &Vec2| {
        let pose = &calibration.cam_from_target[view];
        let point = Vec3::new(point.x, point.y, 0.0);
        let jacobian = project_with_jacobian(&calibration.camera, pose, &point).ok()?;
        let columns = covariance.columns(&jacobian.intrinsics);
        let of_row = |row: usize| {
            let a = DVector::from_iterator(columns.len(), columns.iter().map(|column| column[row]));
            let c: SMatrix<f64, 6, 1> = jacobian.pose.row(row).transpose();
            let intrinsics = a.dot(&(&covariance.intrinsics * &a));
            let cross = a.dot(&(&covariance.cross[view] * c));
            let pose = c.dot(&(covariance.poses[view] * c));
            (intrinsics + 2.0 * cross + pose) / variance
        };
        Some(Vec2::new(of_row(0), of_row(1)))
    };
    views
        .iter()
        .enumerate()
        .map(|(i, view)| view.points().iter().map(|point| of_point(i, point)).collect())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::{Settings, calibrate};
    use crate::synth::{Scene, Stream, StreamKey};

    #[test]
    fn leverages_lie_between_0_and_1_and_sum_to_the_number_of_unknowns() {
        let key = StreamKey { seed: 1, scenario: "leverage", trial: 0, purpose: "noise" };
        let views = Scene::example().observe(0.1, &mut Stream::open(key));
        let result = calibrate(&views, &Settings::standard()).unwrap();
        let all = leverages(&result, &views).unwrap();
        assert!(all.iter().flatten().all(|h| h.min() > 0.0 && h.max() < 1.0));
        // Six of the camera, six of each of four views.
        let sum: f64 = all.iter().flatten().map(|h| h.x + h.y).sum();
        assert!((sum - 30.0).abs() < 1e-6, "{sum}");
        assert_eq!(leverages(&result, &views[1..]), None);
    }
}
