//! How may the world differ from the model that a solver is asked to fit? Noise, boards and lenses that break
//! what the protocol promises.

use calibench::board::View;
use calibench::camera::{Camera, Imaging, Lens, Model, Parameter};
use calibench::geometry::{Vec2, Vec3};
use calibench::synth::departure::{bowed, correlate};
use calibench::synth::{Scene, Stream};

/// Something that the model leaves out.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Violation {
    /// Noise that neighbouring marks share: its correlation from one mark of the grid to the next, along rows
    /// and columns. Its standard deviation stays.
    CorrelatedNoise(f64),
    /// Noise along u of so many times the deviation along v; the mean of both variances stays.
    NoisePerAxis(f64),
    /// Noise of so many times the deviation in the last so many views.
    NoisePerView {
        /// Views.
        last: usize,
        /// Times the deviation of the others.
        factor: f64,
    },
    /// A board so many times as large as stated.
    BoardScale(f64),
    /// A board so many times as wide as stated, and as high as stated.
    BoardWidth(f64),
    /// A board that bulges towards the camera by so much in its middle, in units of the target: a paraboloid
    /// that leaves the corner marks where they should be.
    BowedBoard(f64),
    /// Another camera than the model can be.
    OtherLens(Camera<Lens>),
}

impl Violation {
    /// What is seen of the scene in the world as it is.
    ///
    /// Of a mark that the other world does not image the scene's own pixel is kept: the suite has none.
    pub fn observe(&self, scene: &Scene<Lens>, sigma_px: f64, stream: &mut Stream) -> Vec<View> {
        let points = &scene.truth.points;
        let views = scene.pixels().iter().enumerate();
        let seen = |(i, ideal): (usize, &Vec<Vec2>)| {
            let noise = self.noise(i, scene.pixels().len(), points, stream);
            let pixels = ideal.iter().zip(points).zip(noise);
            let pixels = pixels.map(|((pixel, point), noise)| {
                self.image(scene, i, point).unwrap_or(*pixel) + noise * sigma_px
            });
            View::new(points.clone(), pixels.collect()).expect("a scene has one finite pixel a point")
        };
        views.map(seen).collect()
    }

    /// Of the free parameters those that the world has too, so that there is a true value: another model's
    /// coefficients mean something else.
    pub fn has_true_value(&self, parameter: Parameter) -> bool {
        match self {
            Violation::OtherLens(camera) => {
                camera.distortion.model() == Model::BrownConrady || Parameter::LINEAR.contains(&parameter)
            }
            _ => true,
        }
    }

    fn image(&self, scene: &Scene<Lens>, view: usize, point: &Vec2) -> Option<Vec2> {
        let truth = &scene.truth;
        let camera = match self {
            Violation::OtherLens(camera) => camera,
            _ => &truth.camera,
        };
        let at = match *self {
            Violation::BoardScale(factor) => Vec3::new(factor * point.x, factor * point.y, 0.0),
            Violation::BoardWidth(factor) => Vec3::new(factor * point.x, point.y, 0.0),
            Violation::BowedBoard(height) => bowed(&truth.points, height)(point),
            _ => Vec3::new(point.x, point.y, 0.0),
        };
        Lens::image(camera, &truth.cam_from_target[view].apply(&at))
    }

    /// Noise of a view in units of the scene's deviation.
    fn noise(&self, view: usize, views: usize, points: &[Vec2], stream: &mut Stream) -> Vec<Vec2> {
        let mut noise: Vec<Vec2> =
            points.iter().map(|_| Vec2::new(stream.normal(), stream.normal())).collect();
        match *self {
            Violation::CorrelatedNoise(correlation) => correlate(&mut noise, columns(points), correlation),
            Violation::NoisePerAxis(ratio) => {
                let v = (2.0 / (1.0 + ratio * ratio)).sqrt();
                noise.iter_mut().for_each(|n| *n = Vec2::new(ratio * v * n.x, v * n.y));
            }
            Violation::NoisePerView { last, factor } if view + last >= views => {
                noise.iter_mut().for_each(|n| *n *= factor);
            }
            _ => {}
        }
        noise
    }
}

