//! How may what is photographed depart from what a calibration assumes? Noise that neighbouring marks share,
//! and a board that is not flat.
//!
//! It stands apart from [`Scene`], which is the world as it is assumed; the gate and Monte Carlo studies
//! photograph both.

use super::{Scene, Stream};
use crate::board::View;
use crate::camera::Imaging;
use crate::geometry::{Vec2, Vec3};

/// What of the world a calibration leaves out.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Departure {
    /// Correlation of the noise from one mark of a grid to the next, along rows and columns, from 0 to below
    /// 1; see [`correlate`].
    pub noise_correlation: f64,
    /// By how much the board bulges towards the camera in its middle, in the target's unit; see [`bowed`].
    pub bow: f64,
}

impl Departure {
    /// Whether the world is as it is assumed.
    pub fn is_none(&self) -> bool {
        *self == Departure::default()
    }

    /// The views of a scene in the world as it is, with Gaussian noise of standard deviation `sigma_px` on
    /// each of u and v; `None` where the lens does not show a mark of the bowed board. `columns` are the
    /// marks in a row of the target's grid.
    ///
    /// The noise is drawn as [`Scene::observe`] draws it: without a departure the views are the same, to the
    /// last bit.
    pub fn observe<L: Imaging>(
        &self,
        scene: &Scene<L>,
        columns: usize,
        sigma_px: f64,
        stream: &mut Stream,
    ) -> Option<Vec<View>> {
        let points = &scene.truth.points;
        let seen = |exact: Vec<Vec2>| {
            let mut noise: Vec<Vec2> =
                exact.iter().map(|_| Vec2::new(stream.normal(), stream.normal())).collect();
            correlate(&mut noise, columns, self.noise_correlation);
            let pixels = exact.iter().zip(noise).map(|(pixel, noise)| pixel + noise * sigma_px).collect();
            View::new(points.clone(), pixels).ok()
        };
        self.pixels(scene)?.into_iter().map(seen).collect()
    }

    /// The pixels of a scene without noise, view by view; `None` as there.
    pub fn pixels<L: Imaging>(&self, scene: &Scene<L>) -> Option<Vec<Vec<Vec2>>> {
        if self.bow == 0.0 {
            return Some(scene.pixels().to_vec());
        }
        let truth = &scene.truth;
        let is_one_to_one = truth.camera.distortion.one_to_one();
        let places: Vec<Vec3> = truth.points.iter().map(bowed(&truth.points, self.bow)).collect();
        let image = |point: Vec3| {
            is_one_to_one(&point).then(|| L::image(&truth.camera, &point)).flatten().filter(|pixel| {
                // Right before the lens a pixel may be beyond all numbers.
                pixel.iter().all(|x| x.is_finite())
            })
        };
        let of_view =
            |pose: &crate::geometry::Pose| places.iter().map(|place| image(pose.apply(place))).collect();
        truth.cam_from_target.iter().map(of_view).collect()
    }
}

/// Tells of the marks of a board where they are if it bulges towards the camera by `height` in its middle, in
/// the target's unit: a paraboloid `Z = -h (1 - |p|^2 / r^2)`, `r` the distance of the farthest mark from the
/// origin, so that the corner marks of a centred grid stay where they should be.
pub fn bowed(points: &[Vec2], height: f64) -> impl Fn(&Vec2) -> Vec3 {
    let corner = points.iter().map(Vec2::norm_squared).fold(0.0, f64::max);
    move |point| Vec3::new(point.x, point.y, -height * (1.0 - point.norm_squared() / corner))
}

/// Makes white noise on a grid, given row by row, a stationary field: each row, then each column, an
/// autoregression of first order, `x_i = c x_(i-1) + sqrt(1 - c^2) w_i`, which keeps the variance. Marks i
/// columns and j rows apart have the correlation `c^(i + j)`. With `c = 0` the noise keeps its bits.
pub fn correlate(noise: &mut [Vec2], columns: usize, correlation: f64) {
    let innovation = (1.0 - correlation * correlation).sqrt();
    let mark_before = |along_rows: bool, i: usize| match along_rows {
        true => (!i.is_multiple_of(columns)).then(|| i - 1),
        false => i.checked_sub(columns),
    };
    for along_rows in [true, false] {
        for i in 0..noise.len() {
            if let Some(before) = mark_before(along_rows, i) {
                noise[i] = noise[before] * correlation + noise[i] * innovation;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::StreamKey;

    fn stream(trial: u64) -> Stream {
        Stream::open(StreamKey { seed: 3, scenario: "departure", trial, purpose: "noise" })
    }

    #[test]
    fn without_a_departure_the_views_are_those_of_the_scene() {
        let scene = Scene::example();
        let none = Departure::default();
        assert!(none.is_none());
        let seen = none.observe(&scene, 9, 0.1, &mut stream(0)).unwrap();
        assert_eq!(seen, scene.observe(0.1, &mut stream(0)));
    }

    #[test]
    fn shared_noise_keeps_its_variance_and_falls_off_by_powers() {
        let scene = Scene::example();
        let departure = Departure { noise_correlation: 0.6, ..Departure::default() };
        let draws: Vec<Vec<Vec2>> = (0..4000)
            .map(|trial| {
                let seen = departure.observe(&scene, 9, 1.0, &mut stream(trial)).unwrap();
                seen[2].pixels().iter().zip(&scene.pixels()[2]).map(|(seen, exact)| seen - exact).collect()
            })
            .collect();
        let mean = |product: &dyn Fn(&[Vec2]) -> f64| {
            draws.iter().map(|draw| product(draw)).sum::<f64>() / draws.len() as f64
        };
        // Marks 30 and 31 are neighbours in a row of nine, 30 and 39 in a column. The standard error of a
        // mean is 0.016 to 0.023.
        for (i, j, expected) in
            [(30, 30, 1.0), (62, 62, 1.0), (30, 31, 0.6), (30, 39, 0.6), (30, 40, 0.36), (26, 27, 0.01)]
        {
            let found = mean(&|n| n[i].x * n[j].x);
            assert!((found - expected).abs() < 0.12, "{i} {j}: {found}");
            assert!(mean(&|n| n[i].x * n[j].y).abs() < 0.08);
        }
    }

    #[test]
    fn a_bowed_board_is_nearer_in_its_middle_and_keeps_its_corners() {
        let scene = Scene::example();
        let bow = |bow: f64| Departure { bow, ..Departure::default() }.pixels(&scene);
        let seen = bow(2.0).unwrap();
        assert!((seen[1][0] - scene.pixels()[1][0]).norm() < 1e-9);
        // The first view faces the camera at 120 mm, the middle of the board on its axis: a mark beside it is
        // magnified by 120 / (120 - 2 (1 - 0.04)).
        let middle = scene.truth.points.iter().position(|p| p.norm() < 1e-9).unwrap();
        let place = bowed(&scene.truth.points, 2.0)(&scene.truth.points[middle + 1]);
        assert!((place.z + 2.0 * (1.0 - 100.0 / 2500.0)).abs() < 1e-12, "{place}");
        let pixel = scene.truth.camera.project(&(place + Vec3::new(0.0, 0.0, 120.0))).unwrap();
        assert!((seen[0][middle + 1] - pixel).norm() < 1e-9);
        assert!((pixel - scene.pixels()[0][middle + 1]).norm() > 0.5);
        assert!(bow(120.0).is_none(), "the middle of the board touches the lens");
    }
}
