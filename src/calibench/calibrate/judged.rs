//! What speaks for a minimum, and what against it?

use super::certificate::{self, Certificate};
use super::estimate::Fit;
use super::from_relaxed::beside;
use super::identifiability;
use super::intervals::Skewed;
use super::loss::Loss;
use super::minimise::{Minimum, Problem, State};
use super::noise::Noise;
use super::rival::{Met, RIVALS, Rival};
use super::system::Reduction;
use super::{CalibrationError, Termination, outliers, tilt};
use crate::camera::{Camera, FreeParameters, Parameter};
use nalgebra::DMatrix;

/// A minimum with what is needed to judge it.
pub(super) struct Judged {
    pub minimum: Minimum,
    /// `None` where a pose is undetermined.
    pub reduction: Option<Reduction>,
    pub certificate: Option<Certificate>,
    /// Starts that were refined; 1 on good data.
    pub starts: usize,
    /// Parameters whose cost is no parabola: asked only where they are known poorly.
    pub skewed: Vec<Skewed>,
    /// The best of the other minima, if it is nearly as good.
    pub rival: Option<Rival>,
    /// Views whose other tilt is nearly as good.
    pub twins: Vec<Twin>,
}

/// A view's other tilt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Twin {
    pub view: usize,
    /// By how much its plane is turned there.
    pub degrees: f64,
    /// By how many variances the cost is higher there.
    pub excess: f64,
}

/// Planes that differ by less are one and the same.
const APART_DEGREES: f64 = 1.0;
/// A certificate whose probability is below this is no reason to refuse a minimum, but one to look for a
/// better.
const CLEAR: f64 = 1e-4;
/// With fewer degrees of freedom a certificate tells too little to rely on it alone: two views can be
/// explained by another camera entirely.
const TELLING: usize = 4;
/// Good data take five to ten iterations; a search that took more came from far away.
const SHORT_WAY: usize = 25;

/// A focal length or principal point known worse than this part of the focal length may hide another minimum
/// that is nearly as good.
const WELL_KNOWN: f64 = 0.03;
/// The same where the lens is free to be crooked (tangential terms, skew) or has a third radial term: such a
/// lens explains more.
const WELL_KNOWN_FLEXIBLE: f64 = 0.01;

/// Whether a minimum needs no search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Settled {
    Not,
    /// So many tilts are evident that the camera is the right one whatever the others are: these alone are to
    /// be tried the other way round.
    ButForTilts,
    Entirely,
}

/// Views of evident tilt that leave the others no say in what camera it is: with hundreds of views in all
/// orientations some always face it, and a search over all of them for their sake takes a hundred times as
/// long as the rest.
const ENOUGH_TILTS: usize = 100;

impl Judged {
    pub fn of(problem: &Problem<'_>, minimum: Minimum, starts: usize) -> Judged {
        let reduction = minimum.system.reduction();
        let certificate = reduction
            .as_ref()
            .map(|reduction| certificate::certify(problem, &minimum.state, reduction, minimum.system.cost));
        Judged { minimum, reduction, certificate, starts, skewed: Vec::new(), rival: None, twins: Vec::new() }
    }

    /// With the floor fitted where a step towards it does not certify the minimum: the step is straight, the
    /// relaxed model is not. A lower cost of the relaxed model that was met elsewhere is a floor too.
    pub fn certified(mut self, problem: &Problem<'_>, lowest_relaxed: f64) -> Judged {
        let points = problem.observations.iter().map(|o| o.len()).sum();
        // What rounding leaves of exact data proves nothing.
        let rounding = problem.rounding_cost;
        if let Some(certificate) = self.certificate.as_mut() {
            if !certificate.holds()
                && let Some(beside) = beside(problem, &self.minimum)
            {
                *certificate = certificate.with_floor(problem, &self.minimum, beside.cost.max(rounding));
            }
            if lowest_relaxed.max(rounding) < certificate.floor(points) {
                *certificate = certificate.with_floor(problem, &self.minimum, lowest_relaxed.max(rounding));
            }
        }
        self
    }

    /// Whether the certificate holds and tells enough to rely on.
    pub fn is_certified(&self) -> bool {
        self.certificate
            .as_ref()
            .is_some_and(|c| c.freedom >= TELLING && c.is_possible() && c.p_value > CLEAR)
    }

    /// Whether nothing speaks for another minimum, but perhaps parallel planes or tilts.
    fn is_clear_but_for_tilts(&self, problem: &Problem<'_>) -> bool {
        self.minimum.termination == Termination::Converged
            && self.minimum.iterations <= SHORT_WAY
            && self.is_certified()
            && self.is_well_known(problem)
    }

    /// With the best of the minima met that is another camera and nearly as good.
    pub fn with_rival(mut self, problem: &Problem<'_>, met: &[Met]) -> Judged {
        let Some(covariance) = self.reduction.as_ref().and_then(Reduction::intrinsics_covariance) else {
            return self;
        };
        let noise = self.noise(problem).at_least(problem.rounding_cost);
        let best = Met::of(&self.minimum);
        let value = |camera: &Camera, parameter| camera.get(parameter);
        self.rival = best.rival(met, problem.free, &(covariance * noise.variance), noise.rise, value);
        self
    }

