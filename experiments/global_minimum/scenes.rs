//! Which scene has the number `i`? Truth, noise and settings, drawn from a family by seed and index alone, in
//! any order.

use super::families::{Centre, Draw, Family, Layout, Lens, Model, Places, Second, Target, Tilts, WIDEST};
use calibench::board::View;
use calibench::calibrate::Settings;
use calibench::camera::{BrownConrady, Camera, FreeParameters, Parameter};
use calibench::geometry::{Mat3, Pose, Vec2, Vec3, rotation};
use calibench::synth::scene::looking_at_centre;
use calibench::synth::{Scene, Stream, StreamKey, Truth};

/// Places tried for a target before it is put a little farther away.
const PLACES: usize = 12;
/// How much farther: an eighth.
const FARTHER: f64 = 1.125;
/// How often: by then the target is 17 times as far, and something else is wrong.
const STEPS: usize = 24;
/// Scenes drawn for an index before the family is held for impossible.
const REDRAWS: usize = 10_000;

/// A scene with all that a solver is given, and what it is judged by.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// Its number in the family.
    pub index: u64,
    /// Name of the layout.
    pub layout: &'static str,
    /// Name of the model.
    pub model: &'static str,
    /// Camera, target and poses, with their exact pixels.
    pub scene: Scene,
    /// What is estimated; the rest is held at the truth.
    pub free: FreeParameters,
    /// Standard deviation of a pixel coordinate, px.
    pub noise_px: f64,
    /// Largest tilt of the layout, degrees.
    pub tilt_deg: f64,
    /// Width of the target over width of the image, as asked for.
    pub coverage: f64,
    /// Whether the solver is told the image size.
    pub size_given: bool,
    /// The noisy views.
    pub views: Vec<View>,
}

impl Drawn {
    /// Scene `index` of a family. `None` if the family's rules leave no scene.
    pub fn new(family: &Family, seed: u64, index: u64) -> Option<Drawn> {
        let key = |purpose| StreamKey { seed, scenario: family.name, trial: index, purpose };
        let mut stream = Stream::open(key("scene"));
        let mut drawn = (0..REDRAWS).find_map(|_| family.draw(index, &mut stream))?;
        drawn.views = drawn.scene.observe(drawn.noise_px, &mut Stream::open(key("noise")));
        Some(drawn)
    }

    /// The truth.
    pub fn truth(&self) -> &Truth {
        &self.scene.truth
    }

    /// What the solver is told: the free parameters, the true value of every other, the image size perhaps.
    pub fn settings(&self) -> Settings {
        let camera = &self.truth().camera;
        let held = Parameter::ALL.into_iter().filter(|&p| !self.free.contains(p));
        let settings = held.fold(Settings::new(self.free), |s, p| s.hold(p, camera.get(p)));
        if self.size_given { settings.with_image_size(self.truth().image_size) } else { settings }
    }
}

impl Family {
    /// What scene `index` estimates.
    pub fn model(&self, index: u64) -> &'static Model {
        turn(self.models, index / (self.cameras.len() * self.layouts.len()) as u64)
    }

    /// A scene, or `None` where a rule forbids what was drawn.
    fn draw(&self, index: u64, stream: &mut Stream) -> Option<Drawn> {
        let lens = turn(self.cameras, index);
        let layout = turn(self.layouts, index / self.cameras.len() as u64);
        let model = self.model(index);
        let (camera, image_size) = lens.draw(model, stream)?;
        let points = self.target.draw(stream);
        let views = layout.views.count(stream);
        if !is_enough(model.free, views, points.len()) {
            return None;
        }
        let tilt_deg = layout.tilt_deg.draw(stream);
        let coverage = layout.coverage.draw(stream);
        let noise_px = self.noise_px.draw(stream);
        let size_given = stream.uniform() < self.size_given;
        let bench = Bench {
            camera: &camera,
            image_size,
            points: &points,
            limit: camera.distortion.monotone_radius(),
        };
        let cam_from_target = bench.poses(layout, views, tilt_deg, coverage, stream)?;
        let scene = Scene::new(Truth { camera, image_size, points, cam_from_target }).ok()?;
        Some(Drawn {
            index,
            layout: layout.name,
            model: model.name,
            scene,
            free: model.free,
            noise_px,
            tilt_deg,
            coverage,
            size_given,
            views: Vec::new(),
        })
    }
}

