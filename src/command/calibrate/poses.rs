//! Where did the boards stand before the camera? In space, from above and from the side, to scale.

use super::finished::Finished;
use calibench::geometry::{Vec2, Vec3};
use calibench_harness::{Align, Dash, Drawing, Figure, Look, Plot};

/// The largest picture of the scene, px.
const MOST_WIDTH_PX: f64 = 450.0;
const MOST_HEIGHT_PX: f64 = 340.0;

/// Room around it for the words at its axes, px.
const MARGIN_PX: (f64, f64) = (72.0, 58.0);

/// Ticks of an axis are at least so far apart, px.
const TICK_PX: f64 = 34.0;

/// Numbers of boards are at least so far apart where there is room, px.
const NUMBER_PX: f64 = 17.0;

/// More numbers than these would cover the boards.
const MOST_NUMBERS: usize = 60;

/// The camera's pyramid is so long, as a part of the scene.
const PYRAMID: f64 = 0.14;

/// How the scene is looked at: turned about the vertical, and from above.
const TURN_DEGREES: f64 = 58.0;
const FROM_ABOVE_DEGREES: f64 = 24.0;

/// Camera and boards, and the box that holds them; all in the camera's frame.
struct SpaceScene {
    /// The view's number, and the corners of the rectangle of its marks.
    boards: Vec<(usize, [Vec3; 4])>,
    /// Where the image's corners look, a pyramid's base.
    base: [Vec3; 4],
    low: Vec3,
    high: Vec3,
}

/// The figures.
pub(super) fn figures(finished: &Finished) -> Vec<Figure> {
    let scene = SpaceScene::of(finished);
    let unit = &finished.unit;
    let caption = format!(
        "Camera and boards to scale, in the camera's frame: X to the right, Y down, Z along the optical axis, in {unit}, without \
         perspective. Each board is the rectangle of its marks, with its view's number; the dot is at its least X and Y."
    );
    let flat = |name: &str, title: &str, (across, label): (usize, &str), down: bool| {
        let plot = scene.flat(title, across, &axis_label("Z", unit), &axis_label(label, unit));
        let plot = if down { plot.y_down() } else { plot };
        let caption =
            format!("The same {}, to scale, in {unit}: the camera looks to the right.", title.to_lowercase());
        Figure::plot(name, &plot, caption)
    };
    vec![
        Figure::drawing("poses", &scene.drawing(unit), caption),
        // Seen from above with Z to the right, X points down.
        flat("poses-above", "From above", (0, "X"), true),
        flat("poses-side", "From the side", (1, "Y"), true),
    ]
}

fn axis_label(axis: &str, unit: &str) -> String {
    format!("{axis} ({unit})")
}

impl SpaceScene {
    fn of(finished: &Finished) -> SpaceScene {
        let calibration = &finished.fit.calibration;
        let boards: Vec<(usize, [Vec3; 4])> = finished
            .fit
            .views
            .iter()
            .zip(&calibration.cam_from_target)
            .enumerate()
            .map(|(i, (view, pose))| {
                let corners = rectangle(view.points()).map(|p| pose.apply(&Vec3::new(p.x, p.y, 0.0)));
                (finished.names.number(i), corners)
            })
            .collect();
        let all = || boards.iter().flat_map(|(_, corners)| corners).copied();
        let low = all().fold(Vec3::zeros(), |low, p| low.inf(&p));
        let high = all().fold(Vec3::zeros(), |high, p| high.sup(&p));
        let base = pyramid(finished, PYRAMID * (high - low).amax());
        let low = base.iter().fold(low, |low, p| low.inf(p));
        let high = base.iter().fold(high, |high, p| high.sup(p));
        SpaceScene { boards, base, low, high }
    }

    /// Z to the right against another axis.
    fn flat(&self, title: &str, axis: usize, x: &str, y: &str) -> Plot {
        let at = |p: &Vec3| (p.z, p[axis]);
        let boards = self.boards.iter().enumerate();
        let plot = boards.fold(Plot::new(title, x, y).equal_aspect(), |plot, (i, (_, corners))| {
            plot.line_as("", closed(corners).iter().map(at).collect::<Vec<_>>(), look(i))
        });
        let edges = self.base.iter().flat_map(|corner| [*corner, Vec3::zeros()]);
        let camera: Vec<(f64, f64)> = edges.chain(closed(&self.base)).map(|p| at(&p)).collect();
        plot.line_as("", camera, Look::ink())
    }

