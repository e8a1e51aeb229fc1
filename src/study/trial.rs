//! What happens in one trial? Noise is drawn, a camera is calibrated without seeing the truth, and both are
//! compared.

use super::calibrator::{self, Calibrator, Estimate};
use super::cells::Cell;
use super::frame::Displacement;
use super::quantity::Quantity;
use calibench::board::View;
use calibench::calibrate::Termination;
use calibench::camera::{Lens, Model, Parameter};
use calibench::geometry::Vec2;
use calibench::synth::{Scene, Stream};
use std::borrow::Cow;
use std::ops::Range;

/// The result of one trial.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Index of the cell.
    pub cell: usize,
    /// Index of the trial in the cell.
    pub trial: u64,
    /// `converged`, `iteration-limit`, `stalled`, or `refused-...` with the reason.
    pub outcome: String,
    /// Steps of the refinement.
    pub iterations: usize,
    /// One value a quantity of the study; `None` where the trial has none.
    pub values: Vec<Option<f64>>,
}

/// The outcome whose values count in the statistics.
pub(super) const CONVERGED: &str = Termination::Converged.name();

impl Trial {
    /// Whether a minimum was found.
    pub fn converged(&self) -> bool {
        self.outcome == CONVERGED
    }
}

/// Runs trial `trial` of a cell with this library's solver. It depends on nothing but its arguments.
pub fn run_trial(cell: &Cell, quantities: &[Quantity], trial: u64) -> Trial {
    match seen_in(cell, trial) {
        Err(outcome) => failed(cell, quantities, trial, outcome),
        Ok((scene, views)) => {
            let estimate = calibrator::builtin(cell, &views);
            measured(cell, quantities, trial, &scene, estimate)
        }
    }
}

/// The same for several trials with somebody else's solver, which is asked all at once.
pub(super) fn run_trials_of(
    calibrator: &dyn Calibrator,
    cell: &Cell,
    quantities: &[Quantity],
    trials: Range<u64>,
) -> Vec<Trial> {
    let mut seen: Vec<Vec<View>> = Vec::new();
    let scenes: Vec<_> = trials
        .clone()
        .map(|trial| {
            seen_in(cell, trial).map(|(scene, views)| {
                seen.push(views);
                scene
            })
        })
        .collect();
    let mut estimates = calibrator.calibrate(cell, &seen).into_iter();
    let of_trial = |(trial, scene): (u64, Result<Cow<'_, Scene<Lens>>, String>)| match scene {
        Err(outcome) => failed(cell, quantities, trial, outcome),
        Ok(scene) => {
            let estimate = estimates.next().unwrap_or_else(|| Err("broken".to_string()));
            measured(cell, quantities, trial, &scene, estimate)
        }
    };
    trials.zip(scenes).map(of_trial).collect()
}

/// What a trial photographs, and what is seen of it.
type Seen<'a> = (Cow<'a, Scene<Lens>>, Vec<View>);

/// What a trial photographs and sees; where it cannot, the name of its outcome.
fn seen_in(cell: &Cell, trial: u64) -> Result<Seen<'_>, String> {
    let scene = scene_of(cell, trial)?;
    let views = observe(cell, &scene, trial).ok_or("refused-poses")?;
    Ok((scene, views))
}

/// What a trial photographs; without poses the name of its outcome.
fn scene_of(cell: &Cell, trial: u64) -> Result<Cow<'_, Scene<Lens>>, String> {
    match &cell.scene {
        Some(scene) => Ok(Cow::Borrowed(scene)),
        None => cell.draw_scene(trial).map(Cow::Owned).map_err(|_| "refused-poses".to_string()),
    }
}

fn measured(
    cell: &Cell,
    quantities: &[Quantity],
    trial: u64,
    scene: &Scene<Lens>,
    estimate: Result<Estimate, String>,
) -> Trial {
    match estimate {
        Err(outcome) => failed(cell, quantities, trial, outcome),
        Ok(estimate) => {
            let frame = match cell.measures_frame {
                true => Displacement::of(&cell.camera, &estimate.camera, cell.image_size()),
                false => Displacement::default(),
            };
            Trial {
                cell: cell.index,
                trial,
                iterations: estimate.iterations,
                values: quantities.iter().map(|q| measure(*q, cell, scene, &estimate, &frame)).collect(),
                outcome: estimate.outcome,
            }
        }
    }
}

