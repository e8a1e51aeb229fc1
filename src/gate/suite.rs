//! On which scenes is a solver judged? Families of cameras and poses with known truth, as data.

mod other_lenses;
mod ragged;
mod violations;

use super::principal::Principal;
use super::setup::{Setup, SetupError};
use super::violation::Violation;
use calibench::board::{Board, BoardError, Pattern};
use calibench::camera::{BrownConrady, Camera, FreeParameters, Lens, Model, Parameter};
use calibench::geometry::Pose;
use calibench::synth::scene::looking_at_centre;
use calibench::synth::{Stream, StreamKey, Truth};
use nalgebra::Vector6;
use std::borrow::Cow;

/// What can be asked of a solver on a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Demand {
    /// The linearised theory holds: every statistical property is judged.
    Law,
    /// The data are poor or contaminated: a solver must refuse, warn, or admit its uncertainty.
    Honesty,
    /// The world is not the model: a solver should say so where the residuals show it, or state a covariance
    /// that covers what follows ([`super::residual_tests`]).
    Assumptions,
}

/// From which poses are the samples of a scene taken?
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Poses {
    /// From the same.
    Fixed,
    /// From others for every sample, round those of the scene.
    DrawnAnew,
}

/// A scene with its noise and the parameters to estimate.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Scenario {
    /// Name, the first part of the ids of its problems.
    pub id: &'static str,
    /// What is particular about it.
    pub about: &'static str,
    /// What is demanded.
    pub demand: Demand,
    /// Truth, exact pixels and bound at `sigma_px`: of every sample where the poses are fixed, else see
    /// [`Scenario::setup_of`].
    pub setup: Setup,
    /// Whether the poses are the same for every sample.
    pub poses: Poses,
    /// What is estimated; the rest is held at the truth.
    pub free: FreeParameters,
    /// Standard deviation of a pixel coordinate.
    pub sigma_px: f64,
    /// Share of points that are displaced by [`OUTLIER_PX`].
    pub outliers: f64,
    /// Share of samples to which textbook least squares gives a confidently wrong answer: measured for the
    /// doubtful scenes, none where the law holds ([`super::textbook`]).
    pub textbook_misled: f64,
    /// What the model leaves out of the world; nothing but where [`Demand::Assumptions`] stands.
    pub violation: Option<Violation>,
    /// Share of samples whose residuals show the violation to an ordinary test: measured for these scenes
    /// ([`super::residual_tests`]).
    pub seen_in_residuals: f64,
    /// Most samples for which the second-order terms that the law neglects stay below its resolution.
    pub most: usize,
    /// The bound's uncorrelated combinations of parameters.
    pub principal: Principal,
    /// And those of every pose.
    pub of_poses: Vec<Principal>,
}

/// A scene of the suite that cannot be built: a mistake in the suite.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SuiteError {
    /// The scene cannot be photographed, or determines nothing.
    #[error("{id}: {cause}")]
    Setup {
        /// Scenario.
        id: &'static str,
        /// Why.
        cause: SetupError,
    },
    /// The board does not exist.
    #[error(transparent)]
    Board(#[from] BoardError),
}

impl SuiteError {
    fn of(id: &'static str) -> impl Fn(SetupError) -> SuiteError {
        move |cause| SuiteError::Setup { id, cause }
    }
}

/// How far drawn poses lie from those of their scene: rotation about each axis, rad, then translation along
/// each in units of the target.
const DRAWN: [f64; 6] = [0.2, 0.2, 0.2, 6.0, 6.0, 10.0];

/// Noise of the scenes that test the law. The bias of a least-squares estimate is of second order in the
/// noise, so at a tenth of ordinary corner noise it is a tenth as large against the standard deviation: too
/// small to be seen.
pub const LAW_SIGMA_PX: f64 = 0.01;
/// Ordinary corner noise, the example's.
pub const ORDINARY_SIGMA_PX: f64 = 0.1;
/// Shortest and longest displacement of an outlier, px.
pub const OUTLIER_PX: (f64, f64) = (5.0, 20.0);

/// Most samples of a scene with another lens than Brown-Conrady's: its search takes many times as long.
const OTHER_LENSES: usize = 512;

/// A scene as it is written down below.
struct Draft {
    id: &'static str,
    about: &'static str,
    camera: Camera<Lens>,
    image_size: (usize, usize),
    /// Columns, rows, spacing.
    board: (usize, usize, f64),
    /// Degrees about X, Y, Z; then the target centre's X, Y, Z in target units.
    poses: Vec<[f64; 6]>,
    free: FreeParameters,
}

