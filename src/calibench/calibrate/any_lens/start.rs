//! From where does the search for a camera with any lens start?
//!
//! A homography of pixels needs a pinhole, and beyond some 100 degrees there is none. A ray needs none: with
//! an equidistant fisheye of some focal length every pixel has a ray `b`, and `b x (H X) = 0` gives the
//! homography from the board to rays, whatever the angle. The focal length is searched on a grid; the best
//! few are refined with a polynomial of the angle (Kannala & Brandt 2006), which follows any lens, and the
//! wanted model is fitted to the rays that this one sees.

use super::super::Settings;
use super::super::chunks;
use super::super::estimate::state_alone;
use super::super::minimise::descend;
use super::super::normal::Observations;
use super::super::radial_centre::radial_centre;
use super::super::target_frame::TargetFrames;
use super::super::tie::tied;
use super::super::tilt::mirrored;
use super::marks::{Mark, Marks};
use super::problem::{Problem, ROUGH_GAIN, State};
use super::radial;
use super::rays::Rays;
use super::resection::{Posed, Resection};
use crate::board::View;
use crate::camera::{Camera, FreeParameters, Lens, Model, Parameter};
use crate::geometry::{Mat3, Pose, Vec2, Vec3};
use nalgebra::{SMatrix, SVector};

/// Angles from the axis, rad, at which the farthest pixel may be seen: 3 to 103 degrees, each 1.3 times the
/// last.
const NARROWEST: f64 = 0.05;
const ANGLES: usize = 14;
const ANGLE_FACTOR: f64 = 1.3;
/// Heights of a pixel over its width that are tried beside 1, where it is not known.
const ASPECTS: [f64; 2] = [0.6, 1.7];
/// Pixels whose height over width comes out within this part of 1 are taken for square ones.
const NEARLY_SQUARE: f64 = 0.1;
/// So many of them are refined.
const REFINED: usize = 3;
/// With fewer marks a view than this, the pinhole is searched for beyond its first minima, as those of five
/// marks a view can lead astray
/// (`lens_hard_cases::a_fisheye_behind_tall_pixels_is_found_from_five_marks_a_view`). The search costs little
/// then; with many marks it costs more than all the rest, as it goes on for long where no pinhole fits.
const FEW_MARKS: usize = 16;
/// The focal length is chosen by so many marks of evenly taken views, of [`CHOOSERS`] at the least; all of
/// them follow.
const CHOOSING_MARKS: usize = 500;
const CHOOSERS: usize = 6;
/// Steps of the poses alone, of a first lens, of a better one.
const POSE_STEPS: usize = 6;
const FIRST_STEPS: usize = 15;
const LENS_STEPS: usize = 40;

/// States with lenses of the wanted model like the one that the pinhole's solver finds with k1 and k2,
/// however it fits, and whether that is certified. Of many marks some views tell a lens that is certifiable,
/// and the others follow.
pub(super) fn by_pinhole(problem: &Problem<'_>, views: &[View], settings: &Settings) -> (Vec<State>, bool) {
    let chosen = chosen_views(problem.views);
    if chosen.len() == views.len() || !problem.is_certifiable {
        return from_pinhole(problem, views, settings, |_, pose| *pose);
    }
    let marks: Vec<Marks> = chosen.iter().map(|&view| problem.views[view].clone()).collect();
    let few_views: Vec<View> = chosen.iter().map(|&view| views[view].clone()).collect();
    let (frames, own) = (TargetFrames::of(views), TargetFrames::of(&few_views));
    let few = Problem { views: &marks, relative_gain: ROUGH_GAIN, ..*problem };
    let in_frame = |k: usize, pose: &Pose| frames.at(chosen[k]).of_pose(&own.at(k).cam_from_target(pose));
    let (states, is_certified) = from_pinhole(&few, &few_views, settings, in_frame);
    let of_all = |state| with_other_poses(problem, &chosen, &descend(&few, state).state);
    (states.into_iter().filter_map(of_all).collect(), is_certified)
}

/// The state of some views with poses for all; `None` where a view has none or the lens does not see a mark.
fn with_other_poses(problem: &Problem<'_>, chosen: &[usize], state: &State) -> Option<State> {
    let State { camera, shape, .. } = state;
    let rays = Rays::of(camera);
    let ray = |pixel: &Vec2| rays.near(pixel);
    let pose = |view: usize, marks: &Marks| match chosen.binary_search(&view) {
        Ok(k) => Some(state.cam_from_target[k]),
        Err(_) => {
            let alone = Resection { problem, camera, shape, view };
            Some(alone.refined(pose_from_rays(marks, &ray)?, POSE_STEPS).pose)
        }
    };
    let cam_from_target = chunks::map(problem.views, pose).into_iter().collect::<Option<_>>()?;
    let of_all = State { camera: *camera, cam_from_target, shape: *shape };
    is_seen(problem.views, &of_all).then_some(of_all)
}