fn failed(cell: &Cell, quantities: &[Quantity], trial: u64, outcome: String) -> Trial {
    Trial { cell: cell.index, trial, outcome, iterations: 0, values: vec![None; quantities.len()] }
}

/// Gaussian noise from one stream and gross errors from another, both drawn point by point whatever their
/// size: cells that differ in noise, outliers or model meet the same draws, and a longer series of views
/// begins with those of a shorter one. `None` where a bowed board reaches behind the camera.
fn observe(cell: &Cell, scene: &Scene<Lens>, trial: u64) -> Option<Vec<View>> {
    let (design, departure) = (&cell.design.scene, cell.departure());
    let mut noise = cell.stream(trial, "noise");
    let seen = match departure.is_none() {
        true => scene.observe(design.noise_px, &mut noise),
        // Without columns no noise is shared.
        false => {
            departure.observe(scene, design.target.columns().unwrap_or(1), design.noise_px, &mut noise)?
        }
    };
    if design.outlier_share == 0.0 {
        return Some(seen);
    }
    let mut stream = cell.stream(trial, "outliers");
    let spoilt = |view| spoil(view, design.outlier_share, design.outlier_px, &mut stream);
    Some(seen.iter().map(spoilt).collect())
}

fn spoil(view: &View, share: f64, half_width_px: f64, stream: &mut Stream) -> View {
    let pixels = view.pixels().iter().map(|pixel| {
        let [chance, du, dv] = std::array::from_fn(|_| stream.uniform());
        let jump = Vec2::new(2.0 * du - 1.0, 2.0 * dv - 1.0) * half_width_px;
        if chance < share { pixel + jump } else { *pixel }
    });
    View::new(view.points().to_vec(), pixels.collect()).expect("finite pixels stay finite, one a point")
}

fn measure(
    quantity: Quantity,
    cell: &Cell,
    scene: &Scene<Lens>,
    estimate: &Estimate,
    frame: &Displacement,
) -> Option<f64> {
    let truth = cell.camera.distortion;
    let error = |p: Parameter| {
        let is_comparable = cell.knows_its_lens() || is_the_same_thing(p, [cell.model(), truth.model()]);
        is_comparable.then(|| Some(estimate.camera.value(p)? - cell.camera.value(p)?)).flatten()
    };
    let value = match quantity {
        Quantity::Rmse => estimate.rmse_px?,
        Quantity::Nees => {
            let error: Vec<f64> = cell.free.iter().map(error).collect::<Option<_>>()?;
            estimate.normalised_error_squared(&error)?
        }
        Quantity::Parameter(p) if cell.free.contains(p) => error(p)?,
        Quantity::Parameter(_) => return None,
        Quantity::Depth => {
            let first = estimate.cam_from_target.as_ref()?.first()?;
            first.translation.z - scene.truth.cam_from_target[0].translation.z
        }
        Quantity::Length => {
            let (length, pixels) = cell.length.as_ref()?;
            length.error_mm(&estimate.camera, pixels)?
        }
        Quantity::Frame(of_frame) => frame.value(of_frame)?,
    };
    value.is_finite().then_some(value)
}

