//! What does a sample photograph? A camera, poses, the marks that every view sees, and how well anybody could
//! know them.

use super::bound::bound;
use calibench::board::View;
use calibench::calibrate::Covariance;
use calibench::camera::{FreeParameters, Lens};
use calibench::evaluate::{BoundError, cramer_rao};
use calibench::geometry::{Pose, Vec2};
use calibench::synth::{Scene, SceneError, Stream, Truth};

/// Truth, exact pixels and bound of a sample.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Setup {
    /// Camera, poses and the whole board, with exact pixels.
    pub scene: Scene<Lens>,
    /// Of every view the marks that it sees, by their place on the board; nothing where all see the whole
    /// board.
    seen: Option<Vec<Vec<usize>>>,
    /// Cramer-Rao bound of camera and poses.
    pub bound: Covariance,
}

/// A setup that cannot be.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SetupError {
    /// It cannot be photographed.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// It determines nothing.
    #[error(transparent)]
    Bound(#[from] BoundError),
}

impl Setup {
    /// Every view sees the whole board.
    ///
    /// # Errors
    /// A scene that cannot be photographed, or that determines nothing.
    pub fn whole(truth: Truth<Lens>, free: FreeParameters, sigma_px: f64) -> Result<Setup, SetupError> {
        let bound = cramer_rao(&truth, free, sigma_px)?;
        Ok(Setup { scene: Scene::new(truth)?, seen: None, bound })
    }

    /// A view sees the marks that `sees` names: of a view, and the place and exact pixel of a mark.
    ///
    /// # Errors
    /// As [`Setup::whole`].
    pub fn ragged(
        truth: Truth<Lens>,
        mut sees: impl FnMut(usize, usize, &Vec2) -> bool,
        free: FreeParameters,
        sigma_px: f64,
    ) -> Result<Setup, SetupError> {
        let scene = Scene::new(truth)?;
        let of_view = |(view, pixels): (usize, &Vec<Vec2>)| -> Vec<usize> {
            let marks = pixels.iter().enumerate();
            marks.filter(|(mark, pixel)| sees(view, *mark, pixel)).map(|(mark, _)| mark).collect()
        };
        let seen: Vec<Vec<usize>> = scene.pixels().iter().enumerate().map(of_view).collect();
        let truth = &scene.truth;
        let points = |marks: &Vec<usize>| marks.iter().map(|&mark| truth.points[mark]).collect();
        let views: Vec<(Pose, Vec<Vec2>)> =
            truth.cam_from_target.iter().copied().zip(seen.iter().map(points)).collect();
        let bound = bound(&truth.camera, free, &views, sigma_px)
            .ok_or_else(|| BoundError::Singular { free: free.to_string(), views: views.len() })?;
        Ok(Setup { scene, seen: Some(seen), bound })
    }

    /// Whether every view sees all marks.
    pub fn sees_whole_board(&self) -> bool {
        self.seen.is_none()
    }

    /// The views without noise.
    pub fn exact(&self) -> Vec<View> {
        self.kept(self.scene.exact())
    }

    /// The views with noise, which is drawn for every mark of the board, seen or not.
    pub fn observe(&self, sigma_px: f64, stream: &mut Stream) -> Vec<View> {
        self.kept(self.scene.observe(sigma_px, stream))
    }

    fn kept(&self, views: Vec<View>) -> Vec<View> {
        let Some(seen) = &self.seen else { return views };
        let of_view = |(view, marks): (&View, &Vec<usize>)| {
            let of = |list: &[Vec2]| marks.iter().map(|&mark| list[mark]).collect();
            View::new(of(view.points()), of(view.pixels())).expect("a part of a view is a view")
        };
        views.iter().zip(seen).map(of_view).collect()
    }

    /// Marks that are seen, over all views.
    pub fn observations(&self) -> usize {
        self.seen.as_ref().map_or(self.scene.observations(), |seen| seen.iter().map(Vec::len).sum())
    }

    /// Degrees of freedom of the residuals.
    pub fn degrees_of_freedom(&self) -> usize {
        2 * self.observations() - self.bound.free.len() - 6 * self.bound.poses.len()
    }

    /// Largest distance of a pixel from the image, px; 0 if all lie inside.
    pub fn outside_image_px(&self) -> f64 {
        let (width, height) = self.scene.truth.image_size;
        let over = |x: f64, size: usize| (-0.5 - x).max(x - (size as f64 - 0.5)).max(0.0);
        let beyond = |p: &Vec2| over(p.x, width).max(over(p.y, height));
        self.exact().iter().flat_map(|view| view.pixels().iter().map(beyond)).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn how_far_pixels_lie_outside_is_told_by_the_farthest() {
        let setup = crate::suite::suite().unwrap().remove(0).setup;
        assert_eq!(setup.outside_image_px(), 0.0);
        let pixels: Vec<Vec2> = setup.exact().iter().flat_map(|view| view.pixels().to_vec()).collect();
        let most = |axis: usize| pixels.iter().map(|pixel| pixel[axis]).fold(0.0, f64::max);
        // The image ends half a pixel beyond its last pixel's centre.
        for (size, expected) in
            [((300, 480), most(0) - 299.5), ((640, 300), most(1) - 299.5), ((640, 481), 0.0)]
        {
            let mut cut = setup.clone();
            cut.scene.truth.image_size = size;
            assert!((cut.outside_image_px() - expected).abs() < 1e-9, "{size:?}");
        }
    }

    #[test]
    fn degrees_of_freedom_are_coordinates_less_unknowns() {
        let setup = crate::suite::suite().unwrap().remove(0).setup;
        // Four views of 63 marks, six parameters and six numbers a pose.
        assert_eq!((setup.observations(), setup.degrees_of_freedom()), (252, 504 - 6 - 24));
    }
}
