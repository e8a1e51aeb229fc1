//! The calibrator as a stranger sees it: a matrix of numbers and a call for points.

use calibench::board::View;
use calibench::calibrate::{Calibration, CalibrationError, Settings, calibrate};
use calibench::camera::{Camera, FreeParameters, UndistortError};
use calibench::geometry::Vec2;

/// Our solver behind an interface with two faults in its manual, after those that the chapter met.
pub(crate) struct BlackBox(Calibration);

impl BlackBox {
    /// Calibrates from views of a flat target.
    pub(crate) fn calibrate(views: &[View], free: FreeParameters) -> Result<BlackBox, CalibrationError> {
        calibrate(views, &Settings::new(free)).map(BlackBox)
    }

    /// The camera. The manual: "row 0 holds the focal lengths and the principal point, row 1 the distortion".
    /// What it does not say: row 0 is `_, fx, cx, fy, cy`, row 1 is `k1, k2, p1, p2, _`.
    pub(crate) fn matrix(&self) -> [[f64; 5]; 2] {
        let Camera { fx, fy, cx, cy, distortion: lens, .. } = self.0.camera;
        [[0.0, fx, cx, fy, cy], [lens.k1, lens.k2, lens.p1, lens.p2, 0.0]]
    }

    /// A point corrected for distortion. The manual: "in world coordinates, mm". What it gives: pixels.
    pub(crate) fn correct_point(&self, pixel: &Vec2) -> Result<Vec2, UndistortError> {
        self.0.camera.correct_pixel(pixel)
    }
}