    fn drawing(&self, unit: &str) -> Drawing {
        let (low, high) = (self.low, self.high);
        let raw = Projection::onto_sheet(&low, &high);
        let steps = Vec3::from_fn(|k, _| raw.step(k));
        let low = Vec3::from_fn(|k, _| libm::floor(low[k] / steps[k]) * steps[k]);
        let high = Vec3::from_fn(|k, _| libm::ceil(high[k] / steps[k]) * steps[k]);
        let sheet = Projection::onto_sheet(&low, &high);
        let drawing = Drawing::new(MOST_WIDTH_PX + 2.0 * MARGIN_PX.0, sheet.height + 2.0 * MARGIN_PX.1);
        let drawing =
            drawing.heading("Camera and boards", (0.5 * MOST_WIDTH_PX + MARGIN_PX.0, 16.0), Align::Middle);
        let drawing = walls(drawing, &sheet, (&low, &high), &steps);
        let drawing = axes(drawing, &sheet, (&low, &high), &steps, unit);
        self.with_boards(self.with_camera(drawing, &sheet), &sheet)
    }

    fn with_camera(&self, drawing: Drawing, sheet: &Projection) -> Drawing {
        let look = Look::ink().width(1.3);
        let (centre, axis) = (Vec3::zeros(), Vec3::z() * self.base.iter().map(|p| p.z).fold(0.0, f64::max));
        let sides = self
            .base
            .iter()
            .fold(drawing, |drawing, corner| drawing.line([sheet.place(&centre), sheet.place(corner)], look));
        sides
            .area(self.base.iter().map(|p| sheet.place(p)).collect::<Vec<_>>(), look, 0.15)
            .line(closed(&self.base).iter().map(|p| sheet.place(p)).collect::<Vec<_>>(), look)
            .arrow(sheet.place(&centre), sheet.place(&(axis * 1.7)), look)
    }

    fn with_boards(&self, drawing: Drawing, sheet: &Projection) -> Drawing {
        let mut order: Vec<usize> = (0..self.boards.len()).collect();
        let depth = |i: usize| self.boards[i].1.iter().map(|p| sheet.depth(p)).sum::<f64>();
        order.sort_by(|&a, &b| depth(b).total_cmp(&depth(a)));
        let drawing = order.into_iter().fold(drawing, |drawing, i| {
            let (_, corners) = &self.boards[i];
            let places: Vec<(f64, f64)> = closed(corners).iter().map(|p| sheet.place(p)).collect();
            drawing
                .area(places[..4].to_vec(), look(i), 0.13)
                .line(places.clone(), look(i))
                .mark(places[0], look(i).marker(calibench_harness::Marker::Disc).size(2.4))
        });
        if self.boards.len() > MOST_NUMBERS {
            return drawing;
        }
        let mut taken: Vec<(f64, f64)> = Vec::new();
        self.boards.iter().fold(drawing, |drawing, (number, corners)| {
            let at = free_place(&candidates(corners, sheet), &taken);
            taken.push(at);
            drawing.words(number.to_string(), at, Align::Middle)
        })
    }
}

/// Boards look alike but for their colour.
fn look(board: usize) -> Look {
    Look::series(board).dash(Dash::Solid).width(1.1)
}

/// The upright rectangle of a view's marks on its board, from the least X and Y around.
fn rectangle(points: &[Vec2]) -> [Vec2; 4] {
    let low = points.iter().fold(Vec2::repeat(f64::INFINITY), |low, p| low.inf(p));
    let high = points.iter().fold(Vec2::repeat(f64::NEG_INFINITY), |high, p| high.sup(p));
    [low, Vec2::new(high.x, low.y), high, Vec2::new(low.x, high.y)]
}

/// Where the corners of the image look, at a depth. Of lenses that see too far to the side, or where the
/// image's size is not known, a pyramid of no meaning but its direction.
fn pyramid(finished: &Finished, depth: f64) -> [Vec3; 4] {
    let camera = &finished.fit.calibration.camera;
    let rays = finished.image_size.map(|(width, height)| {
        let (right, bottom) = (width as f64 - 0.5, height as f64 - 0.5);
        [(-0.5, -0.5), (right, -0.5), (right, bottom), (-0.5, bottom)]
            .map(|(u, v)| camera.ray(&Vec2::new(u, v)).ok().filter(|ray| ray.z > 0.4))
    });
    match rays {
        Some([Some(a), Some(b), Some(c), Some(d)]) => [a, b, c, d].map(|ray| ray * (depth / ray.z)),
        _ => [(-0.5, -0.4), (0.5, -0.4), (0.5, 0.4), (-0.5, 0.4)].map(|(x, y)| Vec3::new(x, y, 1.0) * depth),
    }
}

fn closed(corners: &[Vec3; 4]) -> [Vec3; 5] {
    let [a, b, c, d] = *corners;
    [a, b, c, d, a]
}

