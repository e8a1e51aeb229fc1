//! Where else may a refinement start? The relaxed model gives the lens and the homographies without it; focal
//! lengths are tried against both tilts of every plane, and the best are refined.

use super::Termination;
use super::closed_form;
use super::condensed::{self, Hypothesis};
use super::judged::Judged;
use super::minimise::{Minimum, Problem, State};
use super::radial_centre::radial_centre;
use super::relaxed::{self, Relaxed};
use super::rival::Met;
use super::search::is_better;
use super::start::{Held, focal_from_centre};
use super::tie::{met_halfway, tied};
use crate::camera::{BrownConrady, Camera, FreeParameters, Parameter};
use crate::geometry::{Homography, Vec2};

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

/// What the relaxed model led to.
pub(super) struct Found {
    pub best: Minimum,
    pub starts: usize,
    pub met: Vec<Met>,
    /// Least cost of the relaxed model.
    pub lowest_relaxed: f64,
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
pub(super) fn from_relaxed(problem: &Problem<'_>, first: Judged, evidence: &Evidence<'_>) -> Found {
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
pub(super) fn beside(problem: &Problem<'_>, minimum: &Minimum) -> Option<Relaxed> {
    relaxed::beside(problem, &minimum.state.camera, &minimum.state.cam_from_target)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Settings;
    use crate::calibrate::Termination;
    use crate::calibrate::system::System;
    use crate::geometry::{Pose, Vec3, rotation};

    #[test]
    fn the_camera_of_a_hypothesis_makes_the_relaxed_models_picture() {
        use Parameter::{K3, P1, P2, Skew};
        let settings = [K3, P1, P2, Skew].into_iter().fold(Settings::standard(), Settings::estimate);
        let held = Held::of(&settings, Vec2::zeros()).unwrap();
        let plain = Camera::pinhole(600.0, 580.0, 326.0, 243.0);
        let bent = Camera::from_parameters([600.0, 580.0, 326.0, 243.0, 1.5, -0.2, 0.05, 1e-3, -2e-3, 0.01]);
        // Without distortion the centre may move, and the shape of the cells change.
        for (lens, camera) in
            [(bent, Camera::pinhole(1.7, 1.7, 0.0, 0.0)), (plain, Camera::pinhole(1.7, 1.5, 0.1, -0.05))]
        {
            let pose = Pose {
                rotation: rotation::from_xyz_rad(0.3, -0.4, 0.2),
                translation: Vec3::new(5.0, -7.0, 150.0),
            };
            let relaxed = Relaxed { lens, homographies: Vec::new(), information: Vec::new(), cost: 0.0 };
            let state = state_of(&relaxed, &held, &Hypothesis { camera, poses: vec![pose], cost: 0.0 });
            for (x, y) in [(-40.0, -30.0), (13.0, 25.0), (35.0, 0.0)] {
                let point = pose.apply(&Vec3::new(x, y, 0.0));
                // The homography is that of a pinhole in units of the gauge; the lens comes behind it.
                let expected = lens.project(&(camera.k() * point)).unwrap();
                let own =
                    state.camera.project(&state.cam_from_target[0].apply(&Vec3::new(x, y, 0.0))).unwrap();
                assert!((own - expected).norm() < 1e-10, "{own} {expected}");
            }
        }
    }

    #[test]
    fn the_minima_of_a_scan_come_lowest_first() {
        let hypothesis =
            |cost: f64| Hypothesis { camera: Camera::pinhole(1.0, 1.0, 0.0, 0.0), poses: Vec::new(), cost };
        let costs = |scan: &[f64]| -> Vec<f64> {
            let scan = scan.iter().map(|&cost| (cost < 100.0).then(|| hypothesis(cost))).collect();
            lowest(scan).into_iter().map(|hypothesis| hypothesis.cost).collect()
        };
        // 100 stands for no hypothesis.
        assert_eq!(costs(&[5.0, 3.0, 4.0, 100.0, 2.0, 6.0, 1.0, 7.0, 0.5]), [0.5, 1.0, 2.0]);
        assert_eq!(costs(&[3.0, 4.0, 5.0]), [3.0]);
        // Equals are one.
        assert_eq!(costs(&[5.0, 2.0, 2.0, 6.0]), [2.0]);
    }

    #[test]
    fn centres_are_tried_in_the_middle_and_around_it() {
        let list: Vec<Vec2> = spread_over((Vec2::new(320.0, 240.0), 100.0)).collect();
        let around = |x: f64| [180.0, 240.0, 300.0].map(|y| Vec2::new(x, y));
        assert_eq!(list.len(), 9);
        assert!(
            [260.0, 320.0, 380.0].into_iter().flat_map(around).all(|centre| list.contains(&centre)),
            "{list:?}"
        );
    }

    #[test]
    fn a_cost_three_times_that_of_the_relaxed_model_is_far_above_it() {
        let is_far = |cost: f64| {
            let mut system = System::new(FreeParameters::NONE, 0);
            system.cost = cost;
            let camera = Camera::pinhole(600.0, 600.0, 320.0, 240.0);
            let state = State { camera, cam_from_target: Vec::new() };
            let best = Minimum { state, system, termination: Termination::Converged, iterations: 1 };
            Found { best, starts: 1, met: Vec::new(), lowest_relaxed: 2.0 }.is_far_above_floor()
        };
        assert!(is_far(6.1) && !is_far(5.9));
    }
}