fn turn<T>(list: &'static [T], index: u64) -> &'static T {
    &list[(index % list.len() as u64) as usize]
}

/// Whether views and points are as many as the solver asks for: two constraints a view on the linear
/// parameters, and as many pixel coordinates as unknowns.
fn is_enough(free: FreeParameters, views: usize, points: usize) -> bool {
    let linear = free.iter().filter(|&p| p <= Parameter::Skew).count();
    2 * views >= linear && 2 * views * points >= free.len() + 6 * views
}

impl Draw {
    fn draw(&self, stream: &mut Stream) -> f64 {
        match *self {
            Draw::Is(value) => value,
            Draw::Uniform(low, high) => stream.uniform_in(low, high),
            Draw::LogUniform(low, high) => libm::exp(stream.uniform_in(libm::log(low), libm::log(high))),
        }
    }

    /// A whole number; each end of the range is as likely as its share of the range, half a step beyond
    /// included.
    fn count(&self, stream: &mut Stream) -> usize {
        let value = match *self {
            Draw::Is(value) => value,
            Draw::Uniform(low, high) => Draw::Uniform(low - 0.5, high + 0.5).draw(stream),
            Draw::LogUniform(low, high) => Draw::LogUniform(low - 0.5, high + 0.5).draw(stream),
        };
        value.round() as usize
    }
}

impl Lens {
    fn draw(&self, model: &Model, stream: &mut Stream) -> Option<(Camera, (usize, usize))> {
        let fx = self.focal_px.draw(stream);
        let fy = fx * self.focal_ratio.draw(stream);
        let width = self.width_px.draw(stream).round();
        let height = (width / self.aspects[stream.below(self.aspects.len())]).round();
        let (right, down) = self.centres[stream.below(self.centres.len())].draw(stream);
        let distortion = self.distortion(model, stream);
        let skew = if model.free.contains(Parameter::Skew) {
            0.005 * fx * stream.uniform_in(-1.0, 1.0)
        } else {
            0.0
        };
        let camera = Camera {
            fx,
            fy,
            cx: 0.5 * (width - 1.0) + right * width,
            cy: 0.5 * (height - 1.0) + down * height,
            skew,
            distortion,
        };
        (!self.whole_field || sees_all(&camera, width, height))
            .then_some((camera, (width as usize, height as usize)))
    }

    fn distortion(&self, model: &Model, stream: &mut Stream) -> BrownConrady {
        let k1 = self.k1.draw(stream);
        let k2 = self.k2.draw(k1, stream);
        let (p1, p2) = (self.tangential.draw(stream), self.tangential.draw(stream));
        let has_tangential = stream.uniform() < self.tangential_share || model.free.contains(Parameter::P1);
        let k3 = 0.3 * k2 * stream.uniform_in(-1.0, 1.0);
        if model.ideal {
            return BrownConrady::default();
        }
        BrownConrady {
            k1,
            k2,
            p1: if has_tangential { p1 } else { 0.0 },
            p2: if has_tangential { p2 } else { 0.0 },
            k3: if model.free.contains(Parameter::K3) { k3 } else { 0.0 },
        }
    }
}

/// Whether the lens is one-to-one out to every corner of the image, and none is seen beyond [`WIDEST`].
fn sees_all(camera: &Camera, width: f64, height: f64) -> bool {
    [(-0.5, -0.5), (width - 0.5, -0.5), (-0.5, height - 0.5), (width - 0.5, height - 0.5)]
        .into_iter()
        .all(|(u, v)| camera.normalised_ray(&Vec2::new(u, v)).is_ok_and(|ray| ray.norm() <= WIDEST))
}

impl Centre {
    fn draw(&self, stream: &mut Stream) -> (f64, f64) {
        match *self {
            Centre::At(right, down) => (right, down),
            Centre::Within(part) => (stream.uniform_in(-part, part), stream.uniform_in(-part, part)),
        }
    }
}

impl Second {
    fn draw(&self, k1: f64, stream: &mut Stream) -> f64 {
        match self {
            Second::Alone(draw) => draw.draw(stream),
            Second::OfSquare(draw) => k1 * k1 * draw.draw(stream),
            Second::Either(alone, of_square) => {
                if stream.uniform() < 0.5 {
                    alone.draw(stream)
                } else {
                    k1 * k1 * of_square.draw(stream)
                }
            }
        }
    }
}

impl Target {
    /// The marks, row by row.
    fn draw(&self, stream: &mut Stream) -> Vec<Vec2> {
        let (columns, rows) = (self.columns.count(stream), self.rows.count(stream));
        let spacing = self.spacing.draw(stream);
        let width = spacing * (columns - 1) as f64;
        let origin = Vec2::new(self.origin.draw(stream), self.origin.draw(stream)) * width;
        let middle = 0.5 * Vec2::new((columns - 1) as f64, (rows - 1) as f64);
        (0..rows)
            .flat_map(|row| (0..columns).map(move |column| Vec2::new(column as f64, row as f64)))
            .map(|cell| (cell - middle) * spacing + origin)
            .collect()
    }
}

/// The camera in front of which a target is held.
struct Bench<'a> {
    camera: &'a Camera,
    image_size: (usize, usize),
    points: &'a [Vec2],
    /// The lens's monotone radius.
    limit: f64,
}

