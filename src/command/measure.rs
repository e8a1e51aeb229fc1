//! `calibench measure RESULT.json`: lengths on a plane, each with its uncertainty split by cause.

use super::Exit;
use super::format::Format;
use super::report::table;
use super::said::{MOST, Said, number_that, positive, say, written_by};
use calibench::camera::Camera;
use calibench::downstream::{Cause, Conditions, Length, PlaneView, length_in_view, length_on_map};
use calibench::geometry::{Pose, Vec2, Vec3, rotation};
use calibench::io::{
    Known, KnownCalibration, PixelEnds, ShownPath, read_known, read_pixel_ends, significant,
};
use calibench::planar::PlaneCalibration;
use clap::Args;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// result.json of `calibrate` (a camera with Brown-Conrady's lens, or a plane from point pairs) or of
    /// `ninepoint`
    result: PathBuf,
    /// View of the calibration whose target lies in the plane
    #[arg(long, value_name = "NAME", conflicts_with = "pose")]
    view: Option<String>,
    /// Pose of the plane before the camera in place of a view: rotation vector in rad and translation, as in
    /// result.json
    #[arg(long, value_name = "RX,RY,RZ,X,Y,Z", value_parser = parse_pose)]
    pose: Option<Numbers<6>>,
    /// Standard deviations of that pose, independent of the camera's errors [default: 0]
    #[arg(long, value_name = "RX,RY,RZ,X,Y,Z", value_parser = parse_pose_sd, requires = "pose")]
    pose_sd: Option<Numbers<6>>,
    /// Pixels at both ends of a length, such as 100.5,200,300,201.2; may be repeated
    #[arg(long, value_name = "U1,V1,U2,V2", value_parser = parse_ends)]
    pixels: Vec<Numbers<4>>,
    /// CSV of such pixels: length,u1,v1,u2,v2
    #[arg(long, value_name = "FILE")]
    ends: Option<PathBuf>,
    /// Length of a unit of the map of a plane, such as 10 for dots 10 mm apart [default: 1]
    #[arg(long, value_name = "MM", value_parser = positive)]
    spacing: Option<f64>,
    /// Standard deviation of a coordinate of a mark, px [default: the noise that the calibration found]
    #[arg(long, value_name = "PX", value_parser = parse_deviation)]
    mark_sd: Option<f64>,
    /// What the lens model leaves out at either end, px, as a standard deviation
    #[arg(long, value_name = "PX", value_parser = parse_deviation, default_value_t = 0.0)]
    model_sd: f64,
    /// Relative standard deviation of the board's scale, such as 1e-4
    #[arg(long, value_name = "PART", value_parser = parse_deviation, default_value_t = 0.0)]
    scale_sd: f64,
    /// Standard deviation of the height of either end over the plane, in the target's unit
    #[arg(long, value_name = "MM", value_parser = parse_deviation, default_value_t = 0.0)]
    flatness: f64,
    /// Standard deviation of the board's temperature, K
    #[arg(long, value_name = "K", value_parser = parse_deviation, requires = "expansion")]
    temperature_sd: Option<f64>,
    /// Expansion of the board, 1/K, such as 11.5e-6 for steel
    #[arg(long, value_name = "PER_K", value_parser = parse_expansion, allow_hyphen_values = true, requires = "temperature_sd")]
    expansion: Option<f64>,
    /// Folder for lengths.json
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

/// Numbers of one option.
type Numbers<const N: usize> = nalgebra::SVector<f64, N>;

fn parse_numbers<const N: usize>(text: &str) -> Result<Numbers<N>, String> {
    let number = |part: &str| part.trim().parse().ok().filter(|x: &f64| x.abs() <= MOST);
    let numbers: Option<Vec<f64>> = text.split(',').map(number).collect();
    numbers
        .filter(|numbers| numbers.len() == N)
        .map(|numbers| Numbers::from_row_slice(&numbers))
        .ok_or_else(|| format!("expected {N} numbers of at most 1e30, separated by commas"))
}

fn parse_pose(text: &str) -> Result<Numbers<6>, String> {
    parse_numbers(text)
}

