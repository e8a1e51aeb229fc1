//! How does fy follow fx where the two are tied? At a fixed ratio: square pixels, or cells whose shape a data
//! sheet states.
//!
//! Tied, fy is no unknown of its own. With `fy = a fx` the column of fx in every Jacobian becomes `d/dfx + a
//! d/dfy`, every step ends with `fy = a fx`, and the relaxed model knows the shape of the cells.

use crate::camera::Camera;

/// The camera with `fy = a fx`, if they are tied.
pub(super) fn tied<L>(camera: Camera<L>, fy_per_fx: Option<f64>) -> Camera<L> {
    match fy_per_fx {
        Some(ratio) => Camera { fy: ratio * camera.fx, ..camera },
        None => camera,
    }
}

/// The camera with both focal lengths moved alike until they stand in the ratio: `fx <- sqrt(fx fy / a)`. For
/// starts that know of no tie.
pub(super) fn met_halfway(camera: Camera, fy_per_fx: Option<f64>) -> Camera {
    match fy_per_fx {
        Some(ratio) => tied(Camera { fx: (camera.fx * (camera.fy / ratio)).sqrt(), ..camera }, fy_per_fx),
        None => camera,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn focal_lengths_that_meet_halfway_move_by_the_same_factor() {
        // 600 and 300 px to a ratio of 3/4: fx by sqrt(2/3), fy by its inverse.
        let camera = met_halfway(Camera::pinhole(600.0, 300.0, 320.0, 240.0), Some(0.75));
        let factor = (2.0f64 / 3.0).sqrt();
        assert!((camera.fx - 600.0 * factor).abs() < 1e-12 && (camera.fy - 300.0 / factor).abs() < 1e-12);
    }
}
