//! Which minimum is the right one? One start where the data leave no doubt, and a search where they do.
//!
//! Good data need one start, and the certificate says that it was enough. Otherwise the relaxed model
//! ([`super::relaxed`]) gives the lens and the homographies without it; focal lengths are tried against both
//! tilts of every plane ([`super::condensed`]); the best are refined, and tilts that perspective hardly tells
//! are tried the other way round. The least cost wins.

use super::certificate::{self, Certificate};
use super::closed_form;
use super::condensed::{self, Hypothesis};
use super::identifiability::{self, tilts_are_evident};
use super::intervals::{Profile, Skewed};
use super::minimise::{Minimum, Problem, State};
use super::radial_centre::radial_centre;
use super::relaxed::{self, Relaxed};
use super::retraction::Retraction;
use super::rival::{Met, RIVALS, Rival};
use super::start::{Held, focal_from_centre};
use super::system::Reduction;
use super::tie::{met_halfway, tied};
use super::walk::Walked;
use super::{CalibrationError, Termination, strays, tilt, walk};
use crate::camera::{BrownConrady, Camera, FreeParameters, Parameter};
use crate::geometry::{Homography, Vec2};
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

/// What the search starts from.
pub(super) struct Evidence<'a> {
    /// Pixels from target points, without distortion.
    pub homographies: &'a [Homography],
    pub held: &'a Held,
    /// Centre and half-width of the pixels seen.
    pub pixel_frame: (Vec2, f64),
    /// Whether to go on where the first minimum is in doubt.
    pub search: bool,
}

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

impl Judged {
    fn of(problem: &Problem<'_>, minimum: Minimum, starts: usize) -> Judged {
        let reduction = minimum.system.reduction();
        let certificate = reduction
            .as_ref()
            .map(|reduction| certificate::certify(problem, &minimum.state, reduction, minimum.system.cost));
        Judged { minimum, reduction, certificate, starts, skewed: Vec::new(), rival: None, twins: Vec::new() }
    }

    /// With the floor fitted where a step towards it does not certify the minimum: the step is straight, the
    /// relaxed model is not. A lower cost of the relaxed model that was met elsewhere is a floor too.
    fn certified(mut self, problem: &Problem<'_>, lowest_relaxed: f64) -> Judged {
        let cost = self.minimum.system.cost;
        let points = problem.observations.iter().map(|o| o.len()).sum();
        // What rounding leaves of exact data proves nothing.
        let rounding = problem.rounding_cost;
        if let Some(certificate) = self.certificate.as_mut() {
            if !certificate.holds()
                && let Some(beside) = beside(problem, &self.minimum)
            {
                *certificate = certificate.with_floor(cost, beside.cost.max(rounding), points);
            }
            if lowest_relaxed.max(rounding) < certificate.floor(points) {
                *certificate = certificate.with_floor(cost, lowest_relaxed.max(rounding), points);
            }
        }
        self
    }

    /// Whether the certificate holds and tells enough to rely on.
    fn is_certified(&self) -> bool {
        self.certificate
            .as_ref()
            .is_some_and(|c| c.freedom >= TELLING && c.is_possible() && c.p_value > CLEAR)
    }

    /// Whether nothing speaks for another minimum, but perhaps parallel planes.
    fn is_clear(&self, problem: &Problem<'_>) -> bool {
        self.minimum.termination == Termination::Converged
            && self.minimum.iterations <= SHORT_WAY
            && self.is_certified()
            && self.is_well_known(problem)
            && self.doubtful_tilts(problem).is_empty()
    }

    /// With the best of the minima met that is another camera and nearly as good.
    fn with_rival(mut self, problem: &Problem<'_>, met: &[Met]) -> Judged {
        let Some(covariance) = self.reduction.as_ref().and_then(Reduction::intrinsics_covariance) else {
            return self;
        };
        let variance = identifiability::variance(problem, self.noise_px(problem));
        let best = Met::of(&self.minimum);
        let value = |camera: &Camera, parameter| camera.get(parameter);
        self.rival = best.rival(met, problem.free, &(covariance * variance), variance, value);
        self
    }

