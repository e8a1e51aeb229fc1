//! From where does the search for a camera with any lens start?
//!
//! A homography of pixels needs a pinhole, and beyond some 100 degrees there is none. A ray needs none: with an
//! equidistant fisheye of some focal length every pixel has a ray `b`, and `b x (H X) = 0` gives the homography
//! from the board to rays, whatever the angle. The focal length is searched on a grid; the best few are refined
//! with a polynomial of the angle (Kannala & Brandt 2006), which follows any lens, and the wanted model is
//! fitted to the rays that this one sees.

use super::super::Settings;
use super::super::estimate::state_alone;
use super::super::minimise::{Minimum, descend};
use super::super::tie::tied;
use super::super::tilt::mirrored;
use super::WIDTH;
use super::marks::{Mark, Marks};
use super::problem::{Problem, ROUGH_GAIN, State};
use super::radial;
use crate::board::View;
use crate::camera::{Camera, FreeParameters, Lens, Model, Parameter};
use crate::geometry::{Mat3, Pose, Vec2, Vec3};
use nalgebra::{SMatrix, SVector};

/// Angles from the axis, rad, at which the farthest pixel may be seen: 3 to 103 degrees, each 1.3 times the last.
const NARROWEST: f64 = 0.05;
const ANGLES: usize = 14;
const ANGLE_FACTOR: f64 = 1.3;
/// Heights of a pixel over its width that are tried beside 1, where it is not known.
const ASPECTS: [f64; 2] = [0.6, 1.7];
/// Pixels whose height over width comes out within this part of 1 are taken for square ones.
const NEARLY_SQUARE: f64 = 0.1;
/// So many of them are refined.
const REFINED: usize = 3;
/// With fewer marks a view than this, the pinhole is searched for beyond its first minima, as those of five marks a view can
/// lead astray (`lens_hard_cases::a_fisheye_behind_tall_pixels_is_found_from_five_marks_a_view`). The search costs little
/// then; with many marks it costs more than all the rest, as it goes on for long where no pinhole fits.
const FEW_MARKS: usize = 16;
/// The focal length is chosen by so many marks of evenly taken views, of [`CHOOSERS`] at the least; all of them follow.
const CHOOSING_MARKS: usize = 500;
const CHOOSERS: usize = 6;
/// Steps of the poses alone, of a first lens, of a better one.
const POSE_STEPS: usize = 6;
const FIRST_STEPS: usize = 15;
const LENS_STEPS: usize = 40;

/// States with lenses of the wanted model like the one that the pinhole's solver finds with k1 and k2, however it
/// fits, and whether that is certified.
pub(super) fn by_pinhole(problem: &Problem<'_>, views: &[View], settings: &Settings) -> (Vec<State>, bool) {
    match pinhole(problem, views, settings) {
        Some((state, certified)) => (with_model(problem, &state, settings), certified),
        None => (Vec::new(), false),
    }
}

fn pinhole(problem: &Problem<'_>, views: &[View], settings: &Settings) -> Option<(State, bool)> {
    let mut plain = Settings::standard();
    let marks: usize = views.iter().map(View::len).sum();
    (plain.image_size, plain.loss) = (settings.image_size, settings.loss);
    plain.search = marks < FEW_MARKS * views.len();
    let unweighted = |v: &View| View::new(v.points().to_vec(), v.pixels().to_vec()).ok();
    let unweighted: Vec<View> = views.iter().map(unweighted).collect::<Option<_>>()?;
    let (found, is_certified) = state_alone(&unweighted, &plain).ok()?;
    let state =
        State { camera: found.camera.into(), cam_from_target: found.cam_from_target, shape: [0.0; 3] };
    is_seen(problem.views, &state).then_some((state, is_certified))
}

/// States with lenses of the wanted model like angle polynomials of two terms: with pixels of the shape that is tied,
/// otherwise with square ones, and where they come out far from it once fy is free, with pixels of any shape besides. Few
/// marks lead these astray where square ones are right.
pub(super) fn by_rays(problem: &Problem<'_>, settings: &Settings) -> Vec<State> {
    let rough = Problem { priors: &[], bend: None, relative_gain: ROUGH_GAIN, ..*problem };
    let shaped = |fy_per_fx| Problem { fy_per_fx, ..rough };
    let square = polynomial(&shaped(problem.fy_per_fx.or(Some(1.0))), settings);
    let is_known = problem.fy_per_fx.is_some() || !problem.free.contains(Parameter::Fy);
    let any = match &square {
        _ if is_known => None,
        Some(state) if is_nearly_square(&shaped(None), state) => None,
        _ => polynomial(&shaped(None), settings),
    };
    [square, any].into_iter().flatten().flat_map(|state| with_model(problem, &state, settings)).collect()
}

