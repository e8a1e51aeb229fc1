//! `calibench diff A B`: how two cameras differ over the frame, and whether both may be one.

use super::calibrate::{parse_size, round_down};
use super::format::Format as Shown;
use super::said::{print_either, unless_unwritten, written_by};
use super::{Exit, warn};
use calibench::camera::Model;
use calibench::evaluate::{FrameDifference, TakenOut, difference::frame_nodes};
use calibench::io::ShownPath;
use calibench::io::formats::{CameraFile, FormatError, MOST_BYTES, Wishes, detect, read_camera_file};
use calibench::io::{read_regular_text, significant, write_together};
use calibench::validate::{Calibrated, OneCamera, frame_difference, one_camera};
use calibench_harness::{Figure, HeatMap, Look, Plot};
use clap::Args;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// What the exit codes mean here.
const EXIT_CODES: &str = "Exit codes: 0 nothing speaks against one camera, or there are no covariances to ask, 1 they are two, at the rate of \
     false alarms, 2 wrong usage or input, 3 incomplete";

#[derive(Debug, Args)]
#[command(after_help = EXIT_CODES)]
pub(super) struct Arguments {
    /// A camera with any lens in any format that `calibench convert` reads; result.json of `calibench
    /// calibrate` brings its covariance along
    a: PathBuf,
    /// The other camera
    b: PathBuf,
    /// Size of the frame, where neither file says it
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    image_size: Option<(usize, usize)>,
    /// Distance of what is looked at, along its ray, in mm: the best translation is taken out too [default:
    /// the best rotation alone, for any distance]
    #[arg(long, value_name = "MM", value_parser = parse_distance)]
    at: Option<f64>,
    /// Rate of false alarms of the test
    #[arg(long, value_name = "RATE", value_parser = parse_rate, default_value_t = 0.01)]
    rate: f64,
    /// Folder for difference.json and two plots
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Shown::Text)]
    format: Shown,
}

fn parse_distance(text: &str) -> Result<f64, String> {
    let distance = text.strip_suffix("mm").unwrap_or(text).parse().ok();
    distance
        .filter(|d: &f64| d.is_finite() && *d > 0.0)
        .ok_or_else(|| "expected a distance in mm, above 0".into())
}

pub(super) fn parse_rate(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok().filter(|rate| 0.0 < *rate && *rate < 1.0);
    rate.ok_or_else(|| "expected a rate between 0 and 1, such as 0.01".into())
}

pub(super) fn run(arguments: &Arguments) -> Exit {
    let compared = match compared(arguments) {
        Ok(compared) => compared,
        Err(message) => {
            warn(&message);
            return Exit::Usage;
        }
    };
    let json = format!("{:#}\n", compared.json(arguments));
    let written =
        arguments.out.as_ref().map_or(Ok(()), |folder| write_together(&files(folder, &json, &compared)));
    print_either(arguments.format, &compared.text(arguments), &json);
    let exit = match &compared.test {
        Ok(test) if test.p_value < arguments.rate && compared.doubts.is_empty() => Exit::Deviates,
        _ => Exit::Held,
    };
    unless_unwritten(written, exit)
}

/// What was found.
struct Compared {
    size: (usize, usize),
    /// Lens models of A and B.
    models: [Model; 2],
    difference: FrameDifference,
    /// The test, or why there is none.
    test: Result<OneCamera, String>,
    /// What the files themselves say against it.
    doubts: Vec<String>,
}

fn compared(arguments: &Arguments) -> Result<Compared, String> {
    let (a, b) = (read(&arguments.a)?, read(&arguments.b)?);
    let size = frame(arguments, &a, &b)?;
    let taken_out =
        arguments.at.map_or(TakenOut::Rotation, |distance| TakenOut::RotationAndTranslation { distance });
    let difference =
        frame_difference(&a.camera, &b.camera, size, taken_out).map_err(|error| error.to_string())?;
    let test = match (calibrated(&a), calibrated(&b)) {
        (Some(a), Some(b)) => one_camera(&a, &b, size, taken_out).map_err(|error| error.to_string()),
        (None, _) => Err(format!("{} has no covariance", arguments.a.shown())),
        (_, None) => Err(format!("{} has no covariance", arguments.b.shown())),
    };
    let models = [&a, &b].map(|file| file.camera.distortion.model());
    let doubts_in = |file: &CameraFile| file.estimated.as_ref().map_or(Vec::new(), |e| e.doubts.clone());
    let doubts = doubts_of([(&arguments.a, doubts_in(&a)), (&arguments.b, doubts_in(&b))]);
    Ok(Compared { size, models, difference, test, doubts })
}

/// Where a result says that its standard deviations mislead, chi-squared has no law.
pub(super) const NOT_DECIDED: &str =
    "not decided, since standard deviations that mislead, as the files say, give this probability no meaning";