/// The same from all views of a problem; `in_frame` is a pose in the frame of the problem's marks.
fn from_pinhole(
    problem: &Problem<'_>,
    views: &[View],
    settings: &Settings,
    in_frame: impl Fn(usize, &Pose) -> Pose,
) -> (Vec<State>, bool) {
    let Some((mut state, is_certified)) = pinhole(views, settings) else { return (Vec::new(), false) };
    for (view, pose) in state.cam_from_target.iter_mut().enumerate() {
        *pose = in_frame(view, pose);
    }
    if !is_seen(problem.views, &state) {
        return (Vec::new(), false);
    }
    (with_model(problem, &state, settings), is_certified)
}

fn pinhole(views: &[View], settings: &Settings) -> Option<(State, bool)> {
    let mut plain = Settings::standard();
    let marks: usize = views.iter().map(View::len).sum();
    (plain.image_size, plain.loss) = (settings.image_size, settings.loss);
    plain.search = marks < FEW_MARKS * views.len();
    let unweighted = |v: &View| View::new(v.points().to_vec(), v.pixels().to_vec()).ok();
    let unweighted: Vec<View> = views.iter().map(unweighted).collect::<Option<_>>()?;
    let (found, is_certified) = state_alone(&unweighted, &plain).ok()?;
    let (camera, cam_from_target) = (found.camera.into(), found.cam_from_target);
    Some((State { camera, cam_from_target, shape: [0.0; 3] }, is_certified))
}

/// States with lenses of the wanted model like angle polynomials of two terms: with pixels of the shape that
/// is tied, otherwise with square ones, and where they come out far from it once fy is free, with pixels of
/// any shape besides. Few marks lead these astray where square ones are right.
pub(super) fn by_rays(problem: &Problem<'_>, settings: &Settings) -> Vec<State> {
    about(problem, settings, middle(problem.views, settings))
}

/// The same about the pixel about which the marks say that the lens distorts: where the axis meets the image
/// far from its middle, a lens about the middle leads to a wrong camera. None where the principal point is
/// held or the marks do not say.
pub(super) fn by_rays_off_centre(problem: &Problem<'_>, settings: &Settings) -> Vec<State> {
    let is_free = [Parameter::Cx, Parameter::Cy].into_iter().all(|p| problem.free.contains(p));
    match told_centre(problem.views).filter(|_| is_free) {
        Some(centre) => about(problem, settings, centre),
        None => Vec::new(),
    }
}

/// The pixel about which the lens distorts, from the marks alone; `None` where they do not say.
fn told_centre(views: &[Marks]) -> Option<Vec2> {
    let (low, high) = extent(views);
    let pixel_frame = (0.5 * (low + high), 0.5 * (high - low).max());
    let pairs = |marks: &Marks| {
        let pairs: Vec<_> = marks.list.iter().map(|mark| (mark.point, mark.pixel)).collect();
        Observations::new(pairs.into_iter())
    };
    let observations: Vec<Observations> = views.iter().map(pairs).collect();
    radial_centre(&observations, pixel_frame)
}

/// Starts with the axis at a pixel.
fn about(problem: &Problem<'_>, settings: &Settings, centre: Vec2) -> Vec<State> {
    let rough = Problem { priors: &[], bend: None, relative_gain: ROUGH_GAIN, ..*problem };
    let shaped = |fy_per_fx| Problem { fy_per_fx, ..rough };
    let square = polynomial(&shaped(problem.fy_per_fx.or(Some(1.0))), centre);
    let is_known = problem.fy_per_fx.is_some() || !problem.free.contains(Parameter::Fy);
    let any = match &square {
        _ if is_known => None,
        Some(state) if is_nearly_square(&shaped(None), state) => None,
        _ => polynomial(&shaped(None), centre),
    };
    [square, any].into_iter().flatten().flat_map(|state| with_model(problem, &state, settings)).collect()
}

/// Whether pixels stay nearly square where an angle polynomial that takes them for it is refined with fy
/// free.
fn is_nearly_square(fisheye: &Problem<'_>, state: &State) -> bool {
    use Parameter::{Cx, Cy, Fx, Fy, K1, K2};
    let free = FreeParameters::of(&[Fx, Fy, Cx, Cy, K1, K2]);
    let refined = descend(&Problem { free, max_iterations: LENS_STEPS, ..*fisheye }, state.clone());
    let camera = refined.state.camera;
    (camera.fy / camera.fx - 1.0).abs() <= NEARLY_SQUARE
}

