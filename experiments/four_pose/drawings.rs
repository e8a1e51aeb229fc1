//! The pictures that explain: how a camera sees, and what a verdict asks.

use super::*;
use calibench::geometry::Pose;
use calibench_harness::{Align, Drawing, Expectation};

/// Where the sheet shows points of space, px: seen from the right of the camera, behind it and above it, from
/// far away.
struct Sheet;

impl Sheet {
    const ORIGIN: (f64, f64) = (84.0, 300.0);
    const PX_PER_MM: f64 = 3.7;
    /// To the right and down on the sheet, along the camera's X, Y and Z: turned by 53 degrees, looking down
    /// by 20.
    const AXES: [(f64, f64); 3] = [(0.6, 0.274), (0.0, 0.940), (0.8, -0.205)];

    fn place(p: &Vec3) -> (f64, f64) {
        let along =
            |pick: fn(&(f64, f64)) -> f64| -> f64 { (0..3).map(|i| p[i] * pick(&Self::AXES[i])).sum() };
        (Self::ORIGIN.0 + Self::PX_PER_MM * along(|a| a.0), Self::ORIGIN.1 + Self::PX_PER_MM * along(|a| a.1))
    }
}

/// The image plane is drawn this far before the camera, mm; its size follows from the focal length in pixels.
const IMAGE_PLANE_MM: f64 = 52.0;
/// Cells of the drawn image along u and v: a pixel is far too small to see.
const CELLS: (u32, u32) = (16, 12);
/// Points of the target whose rays are drawn, as columns and rows from its centre.
const RAYS: [(f64, f64); 3] = [(-4.0, -3.0), (4.0, -3.0), (-4.0, 3.0)];
const SPACING_MM: f64 = 10.0;

/// The pose that is drawn.
const YAWED: usize = 2;

/// Camera, image plane, rays and the turned target.
pub fn imaging(draw: &Draw) -> Figure {
    let truth = &draw.scene.truth;
    let camera = &truth.camera;
    let pose = &truth.cam_from_target[YAWED];
    // A pixel as a point of the image plane, mm.
    let on_plane = |u: f64, v: f64| {
        let (x, y) = ((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy);
        Vec3::new(x, y, 1.0) * IMAGE_PLANE_MM
    };
    let (width, height) = (truth.image_size.0 as f64, truth.image_size.1 as f64);
    let sheet = Drawing::new(720.0, 432.0);
    let sheet = target(sheet, pose);
    let sheet = image_plane(sheet, (width, height), &on_plane);
    let sheet = rays(sheet, pose);
    let (centre, principal) = (Sheet::place(&Vec3::zeros()), Sheet::place(&on_plane(camera.cx, camera.cy)));
    // Where the axis meets the target; where it comes out from behind it, and where it ends.
    let [meets, leaves, axis_end] =
        [pose.translation.z, 170.0, 196.0].map(|z| Sheet::place(&Vec3::new(0.0, 0.0, z)));
    let axis = Look::ink().dash(Dash::Dashed);
    let sheet = sheet
        .line([centre, meets], axis)
        .arrow(leaves, axis_end, axis)
        .mark(centre, Look::ink().marker(Marker::Disc).size(4.5))
        .mark(principal, Look::series(1).marker(Marker::Plus).size(6.0));
    let sheet = camera_axes(sheet);
    let drawing = sheet
        .words("camera centre", (centre.0 - 4.0, centre.1 - 18.0), Align::Middle)
        .words("optical axis, Z", (axis_end.0 - 6.0, axis_end.1 - 16.0), Align::Middle)
        .words("principal point (cx, cy)", (16.0, 90.0), Align::Start)
        .arrow((96.0, 100.0), (principal.0 - 5.0, principal.1 - 6.0), Look::ink())
        .words("image plane: u to the right, v down,", (150.0, 392.0), Align::Start)
        .words(format!("{width} x {height} pixels, one focal length away"), (150.0, 409.0), Align::Start)
        .words("target, Z = 0 in its own frame:", (480.0, 392.0), Align::Start)
        .words("R and t take it to the camera's", (480.0, 409.0), Align::Start);
    let caption = format!(
        "The virtual camera and its target in the third pose, {} mm away, in space. The image plane is drawn before the camera, where it \
         shows the picture upright, and with {} x {} cells for its pixels. Notice that every point of a ray has the same pixel; and that \
         the optical axis meets the image beside its middle.",
        pose.translation.z, CELLS.0, CELLS.1
    );
    Figure::drawing("imaging", &drawing, caption)
}

fn image_plane(sheet: Drawing, (width, height): (f64, f64), on_plane: &impl Fn(f64, f64) -> Vec3) -> Drawing {
    let at = |u: f64, v: f64| Sheet::place(&on_plane(u - 0.5, v - 0.5));
    let faint = Look::series(0).dash(Dash::Solid).width(0.5);
    let corners = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)].map(|(u, v)| at(u, v));
    let sheet = sheet.area(corners, Look::series(4), 0.15);
    let upright =
        (0..=CELLS.0).map(|k| width * f64::from(k) / f64::from(CELLS.0)).map(|u| [at(u, 0.0), at(u, height)]);
    let level =
        (0..=CELLS.1).map(|k| height * f64::from(k) / f64::from(CELLS.1)).map(|v| [at(0.0, v), at(width, v)]);
    upright.chain(level).fold(sheet, |sheet, line| sheet.line(line, faint))
}

