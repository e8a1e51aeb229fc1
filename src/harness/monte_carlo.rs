//! What do many draws of one scene give? Trials in parallel, gathered in their own order.
//!
//! Every trial opens its own random stream, and results are gathered in the order of the trials and summed in
//! that order: no bit depends on the number of threads.

use super::Progress;
use calibench::calibrate::{Calibration, CalibrationError, Covariance, Settings, Termination, calibrate};
use calibench::camera::FreeParameters;
use calibench::evaluate::{Sample, errors_of};
use calibench::synth::{Scene, Stream, StreamKey};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The ending of a trial whose refinement converged.
pub const CONVERGED: &str = "converged";

/// A scene calibrated again and again, with other noise each time.
#[derive(Debug, Clone, Copy)]
pub struct MonteCarlo<'a> {
    /// What is photographed.
    pub scene: &'a Scene,
    /// What is estimated.
    pub settings: &'a Settings,
    /// Standard deviation of the noise on each of u and v, px.
    pub sigma_px: f64,
    /// Seed of the experiment.
    pub seed: u64,
    /// Name of the scenario: part of the key of every stream.
    pub scenario: &'a str,
    /// Number of trials.
    pub trials: usize,
}

/// The estimate of one trial against the truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Estimate - truth of the free parameters, in order.
    pub errors: Vec<f64>,
    /// Reprojection error per point, px.
    pub rmse_px: f64,
    /// Squared Mahalanobis distance of the errors under the estimate's own covariance: the normalised
    /// estimation error squared (Bar-Shalom, Li & Kirubarajan 2001). NaN if that covariance is singular.
    pub normalised_error_squared: f64,
}

/// What became of the trials.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The free parameters: the order of errors.
    pub free: FreeParameters,
    /// Number of trials.
    pub trials: usize,
    /// Converged estimates, in the order of the trials.
    pub estimates: Vec<Estimate>,
    /// How many trials ended how. Every trial is counted once: as [`CONVERGED`], by another way the
    /// refinement ended, or by the reason for which the data were refused.
    pub endings: BTreeMap<String, usize>,
}

impl MonteCarlo<'_> {
    /// Runs the trials, one step of `progress` each.
    ///
    /// ```
    /// use calibench::calibrate::Settings;
    /// use calibench::synth::Scene;
    /// use calibench_harness::{MonteCarlo, ProgressDisplay};
    ///
    /// let (scene, settings) = (Scene::example(), Settings::standard());
    /// let draws = MonteCarlo {
    ///     scene: &scene,
    ///     settings: &settings,
    ///     sigma_px: 0.1,
    ///     seed: 1,
    ///     scenario: "example",
    ///     trials: 20,
    /// };
    /// let outcome = draws.run(&ProgressDisplay::hidden().start("calibrations", draws.trials));
    /// assert_eq!(outcome.converged(), 20);
    /// // fx is known to 0.68 px, so the mean of twenty lies within a pixel of the truth.
    /// assert!(outcome.errors().bias(0).abs() < 1.0);
    /// ```
    pub fn run(&self, progress: &Progress) -> Outcome {
        let results: Vec<Result<Estimate, String>> = (0..self.trials as u64)
            .into_par_iter()
            .map(|trial| {
                let result = self.trial(trial);
                progress.step();
                result
            })
            .collect();
        let mut endings = BTreeMap::new();
        for result in &results {
            let ending = result.as_ref().err().map_or(CONVERGED, String::as_str);
            *endings.entry(ending.to_string()).or_insert(0) += 1;
        }
        let estimates = results.into_iter().filter_map(Result::ok).collect();
        Outcome { free: self.settings.free(), trials: self.trials, estimates, endings }
    }

    fn trial(&self, trial: u64) -> Result<Estimate, String> {
        let key = StreamKey { seed: self.seed, scenario: self.scenario, trial, purpose: "noise" };
        let views = self.scene.observe(self.sigma_px, &mut Stream::open(key));
        let calibration = calibrate(&views, self.settings).map_err(|e| refusal(&e))?;
        match calibration.termination {
            // Where the world is not the model, as with gross errors, a minimum is a minimum.
            ending if ending.is_minimum() => Ok(self.against_truth(&calibration)),
            Termination::IterationLimit => Err("iteration limit".to_string()),
            other => Err(other.name().to_string()),
        }
    }

    fn against_truth(&self, calibration: &Calibration) -> Estimate {
        let truth = &self.scene.truth.camera;
        let errors = calibration.free.iter().map(|p| calibration.camera.get(p) - truth.get(p)).collect();
        let joint = errors_of(truth, &calibration.camera, &calibration.covariance);
        Estimate {
            errors,
            rmse_px: calibration.rmse_px,
            normalised_error_squared: joint.map_or(f64::NAN, |e| e.chi_squared),
        }
    }
}