/// Whether a parameter means the same with different models: coefficients never do, of one name or not, and a
/// double sphere's focal length is not the scale of the image on the axis.
fn is_the_same_thing(parameter: Parameter, models: [Model; 2]) -> bool {
    match parameter {
        Parameter::Cx | Parameter::Cy | Parameter::Skew => true,
        Parameter::Fx | Parameter::Fy => !models.contains(&Model::DoubleSphere),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example::STUDY;
    use crate::{Engine, Shard};
    use calibench::synth::StreamKey;

    /// A solver that answers with the true camera, but for a focal length three pixels too long and poses two
    /// millimetres too far; it refuses the second problem and forgets the last.
    #[derive(Debug)]
    struct Longer;

    impl Calibrator for Longer {
        fn calibrate(&self, cell: &Cell, seen: &[Vec<View>]) -> Vec<Result<Estimate, String>> {
            let mut poses = cell.poses().unwrap().to_vec();
            poses.iter_mut().for_each(|pose| pose.translation.z += 2.0);
            let answer = |i: usize| match i {
                1 => Err("refused-loss".to_string()),
                _ => Ok(Estimate {
                    camera: cell.camera.with_value(Parameter::Fx, cell.camera.fx + 3.0).unwrap(),
                    cam_from_target: Some(poses.clone()),
                    rmse_px: Some(0.25),
                    covariance: Some(nalgebra::DMatrix::identity(6, 6) * 4.0),
                    outcome: "converged".into(),
                    iterations: 7,
                }),
            };
            (0..seen.len() - 1).map(answer).collect()
        }
    }

    #[test]
    fn an_error_is_the_estimate_less_the_truth() {
        let engine = Engine::new(STUDY, Shard::WHOLE).unwrap();
        let trials = run_trials_of(&Longer, &engine.cells[0], &engine.quantities, 4..8);
        let of = |trial: &Trial, name: &str| {
            let at = engine.quantities.iter().position(|q| q.name() == name).unwrap();
            trial.values[at]
        };
        for i in [0, 2] {
            let value = |name: &str| of(&trials[i], name).unwrap();
            assert_eq!(["fx", "fy", "cx", "k1"].map(value), [3.0, 0.0, 0.0, 0.0]);
            // 3^2 / 4 of the stated variance.
            assert!((value("nees") - 2.25).abs() < 1e-12 && (value("depth") - 2.0).abs() < 1e-12);
            assert_eq!((value("rmse"), trials[i].trial, trials[i].iterations), (0.25, 4 + i as u64, 7));
        }
        assert_eq!([1, 3].map(|i: usize| trials[i].outcome.as_str()), ["refused-loss", "broken"]);
        assert!([1, 3].iter().all(|&i: &usize| of(&trials[i], "fx").is_none() && !trials[i].converged()));
    }

    #[test]
    fn gross_errors_fill_their_square_and_are_as_many_as_their_share() {
        let key = StreamKey { seed: 1, scenario: "spoil", trial: 0, purpose: "outliers" };
        let clean = View::new(vec![Vec2::zeros(); 2000], vec![Vec2::new(100.0, 50.0); 2000]).unwrap();
        let jumps = |share: f64| -> Vec<Vec2> {
            let spoilt = spoil(&clean, share, 8.0, &mut Stream::open(key));
            spoilt.pixels().iter().map(|pixel| pixel - Vec2::new(100.0, 50.0)).collect()
        };
        let all = jumps(1.0);
        for axis in 0..2 {
            let along: Vec<f64> = all.iter().map(|jump| jump[axis]).collect();
            // Of 2000 uniform numbers one lies in each outer tenth, but for once in 10^90.
            let (least, most) = along.iter().fold((0.0f64, 0.0f64), |(l, m), x| (l.min(*x), m.max(*x)));
            assert!((-8.0..-6.4).contains(&least) && (6.4..8.0).contains(&most), "{least} {most}");
        }
        let moved = |share: f64| jumps(share).iter().filter(|jump| jump.norm() > 0.0).count();
        assert_eq!(moved(0.0), 0);
        // Five standard deviations of 18.3.
        assert!((moved(0.2) as f64 - 400.0).abs() < 90.0, "{}", moved(0.2));
    }

    #[test]
    fn only_what_every_model_means_alike_is_compared_between_models() {
        use Model::{BrownConrady, DoubleSphere, KannalaBrandt};
        let fisheye = [BrownConrady, KannalaBrandt];
        let spheres = [DoubleSphere, KannalaBrandt];
        assert!(is_the_same_thing(Parameter::Cx, spheres) && is_the_same_thing(Parameter::Fx, fisheye));
        assert!(!is_the_same_thing(Parameter::Fx, spheres) && !is_the_same_thing(Parameter::K1, fisheye));
    }
}