fn parse_pose_sd(text: &str) -> Result<Numbers<6>, String> {
    let deviations = parse_numbers(text).ok().filter(|numbers: &Numbers<6>| numbers.min() >= 0.0);
    deviations.ok_or_else(|| "expected 6 numbers from 0 to 1e30, separated by commas".into())
}

fn parse_ends(text: &str) -> Result<Numbers<4>, String> {
    parse_numbers(text)
}

fn parse_deviation(text: &str) -> Result<f64, String> {
    number_that(text, |x| (0.0..=MOST).contains(&x), "a number from 0 to 1e30")
}

/// Some materials shrink when they are heated.
fn parse_expansion(text: &str) -> Result<f64, String> {
    number_that(text, |x| x.abs() <= MOST, "a number of at most 1e30, such as 11.5e-6")
}

pub(super) fn run(arguments: &Arguments) -> Exit {
    let measured = measured(arguments);
    let said = measured.map(|m| Said { text: measured_text(&m), json: measured_json(arguments, &m) });
    say(said, arguments.out.as_deref(), "lengths.json", arguments.format)
}

/// A length under its name.
struct Measured {
    name: String,
    pixels: [Vec2; 2],
    length: Length,
}

fn measured(arguments: &Arguments) -> Result<Vec<Measured>, String> {
    let ends = ends(arguments)?;
    match read_known(&arguments.result).map_err(|error| error.to_string())? {
        Known::Camera(known) => measured_in_view(arguments, &known, ends),
        Known::Plane(map) => measured_on_map(arguments, &map, ends),
    }
}

fn measured_in_view(
    arguments: &Arguments,
    known: &KnownCalibration,
    ends: Vec<PixelEnds>,
) -> Result<Vec<Measured>, String> {
    if arguments.spacing.is_some() {
        return Err("--spacing is for the map of a plane: a camera's poses are in its board's unit".into());
    }
    refuse_outside(known, &ends)?;
    let file = arguments.result.shown();
    known
        .refuse_bent_board(&file)
        .map_err(|error| format!("{error}: lengths are measured on flat boards only"))?;
    let camera = known.brown_conrady(&file).map_err(|error| error.to_string())?;
    let plane = plane(arguments, known, &camera)?;
    if arguments.mark_sd.is_none() {
        known.noise_px(&file).map_err(|error| format!("{error}: give it, --mark-sd PX"))?;
    }
    let noise = Noise { sigma_px: known.sigma_px, freedom: known.degrees_of_freedom };
    let conditions = noise.conditions(arguments);
    each(ends, |pixels| length_in_view(&plane, pixels, &conditions).map_err(|error| error.to_string()))
}

fn measured_on_map(
    arguments: &Arguments,
    map: &PlaneCalibration,
    ends: Vec<PixelEnds>,
) -> Result<Vec<Measured>, String> {
    let file = arguments.result.display();
    if arguments.view.is_some() || arguments.pose.is_some() {
        return Err(format!("{file} is the map of one plane: --view and --pose are for a camera's result"));
    }
    let noise = Noise::of_map(map).ok_or_else(|| {
        format!("{file}: the map has as many parameters as numbers: nothing tells its uncertainty")
    })?;
    let (unit, conditions) = (arguments.spacing.unwrap_or(1.0), noise.conditions(arguments));
    each(ends, |pixels| length_on_map(map, unit, pixels, &conditions).map_err(|error| error.to_string()))
}

/// The pixels of the command line, numbered, then those of the file.
fn ends(arguments: &Arguments) -> Result<Vec<PixelEnds>, String> {
    let of_line = arguments.pixels.iter().zip(1..).map(|(p, number)| PixelEnds {
        name: number.to_string(),
        pixels: [Vec2::new(p[0], p[1]), Vec2::new(p[2], p[3])],
    });
    let mut ends: Vec<PixelEnds> = of_line.collect();
    if let Some(file) = &arguments.ends {
        ends.extend(read_pixel_ends(file).map_err(|error| error.to_string())?);
    }
    if ends.is_empty() {
        return Err("give the ends of a length: --pixels U1,V1,U2,V2, or a file with --ends".into());
    }
    Ok(ends)
}