/// What results say against their own standard deviations, each after the name of its file.
pub(super) fn doubts_of<'a>(files: impl IntoIterator<Item = (&'a PathBuf, Vec<String>)>) -> Vec<String> {
    let of_file = |(path, doubts): (&PathBuf, Vec<String>)| {
        doubts.into_iter().map(|doubt| format!("{}: {doubt}", path.shown())).collect::<Vec<_>>()
    };
    files.into_iter().flat_map(of_file).collect()
}

fn read(path: &Path) -> Result<CameraFile, String> {
    let file = path.shown();
    let text = read_regular_text(path, MOST_BYTES).map_err(|error| error.to_string())?;
    let format = detect(&file, &text).map_err(|error| error.to_string())?;
    let read =
        read_camera_file(format, &file, &text, None, &Wishes::default()).map_err(|error| match error {
            FormatError::Several { names, .. } => format!(
                "{file}: {} cameras: take one of {} out first, with calibench convert --camera NAME",
                names.len(),
                names.join(", ")
            ),
            error => error.to_string(),
        })?;
    read.assumed.iter().for_each(|assumed| warn(&format!("{file}: {assumed}")));
    Ok(read)
}

/// The frame of both.
fn frame(arguments: &Arguments, a: &CameraFile, b: &CameraFile) -> Result<(usize, usize), String> {
    let mut sizes = [a.image_size, b.image_size, arguments.image_size].into_iter().flatten();
    let Some(size) = sizes.next() else { return Err("the frame is not known: give --image-size WxH".into()) };
    match sizes.find(|other| *other != size) {
        None => Ok(size),
        Some(other) => Err(format!(
            "{} x {} px and {} x {} px: bring both to one size first, with calibench convert --resize",
            size.0, size.1, other.0, other.1
        )),
    }
}

fn calibrated(file: &CameraFile) -> Option<Calibrated<'_>> {
    let estimated = file.estimated.as_ref()?;
    Some(Calibrated {
        camera: &file.camera,
        free: estimated.free,
        fy_per_fx: estimated.fy_per_fx,
        covariance: &estimated.covariance,
        degrees_of_freedom: estimated.degrees_of_freedom,
    })
}

impl Compared {
    fn text(&self, arguments: &Arguments) -> String {
        let FrameDifference { rms_px, b_from_a, .. } = &self.difference;
        let (width, height) = self.size;
        let mut text = format!(
            "{} against {} over {width} x {height} px\ntaken out: a rotation by {} degrees",
            arguments.b.shown(),
            arguments.a.shown(),
            significant(self.difference.rotation_rad().to_degrees(), 3)
        );
        // Writing to a string cannot fail, here and below.
        if let Some(distance) = arguments.at {
            let [x, y, z] = [0, 1, 2].map(|i| significant(b_from_a.translation[i], 3));
            let _ = write!(text, " and a translation by ({x}, {y}, {z}) mm at {distance} mm");
        }
        let _ =
            writeln!(text, "\ndifference left: {} px RMS{}", significant(*rms_px, 3), self.largest_text());
        match &self.test {
            Ok(test) => text += &self.test_text(test, arguments.rate),
            Err(why) => {
                let _ = writeln!(text, "not tested whether both are one camera: {why}");
            }
        }
        text
    }

    fn test_text(&self, test: &OneCamera, rate: f64) -> String {
        let [a, b] = self.models;
        let says = match (test.p_value < rate, a == b) {
            (true, _) if !self.doubts.is_empty() => NOT_DECIDED.to_string(),
            (false, _) => "nothing speaks against one camera".to_string(),
            (true, true) => "they are two cameras".to_string(),
            (true, false) => format!("they are two cameras, or {a} and {b} do not both fit one"),
        };
        let mut text = format!(
            "chi-squared {} on {} degrees of freedom, by chance with probability {}: {says} (false alarms at {rate})\n",
            significant(test.chi_squared, 4),
            test.degrees_of_freedom,
            significant(test.p_value, 2),
        );
        if test.imitated > 0 {
            let by = if a == b {
                "what was taken out imitates them"
            } else {
                "both models share them, or what was taken out imitates them"
            };
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{} combinations of parameters are left out: {by}", test.imitated);
        }
        text + &self.doubts.iter().map(|doubt| format!("{doubt}\n")).collect::<String>()
    }

    fn largest_text(&self) -> String {
        let Some(largest) = self.difference.largest() else { return String::new() };
        let (size, pixel) = (significant(largest.difference.norm(), 3), largest.pixel);
        format!(", at most {size} px, at ({:.0}, {:.0})", pixel.x, pixel.y)
    }

