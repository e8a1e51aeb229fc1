//! Where is the target held? Generators of poses, from a list to random draws, all with the target inside the
//! image.

use super::inputs::Inputs;
use super::lists;
use super::spec_error::SpecError;
use calibench::camera::{Camera, Imaging, Lens};
use calibench::geometry::{Mat3, Pose, Vec2, Vec3, rotation};
use calibench::io::scene_tables::parse_target_poses;
use calibench::synth::Stream;
use calibench::synth::scene::looking_at_centre;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// A generator of poses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Poses {
    /// The chapter's four poses. (Braces, so that a field too many is an error.)
    Chapter {},
    /// Views tilted alike about directions that follow the golden angle. The first views of a longer series
    /// are those of a shorter one.
    Spread {
        /// Number of views.
        views: usize,
        /// Angle between the target's normal and the optical axis.
        tilt_deg: f64,
        /// How far the target's centre moves from the optical axis towards the place where the target touches
        /// the image's border: 0 stays, 1 touches.
        #[serde(default)]
        coverage: f64,
        /// Depth of the target's centre.
        distance_mm: f64,
    },
    /// Views drawn at random.
    Random(RandomPoses),
    /// These.
    List {
        /// The poses.
        poses: Vec<PoseSpec>,
    },
    /// Those of a file, see [`parse_target_poses`].
    File {
        /// Its name, from the folder of the study's own file.
        file: String,
        /// Whose poses, where it holds those of several cells.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        cell: Option<usize>,
        /// The poses; none until the file is read.
        #[serde(skip)]
        poses: Vec<Pose>,
    },
}

/// Views drawn at random: direction of the tilt uniform, its size uniform in `[tilt_min_deg, tilt_deg]`, roll
/// uniform within `+-roll_deg`, direction and size of the shift uniform, distance uniform within `distance_mm
/// (1 +- distance_spread)`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RandomPoses {
    /// Number of views.
    pub views: usize,
    /// Largest tilt.
    pub tilt_deg: f64,
    /// Least tilt.
    #[serde(default)]
    pub tilt_min_deg: f64,
    /// Largest roll about the target's normal, either way.
    #[serde(default)]
    pub roll_deg: f64,
    /// As for `spread`; the largest share.
    #[serde(default)]
    pub coverage: f64,
    /// Middle of the depths.
    pub distance_mm: f64,
    /// Half of the range of depths over their middle.
    #[serde(default)]
    pub distance_spread: f64,
    /// Whether every trial meets poses of its own, or all trials the same.
    #[serde(default)]
    pub redraw: bool,
}

/// `R = Rz Ry Rx`, target to camera.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseSpec {
    /// Angles about X, Y, Z.
    #[serde(deserialize_with = "lists::exactly")]
    pub rotation_deg: [f64; 3],
    /// Place of the target's centre in the camera's frame.
    #[serde(deserialize_with = "lists::exactly")]
    pub translation_mm: [f64; 3],
}

/// Poses that cannot be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PosesError {
    /// The target does not fit into the image.
    #[error(
        "view {view}: the target does not fit into the image: increase the distance, or reduce target, tilt or shift"
    )]
    OutsideImage {
        /// Index of the view.
        view: usize,
    },
    /// A mark of the target that no view of a file shows.
    #[error(
        "mark {mark} lies outside of the image in every view: are marks and poses in millimetres, and do they belong together? Leave it out otherwise"
    )]
    OutsideEveryView {
        /// Index of the mark.
        mark: usize,
    },
    /// A view of a file that does not show every mark.
    #[error(
        "view {view}: mark {mark} lies outside of the image, {outside} of {marks} marks do: every view of a study shows all marks; leave the view or the marks out"
    )]
    OutsideView {
        /// Index of the view.
        view: usize,
        /// The first mark that it does not show.
        mark: usize,
        /// How many it does not show.
        outside: usize,
        /// All marks.
        marks: usize,
    },
    /// A number outside its domain.
    #[error("{field} is {value}: it must be {need}")]
    Value {
        /// Name of the field.
        field: &'static str,
        /// Its value.
        value: f64,
        /// Its domain.
        need: &'static str,
    },
}