/// The best state with an angle polynomial of two terms that leaves from an axis at `centre`.
fn polynomial(fisheye: &Problem<'_>, centre: Vec2) -> Option<State> {
    let distances = pixels(fisheye.views).map(|p| (p - centre).norm());
    let reach = distances.fold(1.0, f64::max);
    let chosen: Vec<Marks> =
        chosen_views(fisheye.views).into_iter().map(|view| fisheye.views[view].clone()).collect();
    let few = Problem { views: &chosen, ..*fisheye };
    let aspects = match few.fy_per_fx {
        Some(known) => vec![known],
        None => ASPECTS.to_vec(),
    };
    let mut tried: Vec<(f64, State)> = Vec::with_capacity(REFINED + 1);
    let mut angle = NARROWEST;
    for _ in 0..ANGLES {
        for aspect in &aspects {
            let lens = Lens::ideal(Model::KannalaBrandt);
            let camera = Camera::with_lens(reach / angle, aspect * reach / angle, centre.x, centre.y, lens);
            let dearest = tried.get(REFINED - 1).map_or(f64::INFINITY, |(cost, _)| *cost);
            if let Some(found) = with_refined_poses(&few, camera, dearest) {
                tried.push(found);
                tried.sort_by(|a, b| a.0.total_cmp(&b.0));
                tried.truncate(REFINED);
            }
        }
        angle *= ANGLE_FACTOR;
    }
    use Parameter::{Cx, Cy, Fx, Fy, K1, K2};
    let kept = |list: &[Parameter]| {
        let free = FreeParameters::of(list);
        if few.fy_per_fx.is_some() { free.without(Fy) } else { free }
    };
    let first = Problem { free: kept(&[Fx, Fy, K1]), max_iterations: FIRST_STEPS, ..few };
    let lens = kept(&[Fx, Fy, Cx, Cy, K1, K2]);
    let better = Problem { free: lens, max_iterations: LENS_STEPS, ..few };
    let refined = tried.into_iter().map(|(_, state)| descend(&better, descend(&first, state).state));
    let best = refined
        .filter(|m| m.system.cost.is_finite())
        .min_by(|a, b| a.system.cost.total_cmp(&b.system.cost))?;
    let whole = Problem { free: lens, max_iterations: LENS_STEPS, ..*fisheye };
    let camera = best.state.camera;
    let state = if fisheye.is_certifiable {
        with_poses_alone(fisheye, camera, f64::INFINITY)?.1
    } else {
        with_poses(fisheye.views, camera)?
    };
    let state = with_better_tilts(&whole, state);
    Some(descend(&whole, state).state)
}

/// Where the axis may meet the image: where it is held, or else in the middle.
fn middle(views: &[Marks], settings: &Settings) -> Vec2 {
    let (low, high) = extent(views);
    let middle = match settings.image_size {
        Some((width, height)) => Vec2::new(0.5 * (width as f64 - 1.0), 0.5 * (height as f64 - 1.0)),
        None => 0.5 * (low + high),
    };
    let held = |parameter, otherwise: f64| match settings.held(parameter) {
        Ok(Some(value)) => value,
        _ => otherwise,
    };
    Vec2::new(held(Parameter::Cx, middle.x), held(Parameter::Cy, middle.y))
}

fn pixels(views: &[Marks]) -> impl Iterator<Item = Vec2> {
    views.iter().flat_map(|view| &view.list).map(|mark| mark.pixel)
}

/// The least and the greatest coordinates of the pixels.
fn extent(views: &[Marks]) -> (Vec2, Vec2) {
    let outside = (Vec2::repeat(f64::INFINITY), Vec2::repeat(f64::NEG_INFINITY));
    pixels(views).fold(outside, |(low, high), p| (low.inf(&p), high.sup(&p)))
}

/// Views evenly taken from all, with enough marks.
fn chosen_views(views: &[Marks]) -> Vec<usize> {
    let marks: usize = views.iter().map(Marks::len).sum();
    let enough = (CHOOSING_MARKS * views.len()).div_ceil(marks.max(1));
    let count = views.len().min(enough.max(CHOOSERS));
    (0..count).map(|k| k * views.len() / count).collect()
}

