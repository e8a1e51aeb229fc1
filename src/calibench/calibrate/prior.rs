//! What is known of a parameter before any photograph is taken? A value with its standard deviation: one more
//! measurement.
//!
//! With the noise `sigma` of a pixel coordinate a prior is a residual of `sigma (p - mean) / sd` px, and
//! under least squares the cost becomes
//!
//! ```text
//! sum |r|^2 + sigma^2 sum ((p - mean) / sd)^2,   covariance = sigma^2 (J^T J + W)^-1,   W = diag(sigma^2 / sd^2)
//! ```
//! The noise is estimated with the rest. Of `p` unknowns a prior settles a part of its own, `(posterior sd /
//! sd)^2`, which costs the pixels no degree of freedom, so that
//!
//! ```text
//! sigma^2 = sum |r|^2 / (2 N - p + sum (posterior sd / sd)^2)
//! ```
//! without bias in a linear model: with a wide prior as if the parameter were free, with a narrow one as if
//! it were held (MacKay 1992 counts the parameters that data determine alike). The right-hand side depends on
//! `sigma` through the weights, and is repeated until `sigma` changes by less than 1e-6 of itself; a polished
//! minimum keeps the weights.

use super::estimate::Fit;
use super::from_relaxed::{Evidence, relax};
use super::judged::Judged;
use super::minimise::{Minimum, Problem, State};
use super::noise::Noise;
use super::search;
use super::system::System;
use super::{CalibrationError, relaxed};
use crate::camera::{Camera, Parameter};

/// A normal number exceeds this in size with a probability of one in a million.
const CONTRADICTED: f64 = 4.89;
/// Where the pixels make an estimate better than its prior by less than this part, they say nothing of it.
const TOLD_BY_PIXELS: f64 = 1e-6;

/// By how many standard deviations an estimate that lies `away` from a prior's mean contradicts it; `None`
/// where it does not. Before the photographs the estimate is spread about the mean with the variance that
/// they take away from it: `prior_sd^2 - posterior_sd^2`.
pub(crate) fn contradiction(away: f64, prior_sd: f64, posterior_sd: f64) -> Option<f64> {
    let deviations = away.abs() / (prior_sd * taken(prior_sd, posterior_sd).max(0.0).sqrt());
    (!is_held(prior_sd, posterior_sd) && deviations > CONTRADICTED).then_some(deviations)
}

/// Whether what is known of a parameter beforehand leaves the pixels no say: it is as good as held.
pub(super) fn is_held(prior_sd: f64, posterior_sd: f64) -> bool {
    taken(prior_sd, posterior_sd) <= TOLD_BY_PIXELS
}

/// The part of a prior's variance that the pixels take away.
fn taken(prior_sd: f64, posterior_sd: f64) -> f64 {
    let share = posterior_sd / prior_sd;
    1.0 - share * share
}

/// A parameter that is estimated, and known beforehand: `mean +- standard_deviation`, normally distributed.
///
/// With the noise `sigma` of a pixel coordinate it counts as a residual of `sigma (p - mean) /
/// standard_deviation` px, so that the covariance of all unknowns is `sigma^2 (J^T J + W)^-1`, `W =
/// diag(sigma^2 / standard_deviation^2)`. The noise is estimated with the rest, from the pixels' residuals
/// alone: `sum |r|^2 / (2 N - p + sum s^2)`, where `s` is the standard deviation of the estimate over that of
/// the prior. It is repeated until `sigma` changes by less than 1e-6 of itself.
///
/// ```
/// use calibench::calibrate::{Settings, calibrate};
/// use calibench::camera::Parameter;
/// use calibench::synth::{Scene, Stream, StreamKey};
///
/// let mut stream = Stream::open(StreamKey { seed: 1, scenario: "example", trial: 0, purpose: "noise" });
/// let views = Scene::example().observe(0.1, &mut stream);
/// // Square pixels, and a lens whose k1 an earlier calibration told.
/// let settings = Settings::standard().tie_focal_lengths(1.0).with_prior(Parameter::K1, -0.18, 0.002);
/// let result = calibrate(&views, &settings)?;
/// assert_eq!(result.camera.fx, result.camera.fy);
/// assert_eq!(result.standard_deviation(Parameter::Fx), result.standard_deviation(Parameter::Fy));
/// assert!(result.standard_deviation(Parameter::K1) < Some(0.002));
/// # Ok::<(), calibench::calibrate::CalibrationError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Prior {
    /// Which.
    pub parameter: Parameter,
    /// Its value.
    pub mean: f64,
    /// How well it is known.
    pub standard_deviation: f64,
}