/// Where the number of a board may stand: in its middle, or towards its corners.
fn candidates(corners: &[Vec3; 4], sheet: &Projection) -> Vec<(f64, f64)> {
    let middle = corners.iter().sum::<Vec3>() / 4.0;
    let towards = |share: f64| corners.iter().map(move |corner| middle + (corner - middle) * share);
    let places = std::iter::once(middle).chain(towards(0.4)).chain(towards(0.8));
    places.map(|p| sheet.place(&p)).collect()
}

/// The first place that is far enough from those taken, or the farthest.
fn free_place(candidates: &[(f64, f64)], taken: &[(f64, f64)]) -> (f64, f64) {
    let room = |at: &(f64, f64)| {
        taken.iter().map(|t| libm::hypot(t.0 - at.0, t.1 - at.1)).fold(f64::INFINITY, f64::min)
    };
    let first = candidates.iter().find(|at| room(at) >= NUMBER_PX);
    let farthest = || candidates.iter().max_by(|a, b| room(a).total_cmp(&room(b)));
    first.or_else(farthest).copied().unwrap_or_default()
}

/// Space onto the sheet, without perspective.
struct Projection {
    scale: f64,
    left: f64,
    top: f64,
    height: f64,
}

/// To the right and down on the sheet, px at a scale of 1.
fn flattened(p: &Vec3) -> Vec2 {
    let (sin_a, cos_a) = libm::sincos(TURN_DEGREES.to_radians());
    let (sin_b, cos_b) = libm::sincos(FROM_ABOVE_DEGREES.to_radians());
    let away = cos_a * p.z - sin_a * p.x;
    Vec2::new(cos_a * p.x + sin_a * p.z, cos_b * p.y - sin_b * away)
}

impl Projection {
    /// The box between two corners, as large as the sheet takes and in its middle.
    fn onto_sheet(low: &Vec3, high: &Vec3) -> Projection {
        let corner =
            |k: usize| Vec3::from_fn(|axis, _| if k >> axis & 1 == 0 { low[axis] } else { high[axis] });
        let flat = || (0..8).map(|k| flattened(&corner(k)));
        let first = flat().fold(Vec2::repeat(f64::INFINITY), |a, p| a.inf(&p));
        let last = flat().fold(Vec2::repeat(f64::NEG_INFINITY), |a, p| a.sup(&p));
        let size = (last - first).sup(&Vec2::repeat(f64::MIN_POSITIVE));
        let scale = (MOST_WIDTH_PX / size.x).min(MOST_HEIGHT_PX / size.y);
        let left = MARGIN_PX.0 + 0.5 * (MOST_WIDTH_PX - scale * size.x) - scale * first.x;
        Projection { scale, left, top: MARGIN_PX.1 - scale * first.y, height: scale * size.y }
    }

    fn place(&self, p: &Vec3) -> (f64, f64) {
        let flat = flattened(p) * self.scale;
        (self.left + flat.x, self.top + flat.y)
    }

    /// Distance from the reader, up to a constant.
    fn depth(&self, p: &Vec3) -> f64 {
        let (sin_a, cos_a) = libm::sincos(TURN_DEGREES.to_radians());
        let (sin_b, cos_b) = libm::sincos(FROM_ABOVE_DEGREES.to_radians());
        cos_b * (cos_a * p.z - sin_a * p.x) + sin_b * p.y
    }

    /// The smallest round step along an axis whose ticks are far enough apart.
    fn step(&self, axis: usize) -> f64 {
        let unit = Vec3::from_fn(|k, _| if k == axis { 1.0 } else { 0.0 });
        let least = TICK_PX / (self.scale * flattened(&unit).norm());
        let power = libm::exp10(libm::floor(libm::log10(least)));
        [1.0, 2.0, 5.0].map(|m| m * power).into_iter().find(|&step| step >= least).unwrap_or(10.0 * power)
    }
}

/// Multiples of a step between two of them.
fn ticks(low: f64, high: f64, step: f64) -> impl Iterator<Item = f64> {
    let (first, last) = (libm::round(low / step) as i64, libm::round(high / step) as i64);
    (first..=last).map(move |k| k as f64 * step)
}

/// Grids on the floor and on the two walls behind.
fn walls(drawing: Drawing, sheet: &Projection, (low, high): (&Vec3, &Vec3), steps: &Vec3) -> Drawing {
    let thin = Look::ink().width(0.25);
    // The wall is where one axis has one value; along the second its lines stand, along the third they run.
    let back = Vec3::new(low.x, high.y, high.z);
    [(0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)].into_iter().fold(
        drawing,
        |drawing, (wall, stands, runs)| {
            ticks(low[stands], high[stands], steps[stands]).fold(drawing, |drawing, at| {
                let end = |along: f64| {
                    let mut p = back;
                    p[wall] = back[wall];
                    p[stands] = at;
                    p[runs] = along;
                    sheet.place(&p)
                };
                drawing.line([end(low[runs]), end(high[runs])], thin)
            })
        },
    )
}

