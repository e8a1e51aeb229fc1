//! Which changes of a problem must not change its answer? Invariances, with the change of the camera that
//! undoes them.

use super::protocol::Problem;
use calibench::camera::{BrownConrady, Camera, Lens, Model, Parameter};

/// A change of a problem that leaves the camera the same, but for a known change of its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Variant {
    /// The views in another order.
    ViewOrder,
    /// The points of every view in another order.
    PointOrder,
    /// The target in inches instead of millimetres.
    TargetUnits,
    /// The image cut out of a larger one.
    ImageShift,
    /// Rows and columns of the image exchanged, and those of the target with them.
    SwappedAxes,
}

/// Margin of the larger image, px: not a multiple of anything.
const SHIFT_PX: (usize, usize) = (37, 21);
/// Millimetres in an inch.
const INCH: f64 = 25.4;

impl Variant {
    /// All.
    pub const ALL: [Variant; 5] = [
        Variant::ViewOrder,
        Variant::PointOrder,
        Variant::TargetUnits,
        Variant::ImageShift,
        Variant::SwappedAxes,
    ];

    /// Name in ids and reports.
    pub fn name(self) -> &'static str {
        match self {
            Variant::ViewOrder => "view-order",
            Variant::PointOrder => "point-order",
            Variant::TargetUnits => "target-units",
            Variant::ImageShift => "image-shift",
            Variant::SwappedAxes => "swapped-axes",
        }
    }

    /// Whether the camera behind the changed problem is known for a lens model. The two angles of a tilted
    /// sensor are applied one after the other: with the axes exchanged no two angles give the same sensor.
    pub fn is_known_of(self, model: Model) -> bool {
        self != Variant::SwappedAxes || model != Model::Tilted
    }

    /// The changed problem, under another id.
    pub fn apply(self, problem: &Problem, id: String) -> Problem {
        let mut changed = Problem { id, ..problem.clone() };
        match self {
            Variant::ViewOrder => changed.views.reverse(),
            Variant::PointOrder => changed.views.iter_mut().for_each(|view| {
                view.target.reverse();
                view.pixels.reverse();
            }),
            Variant::TargetUnits => changed
                .views
                .iter_mut()
                .flat_map(|view| view.target.iter_mut().flatten())
                .for_each(|x| *x /= INCH),
            Variant::ImageShift => shift(&mut changed),
            Variant::SwappedAxes => swap(&mut changed),
        }
        changed
    }

    /// The camera of the original problem behind the camera of the changed one.
    pub fn undo(self, camera: &Camera<Lens>) -> Camera<Lens> {
        match self {
            Variant::ViewOrder | Variant::PointOrder | Variant::TargetUnits => *camera,
            Variant::ImageShift => {
                let (du, dv) = (SHIFT_PX.0 as f64, SHIFT_PX.1 as f64);
                Camera { cx: camera.cx - du, cy: camera.cy - dv, ..*camera }
            }
            Variant::SwappedAxes => match camera.brown_conrady() {
                Some(plain) => with_axes_swapped(&plain).into(),
                None => with_names_swapped(camera),
            },
        }
    }
}

/// The camera that sees `(v, u)` where this one sees `(u, v)`: with the rows of its matrix exchanged, made
/// triangular again by a rotation about the optical axis, `[[0, fy'], [fx', s']] = [[fx, s], [0, fy]] Q`.
/// Radial distortion does not know of `Q`; the vector `(p2, p1)` of the tangential terms turns with it.
/// Without skew parameters are exchanged, no more.
fn with_axes_swapped(camera: &Camera) -> Camera {
    let fy = libm::hypot(camera.fx, camera.skew);
    let (sine, cosine) = (camera.skew / fy, camera.fx / fy);
    let lens = &camera.distortion;
    Camera {
        fx: camera.fy * cosine,
        fy,
        cx: camera.cy,
        cy: camera.cx,
        skew: camera.fy * sine,
        distortion: BrownConrady {
            p1: cosine * lens.p2 + sine * lens.p1,
            p2: cosine * lens.p1 - sine * lens.p2,
            ..*lens
        },
    }
}

/// The same without skew, for the other models: parameters are exchanged, no more.
fn with_names_swapped(camera: &Camera<Lens>) -> Camera<Lens> {
    camera.values().fold(*camera, |swapped, (parameter, value)| {
        swapped.with_value(partner(parameter), value).unwrap_or(swapped)
    })
}

/// The parameter that takes another's place when the axes are exchanged.
fn partner(parameter: Parameter) -> Parameter {
    use Parameter::{Cx, Cy, Fx, Fy, P1, P2, S1, S2, S3, S4};
    const PAIRS: [(Parameter, Parameter); 5] = [(Fx, Fy), (Cx, Cy), (P1, P2), (S1, S3), (S2, S4)];
    let found = PAIRS.iter().find_map(|&(a, b)| match parameter {
        _ if parameter == a => Some(b),
        _ if parameter == b => Some(a),
        _ => None,
    });
    found.unwrap_or(parameter)
}