/// Priors, and the noise of a pixel coordinate that weighs them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Priors<'a> {
    pub list: &'a [Prior],
    pub noise: Noise,
}

/// What a prior counts for beside pixels of some noise: two numbers, because a robust loss has two of that.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Weight {
    /// In the cost and its gradient.
    pub cost: f64,
    /// In the normal matrix.
    pub information: f64,
}

impl Weight {
    /// Of what is known with a standard deviation.
    pub fn of(noise: Noise, standard_deviation: f64) -> Weight {
        let known = standard_deviation * standard_deviation;
        Weight { cost: noise.rise / known, information: noise.variance / known }
    }
}

impl Priors<'_> {
    /// Nothing is known beforehand.
    pub const NONE: Priors<'static> =
        Priors { list: &[], noise: Noise { coordinate: 0.0, variance: 0.0, rise: 0.0 } };

    /// Each with its weight: `sigma^2 / sd^2` under least squares.
    pub fn weighted(&self) -> impl Iterator<Item = (&Prior, Weight)> {
        self.list.iter().map(|prior| (prior, Weight::of(self.noise, prior.standard_deviation)))
    }

    /// Their share of the cost, px^2. A parameter that is held for a while, as along a profile, pays for its
    /// place too.
    pub fn cost(&self, camera: &Camera) -> f64 {
        let squared = |x: f64| x * x;
        self.weighted()
            .map(|(prior, weight)| weight.cost * squared(camera.get(prior.parameter) - prior.mean))
            .sum()
    }

    /// Adds them to the normal equations at `camera`.
    pub fn add_to(&self, camera: &Camera, system: &mut System) {
        system.cost += self.cost(camera);
        for (prior, weight) in self.weighted() {
            if let Some(row) = system.free.position(prior.parameter) {
                system.intrinsics[(row, row)] += weight.information;
                system.gradient[row] += weight.cost * (camera.get(prior.parameter) - prior.mean);
            }
        }
    }

    /// How many unknowns they settle, `sum (posterior sd / sd)^2`: all of theirs where nothing else is known
    /// of them, none where the pixels say far more.
    pub fn settled(&self, minimum: &Minimum) -> f64 {
        if self.list.is_empty() {
            return 0.0;
        }
        let free = minimum.system.free;
        let covariance = minimum.system.reduction().and_then(|reduction| reduction.intrinsics_covariance());
        let share = |(prior, weight): (&Prior, Weight)| {
            let row = free.position(prior.parameter)?;
            Some(covariance.as_ref()?[(row, row)] * weight.information)
        };
        self.weighted().filter_map(share).sum()
    }
}

/// Where homographies leave no degree of freedom to tell the noise, the first weights are for this, px: what
/// good detectors reach.
const USUAL_PX: f64 = 0.1;
/// Nobody's marks are better than this, px: exact data would otherwise leave priors no weight at all.
const LEAST_PX: f64 = 1e-4;
/// The noise is settled when it changes by less than this part.
const SETTLED: f64 = 1e-6;
/// Refinements until it is; each gains two digits or more on ordinary data.
const MOST_REFITS: usize = 60;
/// Searches, each with the weights that the minimum before it led to: two, and a third where the second found
/// a lower minimum.
const MOST_SEARCHES: usize = 4;

/// The best minimum under priors, and the noise of a pixel coordinate that weighed them.
pub(super) fn best_minimum(
    problem: &Problem<'_>,
    mut starts: Vec<State>,
    evidence: &Evidence<'_>,
) -> Result<(Judged, Noise), CalibrationError> {
    let with = |noise: Noise| Problem { priors: Priors { noise, ..problem.priors }, ..*problem };
    let mut noise = Noise::of_squares(first_variance(problem, evidence));
    let (mut searches, mut iterations) = (0, 0);
    loop {
        let mut judged = search::best_minimum(&with(noise), starts, evidence)?;
        searches += 1;
        iterations += judged.minimum.iterations;
        judged.minimum.iterations = iterations;
        let settled = settle(problem, &judged.minimum, noise);
        if is_settled(settled, noise) || searches == MOST_SEARCHES {
            return Ok((judged, noise));
        }
        (noise, starts) = (settled, vec![judged.minimum.state]);
    }
}