/// Numbers and names at the three edges in front.
fn axes(
    drawing: Drawing,
    sheet: &Projection,
    (low, high): (&Vec3, &Vec3),
    steps: &Vec3,
    unit: &str,
) -> Drawing {
    // X along the lower left edge, Z along the lower right one, Y along the left one.
    let edges = [
        (0, "X", Vec3::new(0.0, high.y, low.z), (-5.0, 15.0), (-32.0, 36.0), Align::End),
        (1, "Y", Vec3::new(low.x, 0.0, low.z), (-7.0, 0.0), (0.0, -18.0), Align::End),
        (2, "Z", Vec3::new(high.x, high.y, 0.0), (5.0, 15.0), (24.0, 36.0), Align::Start),
    ];
    edges.into_iter().fold(drawing, |drawing, (axis, name, edge, (right, down), shift, align)| {
        let at = |value: f64| {
            let mut p = edge;
            p[axis] = value;
            sheet.place(&p)
        };
        let numbered = ticks(low[axis], high[axis], steps[axis]).fold(drawing, |drawing, value| {
            let place = at(value);
            drawing.words(label(value, steps[axis]), (place.0 + right, place.1 + down), align)
        });
        // The name of Y stands above its edge, the others' beside the middle of theirs.
        let (middle, align) = match axis {
            1 => (at(low[axis]), Align::Middle),
            _ => (at(0.5 * (low[axis] + high[axis])), align),
        };
        numbered.words(axis_label(name, unit), (middle.0 + shift.0, middle.1 + shift.1), align)
    })
}

/// A tick with the decimals of its step.
fn label(value: f64, step: f64) -> String {
    let decimals = (-libm::floor(libm::log10(step))).max(0.0) as usize;
    format!("{value:.decimals$}").replace('-', "\u{2212}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_lengths_along_one_direction_are_equally_long_on_the_sheet_wherever_they_are() {
        let sheet = Projection::onto_sheet(&Vec3::new(-10.0, -5.0, 0.0), &Vec3::new(30.0, 8.0, 70.0));
        let length = |from: Vec3, to: Vec3| {
            let (a, b) = (sheet.place(&from), sheet.place(&to));
            libm::hypot(a.0 - b.0, a.1 - b.1)
        };
        let step = Vec3::new(3.0, 1.0, 5.0);
        let there = Vec3::new(10.0, -2.0, 60.0);
        assert!((length(Vec3::zeros(), step) - length(there, there + step)).abs() < 1e-9);
        // What lies in the box lies on the sheet.
        for k in 0..8 {
            let corner = Vec3::new([-10.0, 30.0][k & 1], [-5.0, 8.0][k >> 1 & 1], [0.0, 70.0][k >> 2]);
            let (x, y) = sheet.place(&corner);
            assert!((MARGIN_PX.0 - 1e-9..=MARGIN_PX.0 + MOST_WIDTH_PX + 1e-9).contains(&x));
            assert!((MARGIN_PX.1 - 1e-9..=MARGIN_PX.1 + sheet.height + 1e-9).contains(&y));
        }
    }

    #[test]
    fn ticks_stand_at_round_values_that_are_far_enough_apart() {
        let sheet = Projection::onto_sheet(&Vec3::new(-100.0, -50.0, 0.0), &Vec3::new(300.0, 80.0, 700.0));
        for axis in 0..3 {
            let step = sheet.step(axis);
            let unit = Vec3::from_fn(|k, _| if k == axis { step } else { 0.0 });
            assert!((flattened(&unit) * sheet.scale).norm() >= TICK_PX, "{axis}");
        }
        assert_eq!(ticks(-200.0, 200.0, 100.0).count(), 5);
        assert_eq!((label(-0.5, 0.5), label(1500.0, 500.0)), ("\u{2212}0.5".to_string(), "1500".to_string()));
    }

    #[test]
    fn numbers_keep_out_of_each_others_way() {
        let taken = [(0.0, 0.0)];
        assert_eq!(free_place(&[(1.0, 0.0), (20.0, 0.0), (40.0, 0.0)], &taken), (20.0, 0.0));
        assert_eq!(free_place(&[(1.0, 0.0), (5.0, 0.0), (3.0, 0.0)], &taken), (5.0, 0.0));
    }
}
