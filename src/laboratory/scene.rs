//! Which scene do the knobs of the four poses describe? The chapter's camera and target, with what the reader
//! has moved.

use super::questions::count;
use calibench::camera::{BrownConrady, FreeParameters};
use calibench::evaluate::RmseDistribution;
use calibench::geometry::{Pose, Vec2, Vec3};
use calibench::synth::{Scene, Truth, scene::looking_at_centre};

/// How many knobs a scene has.
pub(crate) const KNOBS: usize = 9;

/// Where they stand in the chapter: tilt, distance, shift, views, noise, k1, k2, points along X and Y.
pub const CHAPTER: [f64; KNOBS] = [20.0, 120.0, 0.0, 4.0, 0.1, -0.18, 0.05, 9.0, 7.0];

/// The seed of the experiment with four poses: at the chapter's knobs its draws are repeated.
pub(crate) const SEED: u64 = 1;

/// Most views and most points along a side: more make a page slow and teach nothing.
const MOST_VIEWS: u32 = 12;
const MOST_POINTS: u32 = 20;

/// Width and height of the target, from its first to its last point, mm.
const TARGET_MM: (f64, f64) = (80.0, 60.0);

/// Angle between the axes about which views beyond the fourth are tilted, degrees: the golden angle, so that
/// any number of them is spread evenly.
const BETWEEN_AXES_DEG: f64 = 137.5;

/// Directions in which the views are shifted, one after the other: towards the corners, along the target's
/// diagonals.
const CORNERS: [(f64, f64); 4] = [(0.8, 0.6), (-0.8, 0.6), (-0.8, -0.6), (0.8, -0.6)];

/// What the reader has chosen.
pub(crate) struct Knobs {
    /// Largest tilt of a view, degrees.
    tilt_deg: f64,
    /// From the camera to the target's centre, mm.
    distance_mm: f64,
    /// How far each view's target is shifted from the axis towards a corner of its own, at the same distance,
    /// mm.
    shift_mm: f64,
    views: usize,
    /// Noise on each of u and v, px.
    pub sigma_px: f64,
    distortion: BrownConrady,
    /// Points of the target along X and Y.
    points: (usize, usize),
}

impl Knobs {
    /// In the order of the fields.
    pub fn read(
        [tilt_deg, distance_mm, shift_mm, views, sigma_px, k1, k2, columns, rows]: [f64; KNOBS],
    ) -> Result<Knobs, String> {
        let points = |number: f64, what: &str| count(number, what, 2, MOST_POINTS);
        Ok(Knobs {
            tilt_deg,
            distance_mm,
            shift_mm,
            views: count(views, "views", 1, MOST_VIEWS)?,
            sigma_px,
            distortion: BrownConrady::radial(k1, k2),
            points: (points(columns, "points along X")?, points(rows, "points along Y")?),
        })
    }

    /// What the virtual camera sees.
    pub fn scene(&self) -> Result<Scene, String> {
        let truth = Truth {
            camera: Truth::example_camera().with_distortion(self.distortion),
            image_size: Truth::EXAMPLE_IMAGE,
            points: self.target(),
            cam_from_target: (0..self.views).map(|view| self.pose(view)).collect(),
        };
        Scene::new(truth).map_err(|error| error.to_string())
    }

    /// The points, row by row, evenly over the target.
    fn target(&self) -> Vec<Vec2> {
        let at = |i: usize, count: usize, width_mm: f64| {
            let last = (count - 1) as f64;
            (i as f64 - 0.5 * last) * (width_mm / last)
        };
        let (columns, rows) = self.points;
        let place = |(i, j)| Vec2::new(at(i, columns, TARGET_MM.0), at(j, rows, TARGET_MM.1));
        (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))).map(place).collect()
    }

    /// The chapter's four turns with another tilt; further views are tilted about other axes. Each is shifted
    /// towards a corner.
    fn pose(&self, view: usize) -> Pose {
        let t = self.tilt_deg;
        let turns = [[0.0, 0.0, 0.0], [t, 0.0, 0.0], [0.0, -t, 0.0], [-0.75 * t, 0.75 * t, 10.0]];
        let further = || {
            let axis = (BETWEEN_AXES_DEG * view as f64).to_radians();
            [t * libm::cos(axis), t * libm::sin(axis), 0.0]
        };
        let mut pose = looking_at_centre(turns.get(view).copied().unwrap_or_else(further), self.distance_mm);
        let (right, down) = CORNERS[view % CORNERS.len()];
        pose.translation += self.shift_mm * Vec3::new(right, down, 0.0);
        pose
    }

    /// The distribution of the reprojection error that theory predicts.
    pub fn rmse(&self, scene: &Scene) -> RmseDistribution {
        let parameters = FreeParameters::STANDARD.len() + 6 * self.views;
        RmseDistribution { sigma_px: self.sigma_px, points: scene.observations(), parameters }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_chapters_knobs_are_the_chapters_scene_to_the_last_bit() {
        let knobs = Knobs::read(CHAPTER).unwrap();
        assert_eq!(knobs.scene().unwrap(), Scene::example());
    }

    #[test]
    fn views_beyond_the_fourth_have_the_tilt_and_other_axes() {
        let knobs = Knobs::read([30.0, 120.0, 0.0, 12.0, 0.1, -0.18, 0.05, 9.0, 7.0]).unwrap();
        let normals: Vec<_> = (4..12).map(|view| knobs.pose(view).rotation.column(2).into_owned()).collect();
        for (i, a) in normals.iter().enumerate() {
            // Turns about X and Y one after the other tilt nearly as far as one turn about the axis between
            // them.
            let tilt_deg = libm::acos(a.z).to_degrees();
            assert!((29.0..=30.0 + 1e-9).contains(&tilt_deg), "{tilt_deg}");
            assert!(normals[..i].iter().all(|b| (a - b).norm() > 0.1));
        }
    }

    #[test]
    fn a_shift_moves_each_view_towards_a_corner_of_its_own_and_keeps_the_distance() {
        let knobs = Knobs::read([20.0, 200.0, 40.0, 4.0, 0.1, -0.18, 0.05, 9.0, 7.0]).unwrap();
        let scene = knobs.scene().unwrap();
        let mut sides = std::collections::BTreeSet::new();
        for (pose, pixels) in scene.truth.cam_from_target.iter().zip(scene.pixels()) {
            let t = pose.translation;
            assert!(t.z == 200.0 && (t.xy().norm() - 40.0).abs() < 1e-12);
            let middle = pixels.iter().sum::<Vec2>() / pixels.len() as f64;
            sides.insert((middle.x > 326.0, middle.y > 243.0));
        }
        assert_eq!(sides.len(), 4);
    }

    #[test]
    fn what_cannot_be_photographed_is_refused_in_words() {
        let near = Knobs::read([45.0, 20.0, 0.0, 4.0, 0.1, -0.18, 0.05, 9.0, 7.0]).unwrap();
        assert!(near.scene().unwrap_err().contains("in front of the camera"));
        let with = |at: usize, number: f64| {
            let mut knobs = CHAPTER;
            knobs[at] = number;
            Knobs::read(knobs)
        };
        assert!(with(3, 4.5).is_err_and(|e| e.contains("views")));
        assert!(with(8, f64::NAN).is_err());
    }
}
