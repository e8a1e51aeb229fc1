//! `calibench calibrate`: a camera from a corner file or from photographs, or a plane map from a file of point pairs.

use super::report::table;
use super::{Exit, print, warn};
use calibench::calibrate::Loss;
use calibench::camera::{FreeParameters, Parameter};
use calibench::io::read_corners;
use calibench::photos::BoardSpec;
use calibench::planar::PlaneModel;
use camera::Observed;
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};

mod advice;
mod camera;
mod finished;
mod maps;
mod page;
mod photographs;
mod plane;
mod plots;

pub(super) use plane::plane_text;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Corner file with the columns view,point,X,Y,u,v, or point pairs with point,px,py,X,Y; with --board, photographs
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// The board in the photographs: chess:9x6:25mm (inner corners), circles:9x7:10mm:3mm (spacing, diameter) or dots:3x3:1
    #[arg(long, value_name = "BOARD")]
    board: Option<BoardSpec>,
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
    /// Leaves out views whose RMSE exceeds FACTOR times the median, worst first, such as 3
    #[arg(long, value_name = "FACTOR", value_parser = parse_factor)]
    reject_views: Option<f64>,
    /// Map of a plane from point pairs
    #[arg(long, value_enum, default_value_t = Mode::Planar)]
    mode: Mode,
    /// Folder for result.json, the page report.html, plots, and the photographs with their marks drawn in
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
        name.trim().parse().map_err(|e: calibench::camera::UnknownParameter| e.to_string())?;
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

fn parse_factor(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(factor) if factor > 1.0 && f64::is_finite(factor) => Ok(factor),
        _ => Err("expected a factor above 1, such as 3".to_string()),
    }
}

pub(super) fn run(arguments: &Arguments) -> Exit {
    let outcome = match (&arguments.board, &arguments.files[..]) {
        (Some(board), photos) => photographs::run(arguments, board, photos),
        (None, [file]) => match has_views(file) {
            Ok(true) => corners(arguments, file),
            Ok(false) => plane::run(arguments, file),
            Err(message) => Err(message),
        },
        (None, files) => Err(format!(
            "{} files but no --board: give one CSV file, or the board that the photographs show",
            files.len()
        )),
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

fn corners(arguments: &Arguments, file: &Path) -> Result<Exit, String> {
    let corners = read_corners(file).map_err(|error| error.to_string())?;
    let observed = Observed {
        source: file.display().to_string(),
        names: corners.view_names,
        views: corners.views,
        image_size: arguments.image_size,
        ..Observed::default()
    };
    camera::run(arguments, observed)
}