impl Bench<'_> {
    fn poses(
        &self,
        layout: &Layout,
        views: usize,
        tilt_deg: f64,
        coverage: f64,
        stream: &mut Stream,
    ) -> Option<Vec<Pose>> {
        if let Tilts::Listed(poses) = layout.tilts {
            return Some(
                poses.iter().map(|&(degrees, distance)| looking_at_centre(degrees, distance)).collect(),
            );
        }
        let common_axis = stream.uniform_in(0.0, std::f64::consts::PI);
        let middle = Vec2::new(0.5 * (self.image_size.0 - 1) as f64, 0.5 * (self.image_size.1 - 1) as f64);
        let corner = middle * 2.0;
        let common_place =
            Vec2::new(stream.uniform_in(0.3, 0.7) * corner.x, stream.uniform_in(0.3, 0.7) * corner.y);
        let mut poses: Vec<Pose> = Vec::with_capacity(views);
        for view in 0..views {
            let rotation = layout.rotation(view, tilt_deg, common_axis, stream);
            let distance = self.distance_of(coverage) * layout.distance.draw(stream);
            let place = match layout.places {
                Places::Anywhere => None,
                Places::Middle => Some(middle),
                Places::One => Some(common_place),
                Places::Corner => Some(corner - Vec2::repeat(0.03 * corner.x)),
            };
            poses.push(self.hold(&rotation, distance, place, stream)?);
        }
        Some(poses)
    }

    /// Extent of the marks.
    fn extent(&self) -> (Vec2, Vec2) {
        let (first, last) = (self.points[0], self.points[self.points.len() - 1]);
        (0.5 * (first + last), last - first)
    }

    /// Distance at which a facing target has this part of the image's width, or less if it would be taller
    /// than the image.
    fn distance_of(&self, coverage: f64) -> f64 {
        let (_, size) = self.extent();
        let wide = self.camera.fx * size.x / (coverage * self.image_size.0 as f64);
        let high = self.camera.fy * size.y / self.image_size.1 as f64;
        wide.max(high)
    }

    /// The target with its middle on the ray of some pixel, at a distance at which all of it is in the image.
    fn hold(
        &self,
        rotation: &Mat3,
        mut distance: f64,
        place: Option<Vec2>,
        stream: &mut Stream,
    ) -> Option<Pose> {
        let (middle, _) = self.extent();
        for _ in 0..STEPS {
            for _ in 0..PLACES {
                let pixel = place.unwrap_or_else(|| {
                    Vec2::new(
                        stream.uniform_in(0.0, self.image_size.0 as f64 - 1.0),
                        stream.uniform_in(0.0, self.image_size.1 as f64 - 1.0),
                    )
                });
                let Ok(ray) = self.camera.normalised_ray(&pixel) else { continue };
                let at = Vec3::new(ray.x, ray.y, 1.0) * distance;
                let translation = at - rotation * Vec3::new(middle.x, middle.y, 0.0);
                let pose = Pose { rotation: *rotation, translation };
                if self.is_seen(&pose) {
                    return Some(pose);
                }
                if place.is_some() {
                    break;
                }
            }
            distance *= FARTHER;
        }
        None
    }

    /// Whether every mark is in front of the camera, where the lens is one-to-one, and in the image.
    fn is_seen(&self, pose: &Pose) -> bool {
        let (right, bottom) = (self.image_size.0 as f64 - 0.5, self.image_size.1 as f64 - 0.5);
        self.points.iter().all(|p| {
            let point = pose.apply(&Vec3::new(p.x, p.y, 0.0));
            point.z > 0.0 && point.xy().norm() < self.limit * point.z && {
                let ideal = point.xy() / point.z;
                let pixel = self.camera.pixel_from_normalised(&self.camera.distortion.distort(&ideal));
                (-0.5..=right).contains(&pixel.x) && (-0.5..=bottom).contains(&pixel.y)
            }
        })
    }
}