/// Whether pixels stay nearly square where an angle polynomial that takes them for it is refined with fy free.
fn is_nearly_square(fisheye: &Problem<'_>, state: &State) -> bool {
    use Parameter::{Cx, Cy, Fx, Fy, K1, K2};
    let free = FreeParameters::of(&[Fx, Fy, Cx, Cy, K1, K2]);
    let refined = descend(&Problem { free, max_iterations: LENS_STEPS, ..*fisheye }, state.clone());
    let camera = refined.state.camera;
    (camera.fy / camera.fx - 1.0).abs() <= NEARLY_SQUARE
}

/// The best state with an angle polynomial of two terms.
fn polynomial(fisheye: &Problem<'_>, settings: &Settings) -> Option<State> {
    let (centre, reach) = frame(fisheye.views, settings);
    let chosen: Vec<Marks> =
        chosen_views(fisheye.views).into_iter().map(|view| fisheye.views[view].clone()).collect();
    let few = Problem { views: &chosen, ..*fisheye };
    let poses_alone = Problem { free: FreeParameters::NONE, max_iterations: POSE_STEPS, ..few };
    let aspects = match few.fy_per_fx {
        Some(known) => vec![known],
        None => ASPECTS.to_vec(),
    };
    let mut tried = Vec::with_capacity(ANGLES * aspects.len());
    let mut angle = NARROWEST;
    for _ in 0..ANGLES {
        for aspect in &aspects {
            let lens = Lens::ideal(Model::KannalaBrandt);
            let camera = Camera::with_lens(reach / angle, aspect * reach / angle, centre.x, centre.y, lens);
            if let Some(state) = with_poses(&chosen, camera) {
                tried.push(descend(&poses_alone, state));
            }
        }
        angle *= ANGLE_FACTOR;
    }
    tried.sort_by(|a, b| a.system.cost.total_cmp(&b.system.cost));
    use Parameter::{Cx, Cy, Fx, Fy, K1, K2};
    let kept = |list: &[Parameter]| {
        let free = FreeParameters::of(list);
        if few.fy_per_fx.is_some() { free.without(Fy) } else { free }
    };
    let first = Problem { free: kept(&[Fx, Fy, K1]), max_iterations: FIRST_STEPS, ..few };
    let lens = kept(&[Fx, Fy, Cx, Cy, K1, K2]);
    let better = Problem { free: lens, max_iterations: LENS_STEPS, ..few };
    let refined = tried.into_iter().take(REFINED).map(|m| descend(&better, descend(&first, m.state).state));
    let best = refined
        .filter(|m| m.system.cost.is_finite())
        .min_by(|a, b| a.system.cost.total_cmp(&b.system.cost))?;
    let whole = Problem { free: lens, max_iterations: LENS_STEPS, ..*fisheye };
    let state = with_better_tilts(&whole, with_poses(fisheye.views, best.state.camera)?);
    Some(descend(&whole, state).state)
}

/// Where the axis may meet the image, and the distance of the farthest pixel from there.
fn frame(views: &[Marks], settings: &Settings) -> (Vec2, f64) {
    let pixels = || views.iter().flat_map(|view| &view.list).map(|mark| mark.pixel);
    let outside = (Vec2::repeat(f64::INFINITY), Vec2::repeat(f64::NEG_INFINITY));
    let (low, high) = pixels().fold(outside, |(low, high), p| (low.inf(&p), high.sup(&p)));
    let middle = match settings.image_size {
        Some((width, height)) => Vec2::new(0.5 * (width as f64 - 1.0), 0.5 * (height as f64 - 1.0)),
        None => 0.5 * (low + high),
    };
    let held = |parameter, otherwise: f64| match settings.held(parameter) {
        Ok(Some(value)) => value,
        _ => otherwise,
    };
    let centre = Vec2::new(held(Parameter::Cx, middle.x), held(Parameter::Cy, middle.y));
    (centre, pixels().map(|p| (p - centre).norm()).fold(1.0, f64::max))
}