fn target(sheet: Drawing, pose: &Pose) -> Drawing {
    let at = |x: f64, y: f64| Sheet::place(&pose.apply(&Vec3::new(x, y, 0.0)));
    let edge = [(-46.0, -36.0), (46.0, -36.0), (46.0, 36.0), (-46.0, 36.0)].map(|(x, y)| at(x, y));
    let sheet = sheet.area(edge, Look::series(5), 0.25).line(edge.into_iter().chain([edge[0]]), Look::ink());
    let places = (-3..=3).flat_map(|row| (-4..=4).map(move |column| (column, row)));
    places.fold(sheet, |sheet, (column, row)| {
        let (x, y) = (SPACING_MM * f64::from(column), SPACING_MM * f64::from(row));
        sheet.mark(at(x, y), Look::ink().marker(Marker::Disc).size(2.2))
    })
}

/// From marks of the target through the image plane to the camera centre.
fn rays(sheet: Drawing, pose: &Pose) -> Drawing {
    let ray = Look::series(1).dash(Dash::Solid).width(1.2);
    RAYS.iter().fold(sheet, |sheet, (column, row)| {
        let mark = pose.apply(&Vec3::new(SPACING_MM * column, SPACING_MM * row, 0.0));
        let on_plane = mark * (IMAGE_PLANE_MM / mark.z);
        sheet
            .line([Sheet::place(&mark), Sheet::place(&Vec3::zeros())], ray)
            .mark(Sheet::place(&mark), Look::series(1).marker(Marker::Disc).size(3.2))
            .mark(Sheet::place(&on_plane), Look::series(1).marker(Marker::Square).size(3.6))
    })
}

fn camera_axes(sheet: Drawing) -> Drawing {
    let axes = [("X", Vec3::new(26.0, 0.0, 0.0)), ("Y", Vec3::new(0.0, 26.0, 0.0))];
    axes.iter().fold(sheet, |sheet, (name, end)| {
        let (from, to) = (Sheet::place(&Vec3::zeros()), Sheet::place(end));
        sheet.arrow(from, to, Look::ink()).words(*name, (to.0 + 8.0, to.1 + 2.0), Align::Start)
    })
}

/// One row of the picture of verdicts: a question, and a line of numbers with an interval and what is held
/// against it.
struct Asked {
    question: &'static str,
    rows: [String; 2],
    interval: (f64, f64),
    marks: Vec<(f64, String, Look)>,
    unit: &'static str,
}

