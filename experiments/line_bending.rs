//! How far does the chapter's lens bend a straight line, and does the true model straighten it again?
//!
//! Expected: the top grid line leaves its regression line by 4.678 px at most and 2.249 px RMS (chapter,
//! section 5.1), and by nothing but rounding once corrected. Nothing is drawn here, so every number is exact.
//!
//! What it cannot show: how well a lens model that was estimated, not known, straightens lines (see
//! `collinearity`).

use calibench::camera::{BrownConrady, Camera};
use calibench::geometry::{LineFit, Vec2};
use calibench::synth::Truth;
use calibench_harness::stats::{largest, smallest};
use calibench_harness::{
    Band, Context, Dash, Experiment, ExperimentError, Figure, Look, Marker, Plot, Record, Table,
};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "line-bending",
    title: "How far the lens bends a straight line",
    question: "61 points of a straight line near the top of the image are distorted with the chapter's \
               lens. How far do they leave a straight line, how does that depend on the line's height and \
               on k1, and does correction with the true model bring it back? Expected: 4.678 px at most, \
               2.249 px RMS, and nothing but rounding after correction.",
    seed: 0,
    takes_image: false,
    run,
};

/// The top grid line in ideal pixels: v = 60, u = 20, 30, ..., 620.
const LINE_V_PX: f64 = 60.0;
const LINE_U_PX: std::ops::RangeInclusive<u32> = 2..=62;
/// k1 of the pincushion grid; k2 stays the chapter's, which gives the sign of k1 only.
const PINCUSHION_K1: f64 = 0.18;
/// Heights of lines: v = 0, 3, ..., 480 px, the principal point's row 243 among them.
const HEIGHT_THIRDS_PX: std::ops::RangeInclusive<u32> = 0..=160;
/// k1 = -0.30, -0.29, ..., 0.30.
const K1_HUNDREDTHS: std::ops::RangeInclusive<i32> = -30..=30;
/// The grids of the figure, px.
const GRID_U_PX: [f64; 11] = [20.0, 80.0, 140.0, 200.0, 260.0, 320.0, 380.0, 440.0, 500.0, 560.0, 620.0];
const GRID_V_PX: [f64; 7] = [60.0, 120.0, 180.0, 240.0, 300.0, 360.0, 420.0];

/// A coordinate below 640 px is rounded by half of 2^-43 px at most. A pixel is distorted and corrected in
/// fewer than 40 operations, whose errors the lens's slope (above 0.8 on the line) hardly enlarges: 40 x
/// 2^-44 / 0.8 = 2.9e-12 px.
const ROUNDING_PX: f64 = 3e-12;

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let barrel = Truth::example_camera();
    let pincushion = with_k1(&barrel, PINCUSHION_K1);
    let ideal = line_at(LINE_V_PX);
    let bent = Bent::new(&barrel, &ideal)?;
    let opposite = Bent::new(&pincushion, &ideal)?;

    report_numbers(&mut record, &bent, &opposite, &barrel);

    let heights = sweep_heights(&barrel)?;
    let strengths = sweep_k1(&barrel)?;
    claim_exact_correction(&mut record, &bent, &opposite);
    claim_directions(&mut record, &bent, &opposite);
    claim_centre_line(&mut record, &barrel)?;
    claim_first_order(&mut record, &strengths);

    record.table(deviation_table(&ideal, &bent, &opposite));
    record.table(sweep_table("height", "line height v", ("v", "px"), &heights));
    record.table(sweep_table("k1", "k1", ("k1", ""), &strengths));
    record.figure(grid_figure(&barrel, &pincushion, &bent, &opposite)?);
    let printed = (record.printed("max-deviation")?, record.printed("rms-deviation")?);
    let k1 = (barrel.distortion.k1, pincushion.distortion.k1);
    record.figure(deviation_figure(&ideal, (&bent, &opposite), k1, printed.0));
    record.figure(height_figure(&heights, &barrel, printed));
    record.figure(k1_figure(&strengths, &barrel));
    Ok(record)
}