/// Views evenly taken from all, with enough marks.
fn chosen_views(views: &[Marks]) -> Vec<usize> {
    let marks: usize = views.iter().map(Marks::len).sum();
    let enough = (CHOOSING_MARKS * views.len()).div_ceil(marks.max(1));
    let count = views.len().min(enough.max(CHOOSERS));
    (0..count).map(|k| k * views.len() / count).collect()
}

/// The camera with a pose for every view; `None` where one has none.
pub(super) fn with_poses(views: &[Marks], camera: Camera<Lens>) -> Option<State> {
    let cam_from_target = views.iter().map(|view| pose_from_rays(view, &camera)).collect::<Option<_>>()?;
    Some(State { camera, cam_from_target, shape: [0.0; 3] })
}

/// The pose of a flat board from the rays of its marks; `None` with fewer than four.
fn pose_from_rays(view: &Marks, camera: &Camera<Lens>) -> Option<Pose> {
    let mut normal = SMatrix::<f64, 9, 9>::zeros();
    let mut rays = Vec::with_capacity(view.len());
    for mark in &view.list {
        let Ok(ray) = camera.ray(&mark.pixel) else { continue };
        // Two directions across the ray: H X has no part along them.
        let other = if ray.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() };
        let first = ray.cross(&other).normalize();
        let point = [mark.point.x, mark.point.y, 1.0];
        for across in [first, ray.cross(&first)] {
            let row = SVector::<f64, 9>::from_fn(|i, _| point[i % 3] * across[i / 3]);
            normal += row * row.transpose();
        }
        rays.push((Vec3::from(point), ray));
    }
    if rays.len() < 4 {
        return None;
    }
    let eigen = normal.symmetric_eigen();
    let least = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let h = Mat3::from_fn(|i, j| least[3 * i + j]);
    let in_front: f64 = rays.iter().map(|(point, ray)| (h * point).dot(ray)).sum();
    let (a, b): (Vec3, Vec3) = (h.column(0).into(), h.column(1).into());
    let scale = in_front.signum() * 2.0 / (a.norm() + b.norm());
    let (a, b) = (scale * a, scale * b);
    let svd = Mat3::from_columns(&[a, b, a.cross(&b)]).svd(true, true);
    let pose = Pose { rotation: svd.u? * svd.v_t?, translation: scale * h.column(2) };
    pose.is_finite().then_some(pose)
}

/// Turns the targets to their other tilt where that costs less: seen from afar the two look alike.
pub(super) fn with_better_tilts(problem: &Problem<'_>, mut state: State) -> State {
    for (view, marks) in problem.views.iter().enumerate() {
        let alone = Problem {
            views: std::slice::from_ref(marks),
            free: FreeParameters::NONE,
            priors: &[],
            bend: None,
            max_iterations: LENS_STEPS,
            relative_gain: ROUGH_GAIN,
            ..*problem
        };
        let at = |pose: Pose| State { cam_from_target: vec![pose], ..state };
        let as_it_is = descend(&alone, at(state.cam_from_target[view]));
        let other = at(mirrored(&as_it_is.state.cam_from_target[0]));
        let turned = descend_unless_dear(&alone, other, as_it_is.system.cost);
        let better = match turned {
            Some(turned) if turned.system.cost < as_it_is.system.cost => turned,
            _ => as_it_is,
        };
        if better.system.cost.is_finite() {
            state.cam_from_target[view] = better.state.cam_from_target[0];
        }
    }
    state
}

/// Steps after which a pose costs less than so many times the other tilt, or is not followed: three steps lead close
/// to the minimum of six unknowns, and as many again into it.
const DEAR: [(usize, f64); 2] = [(3, 100.0), (3, 4.0)];

/// A pose that costs the same up to this part is the one that was there: close views have one tilt.
const SAME: f64 = 1e-3;

/// The minimum near a pose; `None` where it is seen early to cost far more than `cost`, or the same.
fn descend_unless_dear(alone: &Problem<'_>, mut state: State, cost: f64) -> Option<Minimum<State, WIDTH>> {
    for (max_iterations, factor) in DEAR {
        let found = descend(&Problem { max_iterations, ..*alone }, state);
        let is_the_same = (found.system.cost - cost).abs() <= SAME * cost;
        if is_the_same || found.system.cost > factor * cost {
            return None;
        }
        state = found.state;
    }
    Some(descend(alone, state))
}