/// The angle that divides the circle in the golden section: any number of multiples is spread evenly (Vogel
/// 1979).
const GOLDEN_TURN: f64 = 0.381_966_011_250_105_15;
/// Fraction of sqrt(2), unrelated to the golden section, so that shift and tilt do not go together.
const SILVER_TURN: f64 = 0.414_213_562_373_095_03;
/// Halvings of the free room: 2^-24 of it is a fraction of a pixel.
const HALVINGS: usize = 24;

/// What a pose must respect.
pub(super) struct Sight<'a> {
    pub camera: &'a Camera<Lens>,
    pub image: (usize, usize),
    pub points: &'a [Vec2],
}

impl Poses {
    /// Whether every trial has poses of its own.
    pub fn redraws(&self) -> bool {
        matches!(self, Poses::Random(RandomPoses { redraw: true, .. }))
    }

    /// Number of views.
    pub fn views(&self) -> usize {
        match self {
            Poses::Chapter {} => 4,
            Poses::List { poses } => poses.len(),
            Poses::File { poses, .. } => poses.len(),
            Poses::Spread { views, .. } | Poses::Random(RandomPoses { views, .. }) => *views,
        }
    }

    /// The same, with the poses of its file.
    pub(super) fn read(self, inputs: &Inputs) -> Result<Poses, SpecError> {
        let Poses::File { file, cell, .. } = self else { return Ok(self) };
        let poses = parse_target_poses(&file, inputs.get(&file)?.as_bytes(), cell)
            .map_err(|error| SpecError::Table(error.to_string()))?;
        Ok(Poses::File { file, cell, poses })
    }

    /// The poses; `stream` feeds a random generator.
    pub(super) fn generate(&self, sight: &Sight<'_>, stream: &mut Stream) -> Result<Vec<Pose>, PosesError> {
        self.check()?;
        let poses: Vec<Pose> = match self {
            Poses::Chapter {} => calibench::synth::Truth::example_poses(),
            Poses::List { poses } => poses.iter().map(PoseSpec::pose).collect(),
            Poses::File { poses, .. } => poses.clone(),
            Poses::Spread { views, tilt_deg, coverage, distance_mm } => {
                (0..*views).map(|k| spread(k, *tilt_deg, *coverage, *distance_mm, sight)).collect()
            }
            Poses::Random(random) => (0..random.views).map(|_| random.draw(sight, stream)).collect(),
        };
        match poses.iter().position(|pose| !sight.holds(pose)) {
            Some(view) if matches!(self, Poses::File { .. }) => Err(sight.unseen(&poses, view)),
            Some(view) => Err(PosesError::OutsideImage { view }),
            None => Ok(poses),
        }
    }

    fn check(&self) -> Result<(), PosesError> {
        let (views, tilt, share, distance, spread) = match self {
            Poses::Chapter {} => return Ok(()),
            Poses::List { poses } => (poses.len(), 0.0, 0.0, 1.0, 0.0),
            Poses::File { poses, .. } => (poses.len(), 0.0, 0.0, 1.0, 0.0),
            Poses::Spread { views, tilt_deg, coverage, distance_mm } => {
                (*views, *tilt_deg, *coverage, *distance_mm, 0.0)
            }
            Poses::Random(r) => (r.views, r.tilt_deg, r.coverage, r.distance_mm, r.distance_spread),
        };
        let check = |field, value, need, held| {
            if held { Ok(()) } else { Err(PosesError::Value { field, value, need }) }
        };
        if let Poses::Random(random) = self {
            let (least, most) = (random.tilt_min_deg, random.tilt_deg);
            check("tilt_min_deg", least, "from 0 to tilt_deg", (0.0..=most).contains(&least))?;
            check("roll_deg", random.roll_deg, "a finite number", random.roll_deg.is_finite())?;
        }
        check("views", views as f64, "1 or more", views >= 1)?;
        check("tilt_deg", tilt, "from 0 to below 90", (0.0..90.0).contains(&tilt))?;
        check("coverage", share, "from 0 to 1", (0.0..=1.0).contains(&share))?;
        check("distance_mm", distance, "a positive number", distance > 0.0 && distance.is_finite())?;
        check("distance_spread", spread, "from 0 to below 1", (0.0..1.0).contains(&spread))
    }
}

