//! Which changes of a problem must not change its answer? Invariances, with the change of the camera that undoes them.

use super::protocol::Problem;
use calibench::camera::{BrownConrady, Camera};

/// A change of a problem that leaves the camera the same, but for a known change of its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
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
    pub fn undo(self, camera: &Camera) -> Camera {
        match self {
            Variant::ViewOrder | Variant::PointOrder | Variant::TargetUnits => *camera,
            Variant::ImageShift => {
                let (du, dv) = (SHIFT_PX.0 as f64, SHIFT_PX.1 as f64);
                Camera { cx: camera.cx - du, cy: camera.cy - dv, ..*camera }
            }
            Variant::SwappedAxes => {
                let lens = &camera.distortion;
                Camera {
                    fx: camera.fy,
                    fy: camera.fx,
                    cx: camera.cy,
                    cy: camera.cx,
                    skew: camera.skew,
                    distortion: BrownConrady { p1: lens.p2, p2: lens.p1, ..*lens },
                }
            }
        }
    }
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
    const PAIRS: [(&str, &str); 3] = [("fx", "fy"), ("cx", "cy"), ("p1", "p2")];
    let partner = |name: &str| {
        let found = PAIRS.iter().find_map(|&(a, b)| match name {
            _ if name == a => Some(b),
            _ if name == b => Some(a),
            _ => None,
        });
        found.unwrap_or(name).to_string()
    };
    problem.image_size.reverse();
    for view in &mut problem.views {
        view.target.iter_mut().chain(view.pixels.iter_mut()).for_each(|p| p.reverse());
    }
    problem.free.iter_mut().for_each(|name| *name = partner(name));
    problem.held = problem.held.iter().map(|(name, value)| (partner(name), *value)).collect();
}