impl Layout {
    /// Tilt about an axis in the image plane, after a turn about the target's normal.
    fn rotation(&self, view: usize, tilt_deg: f64, common_axis: f64, stream: &mut Stream) -> Mat3 {
        let any_axis = stream.uniform_in(0.0, std::f64::consts::TAU);
        let part = stream.uniform();
        let facing = view.is_multiple_of(2);
        let (axis, degrees) = match self.tilts {
            Tilts::UpTo => (any_axis, part * tilt_deg),
            Tilts::All | Tilts::Listed(_) => (any_axis, tilt_deg),
            Tilts::OneAxis => (common_axis, (2.0 * part - 1.0) * tilt_deg),
            Tilts::Mixed => (any_axis, if facing { 0.0 } else { tilt_deg }),
            Tilts::MixedOneAxis => (common_axis, if facing { 0.0 } else { tilt_deg }),
        };
        let tilt = Vec3::new(libm::cos(axis), libm::sin(axis), 0.0) * degrees.to_radians();
        let roll = self.roll_deg.draw(stream).to_radians();
        rotation::exp(&tilt) * rotation::exp(&Vec3::new(0.0, 0.0, roll))
    }
}

#[cfg(test)]
mod tests {
    use super::super::families::FAMILIES;
    use super::*;

    #[test]
    fn a_scene_is_the_same_in_any_order() {
        for family in FAMILIES {
            let first = Drawn::new(family, 3, 5).unwrap();
            Drawn::new(family, 3, 4).unwrap();
            let again = Drawn::new(family, 3, 5).unwrap();
            assert_eq!((&first.views, first.settings()), (&again.views, again.settings()), "{}", family.name);
        }
    }

    #[test]
    fn every_mark_of_a_random_scene_is_in_the_image_and_the_lens_reaches_its_corners() {
        for index in 0..200 {
            let drawn = Drawn::new(&FAMILIES[0], 3, index).unwrap();
            let (width, height) = drawn.truth().image_size;
            for pixel in drawn.scene.pixels().iter().flatten() {
                let inside = (-0.5..=width as f64 - 0.5).contains(&pixel.x)
                    && (-0.5..=height as f64 - 0.5).contains(&pixel.y);
                assert!(inside, "scene {index}: {pixel}");
            }
            assert!(sees_all(&drawn.truth().camera, width as f64, height as f64));
        }
    }

    #[test]
    fn the_random_scenes_reach_the_ends_of_what_is_stated() {
        let drawn: Vec<Drawn> = (0..600).map(|index| Drawn::new(&FAMILIES[0], 3, index).unwrap()).collect();
        let range = |of: &dyn Fn(&Drawn) -> f64| {
            drawn.iter().map(of).fold((f64::INFINITY, 0.0f64), |(low, high), x| (low.min(x), high.max(x)))
        };
        let (low, high) = range(&|d| d.truth().camera.fx);
        assert!((250.0..300.0).contains(&low) && (4500.0..=5000.0).contains(&high));
        assert_eq!(range(&|d| d.views.len() as f64), (2.0, 50.0));
        let (low, high) = range(&|d| d.noise_px);
        assert!((0.01..0.012).contains(&low) && (1.8..=2.0).contains(&high));
        let (low, high) = range(&|d| d.tilt_deg);
        assert!((2.0..2.2).contains(&low) && (55.0..=60.0).contains(&high));
        let models: std::collections::BTreeSet<&str> = drawn.iter().map(|d| d.model).collect();
        assert_eq!(models.len(), 9);
    }
}