/// The reason of a refusal without the numbers of the single case, so that like cases count together.
fn refusal(error: &CalibrationError) -> String {
    match error {
        CalibrationError::NotIdentifiable { inseparable, .. } => {
            let mut names: Vec<&str> = inseparable.iter().map(|unknown| unknown.name()).collect();
            names.sort();
            format!("refused: cannot separate {}", names.join(", "))
        }
        CalibrationError::TooFewViews { .. } => "refused: too few views".to_string(),
        CalibrationError::TooFewPoints { .. } => "refused: too few points".to_string(),
        CalibrationError::View { .. } => "refused: a view has no homography".to_string(),
        CalibrationError::NoStart { .. } => "refused: no starting values".to_string(),
        CalibrationError::Outliers(_) => "refused: gross errors".to_string(),
        CalibrationError::HeldWithoutValue { .. }
        | CalibrationError::BadHeldValue { .. }
        | CalibrationError::BadRatio { .. }
        | CalibrationError::BadPrior { .. }
        | CalibrationError::BadCoverage { .. }
        | CalibrationError::BadStart { .. }
        | CalibrationError::BadImageSize { .. }
        | CalibrationError::NarrowLoss { .. }
        | CalibrationError::BadLoss => "refused: impossible settings".to_string(),
        _ => "refused: another reason".to_string(),
    }
}

impl Outcome {
    /// Number of trials that converged.
    pub fn converged(&self) -> usize {
        self.estimates.len()
    }

    /// Number of refusals whose reason names every one of `names`.
    pub fn refused_naming(&self, names: &[&str]) -> usize {
        let names_all =
            |ending: &str| ending.starts_with("refused") && names.iter().all(|name| ending.contains(name));
        self.endings.iter().filter(|(ending, _)| names_all(ending)).map(|(_, count)| count).sum()
    }

    /// The errors of the converged estimates, about zero: its bias is that of the estimator.
    pub fn errors(&self) -> Sample {
        let mut sample = Sample::about(&vec![0.0; self.free.len()]);
        self.estimates.iter().for_each(|e| sample.add(&e.errors));
        sample
    }

    /// Mean of a quantity over the converged estimates; NaN if there is none.
    pub fn mean(&self, quantity: impl Fn(&Estimate) -> f64) -> f64 {
        self.estimates.iter().map(quantity).sum::<f64>() / self.converged() as f64
    }

    /// Mean squared Mahalanobis distance of the errors under a predicted covariance; NaN if it is singular.
    pub fn mean_normalised_error_squared(&self, predicted: &Covariance) -> f64 {
        self.mean(|e| predicted.normalised_error_squared(&e.errors).unwrap_or(f64::NAN))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ProgressDisplay;
    use calibench::synth::Truth;
    use calibench::synth::scene::looking_at_centre;

    fn run(scene: &Scene, trials: usize, threads: usize) -> Outcome {
        let settings = Settings::standard();
        let study =
            MonteCarlo { scene, settings: &settings, sigma_px: 0.1, seed: 3, scenario: "test", trials };
        let progress = ProgressDisplay::hidden().start("test", trials);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| study.run(&progress))
    }

    #[test]
    fn the_number_of_threads_changes_no_bit() {
        let scene = Scene::example();
        let alone = run(&scene, 12, 1);
        assert_eq!(alone.converged(), 12);
        assert_eq!(alone, run(&scene, 12, 5));
    }

    #[test]
    fn refusals_are_counted_by_reason() {
        let poses = [100.0, 120.0, 140.0].map(|z| looking_at_centre([0.0; 3], z)).to_vec();
        let scene = Scene::new(Truth { cam_from_target: poses, ..Truth::example() }).unwrap();
        let outcome = run(&scene, 8, 2);
        assert_eq!(outcome.refused_naming(&["focal length", "distance"]), 8, "{:?}", outcome.endings);
        assert_eq!(outcome.endings.values().sum::<usize>(), 8);
        assert!(outcome.estimates.is_empty() && outcome.mean(|e| e.rmse_px).is_nan());
    }
}
