//! Where in the frame does the calibration rest on points, and how well does it know where a pixel looks?

use calibench::calibrate::LensCalibration;
use calibench::camera::{Camera, Lens};
use calibench::geometry::Vec2;
use calibench_harness::{Figure, HeatMap, Plot};

/// Cells along the frame's longer side; the shorter has as many as keep them about square.
const LONG_SIDE_CELLS: usize = 10;

/// The frame cut into cells.
pub(super) struct Cells {
    size: (usize, usize),
    pub(super) columns: usize,
    pub(super) rows: usize,
}

impl Cells {
    pub(super) fn of(size: (usize, usize)) -> Cells {
        let cell = size.0.max(size.1) as f64 / LONG_SIDE_CELLS as f64;
        let count = |length: usize| libm::round(length as f64 / cell).max(1.0) as usize;
        Cells { size, columns: count(size.0), rows: count(size.1) }
    }

    /// Centre of a cell, px.
    fn centre(&self, column: usize, row: usize) -> Vec2 {
        let along = |i: usize, n: usize, length: usize| (i as f64 + 0.5) * length as f64 / n as f64 - 0.5;
        Vec2::new(along(column, self.columns, self.size.0), along(row, self.rows, self.size.1))
    }

    /// Points in each cell, row by row from the top.
    pub(super) fn counts<'a>(&self, pixels: impl IntoIterator<Item = &'a Vec2>) -> Vec<usize> {
        let mut counts = vec![0; self.columns * self.rows];
        for pixel in pixels {
            let place = |x: f64, n: usize, length: usize| libm::floor((x + 0.5) / length as f64 * n as f64);
            let (i, j) = (place(pixel.x, self.columns, self.size.0), place(pixel.y, self.rows, self.size.1));
            if i >= 0.0 && j >= 0.0 && i < self.columns as f64 && j < self.rows as f64 {
                counts[j as usize * self.columns + i as usize] += 1;
            }
        }
        counts
    }

    /// A map of values given row by row from the top.
    fn plot(&self, title: &str, label: &str, values: &[f64], digits: usize) -> Option<Plot> {
        let level = |x: f64| format!("{x:.0}");
        let columns = (0..self.columns).map(|i| level(self.centre(i, 0).x)).collect();
        let rows = (0..self.rows).rev().map(|j| level(self.centre(0, j).y)).collect();
        let upwards: Vec<f64> = values.chunks(self.columns).rev().flatten().copied().collect();
        let heat = HeatMap::new(label, columns, rows, upwards).ok()?.digits(digits);
        Some(Plot::heat_map(title, "u (px)", "v (px)", heat))
    }
}

/// Standard deviation of the pixel that a ray falls on, px, in its worst direction: the ray is held fixed in
/// the camera's frame, and with `J = d pixel / d intrinsics` along it and the intrinsics' covariance `P` this
/// is the root of the larger eigenvalue of `J P J^T`.
///
/// Part of it could be made up by turning the camera, so a pose that is estimated with the same camera
/// predicts pixels better than this; directions measured by the camera alone are known no better. NaN beyond
/// the lens model's monotone radius.
pub(super) fn pixel_deviation(calibration: &LensCalibration, pixel: &Vec2) -> f64 {
    let seen = calibration.camera.ray(pixel).ok();
    let at = seen.and_then(|ray| calibration.camera.pixel_with_derivatives(&ray));
    at.map_or(f64::NAN, |at| calibration.covariance.largest_spread(&at.by_parameters))
}

/// Largest distance of a corner of the frame from the principal point, px.
pub(super) fn corner_radius_px(camera: &Camera<Lens>, size: (usize, usize)) -> f64 {
    let (right, bottom) = (size.0 as f64 - 0.5, size.1 as f64 - 0.5);
    [(-0.5, -0.5), (right, -0.5), (-0.5, bottom), (right, bottom)]
        .map(|(u, v)| libm::hypot(u - camera.cx, v - camera.cy))
        .into_iter()
        .fold(0.0, f64::max)
}

/// The maps of a calibration from marks at these pixels.
pub(super) fn figures(calibration: &LensCalibration, pixels: &[Vec2], size: (usize, usize)) -> Vec<Figure> {
    let cells = Cells::of(size);
    let counts: Vec<f64> = cells.counts(pixels).into_iter().map(|count| count as f64).collect();
    let coverage = cells.plot("Points in each part of the frame", "points", &counts, 1).map(|plot| {
        let caption = "Number of points seen in each cell of the frame, all views together; cells are named by their centre. \
                       Where there are none, the lens model is extrapolated.";
        Figure::plot("coverage", &plot, caption)
    });
    let deviations: Vec<f64> = (0..cells.rows)
        .flat_map(|j| (0..cells.columns).map(move |i| (i, j)))
        .map(|(i, j)| pixel_deviation(calibration, &cells.centre(i, j)))
        .collect();
    let label = "standard deviation (px)";
    let precision = cells.plot("How well is a projected pixel known?", label, &deviations, 2).map(|plot| {
        let caption = "Standard deviation of the pixel that a fixed ray of the camera's frame falls on, px, in its worst \
                       direction, from the covariance of the intrinsics alone; cells are named by their centre. It grows where \
                       no points were seen.";
        Figure::plot("pixel-deviation", &plot, caption)
    });
    coverage.into_iter().chain(precision).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench::calibrate::{Settings, calibrate_lens};
    use calibench::synth::{Scene, Stream, StreamKey};

    fn calibration() -> (LensCalibration, Vec<Vec2>) {
        let key = StreamKey { seed: 1, scenario: "maps", trial: 0, purpose: "noise" };
        let views = Scene::example().observe(0.1, &mut Stream::open(key));
        let pixels = views.iter().flat_map(|view| view.pixels()).copied().collect();
        (calibrate_lens(&views, &Settings::standard()).unwrap(), pixels)
    }

    #[test]
    fn at_the_principal_point_only_its_own_deviation_counts() {
        let (calibration, _) = calibration();
        let centre = Vec2::new(calibration.camera.cx, calibration.camera.cy);
        let worst =
            calibration.covariance.intrinsics.view((2, 2), (2, 2)).symmetric_eigenvalues().max().sqrt();
        assert!((pixel_deviation(&calibration, &centre) / worst - 1.0).abs() < 1e-9);
        assert!(pixel_deviation(&calibration, &Vec2::zeros()) > worst);
    }

    #[test]
    fn every_point_is_counted_in_its_cell() {
        let (calibration, pixels) = calibration();
        let cells = Cells::of((640, 480));
        assert_eq!((cells.columns, cells.rows), (10, 8));
        assert_eq!(cells.counts(&pixels).iter().sum::<usize>(), 252);
        assert!(cells.counts(&pixels)[0] == 0);
        assert_eq!(figures(&calibration, &pixels, (640, 480)).len(), 2);
    }
}