/// The points of a horizontal line in ideal pixels.
fn line_at(v_px: f64) -> Vec<Vec2> {
    LINE_U_PX.map(|tens| Vec2::new(10.0 * f64::from(tens), v_px)).collect()
}

fn with_k1(camera: &Camera, k1: f64) -> Camera {
    camera.with_distortion(BrownConrady { k1, ..camera.distortion })
}

/// A line, bent by a lens and corrected again.
struct Bent {
    distorted: LineFit,
    corrected: LineFit,
    /// Largest distance of a corrected point from its ideal place.
    round_trip_px: f64,
}

impl Bent {
    fn new(camera: &Camera, ideal: &[Vec2]) -> Result<Bent, ExperimentError> {
        let distorted: Vec<Vec2> = ideal.iter().map(|p| camera.distort_pixel(p)).collect();
        let corrected = distorted
            .iter()
            .map(|p| camera.correct_pixel(p))
            .collect::<Result<Vec<Vec2>, _>>()
            .map_err(ExperimentError::at("correction of the line"))?;
        let round_trip_px = largest(corrected.iter().zip(ideal).map(|(c, i)| (c - i).norm()));
        Ok(Bent { distorted: fit(&distorted)?, corrected: fit(&corrected)?, round_trip_px })
    }

    /// Deviation of the line's middle minus that of its ends, px; v grows downwards.
    fn bow_px(&self) -> f64 {
        let d = &self.distorted.deviations;
        d[d.len() / 2] - 0.5 * (d[0] + d[d.len() - 1])
    }
}

fn fit(points: &[Vec2]) -> Result<LineFit, ExperimentError> {
    LineFit::new(points).map_err(ExperimentError::at("line fit"))
}

/// What first-order theory says of a line at `v_px`, and how far the truth may lie from it.
struct FirstOrder {
    max_px: f64,
    bound_px: f64,
}

impl FirstOrder {
    /// To first order in the coefficients a point of the line moves by
    /// `(du, dv) = f (x, y) (k1 r^2 + k2 r^4)`, and its deviation is `dv` less the regression line of `dv` on
    /// `u`.
    ///
    /// The rest is of second order: with the ideal `u` spread over `+-L` and variance `s^2`, `du` and `dv`
    /// within D and E of their means, and slope `b` of the regression, `b D` comes from the shift along the
    /// line, and `L (D E + 2 s D |b|) / s^2` from the change of slope. Twice that covers the higher orders
    /// while `D / s < 0.2`.
    fn of(camera: &Camera, ideal: &[Vec2]) -> FirstOrder {
        let shifts: Vec<Vec2> = ideal
            .iter()
            .map(|p| {
                let x = camera.normalised_from_pixel(p);
                let s = x.norm_squared();
                let lens = &camera.distortion;
                let stretch = s * (lens.k1 + s * lens.k2);
                Vec2::new(camera.fx * x.x * stretch, camera.fy * x.y * stretch)
            })
            .collect();
        let n = ideal.len() as f64;
        let u_mean = ideal.iter().map(|p| p.x).sum::<f64>() / n;
        let shift_mean = shifts.iter().sum::<Vec2>() / n;
        let variance = ideal.iter().map(|p| (p.x - u_mean) * (p.x - u_mean)).sum::<f64>() / n;
        let covariance =
            ideal.iter().zip(&shifts).map(|(p, d)| (p.x - u_mean) * (d.y - shift_mean.y)).sum::<f64>() / n;
        let slope = covariance / variance;
        let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0f64, |l, v| l.max(v.abs()));
        let half_length = largest(&mut ideal.iter().map(|p| p.x - u_mean));
        let along = largest(&mut shifts.iter().map(|d| d.x - shift_mean.x));
        let across = largest(&mut shifts.iter().map(|d| d.y - shift_mean.y));
        let deviations = ideal.iter().zip(&shifts).map(|(p, d)| d.y - shift_mean.y - slope * (p.x - u_mean));
        let spread = variance.sqrt();
        let turn = (along * across + 2.0 * spread * along * slope.abs()) / variance;
        FirstOrder {
            max_px: largest(&mut { deviations }),
            bound_px: 2.0 * (slope.abs() * along + half_length * turn),
        }
    }
}

