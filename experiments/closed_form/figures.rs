//! The figures of the closed form.

use super::*;
use calibench_harness::stats::largest;
use calibench_harness::{Dash, Drawing, Figure, Look, Marker, Plot};

/// The pitched view: its homography is the easiest to see.
const PITCHED: usize = 1;
/// What the homography leaves is drawn this many times longer than it is.
const ENLARGED: f64 = 10.0;
/// Corners of the target, mm: the four points that would be enough.
const CORNERS_MM: [(f64, f64); 4] = [(-40.0, -30.0), (40.0, -30.0), (40.0, 30.0), (-40.0, 30.0)];
const SPACING_MM: f64 = 10.0;

/// The lines of the target's grid, mm, each by its two ends.
fn grid_lines() -> impl Iterator<Item = [Vec2; 2]> {
    let along_x = (-3..=3).map(|row| {
        [Vec2::new(-40.0, SPACING_MM * f64::from(row)), Vec2::new(40.0, SPACING_MM * f64::from(row))]
    });
    let along_y = (-4..=4).map(|column| {
        [Vec2::new(SPACING_MM * f64::from(column), -30.0), Vec2::new(SPACING_MM * f64::from(column), 30.0)]
    });
    along_x.chain(along_y)
}

fn xy(p: Vec2) -> (f64, f64) {
    (p.x, p.y)
}

/// The target, its image by a homography, and what a lens adds that no homography can follow.
pub fn homography([without, with]: &[Case; 2]) -> Result<Figure, ExperimentError> {
    let view_of = |case: &Case| case.scene.exact().swap_remove(PITCHED);
    let corners = || CORNERS_MM.map(|(x, y)| Vec2::new(x, y));
    let marked = Look::series(1).marker(Marker::Square).size(5.0);
    let grey = Look::ink().width(0.8);
    let plane = grid_lines()
        .fold(Plot::new("The target", "X (mm)", "Y (mm)").size(380.0, 380.0), |plot, ends| {
            plot.line_as("", ends.map(xy), grey)
        });
    let plane = plane
        .equal_aspect()
        .y_down()
        .points_as("points", view_of(without).points().iter().map(|p| (p.x, p.y)), Look::series(0).size(2.4))
        .points_as("four of them", corners().map(xy), marked);
    let image = |title: &str, case: &Case| -> Result<(Plot, f64), ExperimentError> {
        let view = view_of(case);
        let h = super::homography(view.points(), view.pixels())?.homography;
        let at = |p: Vec2| h.apply(&p).unwrap_or(Vec2::new(f64::NAN, f64::NAN));
        let left = view.points().iter().zip(view.pixels()).map(|(p, seen)| (at(*p), *seen - at(*p)));
        let left: Vec<(Vec2, Vec2)> = left.collect();
        let plot = grid_lines()
            .fold(Plot::new(title, "u (px)", "v (px)").size(380.0, 380.0), |plot, ends| {
                plot.line_as("", ends.map(|p| xy(at(p))), grey)
            });
        let arrows = left.iter().map(|(p, d)| (p.x, p.y, ENLARGED * d.x, ENLARGED * d.y));
        let plot = plot
            .equal_aspect()
            .y_down()
            .points_as("points as seen", view.pixels().iter().map(|p| (p.x, p.y)), Look::series(0).size(2.4))
            .points_as("the four", corners().map(|p| xy(at(p))), marked)
            .arrows(format!("what H leaves, \u{d7} {ENLARGED}"), arrows);
        Ok((plot, largest(left.iter().map(|(_, d)| d.norm()))))
    };
    let (pinhole, _) = image("Seen without a lens", without)?;
    let (lens, left_px) = image("Seen through the lens", with)?;
    let caption = format!(
        "The target, and its pitched view without noise: the grid that the homography H makes of the target's, and the points as \
         seen. Four points in general position fix H. Notice that without a lens every point lies on its crossing; and that through \
         the lens no H fits: {left_px:.1} px are left at most, drawn {ENLARGED} times longer than they are."
    );
    Ok(Figure::panels("homography", &[plane, pinhole, lens], 3, caption))
}