fn shift(problem: &mut Problem) {
    let margin = [SHIFT_PX.0, SHIFT_PX.1];
    for (axis, name) in ["cx", "cy"].into_iter().enumerate() {
        problem.image_size[axis] += 2 * margin[axis];
        if let Some(held) = problem.held.get_mut(name) {
            *held += margin[axis] as f64;
        }
        for pixel in problem.views.iter_mut().flat_map(|view| view.pixels.iter_mut()) {
            pixel[axis] += margin[axis] as f64;
        }
    }
}

fn swap(problem: &mut Problem) {
    let partner = |name: &str| name.parse().map_or_else(|_| name.to_string(), |p| partner(p).to_string());
    problem.image_size.reverse();
    for view in &mut problem.views {
        view.target.iter_mut().chain(view.pixels.iter_mut()).for_each(|p| p.reverse());
    }
    problem.free.iter_mut().for_each(|name| *name = partner(name));
    problem.held = problem.held.iter().map(|(name, value)| (partner(name), *value)).collect();
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench::geometry::Vec3;

    #[test]
    fn a_skewed_camera_with_its_axes_swapped_sees_the_same_points() {
        let lens = BrownConrady { k1: -0.2, k2: 0.05, p1: 0.003, p2: -0.002, k3: 0.01 };
        let camera =
            Camera { skew: 40.0, ..Camera::pinhole(600.0, 450.0, 320.0, 250.0).with_distortion(lens) };
        let swapped = with_axes_swapped(&camera);
        // Points before the other camera are mirrored, and turned by Q.
        let (sine, cosine) = (camera.skew / swapped.fy, camera.fx / swapped.fy);
        for (x, y) in [(0.3, 0.1), (-0.2, 0.25), (0.05, -0.3)] {
            let seen = camera.project(&Vec3::new(x, y, 1.0)).unwrap();
            let turned = Vec3::new(cosine * y - sine * x, cosine * x + sine * y, 1.0);
            let other = swapped.project(&turned).unwrap();
            assert!((seen.yx() - other).norm() < 1e-10, "{seen} {other}");
        }
        assert!((with_axes_swapped(&swapped).skew - camera.skew).abs() < 1e-10);
    }

    fn held_in_the_middle() -> Problem {
        Problem {
            id: "a".into(),
            image_size: [640, 480],
            model: "brown-conrady".into(),
            views: vec![crate::protocol::ProblemView {
                target: vec![[1.0, 2.0]],
                pixels: vec![[100.0, 50.0]],
            }],
            free: vec!["fx".into(), "p1".into()],
            held: [("cx".to_string(), 320.0), ("k1".to_string(), 0.5)].into(),
        }
    }

    #[test]
    fn an_image_cut_out_of_a_larger_one_has_its_margin_on_every_side() {
        let larger = Variant::ImageShift.apply(&held_in_the_middle(), "b".into());
        assert_eq!(larger.image_size, [640 + 2 * 37, 480 + 2 * 21]);
        assert_eq!((larger.views[0].pixels[0], larger.views[0].target[0]), ([137.0, 71.0], [1.0, 2.0]));
        assert_eq!((larger.held["cx"], larger.held["k1"]), (357.0, 0.5));
        let camera: Camera<Lens> = Camera::pinhole(600.0, 590.0, 357.0, 261.0).into();
        let undone = Variant::ImageShift.undo(&camera);
        assert_eq!((undone.cx, undone.cy, undone.fx, undone.fy), (320.0, 240.0, 600.0, 590.0));
    }

    #[test]
    fn exchanged_axes_exchange_what_belongs_to_them_and_nothing_else() {
        let swapped = Variant::SwappedAxes.apply(&held_in_the_middle(), "b".into());
        assert_eq!(swapped.image_size, [480, 640]);
        assert_eq!((swapped.views[0].pixels[0], swapped.views[0].target[0]), ([50.0, 100.0], [2.0, 1.0]));
        assert_eq!(swapped.free, ["fy", "p2"]);
        assert_eq!((swapped.held["cy"], swapped.held["k1"]), (320.0, 0.5));
        let lens = Lens::new(Model::KannalaBrandt, &[0.1, 0.2, 0.3, 0.4]).unwrap();
        let camera = Camera::with_lens(600.0, 590.0, 320.0, 240.0, lens);
        let other = Variant::SwappedAxes.undo(&camera);
        assert_eq!((other.fx, other.fy, other.cx, other.cy), (590.0, 600.0, 240.0, 320.0));
        assert_eq!(other.distortion, lens);
    }

    #[test]
    fn only_a_tilted_sensor_has_no_known_camera_behind_exchanged_axes() {
        for variant in Variant::ALL {
            for model in Model::ALL {
                let unknown = variant == Variant::SwappedAxes && model == Model::Tilted;
                assert_eq!(variant.is_known_of(model), !unknown, "{variant:?} {model:?}");
            }
        }
    }

    #[test]
    fn a_target_in_inches_is_smaller_by_their_millimetres() {
        let inches = Variant::TargetUnits.apply(&held_in_the_middle(), "b".into());
        let [x, y] = inches.views[0].target[0];
        assert!((x * 25.4 - 1.0).abs() < 1e-15 && (y * 25.4 - 2.0).abs() < 1e-15);
        assert_eq!(inches.views[0].pixels[0], [100.0, 50.0]);
    }
}