/// One node of a sweep.
struct Node {
    at: f64,
    max_px: f64,
    rms_px: f64,
    first_order: FirstOrder,
}

impl Node {
    /// Distance of the largest deviation from what first-order theory makes of it.
    fn gap_px(&self) -> f64 {
        (self.max_px - self.first_order.max_px).abs()
    }
}

fn node(at: f64, camera: &Camera, ideal: &[Vec2]) -> Result<Node, ExperimentError> {
    let bent = Bent::new(camera, ideal)?;
    Ok(Node {
        at,
        max_px: bent.distorted.max_deviation(),
        rms_px: bent.distorted.rms_deviation(),
        first_order: FirstOrder::of(camera, ideal),
    })
}

fn sweep_heights(camera: &Camera) -> Result<Vec<Node>, ExperimentError> {
    HEIGHT_THIRDS_PX.map(|threes| 3.0 * f64::from(threes)).map(|v| node(v, camera, &line_at(v))).collect()
}

fn sweep_k1(camera: &Camera) -> Result<Vec<Node>, ExperimentError> {
    let ideal = line_at(LINE_V_PX);
    K1_HUNDREDTHS
        .map(|hundredths| f64::from(hundredths) / 100.0)
        .map(|k1| node(k1, &camera.with_distortion(BrownConrady::radial(k1, 0.0)), &ideal))
        .collect()
}

fn report_numbers(record: &mut Record, bent: &Bent, opposite: &Bent, barrel: &Camera) {
    let band = || Band::absolute(ROUNDING_PX, "rounding of coordinates below 640 px over 40 operations");
    let points = bent.distorted.deviations.len() as f64;
    let (max, rms) = (bent.distorted.max_deviation(), bent.distorted.rms_deviation());
    record
        .exact("")
        .number("points", points, "points on the line")
        .rounds_to_printed()
        .number("k1-barrel", barrel.distortion.k1, "k1 of the chapter's lens")
        .rounds_to_printed()
        .number("k1-pincushion", PINCUSHION_K1, "k1 of the pincushion grid")
        .rounds_to_printed()
        .group("px", band())
        .number("max-deviation", max, "largest distance of the distorted line from its regression line")
        .rounds_to_printed()
        .number("rms-deviation", rms, "RMS distance of the distorted line")
        .rounds_to_printed();
    let (max, rms) = (opposite.distorted.max_deviation(), opposite.distorted.rms_deviation());
    let (corrected, round_trip) = (bent.corrected.max_deviation(), bent.round_trip_px);
    record
        .group("px", band())
        .number("pincushion-max-deviation", max, "the same line under the pincushion lens")
        .number("pincushion-rms-deviation", rms, "RMS under the pincushion lens")
        .number("max-after-correction", corrected, "largest distance after correction with the true model")
        .rounds_to_printed()
        .number("round-trip", round_trip, "largest distance of a corrected point from its ideal place");
}

/// That the corrected line is straight follows: its regression line minimises the sum of squares.
fn claim_exact_correction(record: &mut Record, bent: &Bent, opposite: &Bent) {
    let reason = "40 roundings of half of 2^-43 px each, over the lens's least slope 0.8";
    let statement =
        "correction with the true model returns every point of the line to its place, up to rounding";
    let worst = bent.round_trip_px.max(opposite.round_trip_px);
    record
        .claim_that("correction-is-exact", statement)
        .at_most(worst, ROUNDING_PX)
        .unit("px")
        .because(reason);
}

fn claim_directions(record: &mut Record, bent: &Bent, opposite: &Bent) {
    let cases = [
        ("barrel: the middle of the top line bows upwards, away from the centre", bent.bow_px() < 0.0),
        (
            "pincushion: the middle of the top line bows downwards, towards the centre",
            opposite.bow_px() > 0.0,
        ),
    ];
    record
        .claim_that(
            "direction-of-bending",
            "a negative k1 bows lines away from the centre, a positive one towards it",
        )
        .every("cases", cases)
        .because(
            "the ends are farther from the centre than the middle: a barrel lens draws them in more (Brown \
             1971)",
        );
}