    /// With the views whose other tilt, the camera held, is nearly as good.
    fn with_twins(mut self, problem: &Problem<'_>) -> Judged {
        let variance = identifiability::variance(problem, self.noise_px(problem));
        let state = &self.minimum.state;
        let twin = |view: usize| {
            let pose = state.cam_from_target[view];
            let (own, cost) = tilt::resected(problem, state, view, pose);
            let (other, other_cost) = tilt::resected(problem, state, view, tilt::mirrored(&own));
            let excess = (other_cost - cost) / variance;
            let degrees = tilt::angle_between(&own, &other).to_degrees();
            (excess < RIVALS && degrees > APART_DEGREES).then_some(Twin { view, degrees, excess })
        };
        self.twins = self.doubtful_tilts(problem).into_iter().filter_map(twin).collect();
        self
    }

    /// Whether the minimum is clear, and the planes are not parallel. Parallel planes that determine nothing
    /// are refused at once, before a search that could find nothing, where the noise is known: at a cost that
    /// its floor certifies.
    fn is_settled(&self, problem: &Problem<'_>) -> Result<bool, CalibrationError> {
        if !self.certificate.as_ref().is_some_and(|c| c.is_possible() && c.holds()) {
            return Ok(false);
        }
        let lower = identifiability::refuse_if_parallel(problem, &self.minimum, self.noise_px(problem));
        let lower = strays::or_blamed(problem, &self.minimum.state, lower)?;
        Ok(lower.is_none() && self.is_clear(problem))
    }

    fn noise_px(&self, problem: &Problem<'_>) -> f64 {
        noise_of(problem, &self.minimum)
    }

