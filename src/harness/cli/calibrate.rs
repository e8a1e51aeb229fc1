//! `calibench calibrate FILE.csv`: a camera from a corner file, or a plane map from a file of point pairs.

use super::report::table;
use super::{Exit, print, warn};
use crate::calibrate::{self as solver, Calibration, Loss, Settings, Termination};
use crate::camera::{FreeParameters, Parameter};
use crate::harness::significant;
use crate::io::{
    CalibrationFields, CornerFile, PointPairs, read_corners, read_point_pairs, write_atomically,
};
use crate::planar::{PlaneCalibration, PlaneModel, calibrate_plane};
use clap::{Args, ValueEnum};
use std::fmt::Write;
use std::path::{Path, PathBuf};

mod plots;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Corner file with the columns view,point,X,Y,u,v, or point pairs with point,px,py,X,Y
    file: PathBuf,
    /// Parameters to estimate, of fx fy cx cy skew k1 k2 p1 p2 k3; the others are held, distortion and skew at 0
    #[arg(long, value_name = "LIST", default_value = "fx,fy,cx,cy,k1,k2")]
    free: FreeParameters,
    /// Holds a parameter at a value, such as k3=0; may be repeated
    #[arg(long, value_name = "NAME=VALUE", value_parser = parse_held)]
    fix: Vec<(Parameter, f64)>,
    /// Image size, such as 640x480: where a held principal point lies by default, and the frame of the plots
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    image_size: Option<(usize, usize)>,
    /// Loss of a residual: squares, huber:PX or cauchy:PX
    #[arg(long, value_name = "LOSS", default_value = "squares", value_parser = parse_loss)]
    loss: Loss,
    /// Map of a plane from point pairs
    #[arg(long, value_enum, default_value_t = Mode::Planar)]
    mode: Mode,
    /// Folder for result.json and plots
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Format {
    Text,
    Json,
}

/// The three maps of a plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Mode {
    /// Affine, six parameters.
    Planar,
    /// Projective, eight parameters.
    Tilted,
    /// Rotation, scale and shift, four parameters.
    Similarity,
}

impl Mode {
    /// Its word on the command line.
    pub(super) fn name(self) -> &'static str {
        match self {
            Mode::Planar => "planar",
            Mode::Tilted => "tilted",
            Mode::Similarity => "similarity",
        }
    }
}

impl From<Mode> for PlaneModel {
    fn from(mode: Mode) -> PlaneModel {
        match mode {
            Mode::Planar => PlaneModel::Affine,
            Mode::Tilted => PlaneModel::Projective,
            Mode::Similarity => PlaneModel::Similarity,
        }
    }
}

fn parse_held(text: &str) -> Result<(Parameter, f64), String> {
    let (name, value) = text.split_once('=').ok_or("expected NAME=VALUE, such as k3=0")?;
    let parameter: Parameter =
        name.trim().parse().map_err(|e: crate::camera::UnknownParameter| e.to_string())?;
    let value = value.trim().parse::<f64>().map_err(|_| format!("`{value}` is not a number"))?;
    Ok((parameter, value))
}

fn parse_size(text: &str) -> Result<(usize, usize), String> {
    let wanted = || "expected WIDTHxHEIGHT in pixels, such as 640x480".to_string();
    let (width, height) = text.split_once('x').ok_or_else(wanted)?;
    match (width.trim().parse(), height.trim().parse()) {
        (Ok(width), Ok(height)) if width > 0 && height > 0 => Ok((width, height)),
        _ => Err(wanted()),
    }
}

fn parse_loss(text: &str) -> Result<Loss, String> {
    let wanted = || "expected squares, huber:PX or cauchy:PX, such as huber:0.5".to_string();
    let loss = match text.split_once(':') {
        None if text == "squares" => Loss::Squares,
        Some(("huber", px)) => Loss::Huber { delta_px: px.parse().map_err(|_| wanted())? },
        Some(("cauchy", px)) => Loss::Cauchy { scale_px: px.parse().map_err(|_| wanted())? },
        _ => return Err(wanted()),
    };
    if loss.is_valid() { Ok(loss) } else { Err(wanted()) }
}

pub(super) fn run(arguments: &Arguments) -> Exit {
    let outcome = match has_views(&arguments.file) {
        Ok(true) => camera(arguments),
        Ok(false) => plane(arguments),
        Err(message) => Err(message),
    };
    outcome.unwrap_or_else(|message| {
        warn(&message);
        Exit::Usage
    })
}

/// Point pairs are told from corners by their header.
fn has_views(path: &Path) -> Result<bool, String> {
    let bytes = std::fs::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let header =
        String::from_utf8_lossy(bytes.split(|b| *b == b'\n').next().unwrap_or_default()).into_owned();
    Ok(!header.split(',').any(|column| column.trim() == "px"))
}