    fn json(&self, arguments: &Arguments) -> Value {
        let difference = &self.difference;
        let rotation = calibench::geometry::rotation::log(&difference.b_from_a.rotation);
        let translation = difference.b_from_a.translation;
        let largest = difference.largest();
        let test = self.test.as_ref().map(|test| {
            json!({
                "chi_squared": test.chi_squared,
                "degrees_of_freedom": test.degrees_of_freedom,
                "imitated": test.imitated,
                "noise_freedom": test.noise_freedom,
                "p_value": test.p_value,
                "rate": arguments.rate,
                "one_camera": (test.p_value >= arguments.rate || self.doubts.is_empty()).then_some(test.p_value >= arguments.rate),
            })
        });
        json!({
            "written_by": written_by(),
            "a": arguments.a.display().to_string(),
            "b": arguments.b.display().to_string(),
            "models": self.models.map(Model::name),
            "image_size": [self.size.0, self.size.1],
            "at_mm": arguments.at,
            "rotation_vector_rad": [rotation.x, rotation.y, rotation.z],
            "translation_mm": arguments.at.map(|_| [translation.x, translation.y, translation.z]),
            "rms_px": difference.rms_px,
            "max_px": largest.map(|node| node.difference.norm()),
            "max_at_px": largest.map(|node| [node.pixel.x, node.pixel.y]),
            "nodes": difference.nodes.iter().map(|node| [
                node.pixel.x, node.pixel.y, node.difference.x, node.difference.y,
            ]).collect::<Vec<_>>(),
            "test": test.as_ref().ok(),
            "not_tested": self.test.as_ref().err(),
            "doubts": self.doubts,
        })
    }
}

/// All or none, `difference.json` last.
fn files(folder: &Path, json: &str, compared: &Compared) -> Vec<(PathBuf, Vec<u8>)> {
    let figures = [Some(arrows(compared)), sizes(compared)].into_iter().flatten();
    let figures = figures.map(|figure| (folder.join(figure.file_name()), figure.bytes));
    figures.chain([(folder.join("difference.json"), json.as_bytes().to_vec())]).collect()
}

/// Where pixels move.
fn arrows(compared: &Compared) -> Figure {
    let nodes = &compared.difference.nodes;
    let (width, height) = compared.size;
    let longest = compared.difference.largest().map_or(0.0, |node| node.difference.norm());
    // The longest arrow takes a twentieth of the frame.
    let factor = round_down(width.max(height) as f64 / 20.0 / longest.max(f64::MIN_POSITIVE));
    let factor = if factor.is_finite() { factor } else { 1.0 };
    let arrows: Vec<(f64, f64, f64, f64)> = nodes
        .iter()
        .map(|n| (n.pixel.x, n.pixel.y, factor * n.difference.x, factor * n.difference.y))
        .collect();
    let (right, bottom) = (width as f64 - 0.5, height as f64 - 0.5);
    let border = [(-0.5, -0.5), (right, -0.5), (right, bottom), (-0.5, bottom), (-0.5, -0.5)];
    let title = format!("Difference of projection, B \u{2212} A, {factor} times enlarged");
    let plot = Plot::new(title, "u (px)", "v (px)").equal_aspect().y_down();
    let plot = plot.line_as("", border, Look::ink()).arrows("", &arrows);
    let caption = "Where camera B shows what camera A shows at the arrow's foot, px, after the best motion between them.";
    Figure::plot("difference", &plot, caption)
}

/// Cells of the map along the frame's longer side: more have no room for their numbers.
const LONG_SIDE_CELLS: usize = 10;

/// How far pixels move.
fn sizes(compared: &Compared) -> Option<Figure> {
    let (all, columns) = frame_nodes(compared.size);
    let rows = all.len() / columns;
    let step = columns.max(rows).div_ceil(LONG_SIDE_CELLS).max(1);
    // Every so many nodes one, in the middle of its cell.
    let places = |count: usize| (step / 2..count).step_by(step).collect::<Vec<_>>();
    let (columns_shown, rows_shown) = (places(columns), places(rows));
    let size = |i: usize, j: usize| {
        let pixel = all[j * columns + i];
        let node = compared.difference.nodes.iter().find(|node| node.pixel == pixel);
        node.map_or(f64::NAN, |node| node.difference.norm())
    };
    let upwards = rows_shown.iter().rev().flat_map(|&j| columns_shown.iter().map(move |&i| (i, j)));
    let values: Vec<f64> = upwards.map(|(i, j)| size(i, j)).collect();
    let label = |x: f64| format!("{x:.0}");
    let x = columns_shown.iter().map(|&i| label(all[i].x)).collect();
    let y = rows_shown.iter().rev().map(|&j| label(all[j * columns].y)).collect();
    let heat = HeatMap::new("difference (px)", x, y, values).ok()?.digits(2);
    let plot = Plot::heat_map("How far are the pixels apart?", "u (px)", "v (px)", heat);
    let caption = "Distance between the pixels of both cameras, px, after the best motion between them; cells are named by their middle.";
    Some(Figure::plot("difference-size", &plot, caption))
}