/// The example's four poses, as a draft gives them.
fn four(distance: f64) -> Vec<[f64; 6]> {
    [[0.0, 0.0, 0.0], [20.0, 0.0, 0.0], [0.0, -20.0, 0.0], [-15.0, 15.0, 10.0]]
        .map(|[x, y, z]| [x, y, z, 0.0, 0.0, distance])
        .to_vec()
}

/// `count` poses round the optical axis: the target leans by `tilt` degrees in turn to every side, and its
/// centre lies `aside` from the axis in turn on every side. The angle grows by the golden angle, so that any
/// number of poses covers all sides.
fn ring(count: usize, tilt: f64, aside: f64, distance: f64) -> Vec<[f64; 6]> {
    const GOLDEN_ANGLE_RAD: f64 = 2.399_963_229_728_653;
    (0..count)
        .map(|i| {
            let angle = GOLDEN_ANGLE_RAD * i as f64;
            let (sine, cosine) = libm::sincos(angle);
            let nearer = 1.0 + 0.1 * libm::cos(3.0 * angle);
            let spin = 15.0 * libm::sin(2.0 * angle);
            [tilt * sine, tilt * cosine, spin, aside * cosine, aside * sine, distance * nearer]
        })
        .collect()
}

fn example_draft(id: &'static str, about: &'static str) -> Draft {
    Draft {
        id,
        about,
        camera: Truth::example_camera().into(),
        image_size: Truth::EXAMPLE_IMAGE,
        board: (9, 7, 10.0),
        poses: four(120.0),
        free: FreeParameters::STANDARD,
    }
}

fn lawful() -> Vec<Draft> {
    use Parameter::{Cx, Cy, Fx, Fy, K1};
    let base = Truth::example_camera();
    let lens = |k1, k2, p1, p2| BrownConrady { k1, k2, p1, p2, k3: 0.0 };
    vec![
        example_draft("four-pose", "the example's camera and four poses"),
        Draft {
            poses: ring(20, 25.0, 15.0, 138.0),
            board: (5, 4, 20.0),
            ..example_draft("many-views", "twenty views")
        },
        Draft {
            poses: ring(6, 30.0, 0.0, 300.0),
            free: FreeParameters::of(&[Fx, Fy, Cx, Cy, K1]),
            ..example_draft("weak-coverage", "points in the middle of the image only")
        },
        Draft {
            camera: base.with_distortion(lens(-0.32, 0.12, 0.0, 0.0)).into(),
            poses: ring(6, 25.0, 12.0, 122.0),
            ..example_draft("strong-distortion", "a wide lens, points out to the image corners")
        },
        Draft {
            camera: base.with_distortion(lens(-0.18, 0.05, 0.002, -0.003)).into(),
            free: FreeParameters::STANDARD.with(Parameter::P1).with(Parameter::P2),
            poses: ring(6, 25.0, 12.0, 128.0),
            ..example_draft("tangential", "decentred lens, p1 and p2 free")
        },
        Draft { camera: Camera { fy: 450.0, ..base }.into(), ..example_draft("non-square", "pixels 4 : 3") },
        Draft {
            camera: Camera { cx: 410.0, cy: 170.0, ..base }.into(),
            ..example_draft("off-centre", "principal point 114 px from the image centre")
        },
        Draft {
            board: (4, 3, 25.0),
            poses: ring(5, 25.0, 8.0, 130.0),
            ..example_draft("few-points", "twelve points a view")
        },
        Draft {
            camera: Camera::pinhole(3800.0, 3800.0, 2060.0, 1490.0)
                .with_distortion(BrownConrady::radial(-0.18, 0.05))
                .into(),
            image_size: (4096, 3000),
            ..example_draft("large-image", "12 megapixels")
        },
        Draft {
            board: (7, 5, 4.0),
            poses: ring(10, 30.0, 35.0, 120.0),
            ..example_draft("small-target", "a small target moved about the image")
        },
        Draft {
            board: (9, 7, 0.01),
            poses: four(0.12),
            ..example_draft("metres", "the example's scene in metres")
        },
        Draft {
            free: FreeParameters::of(&[Fx, Fy, K1]),
            ..example_draft("held", "principal point and k2 held at known values")
        },
        Draft {
            camera: Camera {
                skew: 1.5,
                ..base.with_distortion(BrownConrady { k3: -0.03, ..lens(-0.18, 0.05, 0.0, 0.0) })
            }
            .into(),
            free: FreeParameters::STANDARD.with(Parameter::Skew).with(Parameter::K3),
            poses: ring(8, 30.0, 12.0, 126.0),
            ..example_draft("skew-and-k3", "skewed axes and a third radial coefficient, both free")
        },
        Draft {
            poses: ring(8, 52.0, 8.0, 150.0)
                .into_iter()
                .enumerate()
                .map(|(i, [x, y, _, across, down, distance])| [x, y, 45.0 * i as f64, across, down, distance])
                .collect(),
            ..example_draft("steep", "targets tilted by 52 degrees and rolled all the way round")
        },
        Draft {
            camera: base.with_distortion(lens(0.12, 0.04, 0.0, 0.0)).into(),
            poses: ring(6, 25.0, 10.0, 136.0),
            ..example_draft("pincushion", "magnification that grows towards the corners")
        },
        Draft {
            camera: Camera::pinhole(5000.0, 5000.0, 654.0, 470.0)
                .with_distortion(BrownConrady::radial(-0.3, 0.0))
                .into(),
            image_size: (1280, 960),
            poses: ring(12, 45.0, 8.0, 700.0),
            free: FreeParameters::of(&[Fx, Fy, Cx, Cy, K1]),
            ..example_draft("telephoto", "a focal length of four image widths")
        },
        Draft {
            poses: vec![[25.0, 12.0, 0.0, 3.0, 0.0, 115.0], [-18.0, 24.0, 8.0, 0.0, -3.0, 120.0]],
            ..example_draft("two-views", "as few views as determine the camera")
        },
        Draft { board: (28, 20, 3.0), ..example_draft("many-marks", "560 points a view") },
        Draft {
            board: (5, 4, 20.0),
            poses: ring(32, 30.0, 14.0, 140.0),
            ..example_draft("thirty-two-views", "more views than most programs are tried on")
        },
    ]
}