fn camera(arguments: &Arguments) -> Result<Exit, String> {
    let corners = read_corners(&arguments.file).map_err(|error| error.to_string())?;
    let mut settings = Settings::new(arguments.free).with_loss(arguments.loss);
    settings.image_size = arguments.image_size;
    for &(parameter, value) in &arguments.fix {
        settings = settings.hold(parameter, value);
    }
    let calibration = solver::calibrate(&corners.views, &settings)
        .map_err(|error| format!("{}: {error}", arguments.file.display()))?;
    let fields = CalibrationFields::of(&calibration, &corners.view_names, arguments.image_size);
    if let Some(folder) = &arguments.out {
        write_result(folder, &fields, &calibration, &corners).map_err(|error| error.to_string())?;
    }
    match arguments.format {
        Format::Json => print(&fields.to_json()),
        Format::Text => print(&camera_text(&calibration, &corners)),
    }
    Ok(if calibration.termination == Termination::Converged { Exit::Held } else { Exit::Incomplete })
}

fn write_result(
    folder: &Path,
    fields: &CalibrationFields,
    calibration: &Calibration,
    corners: &CornerFile,
) -> std::io::Result<()> {
    write_atomically(&folder.join("result.json"), fields.to_json().as_bytes())?;
    for figure in plots::figures(calibration, corners, fields.image_size) {
        write_atomically(&folder.join(figure.file_name()), &figure.bytes)?;
    }
    Ok(())
}

fn camera_text(calibration: &Calibration, corners: &CornerFile) -> String {
    let mut parameters = table(&["parameter", "value", "standard deviation", "unit"]);
    for parameter in Parameter::ALL {
        let deviation = match calibration.standard_deviation(parameter) {
            Some(sd) => significant(sd, 3),
            None if calibration.camera.get(parameter) == 0.0 => continue,
            None => "held".to_string(),
        };
        let value = significant(calibration.camera.get(parameter), 10);
        parameters.add_row([parameter.name().to_string(), value, deviation, parameter.unit().to_string()]);
    }
    let mut views = table(&["view", "points", "RMSE (px)", "distance"]);
    for (i, name) in corners.view_names.iter().enumerate() {
        let rmse = calibration.view_rmse_px(i).unwrap_or(f64::NAN);
        let distance = calibration.cam_from_target[i].translation.z;
        let points = calibration.residuals[i].len().to_string();
        views.add_row([name.clone(), points, significant(rmse, 4), significant(distance, 5)]);
    }
    let mut text = format!("{parameters}\n\n{views}\n\n");
    let axes = calibration.rms_per_axis_px();
    // Writing to a string cannot fail.
    let _ = write!(
        text,
        "RMSE {} px over {} points (u {}, v {}); noise of a coordinate {} px on {} degrees of freedom\n{} after {} steps\n",
        significant(calibration.rmse_px, 7),
        calibration.points(),
        significant(axes.x, 4),
        significant(axes.y, 4),
        significant(calibration.sigma_px, 4),
        calibration.degrees_of_freedom,
        calibration.termination.name(),
        calibration.iterations,
    );
    if let Some(conditioning) = &calibration.conditioning {
        let members: Vec<String> =
            conditioning.weakest.iter().map(|m| format!("{} {:+.2}", m.name, m.weight)).collect();
        let _ = writeln!(text, "weakest direction: {}", members.join(", "));
    }
    for warning in &calibration.warnings {
        let _ = writeln!(text, "warning: {warning}");
    }
    text
}

fn plane(arguments: &Arguments) -> Result<Exit, String> {
    let PointPairs { pixels, world, .. } =
        read_point_pairs(&arguments.file).map_err(|error| error.to_string())?;
    let result = calibrate_plane(arguments.mode.into(), &pixels, &world)
        .map_err(|error| format!("{}: {error}", arguments.file.display()))?;
    let json = plane_json(&result);
    if let Some(folder) = &arguments.out {
        write_atomically(&folder.join("result.json"), json.as_bytes()).map_err(|error| error.to_string())?;
    }
    match arguments.format {
        Format::Json => print(&json),
        Format::Text => print(&plane_text(&result)),
    }
    Ok(Exit::Held)
}

fn plane_json(result: &PlaneCalibration) -> String {
    let m = result.map.matrix();
    let value = serde_json::json!({
        "matrix": (0..3).map(|i| (0..3).map(|j| m[(i, j)]).collect::<Vec<f64>>()).collect::<Vec<_>>(),
        "scale_x": result.scale_x,
        "scale_y": result.scale_y,
        "rms_point": result.rms_point,
        "max_point": result.max_point,
        "degrees_of_freedom": result.degrees_of_freedom,
        "residuals": result.residuals.iter().map(|r| [r.x, r.y]).collect::<Vec<_>>(),
    });
    format!("{value:#}\n")
}

pub(super) fn plane_text(result: &PlaneCalibration) -> String {
    let m = result.map.matrix();
    let mut rows = table(&["world from pixel", "", ""]);
    for i in 0..3 {
        rows.add_row([0, 1, 2].map(|j| significant(m[(i, j)], 15)));
    }
    format!(
        "{rows}\n\nscales {} and {} world units per px; residual RMS {} per point, largest {}, {} degrees of freedom\n",
        significant(result.scale_x, 8),
        significant(result.scale_y, 8),
        significant(result.rms_point, 9),
        significant(result.max_point, 9),
        result.degrees_of_freedom,
    )
}
