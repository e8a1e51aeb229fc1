//! From where does a target in space start? From the rays of equidistant fisheyes, and from Tsai's answers to
//! single views.
//!
//! With a fisheye of some focal length every pixel has a ray, whatever its angle from the axis, and the rays
//! of a view give its pose (`resection.rs`). The focal length is searched on a grid; the best few are refined
//! with a polynomial of the angle, which follows any lens, and the wanted model is fitted to what that one
//! sees. The same serves pinholes, which a polynomial follows too; a few views of Tsai's two stages start
//! from pinholes themselves.

use super::data::Data;
use super::descent::{Minimum, descend};
use super::lens::{is_seen, with_model, with_values};
use super::problem::{Problem, State};
use super::resection::with_poses;
use super::tilts::with_better_tilts;
use crate::calibrate::Settings;
use crate::camera::{Camera, FreeParameters, Lens, Model, Parameter};
use crate::geometry::Vec2;
use crate::tsai::{Assumed, SpatialView, two_stage};

/// Angles from the axis, rad, at which the farthest pixel may be seen: 3 to 103 degrees, each 1.3 times the
/// last.
const NARROWEST: f64 = 0.05;
const ANGLES: usize = 14;
const ANGLE_FACTOR: f64 = 1.3;
/// So many of them are refined.
const REFINED: usize = 3;
/// Views that choose the focal length; all of them follow.
const CHOOSERS: usize = 20;
/// Views of which Tsai's two stages are asked.
const OF_TSAI: usize = 3;
/// Points that they need.
const TSAI_POINTS: usize = 7;
/// Steps of a first lens, of a better one.
const FIRST_STEPS: usize = 15;
const LENS_STEPS: usize = 40;

/// States from which the wanted camera may be found.
pub(super) fn starts(problem: &Problem<'_>, settings: &Settings) -> Vec<State> {
    let (centre, reach) = frame(problem.data, settings);
    let found =
        |state: Option<State>| state.map_or(Vec::new(), |state| with_model(problem, &state, settings));
    let mut states = found(by_rays(problem, centre, reach, settings));
    states.extend(by_tsai(problem, centre, settings).into_iter().flat_map(|state| found(Some(state))));
    // A camera of which all is known needs no search.
    let known =
        problem.free.is_empty().then(|| with_values(held(centre, reach, settings), problem.priors, settings));
    states.extend(known.flatten().and_then(|camera| with_poses(problem.data, &camera)));
    states.retain(|state| is_seen(problem.data, state));
    states
}

/// Where the axis may meet the image, and the distance of the farthest pixel from there.
fn frame(data: &Data, settings: &Settings) -> (Vec2, f64) {
    let pixels = || data.views.iter().flatten().map(|seen| seen.pixel);
    let outside = (Vec2::repeat(f64::INFINITY), Vec2::repeat(f64::NEG_INFINITY));
    let (low, high) = pixels().fold(outside, |(low, high), p| (low.inf(&p), high.sup(&p)));
    let middle = match settings.image_size {
        Some((width, height)) => Vec2::new(0.5 * (width as f64 - 1.0), 0.5 * (height as f64 - 1.0)),
        None => 0.5 * (low + high),
    };
    let told = |parameter, otherwise: f64| {
        let prior = settings.priors().find(|prior| prior.parameter == parameter).map(|prior| prior.mean);
        let held = settings.held(parameter).ok().flatten();
        held.or(prior).unwrap_or(otherwise)
    };
    let centre = Vec2::new(told(Parameter::Cx, middle.x), told(Parameter::Cy, middle.y));
    (centre, pixels().map(|p| (p - centre).norm()).fold(1.0, f64::max))
}

/// A camera of the wanted model whose values are all to be set.
fn held(centre: Vec2, reach: f64, settings: &Settings) -> Camera<Lens> {
    Camera::with_lens(reach, reach, centre.x, centre.y, Lens::ideal(settings.model()))
}