fn claim_centre_line(record: &mut Record, camera: &Camera) -> Result<(), ExperimentError> {
    let centre = Bent::new(camera, &line_at(camera.cy))?;
    record
        .claim_that("centre-line-stays-straight", "a line through the distortion centre stays straight")
        .at_most(centre.distorted.max_deviation(), ROUNDING_PX)
        .unit("px")
        .because("radial distortion moves points along rays from the centre; what remains is rounding");
    Ok(())
}

fn claim_first_order(record: &mut Record, strengths: &[Node]) {
    let farthest = largest(strengths.iter().map(Node::gap_px));
    let widest = largest(strengths.iter().map(|n| n.first_order.bound_px));
    record
        .group("px", Band::absolute(1e-10, "differences of sums of 61 coordinates"))
        .number("first-order-gap", farthest, "largest gap of the deviation to first-order theory")
        .number("first-order-bound", widest, "largest bound of the second-order remainder");
    let holds = |n: &Node| n.gap_px() <= n.first_order.bound_px + ROUNDING_PX;
    record
        .claim_that(
            "first-order-theory",
            "at every k1 the largest deviation agrees with first-order theory, within its second-order \
             remainder",
        )
        .every(
            "values of k1",
            strengths.iter().map(|n| (format!("k1 = {:.2}: {} px", n.at, n.max_px), holds(n))),
        )
        .because(
            "expansion in k1: twice the second-order terms of shift along the line and of change of slope, \
             all of one sign",
        );
}

fn deviation_table(ideal: &[Vec2], bent: &Bent, opposite: &Bent) -> Table {
    let caption = "signed distance of every point from its regression line";
    Table::of("deviation", caption, ideal.iter().enumerate())
        .column("u", "px", |(_, p)| p.x)
        .column("v", "px", |(_, p)| p.y)
        .column("barrel", "px", |(i, _)| bent.distorted.deviations[*i])
        .column("pincushion", "px", |(i, _)| opposite.distorted.deviations[*i])
        .column("barrel_corrected", "px", |(i, _)| bent.corrected.deviations[*i])
        .into()
}

fn sweep_table(name: &str, what: &str, axis: (&str, &str), nodes: &[Node]) -> Table {
    Table::of(name, format!("deviation of the line against {what}"), nodes)
        .column(axis.0, axis.1, |n| n.at)
        .column("max", "px", |n| n.max_px)
        .column("rms", "px", |n| n.rms_px)
        .column("first_order_max", "px", |n| n.first_order.max_px)
        .column("remainder_bound", "px", |n| n.first_order.bound_px)
        .into()
}

/// Lines of the grid, fine enough to look smooth.
fn grid_lines(see: impl Fn(&Vec2) -> Vec2) -> Vec<Vec<(f64, f64)>> {
    const STEPS: u32 = 30;
    let between = |low: f64, high: f64, k: u32| low + (high - low) * f64::from(k) / f64::from(STEPS);
    let (left, right) = (GRID_U_PX[0], GRID_U_PX[GRID_U_PX.len() - 1]);
    let (top, bottom) = (GRID_V_PX[0], GRID_V_PX[GRID_V_PX.len() - 1]);
    let seen = |u: f64, v: f64| {
        let pixel = see(&Vec2::new(u, v));
        (pixel.x, pixel.y)
    };
    let rows = GRID_V_PX.iter().map(|&v| (0..=STEPS).map(|k| seen(between(left, right, k), v)).collect());
    let columns = GRID_U_PX.iter().map(|&u| (0..=STEPS).map(|k| seen(u, between(top, bottom, k))).collect());
    rows.chain(columns).collect()
}

/// `barrel, k1 = -0.18`, with a typographer's minus.
fn named(lens: &str, k1: f64) -> String {
    format!("{lens}, k1 = {k1:+}").replace('-', "\u{2212}")
}