/// The three expectations, at work on one number.
pub fn verdicts(record: &Record) -> Result<Figure, ExperimentError> {
    const LEFT: f64 = 372.0;
    const RIGHT: f64 = 812.0;
    const ROW: f64 = 112.0;
    let missing = || ExperimentError::Input("the record has no fx yet".to_string());
    let asked = [golden(record), claim(record), published(record)];
    let asked = asked.into_iter().collect::<Option<Vec<Asked>>>().ok_or_else(missing)?;
    let sheet = Drawing::new(840.0, 3.0 * ROW + 8.0);
    let drawing = asked.iter().enumerate().fold(sheet, |sheet, (k, asked)| {
        let top = ROW * k as f64 + 10.0;
        let middle = top + 56.0;
        let half = 0.7 * (asked.interval.1 - asked.interval.0);
        let centre = 0.5 * (asked.interval.0 + asked.interval.1);
        let at = |value: f64| LEFT + (RIGHT - LEFT) * (0.5 + 0.5 * (value - centre) / half);
        let (low, high) = (at(asked.interval.0), at(asked.interval.1));
        let (above, below) = (middle - 9.0, middle + 9.0);
        let sheet = sheet
            .boxed((12.0, top + 4.0), 338.0, asked.question, &asked.rows, Look::series(k))
            .area([(low, above), (high, above), (high, below), (low, below)], Look::series(k), 0.3)
            .line([(LEFT, middle), (RIGHT, middle)], Look::ink())
            .words(decimals(asked.interval.0, asked.interval), (low, middle + 22.0), Align::Middle)
            .words(decimals(asked.interval.1, asked.interval), (high, middle + 22.0), Align::Middle)
            .words(asked.unit, (0.5 * (low + high), middle + 38.0), Align::Middle);
        asked.marks.iter().enumerate().fold(sheet, |sheet, (row, (value, name, look))| {
            let words_at = (at(*value), middle - 18.0 - 15.0 * (row % 2) as f64);
            sheet.mark((at(*value), middle), look.size(5.0)).words(name, words_at, Align::Middle)
        })
    });
    let caption = format!(
        "Three questions about one number, fx of our draw: the shaded interval is what each allows, the marks are what is held \
         against it. Notice how differently wide the intervals are: unchanged is a matter of rounding, correct one of {TRIALS} trials, \
         and the chapter's value one of a single draw of noise."
    );
    Ok(Figure::drawing("verdicts", &drawing, caption))
}

/// A number with two significant digits more than the interval's width has.
fn decimals(value: f64, (low, high): (f64, f64)) -> String {
    let digits = (2.0 - libm::floor(libm::log10(high - low))).max(0.0) as usize;
    format!("{value:.digits$}")
}

fn golden(record: &Record) -> Option<Asked> {
    let number = record.numbers().iter().find(|number| number.id == "fx")?;
    let Band::Absolute { half_width, .. } = number.band else { return None };
    Some(Asked {
        question: "Golden: is it unchanged?",
        rows: [
            "yesterday's number, with its band:".to_string(),
            "the rounding of the computation".to_string(),
        ],
        interval: (number.value - half_width, number.value + half_width),
        marks: vec![(number.value, "fx today".to_string(), Look::series(0).marker(Marker::Disc))],
        unit: "px, fx of our draw",
    })
}

fn claim(record: &Record) -> Option<Asked> {
    let claim = record.claims().iter().find(|claim| claim.id == "fx-unbiased")?;
    Some(Asked {
        question: "Claim: is it correct?",
        rows: [
            format!("mean error of fx over {TRIALS} trials,"),
            "and what theory allows it to be".to_string(),
        ],
        interval: claim.interval,
        marks: vec![(claim.value, "mean error".to_string(), Look::series(1).marker(Marker::Disc))],
        unit: "px, estimate less truth",
    })
}

fn published(record: &Record) -> Option<Asked> {
    let found = record.reconciliations().iter().find(|found| found.entry.id.ends_with(".fx"))?;
    let Expectation::Distribution { interval, .. } = found.expectation else {
        return None;
    };
    let truth = record.value("fx-true")?;
    Some(Asked {
        question: "Published: does it reproduce?",
        rows: [
            "one draw of noise each, ours and the".to_string(),
            "chapter's: both in what is predicted".to_string(),
        ],
        interval,
        marks: vec![
            (truth, "truth".to_string(), Look::ink()),
            (found.ours, "ours".to_string(), Look::series(2).marker(Marker::Disc)),
            (found.entry.value(), "the chapter's".to_string(), Look::series(2).marker(Marker::Diamond)),
        ],
        unit: "px, fx",
    })
}
