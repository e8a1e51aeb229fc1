//! Do points lie on a line, near a plane, or in space? Centroid, principal axes and extents.

use crate::geometry::{Mat3, Pose, Vec3};

/// Points are a plane's where their extent across it is at most this part of that along its narrower side:
/// what a plane leaves of such marks, less than a tenth of a pixel on an ordinary image, starts no search
/// wrongly.
pub(super) const FLAT: f64 = 1e-3;
/// And near a plane up to here: a start may take them for flat, and one that does not is tried too.
pub(super) const NEARLY_FLAT: f64 = 0.05;
/// Extent along the second axis over that along the first below which points lie on a line; half of the
/// digits are lost in squares.
const ON_A_LINE: f64 = 1e-6;

/// How points lie.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shape {
    pub centre: Vec3,
    /// Columns by falling extent, right-handed.
    pub axes: Mat3,
    /// Root mean square along them.
    pub extents: [f64; 3],
}

impl Shape {
    pub fn of(points: &[Vec3]) -> Shape {
        let count = points.len() as f64;
        let near = points.iter().sum::<Vec3>() / count;
        let centre = near + points.iter().map(|p| p - near).sum::<Vec3>() / count;
        let scatter = |sum: Mat3, p: &Vec3| sum + (p - centre) * (p - centre).transpose();
        let eigen = (points.iter().fold(Mat3::zeros(), scatter) / count).symmetric_eigen();
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let axis = |k: usize| eigen.eigenvectors.column(order[k]).into_owned();
        let (first, second): (Vec3, Vec3) = (axis(0), axis(1));
        let axes = Mat3::from_columns(&[first, second, first.cross(&second)]);
        // Of a plane the smallest eigenvalue is the rounding of the larger ones; the points themselves are
        // not.
        let along = |k: usize| {
            let square = points.iter().map(|p| (p - centre).dot(&axes.column(k)));
            (square.map(|x| x * x).sum::<f64>() / count).sqrt()
        };
        Shape { centre, axes, extents: [along(0), along(1), along(2)] }
    }

    pub fn is_line(&self) -> bool {
        self.extents[1].is_nan() || self.extents[1] <= ON_A_LINE * self.extents[0]
    }

    /// Extent across the plane over that along its narrower side.
    pub fn thickness(&self) -> f64 {
        self.extents[2] / self.extents[1]
    }

    /// From the points' frame to that of their plane, in which it is Z = 0.
    pub fn plane_from_points(&self) -> Pose {
        let rotation = self.axes.transpose();
        Pose { rotation, translation: -(rotation * self.centre) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_planes_and_solids_are_told_apart() {
        let line: Vec<Vec3> = (0..6).map(|i| Vec3::new(1.0, -2.0, 0.3) * f64::from(i)).collect();
        assert!(Shape::of(&line).is_line() && Shape::of(&[Vec3::x(); 4]).is_line());
        let tilted = |i: i32, h: f64| {
            let (x, y) = (f64::from(i % 4), f64::from(i / 4));
            Vec3::new(x, 0.6 * y + 0.8 * h, 0.8 * y - 0.6 * h) + Vec3::repeat(1000.0)
        };
        let plane = Shape::of(&(0..12).map(|i| tilted(i, 0.0)).collect::<Vec<_>>());
        assert!(!plane.is_line() && plane.thickness() < 1e-12, "{}", plane.thickness());
        let at = plane.plane_from_points().apply(&tilted(7, 0.0));
        assert!(at.z.abs() < 1e-11);
        let solid = Shape::of(&(0..12).map(|i| tilted(i, f64::from(i % 3))).collect::<Vec<_>>());
        assert!(solid.thickness() > 0.3);
    }
}