/// The row and the column of points through the principal point, as a lens shows them.
fn central_lines(camera: &Camera, see: impl Fn(&Vec2) -> Vec2) -> [Vec<Vec2>; 2] {
    let across = (0..=62).map(|k| see(&Vec2::new(10.0 + 10.0 * f64::from(k), camera.cy)));
    let down = (0..=46).map(|k| see(&Vec2::new(camera.cx, 10.0 + 10.0 * f64::from(k))));
    [across.collect(), down.collect()]
}

/// Largest distance of the central lines from their regression lines under a lens, px.
fn central_deviation(camera: &Camera) -> Result<f64, ExperimentError> {
    let [across, down] = central_lines(camera, |p| camera.distort_pixel(p));
    Ok(fit(&across)?.max_deviation().max(fit(&down)?.max_deviation()))
}

fn grid_figure(
    barrel: &Camera,
    pincushion: &Camera,
    bent: &Bent,
    opposite: &Bent,
) -> Result<Figure, ExperimentError> {
    let panel = |title: &str, see: &dyn Fn(&Vec2) -> Vec2| {
        let (width, height) = Truth::EXAMPLE_IMAGE;
        let (right, bottom) = (width as f64 - 0.5, height as f64 - 0.5);
        let border = [(-0.5, -0.5), (right, -0.5), (right, bottom), (-0.5, bottom), (-0.5, -0.5)];
        let plot = Plot::new(title, "u (px)", "v (px)").size(400.0, 350.0).equal_aspect().y_down().line_as(
            "image border",
            border,
            Look::ink().dash(Dash::Dotted),
        );
        let lines = grid_lines(see);
        let [across, down] = central_lines(barrel, see).map(|line| line.into_iter().map(|p| (p.x, p.y)));
        let central = Look::series(2).dash(Dash::Dashed).width(1.2);
        let plot = plot.line_as("through the principal point", across, central).line_as("", down, central);
        let plain = Look::series(0).width(0.9);
        let plot = lines[1..].iter().fold(plot, |plot, line| plot.line_as("", line, plain));
        plot.line_as("top line", &lines[0], Look::series(1).dash(Dash::Solid).width(2.2))
    };
    let panels = [
        panel("ideal", &|p| *p),
        panel(&named("barrel", barrel.distortion.k1), &|p| barrel.distort_pixel(p)),
        panel(&named("pincushion", pincushion.distortion.k1), &|p| pincushion.distort_pixel(p)),
    ];
    let lens = |camera: &Camera| format!("k1 = {:+}, k2 = {}", camera.distortion.k1, camera.distortion.k2);
    let caption = format!(
        "A grid seen through an ideal lens, the chapter's lens ({}) and its opposite ({}), in pixels. \
         Nothing is drawn at random. Notice that the two dashed lines, through the principal point ({}, \
         {}), leave their regression lines by {:.3} px at most, the top line by {:.3} px under the one lens \
         and {:.3} px under the other.",
        lens(barrel),
        lens(pincushion),
        barrel.cx,
        barrel.cy,
        central_deviation(barrel)?.max(central_deviation(pincushion)?),
        bent.distorted.max_deviation(),
        opposite.distorted.max_deviation()
    );
    Ok(Figure::panels("grids", &panels, 3, caption))
}

fn deviation_figure(
    ideal: &[Vec2],
    (bent, opposite): (&Bent, &Bent),
    k1: (f64, f64),
    printed_max_px: f64,
) -> Figure {
    let along = |fit: &LineFit| -> Vec<_> { ideal.iter().map(|p| p.x).zip(fit.deviations.clone()).collect() };
    let plot = Plot::new(
        "Top line: distance from the regression line",
        "u of the ideal point (px)",
        "deviation (px), down positive",
    )
    .y_down()
    .line(named("barrel", k1.0), along(&bent.distorted))
    .line(named("pincushion", k1.1), along(&opposite.distorted))
    .line("barrel, corrected", along(&bent.corrected))
    .hline(format!("\u{b1}{printed_max_px} px, as published"), printed_max_px)
    .hline("", -printed_max_px);
    let end = |fit: &LineFit| fit.deviations[0].abs().max(fit.deviations[ideal.len() - 1].abs());
    let caption = format!(
        "Signed distance of the {} points (v = {LINE_V_PX} px, u = {} ... {} px) from their \
         orthogonal-regression line, in pixels; nothing is drawn at random. Notice that the barrel lens \
         makes {:.3} px at an end of the line, the pincushion lens {:.3} px, and that {:.0e} px are left \
         after correction.",
        ideal.len(),
        ideal[0].x,
        ideal[ideal.len() - 1].x,
        end(&bent.distorted),
        end(&opposite.distorted),
        bent.corrected.max_deviation()
    );
    Figure::plot("deviation", &plot, caption)
}

