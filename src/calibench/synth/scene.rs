//! What does the virtual camera photograph, and with what noise?

use super::Stream;
use crate::board::{Board, View};
use crate::camera::{BrownConrady, Camera, Imaging};
use crate::geometry::{Mat3, Pose, Vec2, Vec3, rotation};

/// The truth of a synthetic experiment: camera, image size, target points and poses. The lens is
/// Brown-Conrady's unless another type is named.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Truth<L = BrownConrady> {
    /// Intrinsic parameters.
    pub camera: Camera<L>,
    /// Image width and height, px.
    pub image_size: (usize, usize),
    /// Target points, plane Z = 0.
    pub points: Vec<Vec2>,
    /// One pose a view.
    pub cam_from_target: Vec<Pose>,
}

/// A scene: noise-free pixels of every view of a truth.
///
/// ```
/// use calibench::synth::{Scene, Stream, StreamKey};
///
/// let scene = Scene::example();
/// assert_eq!(scene.observations(), 4 * 63);
/// let key = StreamKey { seed: 1, scenario: "example", trial: 0, purpose: "noise" };
/// let noisy = scene.observe(0.1, &mut Stream::open(key));
/// // The same key gives the same noise, to the last bit.
/// assert_eq!(noisy, scene.observe(0.1, &mut Stream::open(key)));
/// assert_ne!(noisy, scene.exact());
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Scene<L = BrownConrady> {
    /// What produced the pixels.
    pub truth: Truth<L>,
    pixels: Vec<Vec<Vec2>>,
}

/// Why a scene cannot be photographed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A target point is not in front of the camera.
    #[error(
        "view {view}: target point {point} is not in front of the camera; increase the distance or reduce the tilt"
    )]
    BehindCamera {
        /// Index of the view.
        view: usize,
        /// Index of the point.
        point: usize,
    },
    /// A target point lies beyond the radius where the lens model is one-to-one.
    #[error("view {view}: target point {point} lies beyond the radius where the lens model folds back")]
    BeyondMonotoneRadius {
        /// Index of the view.
        view: usize,
        /// Index of the point.
        point: usize,
    },
}

impl Truth {
    /// A virtual camera: f = 600, principal point (326, 243), k1 = -0.18, k2 = 0.05.
    pub fn example_camera() -> Camera {
        Camera::pinhole(600.0, 600.0, 326.0, 243.0).with_distortion(BrownConrady::radial(-0.18, 0.05))
    }

    /// The size of its image, px.
    pub const EXAMPLE_IMAGE: (usize, usize) = (640, 480);

    /// A target: 9 x 7 circles of 3 mm, 10 mm apart.
    pub fn example_board() -> Board {
        Board::circles(9, 7, 10.0, 3.0).expect("a 9 x 7 grid of 3 mm discs is a board")
    }

    /// Four poses at 120 mm: fronto-parallel, +20 deg about X, -20 deg about Y, and (-15, 15, 10) deg.
    pub fn example_poses() -> Vec<Pose> {
        [[0.0, 0.0, 0.0], [20.0, 0.0, 0.0], [0.0, -20.0, 0.0], [-15.0, 15.0, 10.0]]
            .map(|degrees| looking_at_centre(degrees, 120.0))
            .to_vec()
    }

    /// The four poses of that target before that camera.
    pub fn example() -> Truth {
        Truth {
            camera: Truth::example_camera(),
            image_size: Truth::EXAMPLE_IMAGE,
            points: Truth::example_board().points(),
            cam_from_target: Truth::example_poses(),
        }
    }
}

/// The pose of a target whose centre lies on the optical axis at `distance`, turned by `Rz Ry Rx` of the
/// given degrees.
pub fn looking_at_centre(xyz_degrees: [f64; 3], distance: f64) -> Pose {
    let [x, y, z] = xyz_degrees.map(f64::to_radians);
    let rotation: Mat3 = rotation::from_xyz_rad(x, y, z);
    Pose { rotation, translation: Vec3::new(0.0, 0.0, distance) }
}

impl Scene {
    /// Four photographs of a target, [`Truth::example`].
    pub fn example() -> Scene {
        Scene::new(Truth::example()).expect("the target is in front of its camera")
    }
}

impl<L: Imaging> Scene<L> {
    /// Projects every target point in every view.
    ///
    /// # Errors
    /// See [`SceneError`]: a point that the camera does not see, or that its lens folds over another.
    pub fn new(truth: Truth<L>) -> Result<Scene<L>, SceneError> {
        let is_one_to_one = truth.camera.distortion.one_to_one();
        let see = |view: usize, pose: &Pose| -> Result<Vec<Vec2>, SceneError> {
            truth
                .points
                .iter()
                .enumerate()
                .map(|(point, p)| {
                    let point_cam = pose.apply(&Vec3::new(p.x, p.y, 0.0));
                    let pixel = L::image(&truth.camera, &point_cam)
                        .ok_or(SceneError::BehindCamera { view, point })?;
                    if !is_one_to_one(&point_cam) {
                        return Err(SceneError::BeyondMonotoneRadius { view, point });
                    }
                    Ok(pixel)
                })
                .collect()
        };
        let pixels = truth
            .cam_from_target
            .iter()
            .enumerate()
            .map(|(i, pose)| see(i, pose))
            .collect::<Result<_, _>>()?;
        drop(is_one_to_one);
        Ok(Scene { truth, pixels })
    }

    /// Noise-free pixels, view by view.
    pub fn pixels(&self) -> &[Vec<Vec2>] {
        &self.pixels
    }

    /// Number of point observations over all views.
    pub fn observations(&self) -> usize {
        self.pixels.iter().map(Vec::len).sum()
    }

    /// The views without noise.
    pub fn exact(&self) -> Vec<View> {
        self.observe_with(|pixel| *pixel)
    }

    /// The views with Gaussian noise of standard deviation `sigma_px` on each of u and v, drawn view by view,
    /// point by point, u before v.
    ///
    /// # Panics
    /// A standard deviation that is not finite: no pixel has such a place.
    pub fn observe(&self, sigma_px: f64, stream: &mut Stream) -> Vec<View> {
        self.observe_with(|pixel| {
            let du = stream.normal();
            let dv = stream.normal();
            pixel + Vec2::new(du, dv) * sigma_px
        })
    }

    fn observe_with(&self, mut see: impl FnMut(&Vec2) -> Vec2) -> Vec<View> {
        self.pixels
            .iter()
            .map(|view| {
                let seen = view.iter().map(&mut see).collect();
                View::new(self.truth.points.clone(), seen).expect("a scene has one finite pixel a point")
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_examples_target_fills_the_published_part_of_the_image() {
        let scene = Scene::example();
        assert_eq!(scene.observations(), 252);
        let camera = &scene.truth.camera;
        // r_max is about 0.44 in normalised coordinates.
        let largest = scene
            .pixels()
            .iter()
            .flatten()
            .map(|p| camera.normalised_ray(p).unwrap().norm())
            .fold(0.0, f64::max);
        assert!((0.42..0.52).contains(&largest), "r_max {largest}");
    }

    #[test]
    fn a_target_behind_the_camera_is_refused() {
        let mut truth = Truth::example();
        truth.cam_from_target[1].translation.z = -5.0;
        assert_eq!(Scene::new(truth), Err(SceneError::BehindCamera { view: 1, point: 0 }));
    }
}