/// The camera with a pose for every view, refined a few steps, and their cost; `None` where a view has none,
/// and perhaps where they cost more than `dearest`.
fn with_refined_poses(problem: &Problem<'_>, camera: Camera<Lens>, dearest: f64) -> Option<(f64, State)> {
    if problem.is_certifiable {
        return with_poses_alone(problem, camera, dearest);
    }
    let together = Problem { free: FreeParameters::NONE, max_iterations: POSE_STEPS, ..*problem };
    let found = descend(&together, with_poses(problem.views, camera)?);
    Some((found.system.cost, found.state))
}

/// The same, with each pose refined alone from rays of a table, until they cost more than `dearest`.
fn with_poses_alone(problem: &Problem<'_>, camera: Camera<Lens>, dearest: f64) -> Option<(f64, State)> {
    let shape = [0.0; 3];
    let mut cost = 0.0;
    let mut cam_from_target = Vec::with_capacity(problem.views.len());
    let rays = Rays::of(&camera);
    let ray = |pixel: &Vec2| rays.near(pixel);
    for (view, marks) in problem.views.iter().enumerate() {
        let alone = Resection { problem, camera: &camera, shape: &shape, view };
        let found = alone.refined(pose_from_rays(marks, &ray)?, POSE_STEPS);
        cost += found.cost;
        if cost.is_nan() || cost >= dearest {
            return None;
        }
        cam_from_target.push(found.pose);
    }
    Some((cost, State { camera, cam_from_target, shape }))
}

/// The camera with a pose for every view; `None` where one has none.
pub(super) fn with_poses(views: &[Marks], camera: Camera<Lens>) -> Option<State> {
    let ray = |pixel: &Vec2| camera.ray(pixel).ok();
    let cam_from_target = views.iter().map(|view| pose_from_rays(view, &ray)).collect::<Option<_>>()?;
    Some(State { camera, cam_from_target, shape: [0.0; 3] })
}

/// The pose of a flat board from the rays of its marks; `None` with fewer than four.
fn pose_from_rays(view: &Marks, ray: &impl Fn(&Vec2) -> Option<Vec3>) -> Option<Pose> {
    let mut normal = SMatrix::<f64, 9, 9>::zeros();
    let mut rays = Vec::with_capacity(view.len());
    for mark in &view.list {
        let Some(ray) = ray(&mark.pixel) else { continue };
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
    let State { camera, shape, .. } = &state;
    let better = |view: usize, pose: &Pose| {
        let alone = Resection { problem, camera, shape, view };
        let as_it_is = alone.refined(*pose, LENS_STEPS);
        match refined_unless_dear(&alone, mirrored(&as_it_is.pose), as_it_is.cost) {
            Some(turned) if turned.cost < as_it_is.cost => turned.pose,
            _ => as_it_is.pose,
        }
    };
    state.cam_from_target = chunks::map(&state.cam_from_target, better);
    state
}

/// Steps after which a pose costs less than so many times the other tilt, or is not followed: three steps
/// lead close to the minimum of six unknowns, and as many again into it.
const DEAR: [(usize, f64); 2] = [(3, 100.0), (3, 4.0)];

/// A pose that costs the same up to this part is the one that was there: close views have one tilt.
const SAME: f64 = 1e-3;

/// The minimum near a pose; `None` where it is seen early to cost far more than `cost`, or the same.
fn refined_unless_dear(alone: &Resection<'_>, mut pose: Pose, cost: f64) -> Option<Posed> {
    for (steps, factor) in DEAR {
        let found = alone.refined(pose, steps);
        let is_the_same = (found.cost - cost).abs() <= SAME * cost;
        if is_the_same || found.cost > factor * cost {
            return None;
        }
        pose = found.pose;
    }
    Some(alone.refined(pose, LENS_STEPS))
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

/// The state with other lenses, each with its factor of the focal lengths that are free, where they see every
/// mark.
fn with_lenses(problem: &Problem<'_>, state: &State, lenses: Vec<(Lens, f64)>) -> Vec<State> {
    let with_lens = |(lens, factor): (Lens, f64)| {
        let mut camera = Camera { distortion: lens, ..state.camera };
        for (parameter, focal_length) in [(Parameter::Fx, &mut camera.fx), (Parameter::Fy, &mut camera.fy)] {
            if problem.free.contains(parameter) {
                *focal_length *= factor;
            }
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

/// Starts near a minimum that may lead to another one: with the same picture made by other coefficients, and
/// with the sensor tilted other ways.
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

/// Starts at the double spheres that make nearly the same picture as the one of a minimum: a first lens that
/// fits badly leads to any of them. None with another model.
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