/// All scenarios, in the order of reports.
///
/// # Errors
/// A scenario that cannot be built, which is a mistake in this file.
pub fn suite() -> Result<Vec<Scenario>, SuiteError> {
    let mut scenarios: Vec<Scenario> =
        lawful().into_iter().map(|draft| build(draft, LAW_SIGMA_PX)).collect::<Result<_, _>>()?;
    scenarios.extend(ragged::scenarios()?);
    let other_lenses = other_lenses::drafts()
        .into_iter()
        .map(|draft| Ok(Scenario { most: OTHER_LENSES, ..build(draft, LAW_SIGMA_PX)? }));
    // Second-order bias grows with the square of the noise. 500 samples would show one of 0.02 standard
    // deviations as 0.02 sqrt(500) = 0.45 standard errors, a tenth of what is called a deviation.
    let ordinary = example_draft("ordinary-noise", "the example's scene with its noise of 0.1 px");
    scenarios.push(Scenario { most: 500, ..build(ordinary, ORDINARY_SIGMA_PX)? });
    let near = Draft {
        poses: vec![
            [0.0, 0.0, 0.0, 0.0, 0.0, 120.0],
            [1.5, 0.0, 0.0, 0.0, 0.0, 125.0],
            [0.0, -1.5, 0.0, 0.0, 0.0, 115.0],
            [-1.0, 1.0, 10.0, 0.0, 0.0, 120.0],
        ],
        ..example_draft("near-degenerate", "four views within two degrees of parallel")
    };
    scenarios.push(Scenario {
        demand: Demand::Honesty,
        textbook_misled: 0.006_47,
        most: 200,
        ..build(near, ORDINARY_SIGMA_PX)?
    });
    let wrong = example_draft("outliers", "two points in a hundred displaced by 5 to 20 px");
    scenarios.push(Scenario {
        demand: Demand::Honesty,
        outliers: 0.02,
        textbook_misled: 0.002_31,
        most: 200,
        ..build(wrong, ORDINARY_SIGMA_PX)?
    });
    scenarios.extend(other_lenses.collect::<Result<Vec<_>, SuiteError>>()?);
    for (draft, violation, seen_in_residuals) in violations::drafts() {
        scenarios.push(Scenario {
            demand: Demand::Assumptions,
            violation: Some(violation),
            seen_in_residuals,
            ..build(draft, ORDINARY_SIGMA_PX)?
        });
    }
    Ok(scenarios)
}