/// The best state with an angle polynomial of two terms.
fn by_rays(problem: &Problem<'_>, centre: Vec2, reach: f64, settings: &Settings) -> Option<State> {
    use Parameter::{Cx, Cy, Fx, K1, K2};
    let chosen = problem.data.with_views(&chosen_views(problem.data.views.len()));
    let ratio = settings.fy_per_fx().unwrap_or(1.0);
    let few = Problem { data: &chosen, ..plain(problem, ratio) };
    let mut tried: Vec<Minimum> = Vec::with_capacity(ANGLES);
    let mut angle = NARROWEST;
    for _ in 0..ANGLES {
        let lens = Lens::ideal(Model::KannalaBrandt);
        let camera = Camera::with_lens(reach / angle, ratio * reach / angle, centre.x, centre.y, lens);
        let poses_alone = Problem { free: FreeParameters::NONE, max_iterations: FIRST_STEPS, ..few };
        tried.extend(with_poses(&chosen, &camera).and_then(|state| descend(&poses_alone, state)));
        angle *= ANGLE_FACTOR;
    }
    tried.sort_by(|a, b| a.equations.cost.total_cmp(&b.equations.cost));
    let first = Problem { free: FreeParameters::of(&[Fx, K1]), max_iterations: FIRST_STEPS, ..few };
    let lens = FreeParameters::of(&[Fx, Cx, Cy, K1, K2]);
    let better = Problem { free: lens, max_iterations: LENS_STEPS, ..few };
    let refine = |m: Minimum| descend(&better, descend(&first, m.state)?.state);
    let refined = tried.into_iter().take(REFINED).filter_map(refine);
    let best = refined.min_by(|a, b| a.equations.cost.total_cmp(&b.equations.cost))?;
    let whole = Problem { free: lens, max_iterations: LENS_STEPS, ..plain(problem, ratio) };
    let state = with_poses(problem.data, &best.state.camera).unwrap_or(best.state);
    if state.cam_from_target.len() < problem.data.views.len() {
        return None;
    }
    Some(descend(&whole, state)?.state)
}

/// Nothing known beforehand, marks where they were measured, pixels of one shape.
fn plain<'a>(problem: &Problem<'a>, ratio: f64) -> Problem<'a> {
    Problem { fy_per_fx: Some(ratio), priors: &[], moves_marks: false, ..*problem }
}

/// Views evenly taken from all.
fn chosen_views(count: usize) -> Vec<usize> {
    let chosen = count.min(CHOOSERS);
    (0..chosen).map(|k| k * count / chosen).collect()
}

/// States with the cameras that Tsai's two stages find for single views, refined with k1 and k2 over all.
fn by_tsai(problem: &Problem<'_>, centre: Vec2, settings: &Settings) -> Vec<State> {
    use Parameter::{Fx, K1, K2};
    let ratio = settings.fy_per_fx().unwrap_or(1.0);
    let assumed = Assumed { principal_point_px: centre, fy_per_fx: Some(ratio) };
    let data = problem.data;
    let spatial = |view: &usize| {
        data.views[*view].len() >= TSAI_POINTS && data.shape(*view).thickness() > super::shape::NEARLY_FLAT
    };
    let whole = Problem {
        free: FreeParameters::of(&[Fx, K1, K2]),
        max_iterations: LENS_STEPS,
        ..plain(problem, ratio)
    };
    let state = |view: usize| {
        let seen = &data.views[view];
        let points = seen.iter().map(|seen| data.positions[seen.mark]).collect();
        let view = SpatialView::new(points, seen.iter().map(|seen| seen.pixel).collect()).ok()?;
        let found = two_stage(&view, &assumed).ok()?;
        Some(descend(&whole, with_poses(data, &found.camera.into())?)?.state)
    };
    (0..data.views.len()).filter(spatial).take(OF_TSAI).filter_map(state).collect()
}

/// What the starts lead to with the marks where they were measured, the best first, each camera once; and how
/// many starts there were.
pub(super) fn minima(problem: &Problem<'_>, starts: Vec<State>) -> (Vec<Minimum>, usize) {
    let exact = Problem { moves_marks: false, ..*problem };
    let search = |state| Some(with_better_tilts(&exact, descend(&exact, state)?));
    let mut all: Vec<Minimum> = starts.into_iter().filter_map(search).collect();
    let count = all.len();
    all.sort_by(|a, b| a.equations.cost.total_cmp(&b.equations.cost));
    let mut kept: Vec<Minimum> = Vec::new();
    for minimum in all {
        if !kept.iter().any(|other| is_same(&other.state.camera, &minimum.state.camera)) {
            kept.push(minimum);
        }
    }
    kept.truncate(KEPT);
    (kept, count)
}

/// So many minima are refined with the positions of the marks: measurement errors may change their order.
const KEPT: usize = 4;
/// Two cameras whose parameters differ by less than this part, or this much, are one minimum.
const SAME: f64 = 1e-4;

fn is_same(a: &Camera<Lens>, b: &Camera<Lens>) -> bool {
    a.values().zip(b.values()).all(|((_, a), (_, b))| (a - b).abs() <= SAME * a.abs().max(1.0))
}