fn each(
    ends: Vec<PixelEnds>,
    length: impl Fn(&[Vec2; 2]) -> Result<Length, String>,
) -> Result<Vec<Measured>, String> {
    let measure = |PixelEnds { name, pixels }: PixelEnds| {
        let length = length(&pixels).map_err(|error| format!("length {name}: {error}"))?;
        if !(length.value.is_finite() && length.standard_uncertainty().is_finite()) {
            return Err(format!(
                "length {name}: it or its uncertainty is beyond all numbers: look at the pose and the deviations"
            ));
        }
        Ok(Measured { name, pixels, length })
    };
    ends.into_iter().map(measure).collect()
}

/// Nothing was calibrated beyond the image.
fn refuse_outside(known: &KnownCalibration, ends: &[PixelEnds]) -> Result<(), String> {
    let Some((width, height)) = known.image_size else { return Ok(()) };
    let within = |x: f64, side: usize| (-0.5..=side as f64 - 0.5).contains(&x);
    let outside = ends.iter().find_map(|ends| {
        let pixel = ends.pixels.iter().find(|p| !(within(p.x, width) && within(p.y, height)))?;
        Some((&ends.name, pixel))
    });
    match outside {
        None => Ok(()),
        Some((name, p)) => Err(format!(
            "length {name}: pixel ({}, {}) lies outside the image of {width} x {height} px",
            p.x, p.y
        )),
    }
}

/// The plane: a view of the calibration, or a pose.
fn plane(arguments: &Arguments, known: &KnownCalibration, camera: &Camera) -> Result<PlaneView, String> {
    if let Some(p) = arguments.pose {
        let pose = Pose {
            rotation: rotation::exp(&Vec3::new(p[0], p[1], p[2])),
            translation: Vec3::new(p[3], p[4], p[5]),
        };
        let deviations = arguments.pose_sd.unwrap_or_else(Numbers::zeros);
        return Ok(PlaneView::with_pose(camera, &pose, &known.covariance, deviations.into()));
    }
    let names = || known.views.join(", ");
    let name = arguments
        .view
        .as_ref()
        .ok_or_else(|| format!("which plane? Give --view, one of {}, or --pose", names()))?;
    let index = known
        .views
        .iter()
        .position(|view| view == name)
        .ok_or_else(|| format!("no view `{name}`; there are: {}", names()))?;
    PlaneView::of_view(camera, &known.cam_from_target, &known.covariance, index)
        .map_err(|error| error.to_string())
}

/// The noise of a calibration's marks.
struct Noise {
    sigma_px: f64,
    freedom: usize,
}

impl Noise {
    /// Of a map, from world units to pixels at the middle of its points.
    fn of_map(map: &PlaneCalibration) -> Option<Noise> {
        let per_px = (map.scale_x * map.scale_y).sqrt();
        Some(Noise { sigma_px: map.spread.as_ref()?.sigma / per_px, freedom: map.degrees_of_freedom })
    }

    fn conditions(&self, arguments: &Arguments) -> Conditions {
        Conditions {
            noise_freedom: Some(self.freedom),
            mark_is_noise: arguments.mark_sd.is_none(),
            model_px: arguments.model_sd,
            scale: arguments.scale_sd,
            flatness: arguments.flatness,
            temperature_k: arguments.temperature_sd.unwrap_or(0.0),
            // Either way it makes as much of a length's variance.
            expansion_per_k: arguments.expansion.unwrap_or(0.0).abs(),
            ..Conditions::marks(arguments.mark_sd.unwrap_or(self.sigma_px))
        }
    }
}

/// Probability that the second interval contains the length.
const COVERAGE: f64 = 0.95;
/// The factor of the expanded uncertainty.
const EXPANDED: f64 = 2.0;

/// What is said of a length beside its value.
struct Statement {
    standard: f64,
    expanded: f64,
    freedom: Option<f64>,
    /// Half the width of the interval of 95 %.
    half_width: f64,
}

impl Statement {
    fn of(length: &Length) -> Statement {
        let standard = length.standard_uncertainty();
        Statement {
            standard,
            expanded: EXPANDED * standard,
            freedom: length.effective_freedom(),
            half_width: length.coverage_factor(COVERAGE) * standard,
        }
    }
}