fn build(draft: Draft, sigma_px: f64) -> Result<Scenario, SuiteError> {
    let setup = Setup::whole(truth_of(&draft)?, draft.free, sigma_px).map_err(SuiteError::of(draft.id))?;
    Ok(scenario(&draft, sigma_px, setup))
}

fn truth_of(draft: &Draft) -> Result<Truth<Lens>, SuiteError> {
    let (columns, rows, spacing) = draft.board;
    Ok(Truth {
        camera: draft.camera,
        image_size: draft.image_size,
        points: Board::new(columns, rows, spacing, Pattern::Chessboard)?.points(),
        cam_from_target: draft.poses.iter().map(pose).collect(),
    })
}

fn scenario(draft: &Draft, sigma_px: f64, setup: Setup) -> Scenario {
    Scenario {
        id: draft.id,
        about: draft.about,
        demand: Demand::Law,
        poses: Poses::Fixed,
        free: draft.free,
        sigma_px,
        outliers: 0.0,
        textbook_misled: 0.0,
        violation: None,
        seen_in_residuals: 0.0,
        most: usize::MAX,
        principal: Principal::of(&setup.bound.intrinsics, setup.bound.free),
        of_poses: setup.bound.poses.iter().map(Principal::of_pose).collect(),
        setup,
    }
}

fn pose(&[x, y, z, across, down, distance]: &[f64; 6]) -> Pose {
    let mut pose = looking_at_centre([x, y, z], distance);
    pose.translation.x = across;
    pose.translation.y = down;
    pose
}

impl Scenario {
    /// Its lens model.
    pub fn model(&self) -> Model {
        self.setup.scene.truth.camera.distortion.model()
    }

    /// Degrees of freedom of the residuals; the same for every sample.
    pub fn degrees_of_freedom(&self) -> usize {
        self.setup.degrees_of_freedom()
    }

    /// What is photographed in a trial of a run with this seed.
    pub fn setup_of(&self, seed: u64, trial: u64) -> Cow<'_, Setup> {
        match self.poses {
            Poses::Fixed => Cow::Borrowed(&self.setup),
            Poses::DrawnAnew => {
                let key = StreamKey { seed, scenario: self.id, trial, purpose: "poses" };
                Cow::Owned(self.drawn(&mut Stream::open(key)))
            }
        }
    }

    /// The scene from other poses: the first that are drawn from which all marks are seen.
    fn drawn(&self, stream: &mut Stream) -> Setup {
        loop {
            let mut moved = |pose: &Pose| {
                pose.perturbed(&Vector6::from(DRAWN.map(|most| stream.uniform_in(-most, most))))
            };
            let truth = &self.setup.scene.truth;
            let cam_from_target = truth.cam_from_target.iter().map(&mut moved).collect();
            let drawn = Setup::whole(Truth { cam_from_target, ..truth.clone() }, self.free, self.sigma_px);
            if let Some(setup) = drawn.ok().filter(|setup| setup.outside_image_px() == 0.0) {
                return setup;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_lies_in_its_image_and_is_named_once() {
        let suite = suite().unwrap();
        for (i, scenario) in suite.iter().enumerate() {
            assert!(suite[..i].iter().all(|other| other.id != scenario.id));
        }
        let outside =
            |s: &Scenario| (s.setup.outside_image_px() > 0.0).then(|| (s.id, s.setup.outside_image_px()));
        assert_eq!(suite.iter().filter_map(outside).collect::<Vec<_>>(), []);
    }

    /// The law is linear: a standard deviation must be a small part of what it is compared with, the scale on
    /// which the projection bends (the focal length itself, and 1 for the distortion coefficients).
    #[test]
    fn the_noise_of_the_law_is_small_against_the_curvature() {
        for s in suite().unwrap().iter().filter(|s| s.demand == Demand::Law) {
            for parameter in s.free.iter() {
                let scale = if parameter <= Parameter::Skew { s.setup.scene.truth.camera.fx } else { 1.0 };
                let sd = s.setup.bound.standard_deviation(parameter).unwrap();
                assert!(sd / scale < 0.02, "{} {parameter}: {sd}", s.id);
            }
        }
    }

    #[test]
    fn every_target_turns_its_face_to_the_camera() {
        for s in suite().unwrap() {
            for (view, pose) in s.setup.scene.truth.cam_from_target.iter().enumerate() {
                // A target's Z points away from who looks at it.
                assert!(pose.rotation.column(2).dot(&pose.translation) > 0.0, "{}, view {view}", s.id);
            }
        }
    }
}
