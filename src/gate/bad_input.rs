//! Which data deserve no camera? Sets that cannot determine one, and input that is broken.

use super::protocol::{Problem, ProblemView};
use calibench::camera::{Camera, FreeParameters, Lens};
use calibench::geometry::{Pose, Vec2};
use calibench::synth::scene::looking_at_centre;
use calibench::synth::{Scene, SceneError, Stream, StreamKey, Truth};

/// What is wrong with the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fault {
    /// They are well formed and cannot determine the parameters.
    Degenerate,
    /// They are not a calibration problem at all: any estimate is wrong.
    Malformed,
}

/// A problem that should be refused or flagged.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct BadCase {
    /// Name.
    pub id: &'static str,
    /// What is wrong.
    pub fault: Fault,
    /// The problem.
    pub problem: Problem,
    /// The camera that took the pictures.
    pub truth: Camera<Lens>,
}

/// Noise of the degenerate sets, px. Without noise their normal equations are singular and nearly every
/// solver notices.
const SIGMA_PX: f64 = 0.1;

/// The cases, drawn from `seed`.
///
/// # Errors
/// A scene that cannot be photographed, which is a mistake in this file.
pub fn bad_cases(seed: u64) -> Result<Vec<BadCase>, SceneError> {
    let mut cases = degenerate(seed)?;
    cases.extend(malformed(seed)?);
    Ok(cases)
}

fn degenerate(seed: u64) -> Result<Vec<BadCase>, SceneError> {
    let facing = |distances: &[f64]| -> Vec<Pose> {
        distances.iter().map(|&z| looking_at_centre([0.0; 3], z)).collect()
    };
    let tilted = |degrees: [f64; 3]| looking_at_centre(degrees, 120.0);
    let grid = Truth::example_board().points();
    let line: Vec<Vec2> = (0..9).map(|i| Vec2::new(10.0 * f64::from(i) - 40.0, 0.0)).collect();
    let corners = vec![grid[0], grid[8], grid[62]];
    let four = Truth::example_poses();
    let sets: [(&'static str, Vec<Pose>, Vec<Vec2>); 10] = [
        ("three-parallel-views", facing(&[110.0, 120.0, 135.0]), grid.clone()),
        (
            "eight-parallel-views",
            facing(&[110.0, 112.0, 115.0, 119.0, 124.0, 128.0, 133.0, 140.0]),
            grid.clone(),
        ),
        ("one-view", vec![tilted([20.0, 0.0, 0.0])], grid.clone()),
        ("one-facing-view", facing(&[120.0]), grid.clone()),
        ("same-view-four-times", vec![tilted([0.0, 20.0, 0.0]); 4], grid.clone()),
        (
            "same-tilt",
            [110.0, 120.0, 130.0, 140.0].iter().map(|&z| looking_at_centre([20.0, 0.0, 0.0], z)).collect(),
            grid.clone(),
        ),
        ("turned-in-its-plane", [0.0, 30.0, 60.0, 90.0].map(|z| tilted([0.0, 0.0, z])).to_vec(), grid),
        ("points-on-a-line", four.clone(), line),
        ("points-coincide", four.clone(), vec![Vec2::new(1.0, 2.0); 12]),
        ("three-points", four, corners),
    ];
    sets.into_iter()
        .map(|(id, cam_from_target, points)| {
            let truth = Truth { cam_from_target, points, ..Truth::example() };
            let problem = observed(id, &truth, seed)?;
            Ok(BadCase { id, fault: Fault::Degenerate, problem, truth: truth.camera.into() })
        })
        .collect()
}

fn malformed(seed: u64) -> Result<Vec<BadCase>, SceneError> {
    let truth = Truth::example();
    let case = |id: &'static str, spoil: &dyn Fn(&mut Problem)| {
        let mut problem = observed(id, &truth, seed)?;
        spoil(&mut problem);
        Ok(BadCase { id, fault: Fault::Malformed, problem, truth: truth.camera.into() })
    };
    Ok(vec![
        case("no-views", &|p| p.views.clear())?,
        case("an-empty-view", &|p| p.views[2] = ProblemView { target: vec![], pixels: vec![] })?,
        case("a-pixel-too-few", &|p| p.views[1].pixels.truncate(62))?,
        case("a-point-too-few", &|p| p.views[1].target.truncate(62))?,
        case("a-pixel-not-measured", &|p| p.views[3].pixels[17] = [f64::NAN, f64::NAN])?,
        case("a-coordinate-not-measured", &|p| p.views[0].pixels[5][1] = f64::NAN)?,
    ])
}

fn observed(id: &str, truth: &Truth, seed: u64) -> Result<Problem, SceneError> {
    let key = StreamKey { seed, scenario: id, trial: 0, purpose: "noise" };
    let views = Scene::new(truth.clone())?.observe(SIGMA_PX, &mut Stream::open(key));
    let free = FreeParameters::STANDARD;
    Ok(Problem::of_views(id.to_string(), truth.image_size, &views, &truth.camera.into(), free))
}