/// Largest and RMS deviation of a sweep as curves, and first-order theory as markers on every tenth node, so
/// that they leave the curve beneath visible.
fn swept(plot: Plot, nodes: &[Node]) -> Plot {
    let curve = |value: fn(&Node) -> f64| nodes.iter().map(move |n| (n.at, value(n)));
    plot.line("max", curve(|n| n.max_px)).line("RMS", curve(|n| n.rms_px)).points_as(
        "max, first order (every tenth)",
        curve(|n| n.first_order.max_px).step_by(10),
        Look::series(2).marker(Marker::Circle),
    )
}

fn height_figure(heights: &[Node], camera: &Camera, (max_px, rms_px): (f64, f64)) -> Figure {
    let plot =
        Plot::new("Bending against the height of the line", "height v of the line (px)", "deviation (px)");
    let plot = swept(plot, heights).vline("principal point", camera.cy).points_as(
        format!("published: {max_px} and {rms_px} px"),
        [(LINE_V_PX, max_px), (LINE_V_PX, rms_px)],
        Look::ink(),
    );
    let away = || heights.iter().filter(|n| n.at != camera.cy);
    let a_tenth = || away().map(|n| 10.0 * n.max_px / (n.at - camera.cy).abs());
    let at_centre = heights.iter().filter(|n| n.at == camera.cy).map(|n| n.max_px);
    let caption = format!(
        "Largest and RMS deviation of a horizontal line (u = {} ... {} px) under the chapter's lens against \
         its height, in pixels; nothing is drawn at random. Notice that a line at the principal point's row \
         leaves its regression line by {:.3} px, and any other by {:.2} to {:.2} px for every 10 px between \
         it and that row.",
        10 * LINE_U_PX.start(),
        10 * LINE_U_PX.end(),
        largest(at_centre),
        smallest(a_tenth()),
        largest(a_tenth())
    );
    Figure::plot("height", &plot, caption)
}

fn k1_figure(strengths: &[Node], camera: &Camera) -> Figure {
    let remainder =
        strengths.iter().map(|Node { at, first_order: FirstOrder { max_px, bound_px }, .. }| {
            (*at, max_px - bound_px, max_px + bound_px)
        });
    let plot = Plot::new("Bending against k1 (k2 = 0)", "k1", "deviation of the top line (px)");
    let plot = swept(plot, strengths)
        .band_as("bound of the second-order remainder", remainder, Look::series(4))
        .y_range(0.0, 14.0)
        .vline("chapter's k1", camera.distortion.k1);
    let gap = largest(strengths.iter().map(Node::gap_px));
    let bound = largest(strengths.iter().map(|n| n.first_order.bound_px));
    let a_tenth = || strengths.iter().filter(|n| n.at != 0.0).map(|n| 0.1 * n.max_px / n.at.abs());
    let caption = format!(
        "Deviation of the top line (v = {LINE_V_PX} px) against k1 alone, in pixels; nothing is drawn at \
         random. Notice that every tenth of k1, of either sign, bends the line by {:.2} to {:.2} px. \
         First-order theory misses it by {gap:.2} px at most; the bound, which adds up all second-order \
         terms as if they had one sign, allows {bound:.1} px there and says little more than that the \
         theory is one of small k1.",
        smallest(a_tenth()),
        largest(a_tenth())
    );
    Figure::plot("k1", &plot, caption)
}