/// Decimals that show two significant digits of an uncertainty (JCGM 100:2008, 7.2.6).
fn decimals(uncertainty: f64) -> usize {
    if !(uncertainty > 0.0 && uncertainty.is_finite()) {
        return 6;
    }
    let exponent = libm::floor(libm::log10(uncertainty)) as i32;
    (1 - exponent).clamp(0, 12) as usize
}

fn measured_text(measured: &[Measured]) -> String {
    measured.iter().map(length_text).collect::<Vec<_>>().join("\n")
}

fn length_text(m: &Measured) -> String {
    let said = Statement::of(&m.length);
    let n = decimals(said.standard);
    let shown = |x: f64| format!("{x:.n$}");
    let freedom =
        said.freedom.map_or(String::new(), |nu| format!(" on {nu:.0} effective degrees of freedom"));
    let mut rows = table(&["cause", "standard uncertainty", "share of the variance"]);
    for (cause, variance) in shown_causes(&m.length) {
        let share = 100.0 * variance / (said.standard * said.standard);
        let size = if variance < 0.0 { "-".into() } else { significant(variance.sqrt(), 2) };
        rows.add_row([cause.to_string(), size, format!("{share:.1} %")]);
    }
    let mut text = format!(
        "length {}: {} +- {} (expanded uncertainty, k = 2)\n",
        m.name,
        shown(m.length.value),
        shown(said.expanded)
    );
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "standard uncertainty {}; interval of 95 %{freedom}: +- {}\n\n{}",
        shown(said.standard),
        shown(said.half_width),
        rows.trim_fmt()
    );
    text
}

/// The budget for people: what camera and pose come to together, before what each contributes, which is often
/// far more.
fn shown_causes(length: &Length) -> Vec<(&'static str, f64)> {
    let of_calibration = |cause| matches!(cause, Cause::Camera | Cause::Pose | Cause::CameraWithPose);
    let together = length.budget.iter().filter(|c| of_calibration(c.cause)).map(|c| c.variance).sum();
    let label = |cause: Cause| match cause {
        Cause::Camera => "- of it the camera",
        Cause::Pose => "- of it the pose",
        Cause::CameraWithPose => "- of it their correlation",
        Cause::BoardScale => "board scale",
        other => other.name(),
    };
    let mut rows = Vec::new();
    for c in length.budget.iter().filter(|c| c.variance != 0.0) {
        if c.cause == Cause::Camera {
            rows.push(("camera and pose", together));
        }
        rows.push((label(c.cause), c.variance));
    }
    rows
}

fn measured_json(arguments: &Arguments, measured: &[Measured]) -> Value {
    json!({
        "written_by": written_by(),
        "result": arguments.result.display().to_string(),
        "view": arguments.view,
        "lengths": measured.iter().map(length_json).collect::<Vec<_>>(),
    })
}

fn length_json(m: &Measured) -> Value {
    let said = Statement::of(&m.length);
    let pairs = |points: &[Vec2; 2]| points.iter().map(|p| [p.x, p.y]).collect::<Vec<_>>();
    json!({
        "length": m.name,
        "pixels": pairs(&m.pixels),
        "ends": pairs(&m.length.ends),
        "value": m.length.value,
        "standard_uncertainty": said.standard,
        "expanded_uncertainty": said.expanded,
        "coverage_factor": EXPANDED,
        "effective_degrees_of_freedom": said.freedom,
        "interval": { "coverage": COVERAGE, "half_width": said.half_width },
        "budget": m.length.budget.iter().map(|c| json!({
            "cause": c.cause.name(), "variance": c.variance,
        })).collect::<Vec<_>>(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_uncertainty_is_shown_with_two_digits_and_the_value_with_as_many_decimals() {
        for (uncertainty, places) in [(0.0123, 3), (0.5, 2), (1.7, 1), (25.0, 0), (3000.0, 0), (0.0, 6)] {
            assert_eq!(decimals(uncertainty), places, "{uncertainty}");
        }
    }
}