/// The steps of the method, with what each makes of one draw.
pub fn steps(draw: &Draw) -> Figure {
    const WIDTH: f64 = 296.0;
    const GAP: f64 = 44.0;
    let views = draw.homographies.len();
    let truth = Truth::example_camera().fx;
    let (closed, refined) = (draw.closed.fx, draw.refined.camera.fx);
    let unknowns = FreeParameters::STANDARD.len() + 6 * views;
    let boxes: [(&str, Vec<String>); 4] = [
        (
            "Views",
            vec![
                format!("{views} photographs of a plane,"),
                format!("{} points: what is known", draw.points),
                "on the target, and its pixel".to_string(),
            ],
        ),
        (
            "1  A homography for each view",
            vec![
                format!("{views} times 8 numbers"),
                "no camera, no lens, no pose yet".to_string(),
                format!("leaves {:.2} px of a point", draw.homography_rms_px()),
            ],
        ),
        (
            "2  Conic constraints, closed form",
            vec![
                format!("{views} times 2 equations for fx, fy, cx, cy"),
                "linear, no lens; then the poses".to_string(),
                format!("fx = {closed:.1} px, off by {:+.1}", closed - truth),
            ],
        ),
        (
            "3  Everything refined together",
            vec![
                format!("{unknowns} unknowns, with k1, k2 and all poses"),
                format!("{} coordinates; leaves {:.4} px", 2 * draw.points, draw.refined.rmse_px),
                format!("fx = {refined:.2} px, off by {:+.2}", refined - truth),
            ],
        ),
    ];
    let height = Drawing::box_height(3);
    let left_of = |k: usize| 12.0 + (WIDTH + GAP) * (k % 2) as f64;
    let top_of = |k: usize| 12.0 + (height + GAP) * (k / 2) as f64;
    let sheet = Drawing::new(2.0 * WIDTH + GAP + 24.0, 2.0 * height + GAP + 24.0);
    let drawing = boxes.iter().enumerate().fold(sheet, |drawing, (k, (heading, rows))| {
        drawing.boxed((left_of(k), top_of(k)), WIDTH, *heading, rows, Look::series(k))
    });
    let middle = 0.5 * height;
    let arrow = Look::ink().width(1.6);
    let drawing = drawing
        .arrow((left_of(0) + WIDTH + 4.0, top_of(0) + middle), (left_of(1) - 4.0, top_of(1) + middle), arrow)
        .line(
            [
                (left_of(1) + 0.5 * WIDTH, top_of(1) + height + 4.0),
                (left_of(1) + 0.5 * WIDTH, top_of(1) + height + 0.5 * GAP),
                (left_of(2) + 0.5 * WIDTH, top_of(1) + height + 0.5 * GAP),
            ],
            arrow,
        )
        .arrow(
            (left_of(2) + 0.5 * WIDTH, top_of(1) + height + 0.5 * GAP),
            (left_of(2) + 0.5 * WIDTH, top_of(2) - 4.0),
            arrow,
        )
        .arrow((left_of(2) + WIDTH + 4.0, top_of(2) + middle), (left_of(3) - 4.0, top_of(3) + middle), arrow);
    let caption = format!(
        "Zhang's steps, with what each makes of the same draw of the four views (noise {DRAW_SIGMA_PX} px, seed 1; true fx {truth} px). \
         Notice that the lens enters with the last step only."
    );
    Figure::drawing("steps", &drawing, caption)
}

/// Errors over the noise.
pub fn errors([without, with]: &[Case; 2], nodes: &[Node], seed: u64) -> Figure {
    let of = |case: &Case, value: fn(&Node) -> f64| {
        let here = nodes.iter().filter(|node| node.case == case.name);
        here.map(|node| (node.sigma_px, value(node))).collect::<Vec<_>>()
    };
    let closed = |node: &Node| node.errors.root_mean_square(CLOSED_FORM);
    let refined = |node: &Node| node.errors.root_mean_square(REFINED);
    let panel = |case: &Case| {
        Plot::new(format!("fx {}", case.name), "noise (px)", "root mean square error of fx (px)")
            .size(430.0, 390.0)
            .log_x()
            .log_y()
            .y_range(0.2, 40.0)
            .points_as("closed form", of(case, closed), Look::series(1))
            .points_as("refined", of(case, refined), Look::series(0))
            .line_as("Cramer-Rao bound", of(case, |node| node.bound_px), Look::ink())
            .line_as(
                "spread of the closed form, predicted",
                of(case, |node| node.closed_form_sd_px),
                Look::series(1).dash(Dash::Dashed),
            )
    };
    let caption = format!(
        "Root mean square error of fx over {TRIALS} draws a level (seed {seed}), by the closed form alone and refined. Notice that \
         without a lens the two can hardly be told apart, and that with the chapter's lens the closed form is off by {:.0} px whatever the noise.",
        with.exact_error_px.abs()
    );
    Figure::panels("errors", &[panel(without), panel(with)], 2, caption)
}