impl RandomPoses {
    /// A fixed number of draws a view, whatever the ranges: cells that differ in a range meet the same
    /// directions.
    fn draw(&self, sight: &Sight<'_>, stream: &mut Stream) -> Pose {
        let [direction, size, roll, shift_direction, shift, depth] =
            std::array::from_fn(|_| stream.uniform());
        let tilt = self.tilt_min_deg + (self.tilt_deg - self.tilt_min_deg) * size;
        let roll = self.roll_deg.to_radians() * (2.0 * roll - 1.0);
        let distance = self.distance_mm * (1.0 + self.distance_spread * (2.0 * depth - 1.0));
        let rotation = tilted(TAU * direction, tilt.to_radians(), roll);
        sight.shifted(rotation, distance, TAU * shift_direction, self.coverage * shift)
    }
}

impl PoseSpec {
    fn pose(&self) -> Pose {
        Pose { translation: Vec3::from(self.translation_mm), ..looking_at_centre(self.rotation_deg, 1.0) }
    }
}

/// View `k` of a series: tilt and shift turn by unrelated steps; the shift's size follows van der Corput's
/// sequence (1935), its root spreading the centres evenly over the area.
fn spread(k: usize, tilt_deg: f64, coverage: f64, distance: f64, sight: &Sight<'_>) -> Pose {
    let turns = k as f64;
    let rotation = tilted(TAU * GOLDEN_TURN * turns, tilt_deg.to_radians(), 0.0);
    sight.shifted(rotation, distance, TAU * SILVER_TURN * turns, coverage * van_der_corput(k + 1).sqrt())
}

/// The binary digits of `k` mirrored at the point.
fn van_der_corput(mut k: usize) -> f64 {
    let (mut value, mut digit) = (0.0, 0.5);
    while k > 0 {
        if k & 1 == 1 {
            value += digit;
        }
        digit *= 0.5;
        k >>= 1;
    }
    value
}

/// A tilt about the axis at angle `direction` in the image plane, after a roll about the normal.
fn tilted(direction: f64, tilt: f64, roll: f64) -> Mat3 {
    let (sin, cos) = libm::sincos(direction);
    rotation::exp(&(Vec3::new(cos, sin, 0.0) * tilt)) * rotation::exp(&(Vec3::z() * roll))
}