/// The noise at which weights and residuals agree, next to a minimum.
fn settle(problem: &Problem<'_>, minimum: &Minimum, noise: Noise) -> Noise {
    let with = |noise: Noise| Problem { priors: Priors { noise, ..problem.priors }, ..*problem };
    let mut next = noise_at(&with(noise), minimum);
    let mut last = noise;
    let mut state = minimum.state.clone();
    for _ in 0..MOST_REFITS {
        if is_settled(next, last) {
            break;
        }
        let problem = with(next);
        let refined = problem.minimise(state);
        (last, next) = (next, noise_at(&problem, &refined));
        state = refined.state;
    }
    next
}

fn is_settled(next: Noise, last: Noise) -> bool {
    // A variance changes by twice the part that its root does.
    let agree = |next: f64, last: f64| (next - last).abs() <= 2.0 * SETTLED * last;
    agree(next.variance, last.variance) && agree(next.rise, last.rise)
}

/// Before any camera is known: what homographies behind a common lens leave over.
fn first_variance(problem: &Problem<'_>, evidence: &Evidence<'_>) -> f64 {
    let marks: usize = problem.observations.iter().map(|o| o.len()).sum();
    let least = relax(problem, evidence, true).first().map_or(f64::NAN, |relaxed| relaxed.cost);
    let lens =
        relaxed::parameters(problem, |p| evidence.held.value(p).is_some_and(|value| value != 0.0)).len();
    let freedom = (2 * marks).saturating_sub(8 * problem.observations.len() + lens);
    let variance = least / freedom as f64;
    let is_told = freedom > 0 && variance.is_finite();
    if is_told { variance.max(LEAST_PX * LEAST_PX) } else { USUAL_PX * USUAL_PX }
}

/// The noise that the residuals of a minimum show.
fn noise_at(problem: &Problem<'_>, minimum: &Minimum) -> Noise {
    let fit = Fit::of(&minimum.state, problem.observations);
    let freedom = fit.freedom(&minimum.system, problem.priors.settled(minimum));
    fit.noise(problem.loss, freedom).at_least(LEAST_PX * LEAST_PX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Settings;
    use crate::calibrate::minimise::rounding_cost;
    use crate::calibrate::normal::Observations;
    use crate::calibrate::retraction::Retraction;
    use crate::calibrate::start::Held;
    use crate::calibrate::tests::four_views;
    use crate::geometry::{Homography, Vec2};

    #[test]
    fn the_noise_is_known_before_any_camera_is() {
        let views = four_views(0.3);
        let observations: Vec<Observations> = views
            .iter()
            .map(|view| Observations::new(view.pairs().map(|(point, pixel)| (point / 40.0, *pixel))))
            .collect();
        let homographies: Vec<Homography> =
            observations.iter().map(|pairs| Homography::fit_pairs(pairs, 1e-3).unwrap().homography).collect();
        let pixel_frame = (Vec2::new(320.0, 240.0), 300.0);
        let settings = Settings::standard();
        let held = Held::of(&settings, pixel_frame.0).unwrap();
        let problem = Problem {
            free: settings.free(),
            fy_per_fx: None,
            priors: Priors::NONE,
            observations: &observations,
            loss: settings.loss,
            max_iterations: settings.max_iterations,
            hold_tilt: false,
            retraction: Retraction::Straight,
            focal_limits: (0.0, f64::INFINITY),
            rounding_cost: rounding_cost(&observations),
        };
        let evidence = Evidence { homographies: &homographies, held: &held, pixel_frame, search: true };
        // Of 467 degrees of freedom the noise is known to 3.3 %.
        let noise_px = first_variance(&problem, &evidence).sqrt();
        assert!((0.27..0.33).contains(&noise_px), "{noise_px}");
    }
}