/// Whether the lens has an image of every mark.
fn is_seen(views: &[Marks], state: &State) -> bool {
    let mut marks =
        views.iter().enumerate().flat_map(|(view, marks)| marks.list.iter().map(move |mark| (view, mark)));
    marks.all(|(view, mark)| state.pixel(view, mark).is_some())
}

/// The state with lenses of the wanted model that see the marks where this one does; what is held or known
/// beforehand has its value.
fn with_model(problem: &Problem<'_>, state: &State, settings: &Settings) -> Vec<State> {
    let Some(told) = with_values(problem, &state.camera, settings) else { return Vec::new() };
    let lenses = radial::fitted(told.distortion, problem.free, &radii(problem.views, state));
    with_lenses(problem, &State { camera: told, ..state.clone() }, lenses)
}

/// The state with other lenses, each with its factor of the focal length, where they see every mark.
fn with_lenses(problem: &Problem<'_>, state: &State, lenses: Vec<(Lens, f64)>) -> Vec<State> {
    let with_lens = |(lens, factor): (Lens, f64)| {
        let mut camera = Camera { distortion: lens, ..state.camera };
        if problem.free.contains(Parameter::Fx) {
            (camera.fx, camera.fy) = (factor * camera.fx, factor * camera.fy);
        }
        State { camera: tied(camera, problem.fy_per_fx), ..state.clone() }
    };
    lenses.into_iter().map(with_lens).filter(|state| is_seen(problem.views, state)).collect()
}

/// The camera with an ideal lens of the wanted model, and the values that are held or known beforehand.
fn with_values(problem: &Problem<'_>, camera: &Camera<Lens>, settings: &Settings) -> Option<Camera<Lens>> {
    let mut camera = Camera { distortion: Lens::ideal(settings.model()), skew: 0.0, ..*camera };
    for parameter in settings.model().parameters() {
        if let Ok(Some(value)) = settings.held(parameter) {
            camera = camera.with_value(parameter, value)?;
        }
    }
    for prior in problem.priors {
        camera = camera.with_value(prior.parameter, prior.mean)?;
    }
    Some(camera)
}

/// Starts near a minimum that may lead to another one: with the same picture made by other coefficients, and with
/// the sensor tilted other ways.
pub(super) fn alternatives(problem: &Problem<'_>, state: &State) -> Vec<State> {
    use Parameter::{TauX, TauY};
    let lens = state.camera.distortion;
    let mut lenses = radial::alternatives(lens, problem.free, &radii(problem.views, state));
    let turned = |turned: &[Parameter]| turned.iter().try_fold(lens, |lens, &p| lens.with(p, -lens.get(p)?));
    if problem.free.contains(TauX) && problem.free.contains(TauY) {
        lenses.extend([[TauX].as_slice(), &[TauY], &[TauX, TauY]].into_iter().filter_map(turned));
    }
    let with_lens = |lens| State { camera: Camera { distortion: lens, ..state.camera }, ..state.clone() };
    lenses.into_iter().map(with_lens).filter(|state| is_seen(problem.views, state)).collect()
}

/// Starts at the double spheres that make nearly the same picture as the one of a minimum: a first lens that fits badly leads to any of them.
/// None with another model.
pub(super) fn other_spheres(problem: &Problem<'_>, state: &State) -> Vec<State> {
    let lenses = radial::other_spheres(state.camera.distortion, problem.free, &radii(problem.views, state));
    with_lenses(problem, state, lenses)
}

/// Angles from the axis and distorted radii, of some marks.
fn radii(views: &[Marks], state: &State) -> Vec<[f64; 2]> {
    const ENOUGH: usize = 500;
    let every = views.iter().map(Marks::len).sum::<usize>().div_ceil(ENOUGH).max(1);
    let marks =
        views.iter().enumerate().flat_map(|(view, marks)| marks.list.iter().map(move |mark| (view, mark)));
    let polar = |(view, mark): (usize, &Mark)| {
        let point = state.cam_from_target[view].apply(&mark.on_board(&state.shape));
        let image = state.camera.distortion.project(&point)?;
        Some([libm::atan2(point.xy().norm(), point.z), image.norm()])
    };
    marks.step_by(every).filter_map(polar).collect()
}