    /// With the views whose other tilt, the camera held, is nearly as good.
    pub fn with_twins(mut self, problem: &Problem<'_>) -> Judged {
        let noise = self.noise(problem).at_least(problem.rounding_cost);
        let state = &self.minimum.state;
        let twin = |view: usize| {
            let pose = state.cam_from_target[view];
            let (own, cost) = tilt::resected(problem, state, view, pose);
            let (other, other_cost) = tilt::resected(problem, state, view, tilt::mirrored(&own));
            let excess = (other_cost - cost) / noise.rise;
            let degrees = tilt::angle_between(&own, &other).to_degrees();
            (excess < RIVALS && degrees > APART_DEGREES).then_some(Twin { view, degrees, excess })
        };
        self.twins = self.doubtful_tilts(problem).into_iter().filter_map(twin).collect();
        self
    }

    /// Whether the minimum is clear, and the planes are not parallel. Parallel planes that determine nothing
    /// are refused at once, before a search that could find nothing, where the noise is known: at a cost that
    /// its floor certifies.
    pub fn is_settled(&self, problem: &Problem<'_>) -> Result<Settled, CalibrationError> {
        if !self.certificate.as_ref().is_some_and(|c| c.is_possible() && c.holds()) {
            return Ok(Settled::Not);
        }
        let lower = identifiability::refuse_if_parallel(problem, &self.minimum, self.noise(problem));
        let lower = outliers::or_blamed(problem, &self.minimum.state, lower)?;
        if lower.is_some() || !self.is_clear_but_for_tilts(problem) {
            return Ok(Settled::Not);
        }
        let doubtful = self.doubtful_tilts(problem).len();
        Ok(match problem.observations.len() - doubtful {
            _ if doubtful == 0 => Settled::Entirely,
            evident if evident >= ENOUGH_TILTS => Settled::ButForTilts,
            _ => Settled::Not,
        })
    }

    pub fn noise(&self, problem: &Problem<'_>) -> Noise {
        noise_of(problem, &self.minimum)
    }

    /// Whether focal lengths and principal point are known so well that no other minimum can be nearly as
    /// good.
    pub fn is_well_known(&self, problem: &Problem<'_>) -> bool {
        let Some(covariance) = self.reduction.as_ref().and_then(Reduction::intrinsics_covariance) else {
            return false;
        };
        let scale_px = self.noise(problem).scale();
        let camera = &self.minimum.state.camera;
        let flexible = [Parameter::Skew, Parameter::P1, Parameter::P2, Parameter::K3];
        let is_flexible = flexible.iter().any(|&p| problem.free.contains(p));
        if is_flexible && trades_off(problem.free, &covariance) {
            return false;
        }
        let limit = if is_flexible { WELL_KNOWN_FLEXIBLE } else { WELL_KNOWN };
        problem.free.iter().zip(covariance.diagonal().iter()).all(|(parameter, variance)| {
            let scale = match parameter {
                Parameter::Fx | Parameter::Cx => camera.fx,
                Parameter::Fy | Parameter::Cy => camera.fy,
                _ => return true,
            };
            variance.sqrt() * scale_px <= limit * scale
        })
    }

    /// Standard deviations of cx and cy; infinite where nothing is known, `None` where they are held.
    pub fn centre_deviations(&self, problem: &Problem<'_>) -> [Option<f64>; 2] {
        let covariance = self.reduction.as_ref().and_then(Reduction::intrinsics_covariance);
        [Parameter::Cx, Parameter::Cy].map(|parameter| {
            let row = problem.free.position(parameter)?;
            Some(
                covariance
                    .as_ref()
                    .map_or(f64::INFINITY, |c| c[(row, row)].sqrt() * self.noise(problem).scale()),
            )
        })
    }

    /// Views whose other tilt might do as well.
    fn doubtful_tilts(&self, problem: &Problem<'_>) -> Vec<usize> {
        let State { camera, cam_from_target } = &self.minimum.state;
        let (focal, noise_px) = (0.5 * (camera.fx + camera.fy), self.noise(problem).px());
        let views = cam_from_target.iter().zip(problem.observations).enumerate();
        views
            .filter(|(_, (pose, observations))| tilt::is_doubtful(pose, observations, focal, noise_px))
            .map(|(view, _)| view)
            .collect()
    }
}

/// Beyond this correlation a crooked lens can take the place of the principal point: there may be two of
/// them.
const TRADES_OFF: f64 = 0.98;

/// Whether the principal point is hardly told from the tangential terms.
fn trades_off(free: FreeParameters, covariance: &DMatrix<f64>) -> bool {
    let rows = |list: [Parameter; 2]| list.into_iter().filter_map(|p| free.position(p)).collect::<Vec<_>>();
    let correlation =
        |i: usize, j: usize| covariance[(i, j)] / (covariance[(i, i)] * covariance[(j, j)]).sqrt();
    let (centre, tangential) = (rows([Parameter::Cx, Parameter::Cy]), rows([Parameter::P1, Parameter::P2]));
    centre.iter().any(|&i| tangential.iter().any(|&j| correlation(i, j).abs() > TRADES_OFF))
}

/// Noise of a pixel coordinate: under least squares from the cost, and otherwise from what the residuals
/// count for, as gross errors, which a robust loss discounts, say nothing of it.
pub(super) fn noise_of(problem: &Problem<'_>, minimum: &Minimum) -> Noise {
    let coordinates = 2 * problem.observations.iter().map(|o| o.len()).sum::<usize>();
    let measurements = coordinates + problem.priors.list.len();
    let freedom = measurements.saturating_sub(minimum.system.unknowns()).max(1);
    if problem.loss == Loss::Squares {
        return Noise::of_squares(minimum.system.cost / freedom as f64);
    }
    Fit::of(&minimum.state, problem.observations).noise(problem.loss, freedom as f64)
}