impl Sight<'_> {
    /// Whether every point lies within the image, where the lens model is one-to-one.
    fn holds(&self, pose: &Pose) -> bool {
        let shows = self.shows(pose);
        self.points.iter().all(shows)
    }

    /// Tells of points whether they lie within the image, where the lens model is one-to-one.
    fn shows(&self, pose: &Pose) -> impl Fn(&Vec2) -> bool {
        let is_one_to_one = self.camera.distortion.one_to_one();
        let (right, bottom) = (self.image.0 as f64 - 0.5, self.image.1 as f64 - 0.5);
        move |p| {
            let c = pose.apply(&Vec3::new(p.x, p.y, 0.0));
            is_one_to_one(&c)
                && Lens::image(self.camera, &c).is_some_and(|pixel| {
                    (-0.5..=right).contains(&pixel.x) && (-0.5..=bottom).contains(&pixel.y)
                })
        }
    }

    /// Which mark a view does not show, or no view.
    fn unseen(&self, poses: &[Pose], view: usize) -> PosesError {
        let outside = |pose: &Pose| -> Vec<bool> {
            let shows = self.shows(pose);
            self.points.iter().map(|point| !shows(point)).collect()
        };
        let views: Vec<Vec<bool>> = poses.iter().map(outside).collect();
        let marks = self.points.len();
        if let Some(mark) = (0..marks).find(|&mark| views.iter().all(|view| view[mark])) {
            return PosesError::OutsideEveryView { mark };
        }
        let mark = views[view].iter().position(|outside| *outside).unwrap_or(0);
        let outside = views[view].iter().filter(|outside| **outside).count();
        PosesError::OutsideView { view, mark, outside, marks }
    }

    /// The centre moved off the axis in the given direction, by `share` of the way to the image's border.
    fn shifted(&self, rotation: Mat3, distance: f64, direction: f64, share: f64) -> Pose {
        let (sin, cos) = libm::sincos(direction);
        let at =
            |shift: f64| Pose { rotation, translation: Vec3::new(cos * shift, sin * shift, 1.0) * distance };
        if share == 0.0 {
            return at(0.0);
        }
        let (mut inside, mut outside) =
            (0.0, self.image.0.max(self.image.1) as f64 / self.camera.fx.min(self.camera.fy));
        for _ in 0..HALVINGS {
            let middle = 0.5 * (inside + outside);
            if self.holds(&at(middle)) {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        at(share * inside)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench::synth::{StreamKey, Truth};

    fn generate(poses: &Poses) -> Result<Vec<Pose>, PosesError> {
        let points = Truth::example_board().points();
        let camera = Truth::example_camera().into();
        let sight = Sight { camera: &camera, image: Truth::EXAMPLE_IMAGE, points: &points };
        poses.generate(
            &sight,
            &mut Stream::open(StreamKey { seed: 1, scenario: "poses", trial: 0, purpose: "pose" }),
        )
    }

    fn series(views: usize, tilt_deg: f64, coverage: f64) -> Poses {
        Poses::Spread { views, tilt_deg, coverage, distance_mm: 160.0 }
    }

    #[test]
    fn a_shorter_series_is_the_beginning_of_a_longer_one() {
        let long = generate(&series(20, 25.0, 0.8)).unwrap();
        assert_eq!(generate(&series(7, 25.0, 0.8)).unwrap(), long[..7]);
    }

    #[test]
    fn every_view_has_the_tilt_asked_for() {
        for pose in generate(&series(12, 25.0, 0.5)).unwrap() {
            // Two products of a rotation by 0.44 rad: a few roundings, divided by its sine.
            assert!((libm::acos(pose.rotation[(2, 2)]) - 25f64.to_radians()).abs() < 1e-14);
        }
    }

    #[test]
    fn random_poses_fill_their_ranges_and_do_not_leave_them() {
        let random = RandomPoses {
            views: 400,
            tilt_deg: 35.0,
            tilt_min_deg: 10.0,
            roll_deg: 0.0,
            coverage: 0.0,
            distance_mm: 200.0,
            distance_spread: 0.25,
            redraw: false,
        };
        let poses = generate(&Poses::Random(random)).unwrap();
        let fills = |values: Vec<f64>, low: f64, high: f64| {
            assert!(values.iter().all(|value| (low - 1e-9..=high + 1e-9).contains(value)), "{values:?}");
            // None of 400 uniform numbers in the lowest or highest tenth: by chance once in 10^18.
            let tenth = 0.1 * (high - low);
            assert!(
                values.iter().any(|value| *value < low + tenth)
                    && values.iter().any(|value| *value > high - tenth)
            );
        };
        fills(poses.iter().map(|pose| pose.translation.z).collect(), 150.0, 250.0);
        fills(poses.iter().map(|pose| libm::acos(pose.rotation[(2, 2)]).to_degrees()).collect(), 10.0, 35.0);
    }

    #[test]
    fn a_target_that_does_not_fit_is_refused() {
        let near = Poses::Spread { views: 3, tilt_deg: 20.0, coverage: 0.0, distance_mm: 60.0 };
        assert_eq!(generate(&near), Err(PosesError::OutsideImage { view: 0 }));
        assert!(matches!(generate(&series(3, 95.0, 0.0)), Err(PosesError::Value { field: "tilt_deg", .. })));
    }

    #[test]
    fn the_radical_inverse_is_van_der_corputs() {
        assert_eq!([1, 2, 3, 4].map(van_der_corput), [0.5, 0.25, 0.75, 0.125]);
    }

    #[test]
    fn the_image_ends_half_a_pixel_beyond_its_last_pixels() {
        let camera = Camera::pinhole(100.0, 100.0, 0.0, 0.0).into();
        let sight = Sight { camera: &camera, image: (640, 480), points: &[] };
        let pose = looking_at_centre([0.0; 3], 1.0);
        let shows = sight.shows(&pose);
        let at = |u: f64, v: f64| shows(&(Vec2::new(u, v) / 100.0));
        for (u, v) in [(-0.4, -0.4), (639.4, 0.0), (0.0, 479.4)] {
            assert!(at(u, v), "({u}, {v})");
        }
        for (u, v) in [(-0.6, 0.0), (0.0, -0.6), (639.6, 0.0), (0.0, 479.6)] {
            assert!(!at(u, v), "({u}, {v})");
        }
    }

    /// Angles in four quarters of the circle, of which each has a quarter: five standard deviations of the
    /// binomial.
    fn go_all_round(angles: &[f64]) {
        let expected = angles.len() as f64 / 4.0;
        for quarter in 0..4 {
            let low = f64::from(quarter) * TAU / 4.0;
            let held = |angle: &&f64| (low..low + TAU / 4.0).contains(&angle.rem_euclid(TAU));
            let count = angles.iter().filter(held).count() as f64;
            assert!((count - expected).abs() < 5.0 * (0.75 * expected).sqrt(), "{quarter}: {count}");
        }
    }

    #[test]
    fn random_poses_tilt_and_shift_in_every_direction_alike_and_roll_both_ways() {
        let random = RandomPoses {
            views: 1600,
            tilt_deg: 20.0,
            tilt_min_deg: 10.0,
            roll_deg: 0.0,
            coverage: 0.5,
            distance_mm: 200.0,
            distance_spread: 0.0,
            redraw: false,
        };
        let poses = generate(&Poses::Random(random)).unwrap();
        // The normal leans at a right angle to the axis of the tilt.
        go_all_round(
            &poses
                .iter()
                .map(|pose| libm::atan2(pose.rotation[(0, 2)], -pose.rotation[(1, 2)]))
                .collect::<Vec<_>>(),
        );
        go_all_round(
            &poses.iter().map(|pose| libm::atan2(pose.translation.y, pose.translation.x)).collect::<Vec<_>>(),
        );
        let rolled = RandomPoses {
            tilt_deg: 0.0,
            tilt_min_deg: 0.0,
            roll_deg: 40.0,
            coverage: 0.0,
            views: 400,
            ..random
        };
        let angle = |pose: &Pose| libm::atan2(pose.rotation[(1, 0)], pose.rotation[(0, 0)]).to_degrees();
        let rolls: Vec<f64> = generate(&Poses::Random(rolled)).unwrap().iter().map(angle).collect();
        // None of 400 uniform numbers in the outer tenths: by chance once in 10^18.
        let (least, most) = rolls.iter().fold((0.0f64, 0.0f64), |(l, m), r| (l.min(*r), m.max(*r)));
        assert!((-40.0..-32.0).contains(&least) && (32.0..40.0).contains(&most), "{least} {most}");
    }

    #[test]
    fn views_of_a_series_tilt_and_shift_by_their_own_steps_around_the_circle() {
        // Golden and silver steps: (3 - sqrt(5)) / 2 and sqrt(2) - 1 of a turn.
        let (golden, silver) = (TAU * (3.0 - 5.0f64.sqrt()) / 2.0, TAU * (2.0f64.sqrt() - 1.0));
        let apart = |angle: f64, expected: f64| {
            let turned = (angle - expected).rem_euclid(TAU);
            turned.min(TAU - turned)
        };
        for (k, pose) in generate(&series(6, 25.0, 0.8)).unwrap().iter().enumerate() {
            let tilt = libm::atan2(pose.rotation[(0, 2)], -pose.rotation[(1, 2)]);
            let shift = libm::atan2(pose.translation.y, pose.translation.x);
            assert!(apart(tilt, golden * k as f64) < 1e-12, "{k}: {tilt}");
            assert!(apart(shift, silver * k as f64) < 1e-12, "{k}: {shift}");
        }
    }

    #[test]
    fn a_shift_by_its_whole_share_touches_the_border_of_the_image() {
        let points = Truth::example_board().points();
        let camera = Truth::example_camera().into();
        let sight = Sight { camera: &camera, image: Truth::EXAMPLE_IMAGE, points: &points };
        for direction in [0.0, 0.7, 2.0, 4.0] {
            let at = |share: f64| sight.shifted(Mat3::identity(), 160.0, direction, share);
            let way = |pose: Pose| pose.translation.xy();
            assert!(sight.holds(&at(1.0)) && way(at(1.0)).norm() > 10.0);
            let beyond =
                Pose { translation: at(1.0).translation + (way(at(1.0)) * 1e-5).push(0.0), ..at(1.0) };
            assert!(!sight.holds(&beyond), "{direction}");
            assert!((way(at(0.3)) - way(at(1.0)) * 0.3).norm() < 1e-9 && way(at(0.0)).norm() == 0.0);
        }
    }

    #[test]
    fn what_no_poses_can_have_is_refused_by_its_field() {
        let random = RandomPoses {
            views: 3,
            tilt_deg: 30.0,
            tilt_min_deg: 0.0,
            roll_deg: 0.0,
            coverage: 0.0,
            distance_mm: 200.0,
            distance_spread: 0.0,
            redraw: false,
        };
        assert!(generate(&Poses::Random(random)).is_ok());
        for (field, wrong) in [
            ("views", RandomPoses { views: 0, ..random }),
            ("tilt_deg", RandomPoses { tilt_deg: 90.0, ..random }),
            ("tilt_min_deg", RandomPoses { tilt_min_deg: 31.0, ..random }),
            ("roll_deg", RandomPoses { roll_deg: f64::INFINITY, ..random }),
            ("coverage", RandomPoses { coverage: 1.5, ..random }),
            ("distance_mm", RandomPoses { distance_mm: 0.0, ..random }),
            ("distance_mm", RandomPoses { distance_mm: f64::INFINITY, ..random }),
            ("distance_spread", RandomPoses { distance_spread: 1.0, ..random }),
        ] {
            let refused = generate(&Poses::Random(wrong)).unwrap_err();
            assert!(matches!(&refused, PosesError::Value { field: own, .. } if *own == field), "{refused}");
        }
    }

    #[test]
    fn a_pose_of_a_list_stands_where_it_is_said_to_stand() {
        let spec = PoseSpec { rotation_deg: [0.0, 0.0, 90.0], translation_mm: [3.0, -4.0, 160.0] };
        let pose = generate(&Poses::List { poses: vec![spec] }).unwrap()[0];
        // A quarter turn about Z takes X to Y.
        assert!((pose.apply(&Vec3::new(10.0, 0.0, 0.0)) - Vec3::new(3.0, 6.0, 160.0)).norm() < 1e-12);
    }
}
