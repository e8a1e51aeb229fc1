//! What may a file say of a camera? All that any of the formats holds, in the conventions of this library.

use crate::camera::{Camera, FreeParameters, Lens, Parameter};
use crate::geometry::Pose;
use nalgebra::DMatrix;

/// Covariance of the parameters that a calibration estimated.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimated {
    /// Which parameters the rows are, in order; the others were held.
    pub free: FreeParameters,
    /// fy over fx, if the two were tied: fy then has no row.
    pub fy_per_fx: Option<f64>,
    /// n x n.
    pub covariance: DMatrix<f64>,
    /// Degrees of freedom behind the noise that scales the covariance, if known.
    pub degrees_of_freedom: Option<usize>,
    /// What the file itself says against its standard deviations: tests by them then mean nothing.
    pub doubts: Vec<String>,
}

/// A camera as a file holds it.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraFile {
    /// Its name, where the format gives one.
    pub name: Option<String>,
    /// The camera; pixel (0, 0) is the centre of the top-left pixel.
    pub camera: Camera<Lens>,
    /// Width and height, px.
    pub image_size: Option<(usize, usize)>,
    /// How well it is known.
    pub estimated: Option<Estimated>,
    /// Where the camera stands: from the coordinates of a reference to those of the camera.
    pub cam_from_reference: Option<Pose>,
    /// What the file says that is not kept.
    pub notes: Vec<String>,
    /// What had to be assumed, since the file does not say it: a file that was cut off may look so.
    pub assumed: Vec<String>,
}

impl CameraFile {
    /// A camera of which nothing more is known.
    pub fn of(camera: impl Into<Camera<Lens>>) -> CameraFile {
        CameraFile {
            name: None,
            camera: camera.into(),
            image_size: None,
            estimated: None,
            cam_from_reference: None,
            notes: Vec::new(),
            assumed: Vec::new(),
        }
    }

    /// The same camera where the centre of the first pixel has other coordinates: `by` px more in u and v.
    pub(super) fn with_origin_moved(mut self, by: f64) -> CameraFile {
        self.camera.cx += by;
        self.camera.cy += by;
        self
    }

    /// The camera of the same image scaled to another size, edge to edge.
    ///
    /// The image's edge lies at -1/2, so `u' = s (u + 1/2) - 1/2`, with `s` the ratio of the widths, and the
    /// same for v with the heights. Focal lengths and skew take the factor of their axis; the lens, which
    /// acts on normalised coordinates, stays. `None` where the size of the image is not known.
    pub fn resized(mut self, to: (usize, usize)) -> Option<CameraFile> {
        let from = self.image_size?;
        let (su, sv) = (to.0 as f64 / from.0 as f64, to.1 as f64 / from.1 as f64);
        let factor = |p: Parameter| match p {
            Parameter::Fx | Parameter::Cx | Parameter::Skew => su,
            Parameter::Fy | Parameter::Cy => sv,
            _ => 1.0,
        };
        let camera = &mut self.camera;
        (camera.fx, camera.fy, camera.skew) = (su * camera.fx, sv * camera.fy, su * camera.skew);
        (camera.cx, camera.cy) = (su * (camera.cx + 0.5) - 0.5, sv * (camera.cy + 0.5) - 0.5);
        if let Some(estimated) = &mut self.estimated {
            let factors: Vec<f64> = estimated.free.iter().map(factor).collect();
            let scaled = |i: usize, j: usize| factors[i] * factors[j] * estimated.covariance[(i, j)];
            estimated.covariance = DMatrix::from_fn(factors.len(), factors.len(), scaled);
            estimated.fy_per_fx = estimated.fy_per_fx.map(|ratio| ratio * sv / su);
        }
        self.image_size = Some(to);
        Some(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::BrownConrady;
    use crate::geometry::Vec3;

    #[test]
    fn a_resized_image_shows_a_point_at_the_resized_place() {
        let camera = Camera { skew: 1.5, ..Camera::pinhole(600.0, 590.0, 326.0, 243.0) }
            .with_distortion(BrownConrady { k1: -0.2, k2: 0.05, p1: 1e-3, p2: -2e-3, k3: 0.01 });
        let file = CameraFile { image_size: Some((640, 480)), ..CameraFile::of(camera) };
        let smaller = file.clone().resized((320, 160)).unwrap();
        let point = Vec3::new(0.3, -0.2, 1.0);
        let (before, after) = (camera.project(&point).unwrap(), smaller.camera.pixel(&point).unwrap());
        // Edges meet edges: -1/2 stays, and 639.5 becomes 319.5.
        assert!((after.x - (0.5 * (before.x + 0.5) - 0.5)).abs() < 1e-12);
        assert!((after.y - ((before.y + 0.5) / 3.0 - 0.5)).abs() < 1e-12);
        assert!(CameraFile { image_size: None, ..file }.resized((1, 1)).is_none());
    }
}