/// Marks in a row of a grid that is given row by row.
pub(super) fn columns(points: &[Vec2]) -> usize {
    points.iter().take_while(|p| p.y == points[0].y).count().max(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench::synth::StreamKey;

    fn noise_of(violation: Violation, view: usize) -> Vec<Vec<Vec2>> {
        let points = calibench::synth::Truth::example().points;
        let draw = |trial| {
            let key = StreamKey { seed: 3, scenario: "violation", trial, purpose: "noise" };
            violation.noise(view, 4, &points, &mut Stream::open(key))
        };
        (0..4000).map(draw).collect()
    }

    /// Mean of a product over draws: 4000 of them, standard error 0.016 to 0.03.
    fn mean(draws: &[Vec<Vec2>], product: impl Fn(&[Vec2]) -> f64) -> f64 {
        draws.iter().map(|draw| product(draw)).sum::<f64>() / draws.len() as f64
    }

    #[test]
    fn shared_noise_keeps_its_variance_and_falls_off_by_powers() {
        let draws = noise_of(Violation::CorrelatedNoise(0.6), 0);
        // Marks 30 and 31 are neighbours in a row of nine, 30 and 39 in a column.
        for (i, j, expected) in
            [(30, 30, 1.0), (62, 62, 1.0), (30, 31, 0.6), (30, 39, 0.6), (30, 40, 0.36), (26, 27, 0.01)]
        {
            let found = mean(&draws, |n| n[i].x * n[j].x);
            assert!((found - expected).abs() < 0.12, "{i} {j}: {found}");
            assert!(mean(&draws, |n| n[i].x * n[j].y).abs() < 0.08);
        }
    }

    #[test]
    fn unequal_noise_keeps_what_it_says() {
        let draws = noise_of(Violation::NoisePerAxis(3.0), 0);
        let (u, v) = (mean(&draws, |n| n[7].x * n[7].x), mean(&draws, |n| n[7].y * n[7].y));
        assert!((u - 1.8).abs() < 0.25 && (v - 0.2).abs() < 0.03, "{u} {v}");
        let late = Violation::NoisePerView { last: 1, factor: 3.0 };
        let (early, last) =
            (mean(&noise_of(late, 2), |n| n[7].x * n[7].x), mean(&noise_of(late, 3), |n| n[7].x * n[7].x));
        assert!((early - 1.0).abs() < 0.12 && (last - 9.0).abs() < 1.1, "{early} {last}");
    }

    #[test]
    fn a_board_of_another_size_is_the_same_board_farther_away() {
        let scene: Scene<Lens> = {
            let truth = calibench::synth::Truth::example();
            let camera = Camera::from(truth.camera);
            Scene::new(calibench::synth::Truth {
                camera,
                image_size: truth.image_size,
                points: truth.points,
                cam_from_target: truth.cam_from_target,
            })
            .unwrap()
        };
        let point = scene.truth.points[0];
        let seen = |violation: Violation, view| violation.image(&scene, view, &point).unwrap();
        // Scaled by 1.25 and 150 mm away instead of 120: the first view faces the camera.
        let camera = &scene.truth.camera;
        let farther = Lens::image(camera, &Vec3::new(1.25 * point.x, 1.25 * point.y, 120.0)).unwrap();
        assert!((seen(Violation::BoardScale(1.25), 0) - farther).norm() < 1e-9);
        // A corner mark stays where it is when the board bulges; the middle comes nearer.
        assert!((seen(Violation::BowedBoard(2.0), 1) - scene.pixels()[1][0]).norm() < 1e-9);
        let middle = scene.truth.points.iter().position(|p| p.norm() < 1e-9).unwrap();
        let bulged = Violation::BowedBoard(2.0).image(&scene, 1, &scene.truth.points[middle]).unwrap();
        assert!((bulged - scene.pixels()[1][middle]).norm() > 1.0);
    }
}