    /// Whether focal lengths and principal point are known so well that no other minimum can be nearly as
    /// good.
    fn is_well_known(&self, problem: &Problem<'_>) -> bool {
        let Some(covariance) = self.reduction.as_ref().and_then(Reduction::intrinsics_covariance) else {
            return false;
        };
        let noise_px = self.noise_px(problem);
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
            variance.sqrt() * noise_px <= limit * scale
        })
    }

    /// Standard deviations of cx and cy; infinite where nothing is known, `None` where they are held.
    fn centre_deviations(&self, problem: &Problem<'_>) -> [Option<f64>; 2] {
        let covariance = self.reduction.as_ref().and_then(Reduction::intrinsics_covariance);
        [Parameter::Cx, Parameter::Cy].map(|parameter| {
            let row = problem.free.position(parameter)?;
            Some(covariance.as_ref().map_or(f64::INFINITY, |c| c[(row, row)].sqrt() * self.noise_px(problem)))
        })
    }

    /// Views whose other tilt might do as well.
    fn doubtful_tilts(&self, problem: &Problem<'_>) -> Vec<usize> {
        let State { camera, cam_from_target } = &self.minimum.state;
        let (focal, noise_px) = (0.5 * (camera.fx + camera.fy), self.noise_px(problem));
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

/// Standard deviation of a pixel coordinate, from the cost under the loss in use: gross errors, which a
/// robust loss discounts, say nothing of the noise.
pub(super) fn noise_of(problem: &Problem<'_>, minimum: &Minimum) -> f64 {
    let coordinates = 2 * problem.observations.iter().map(|o| o.len()).sum::<usize>();
    let measurements = coordinates + problem.priors.list.len();
    let freedom = measurements.saturating_sub(minimum.system.unknowns()).max(1);
    (minimum.system.cost / freedom as f64).sqrt()
}

/// The best minimum that is found; `starts` are tried in order until one converges, and the search goes on if
/// that is in doubt.
///
/// # Errors
/// Where the data do not determine focal length or principal point.
pub(super) fn best_minimum(
    problem: &Problem<'_>,
    starts: Vec<State>,
    evidence: &Evidence<'_>,
) -> Result<Judged, CalibrationError> {
    let mut starts = starts.into_iter();
    let first = problem.minimise(starts.next().expect("there is at least one start"));
    let first = Judged::of(problem, first, 1);
    if !evidence.search || first.is_settled(problem)? {
        return Ok(first);
    }
    let first = first_converged(problem, first, starts);
    if first.is_settled(problem)? {
        return Ok(first);
    }
    let half_width = evidence.pixel_frame.1;
    let patient = Problem {
        max_iterations: PATIENCE * problem.max_iterations,
        retraction: Retraction::Curved,
        focal_limits: (SHORTEST * half_width, LONGEST * half_width),
        ..*problem
    };
    let Found { best, starts: count, mut met, lowest_relaxed } = from_relaxed(&patient, first, evidence);
    let best = walk::with_better_tilts(&patient, best);
    let judged = Judged::of(problem, best, count);
    let noise_px = judged.noise_px(problem);
    if judged.is_well_known(problem) && tilts_are_evident(problem, &judged.minimum.state, noise_px) {
        return Ok(judged.certified(problem, lowest_relaxed).with_rival(problem, &met).with_twins(problem));
    }
    let centre_sd = judged.centre_deviations(problem);
    let walked = walk::far_away(&patient, judged.minimum, noise_px, centre_sd);
    let noise_px = noise_of(problem, &walked.best);
    let lower = refuse_undetermined(problem, &walked, noise_px)?;
    let mut best = walked.best;
    if let Some(lower) = lower {
        let minimum = patient.minimise(lower);
        if is_better(&minimum, &best) {
            best = minimum;
        }
    }
    met.extend(walked.met);
    let judged = Judged::of(problem, best, count + walked.starts);
    Ok(with_profiles(&patient, judged)
        .certified(problem, lowest_relaxed)
        .with_rival(problem, &met)
        .with_twins(problem))
}

/// What the relaxed model led to.
struct Found {
    best: Minimum,
    starts: usize,
    met: Vec<Met>,
    /// Least cost of the relaxed model.
    lowest_relaxed: f64,
}

/// Cells of a camera, height over width, that are tried where square ones lead to nothing.
const ASPECTS: [f64; 4] = [0.5, 0.7, 1.4, 2.0];
/// A cost this many times that of the relaxed model is no minimum of a model that holds.
const FAR_ABOVE: f64 = 3.0;

impl Found {
    /// Refines from every start and keeps the best.
    fn try_all(&mut self, problem: &Problem<'_>, starts: Vec<State>) {
        for start in starts {
            self.starts += 1;
            let minimum = problem.minimise(start);
            self.met.push(Met::of(&minimum));
            if is_better(&minimum, &self.best) {
                self.best = minimum;
            }
        }
    }

    fn is_far_above_floor(&self) -> bool {
        self.best.system.cost > FAR_ABOVE * self.lowest_relaxed
    }
}

/// Rounds of the search: each from a relaxed model that explains the data better than the one before.
const ROUNDS: usize = 4;
/// A relaxed model is better if its cost is lower by more than this part.
const LOWER: f64 = 1e-4;

/// Refines from the relaxed model's starts; where the relaxed model next to the best of them is lower than
/// the one known, again from that.
fn from_relaxed(problem: &Problem<'_>, first: Judged, evidence: &Evidence<'_>) -> Found {
    let is_certified = first.is_certified();
    let best = if first.minimum.termination == Termination::IterationLimit {
        problem.minimise(first.minimum.state)
    } else {
        first.minimum
    };
    let met = vec![Met::of(&best)];
    let mut found = Found { best, starts: first.starts, met, lowest_relaxed: f64::INFINITY };
    let mut next = relax(problem, evidence, is_certified);
    for _ in 0..ROUNDS {
        let least = next.first().map_or(f64::INFINITY, |relaxed| relaxed.cost);
        if least >= found.lowest_relaxed * (1.0 - LOWER) {
            break;
        }
        found.lowest_relaxed = least;
        let starts: Vec<State> =
            next.iter().flat_map(|relaxed| relaxed_starts(problem, relaxed, evidence, 1.0)).collect();
        found.try_all(problem, starts);
        if found.is_far_above_floor() && problem.fy_per_fx.is_none() {
            let stretched =
                |relaxed: &Relaxed| ASPECTS.map(|aspect| relaxed_starts(problem, relaxed, evidence, aspect));
            found.try_all(problem, next.iter().flat_map(stretched).flatten().collect());
        }
        next = beside(problem, &found.best).into_iter().collect();
    }
    found
}

/// The relaxed model next to a minimum.
fn beside(problem: &Problem<'_>, minimum: &Minimum) -> Option<Relaxed> {
    relaxed::beside(problem, &minimum.state.camera, &minimum.state.cam_from_target)
}

/// Refuses what the data do not determine, where the noise is known: at a cost that its floor certifies.
/// Gross errors would pass for noise under which nothing is determined, and the advice would be wrong. A
/// state of lower cost is returned if one is met.
fn refuse_undetermined(
    problem: &Problem<'_>,
    walked: &Walked,
    noise_px: f64,
) -> Result<Option<State>, CalibrationError> {
    let certified = walked.best.system.reduction().is_none_or(|reduction| {
        let best = &walked.best;
        let certificate = certificate::certify(problem, &best.state, &reduction, best.system.cost);
        !certificate.is_possible() || certificate.holds()
    });
    if !certified {
        return Ok(None);
    }
    let refused = identifiability::refuse_if_parallel(problem, &walked.best, noise_px)
        .and_then(|lower| identifiability::refuse_if_flat(problem, walked, noise_px).map(|()| lower));
    strays::or_blamed(problem, &walked.best.state, refused)
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
/// Minima that profiles may meet on their way before the search is left as it is.
const BETTER_BY_PROFILE: usize = 3;

/// Looks along the profile of every parameter: for those that are no parabola, and for lower costs.
fn with_profiles(problem: &Problem<'_>, mut judged: Judged) -> Judged {
    for _ in 0..BETTER_BY_PROFILE {
        let noise_px = judged.noise_px(problem);
        let Some(reduction) = &judged.reduction else { break };
        let Some(profile) = Profile::new(problem, &judged.minimum, reduction, noise_px) else { break };
        match profile.skewed() {
            Ok(skewed) => {
                judged.skewed = skewed;
                break;
            }
            Err(state) => {
                let minimum = problem.minimise(*state);
                if !is_better(&minimum, &judged.minimum) {
                    break;
                }
                judged = Judged::of(problem, minimum, judged.starts + 1);
            }
        }
    }
    judged
}

/// A search in doubt may take this many times the iterations.
const PATIENCE: usize = 10;
/// A focal length shorter than this many half-widths of the pixels seen is no lens's: a search that comes
/// there has run away.
const SHORTEST: f64 = 0.02;
/// Likewise a longer one.
const LONGEST: f64 = 1e4;

/// The first minimum, or that of the next start that converges, or else the lowest point reached.
fn first_converged(problem: &Problem<'_>, first: Judged, starts: impl Iterator<Item = State>) -> Judged {
    let converged = |minimum: &Minimum| minimum.termination == Termination::Converged;
    if converged(&first.minimum) {
        return first;
    }
    let (mut best, mut tried) = (first.minimum, first.starts);
    for start in starts {
        tried += 1;
        let minimum = problem.minimise(start);
        if converged(&minimum) || minimum.system.cost < best.system.cost {
            best = minimum;
        }
        if converged(&best) {
            break;
        }
    }
    Judged::of(problem, best, tried)
}

/// A lower cost, by more than rounding; among equals a search that converged.
pub(super) fn is_better(new: &Minimum, old: &Minimum) -> bool {
    const EQUAL: f64 = 1e-9;
    let converged = |m: &Minimum| m.termination == Termination::Converged;
    if new.system.cost < old.system.cost * (1.0 - EQUAL) {
        return true;
    }
    converged(new) && !converged(old) && new.system.cost <= old.system.cost * (1.0 + EQUAL)
}

/// Where the relaxed model leaves fewer degrees of freedom it has minima of its own, and is fitted from more
/// starts unless the first minimum is certified: with few marks these cost little.
const FEW: usize = 100;
/// Radial distortions to start from where marks are few, at the gauge focal length: none, a barrel and a
/// pincushion.
const BENT: [f64; 3] = [0.0, -0.2, 0.2];

/// The relaxed model of these data, its least minimum first and then that of an ordinary camera: square
/// pixels, and its centre in the middle.
pub(super) fn relax(problem: &Problem<'_>, evidence: &Evidence<'_>, is_certified: bool) -> Vec<Relaxed> {
    use Parameter::{Cx, Cy, Fx, Fy, Skew};
    let held = evidence.held;
    let sought = relaxed::parameters(problem, |p| held.value(p).is_some_and(|value| value != 0.0));
    let gauge = gauge_lens(problem, evidence);
    let middle = held.centre;
    let is_centred = !(sought.contains(Cx) && sought.contains(Cy));
    let mut centres = vec![middle];
    if !is_centred {
        centres.extend(radial_centre(problem.observations, evidence.pixel_frame));
    }
    let fit = |centre: Vec2, k1: f64, sought: FreeParameters| {
        let mut start = Camera { cx: centre.x, cy: centre.y, ..gauge };
        start.distortion.k1 += k1;
        relaxed::relax(problem, evidence.homographies, start, sought)
    };
    let marks: usize = problem.observations.iter().map(|o| o.len()).sum();
    let freedom = (2 * marks).saturating_sub(8 * problem.observations.len() + sought.len());
    let is_bendable = sought.contains(Parameter::K1);
    let has_more_minima = freedom < FEW && !is_certified;
    let bent: &[f64] = if has_more_minima && is_bendable { &BENT } else { &BENT[..1] };
    if has_more_minima && !is_centred {
        centres.extend(spread_over(evidence.pixel_frame));
    }
    let starts = centres.iter().flat_map(|&centre| bent.iter().map(move |&k1| (centre, k1)));
    let fits = starts.filter_map(|(centre, k1)| fit(centre, k1, sought));
    let least = fits.min_by(|a, b| a.cost.total_cmp(&b.cost));
    let unusual = [Fx, Fy, Cx, Cy, Skew].into_iter().filter(|&p| sought.contains(p));
    let ordinary = unusual.fold(sought, FreeParameters::without);
    let usual = (ordinary != sought).then(|| fit(middle, 0.0, ordinary)).flatten();
    least.into_iter().chain(usual).collect()
}

/// A centre in the middle of the pixels seen and eight around it.
fn spread_over((middle, half_width): (Vec2, f64)) -> impl Iterator<Item = Vec2> {
    const ASIDE: f64 = 0.6;
    let offsets = [0.0, -ASIDE, ASIDE];
    let pairs = offsets.into_iter().flat_map(move |y| offsets.into_iter().map(move |x| Vec2::new(x, y)));
    pairs.map(move |offset| middle + offset * half_width)
}

/// The lens that the relaxed model starts from. Its gauge is the focal length that is held, or else a wide
/// lens's.
fn gauge_lens(problem: &Problem<'_>, evidence: &Evidence<'_>) -> Camera {
    use Parameter::{Fx, Fy};
    let held = evidence.held;
    let half_width = evidence.pixel_frame.1;
    let gauge = held.value(Fx).or(held.value(Fy)).unwrap_or(2.0 * half_width);
    let start = held.camera(Camera::pinhole(gauge, gauge, held.centre.x, held.centre.y));
    if problem.free.contains(Fx) || problem.free.contains(Fy) {
        // The coefficients start at 0: their values belong to another focal length.
        let cells = tied(Camera { fx: gauge, fy: gauge, ..start }, problem.fy_per_fx);
        cells.with_distortion(BrownConrady::radial(0.0, 0.0))
    } else {
        start
    }
}

/// Focal lengths that are tried, in units of the half-width of the pixels seen: from a fisheye to a long
/// lens.
const SCAN: (f64, f64) = (0.3, 300.0);
/// Steps of the scan: 14 % each, less than the width of a minimum.
const SCAN_STEPS: usize = 52;
/// Minima of the scan that are refined.
const REFINED: usize = 3;

/// States to refine from, the most promising first; `aspect` is that of the cameras tried, relative to the
/// relaxed lens's.
fn relaxed_starts(
    problem: &Problem<'_>,
    relaxed: &Relaxed,
    evidence: &Evidence<'_>,
    aspect: f64,
) -> Vec<State> {
    let gauge = relaxed.lens.fx;
    let homographies: Vec<Homography> =
        relaxed.homographies.iter().map(|h| Homography(relaxed::matrix(h))).collect();
    let mut cameras = Vec::new();
    let skew = problem.free.contains(Parameter::Skew);
    if let Ok(camera) = closed_form::closed_form(&homographies, skew) {
        cameras.push(camera);
    }
    let centred = |focal: f64| Camera::pinhole(focal, focal * aspect, 0.0, 0.0);
    cameras.extend(focal_from_centre(&homographies, Vec2::zeros(), 1.0).map(centred));
    let known = cameras.iter().filter_map(|camera| hypothesis(relaxed, evidence, camera));
    let mut hypotheses: Vec<Hypothesis> = known.collect();
    let unit = evidence.pixel_frame.1 / gauge;
    let ratio = libm::log(SCAN.1 / SCAN.0) / (SCAN_STEPS - 1) as f64;
    let focal = |i: usize| unit * SCAN.0 * libm::exp(ratio * i as f64);
    let with_priors = |mut hypothesis: Hypothesis| {
        if !problem.priors.list.is_empty() {
            hypothesis.cost += problem.priors.cost(&state_of(relaxed, evidence.held, &hypothesis).camera);
        }
        hypothesis
    };
    let scan: Vec<Option<Hypothesis>> =
        (0..SCAN_STEPS).map(|i| hypothesis(relaxed, evidence, &centred(focal(i))).map(with_priors)).collect();
    hypotheses.extend(lowest(scan));
    hypotheses.iter().map(|hypothesis| state_of(relaxed, evidence.held, hypothesis)).collect()
}

/// The hypothesis of a camera, its held values put in, in units of the gauge.
fn hypothesis(relaxed: &Relaxed, evidence: &Evidence<'_>, camera: &Camera) -> Option<Hypothesis> {
    let held = evidence.held;
    let lens = &relaxed.lens;
    let value = |parameter: Parameter, of: f64, unit: f64, origin: f64| {
        held.value(parameter).map_or(of, |value| (value - origin) / unit)
    };
    let in_gauge = Camera {
        skew: camera.skew,
        ..Camera::pinhole(
            value(Parameter::Fx, camera.fx, lens.fx, 0.0),
            value(Parameter::Fy, camera.fy, lens.fy, 0.0),
            value(Parameter::Cx, camera.cx, lens.fx, lens.cx),
            value(Parameter::Cy, camera.cy, lens.fy, lens.cy),
        )
    };
    // In units of the gauge, whose focal lengths stand in the ratio themselves, tied ones are equal.
    let tie = held.fy_per_fx.map(|ratio| ratio * lens.fx / lens.fy);
    condensed::hypothesis(relaxed, &met_halfway(in_gauge, tie))
}

/// The lowest minima of a scan, the lowest first.
fn lowest(scan: Vec<Option<Hypothesis>>) -> Vec<Hypothesis> {
    let cost = |i: usize| scan.get(i).and_then(Option::as_ref).map_or(f64::INFINITY, |h| h.cost);
    let is_minimum = |i: usize| {
        let before = if i == 0 { f64::INFINITY } else { cost(i - 1) };
        cost(i).is_finite() && cost(i) <= before && cost(i) < cost(i + 1)
    };
    let mut minima: Vec<usize> = (0..scan.len()).filter(|&i| is_minimum(i)).collect();
    minima.sort_by(|&a, &b| cost(a).total_cmp(&cost(b)));
    minima.truncate(REFINED);
    minima.into_iter().filter_map(|i| scan[i].clone()).collect()
}

/// The camera and poses of a hypothesis: with `s = f / f0` the coefficients are `k1 s^2`, `k2 s^4`, `k3 s^6`,
/// `p1 s`, `p2 s`.
fn state_of(relaxed: &Relaxed, held: &Held, hypothesis: &Hypothesis) -> State {
    let (lens, k) = (&relaxed.lens, &hypothesis.camera);
    let s = k.fx;
    let (s2, d) = (s * s, &lens.distortion);
    let camera = Camera {
        skew: lens.skew * s,
        ..Camera::pinhole(k.fx * lens.fx, k.fy * lens.fy, lens.cx + k.cx * lens.fx, lens.cy + k.cy * lens.fy)
    };
    let distortion = BrownConrady {
        k1: d.k1 * s2,
        k2: d.k2 * s2 * s2,
        k3: d.k3 * s2 * s2 * s2,
        p1: d.p1 * s,
        p2: d.p2 * s,
    };
    State {
        camera: held.camera(camera.with_distortion(distortion)),
        cam_from_target: hypothesis.poses.clone(),
    }
}
