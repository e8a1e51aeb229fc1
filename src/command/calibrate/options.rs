//! What can be asked of a calibration?

use super::super::board::board_or_file;
use super::super::format::Format;
use super::super::said::{self, ratio};
use calibench::calibrate::{Board, CalibrationError, Loss, Prior, Settings};
use calibench::camera::{FreeParameters, Model, Parameter, UnknownModel};
use calibench::io::input::MOST_SIDE_PX;
use calibench::io::memory::{DEFAULT_MEMORY, parse_bytes};
use calibench::io::{implausible_value, loss_from_text};
use calibench::photos::BoardSpec;
use calibench::planar::PlaneModel;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// What the exit codes mean here.
const EXIT_CODES: &str = "\
Exit codes:
  0  calibrated: a minimum whose RMSE lies at most a quarter above that of free homographies; with another lens
     model than brown-conrady any minimum, which nothing certifies; read the warnings
  2  wrong usage, or data that do not determine the camera: there is no result
  3  do not use the result, if one is printed: no minimum, or with brown-conrady one far above free homographies;
     or files or standard output that could not be written, or interrupted
Code 1 is of other verbs.";

#[derive(Debug, Args)]
#[command(after_help = EXIT_CODES)]
pub(in super::super) struct Arguments {
    /// Corner file with the columns view,point,X,Y,u,v (and weight, by which a mark's residual is multiplied,
    /// or its sigma_px, if marks differ), or point pairs with point,px,py,X,Y, or - for one of them on
    /// standard input; with --board, photographs
    #[arg(required = true)]
    pub(super) files: Vec<PathBuf>,
    /// The board in the photographs: chess:9x6:25mm (inner corners), circles:9x7:10mm:3mm (spacing,
    /// diameter), asymmetric:4x11:20mm:15mm (distance of rows, half that of a row's discs; OpenCV's
    /// asymmetric grid), hexagonal:9x9:10mm:5mm, dots:3x3:1, charuco:7x5:30mm:22mm:DICT_4X4_50 (squares,
    /// their side, that of a marker; OpenCV's dictionaries) or aprilgrid:6x6:88mm:0.3 (Kalibr's tagCols,
    /// tagRows, tagSize, tagSpacing); or the board.toml beside a page that `calibench board` drew
    #[arg(long, value_name = "BOARD", value_parser = board_or_file)]
    pub(super) board: Option<BoardSpec>,
    /// Where the marks of a corner file are, measured in space: a file with the columns point,X,Y,Z and their
    /// standard deviation sd, or sdX,sdY,sdZ; without them marks are exact. The corner file then needs
    /// view,point,u,v only
    #[arg(long, value_name = "FILE")]
    pub(super) target: Option<PathBuf>,
    /// With --target: the noise of a pixel coordinate, px, where it is known (of a mark of weight 1; 1 takes
    /// a column sigma_px at its word) [default: estimated from the residuals]
    #[arg(long, value_name = "PX", value_parser = said::noise_px)]
    pub(super) sigma: Option<f64>,
    /// Lens model: brown-conrady, rational, thin-prism, tilted, kannala-brandt, division, double-sphere or
    /// halcon-polynomial; auto compares eight (tilted, thin-prism and halcon-polynomial are not among them)
    /// by Schwarz's criterion, and by how they predict views that were left out where it is undecided
    /// [default: brown-conrady]
    #[arg(long, value_name = "MODEL")]
    pub(super) model: Option<ModelChoice>,
    /// Estimates how the board is bent, each number known beforehand to be 0 with a standard deviation in the
    /// target's unit, or free: bow:SD (two bows), bow:free, bent:SD (with a twist), bent:free. A mark lies
    /// bow_x (1 - x^2) + bow_y (1 - y^2) + twist x y towards the target's +Z, x and y from -1 to 1 over all
    /// marks; nothing certifies the minimum then
    #[arg(long = "board-shape", value_name = "SHAPE", value_parser = parse_shape)]
    pub(super) bow: Option<Board>,
    /// Parameters to estimate, of fx fy cx cy skew k1 k2 p1 p2 k3 and those of other lens models; the others
    /// are held, distortion and skew at 0 [default: fx,fy,cx,cy,k1,k2, with other lens models all of their
    /// coefficients, and those of --prior, without those of --fix and --tie]
    #[arg(long, value_name = "LIST")]
    pub(super) free: Option<FreeParameters>,
    /// Holds a parameter at a value, such as k3=0; may be repeated
    #[arg(long, value_name = "NAME=VALUE", value_parser = parse_held)]
    pub(super) fix: Vec<(Parameter, f64)>,
    /// Ties the focal lengths: fy=fx for square pixels, fy/fx=1.02 for others
    #[arg(long, value_name = "fy=fx", value_parser = parse_tie)]
    pub(super) tie: Option<f64>,
    /// What is known of a parameter beforehand, value and standard deviation, such as k1=-0.2+-0.01: one more
    /// measurement; may be repeated
    #[arg(long, value_name = "NAME=VALUE+-SD", value_parser = parse_prior)]
    pub(super) prior: Vec<Prior>,
    /// Image size, such as 640x480: where a held principal point lies by default, and the frame of the plots
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub(super) image_size: Option<(usize, usize)>,
    /// Distance of the sensor's pixels, micrometres: says the focal length in mm too
    #[arg(long, value_name = "UM", value_parser = said::positive)]
    pub(super) pixel_pitch: Option<f64>,
    /// Loss of a residual: squares, huber:PX or cauchy:PX; of marks with weights PX is one of weight times
    /// residual, with sigma_px a multiple of it [default: squares]
    #[arg(long, value_name = "LOSS", value_parser = parse_loss)]
    pub(super) loss: Option<Loss>,
    /// Leaves out views whose RMSE exceeds FACTOR times the median, worst first, such as 3
    #[arg(long, value_name = "FACTOR", value_parser = parse_factor)]
    pub(super) reject_views: Option<f64>,
    /// Intervals of 95 % beside the standard deviations: by the profile of the cost, which holds where the
    /// data are weak [default: linear]
    #[arg(long, value_enum)]
    pub(super) intervals: Option<Intervals>,
    /// Map of a plane from point pairs [default: planar]
    #[arg(long, value_enum)]
    pub(super) mode: Option<Mode>,
    /// Memory that photographs may take together, such as 500MB or 2GiB; large ones then come one at a time
    /// [default: 2GiB]
    #[arg(long, value_name = "BYTES", value_parser = parse_bytes)]
    pub(super) memory: Option<u64>,
    /// Folder for result.json, the page report.html, plots, and of photographs corners.csv, with the marks as
    /// they were fitted, pictures with the marks drawn in, and one photograph before and after undistortion
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub(super) format: Format,
}

/// Coverage of the intervals: what a certificate of measurement states.
const COVERAGE: f64 = 0.95;

impl Arguments {
    /// Memory that photographs may take together.
    pub(super) fn memory(&self) -> u64 {
        self.memory.unwrap_or(DEFAULT_MEMORY)
    }

    /// What is estimated and how; with `--model auto` before a model is chosen.
    pub(super) fn settings(&self, image_size: Option<(usize, usize)>) -> Settings {
        let model = match self.model {
            Some(ModelChoice::Of(model)) => model,
            Some(ModelChoice::Auto) | None => Model::default(),
        };
        let free = self.free.unwrap_or(model.standard_free());
        let mut settings =
            Settings::new(free).with_model(model).with_loss(self.loss.unwrap_or(Loss::Squares));
        settings.board = self.bow.unwrap_or_default();
        settings.image_size = image_size;
        if self.intervals == Some(Intervals::Profile) {
            settings = settings.with_profile_intervals(COVERAGE);
        }
        for &(parameter, value) in &self.fix {
            settings = settings.hold(parameter, value);
        }
        for &Prior { parameter, mean, standard_deviation } in &self.prior {
            settings = settings.with_prior(parameter, mean, standard_deviation);
        }
        match self.tie {
            Some(ratio) => settings.tie_focal_lengths(ratio),
            None => settings,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Intervals {
    /// Standard deviations only.
    Linear,
    /// Profile intervals too.
    Profile,
}

/// A lens model, or the best.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in super::super) enum ModelChoice {
    Auto,
    Of(Model),
}

impl std::str::FromStr for ModelChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<ModelChoice, String> {
        match text {
            "auto" => Ok(ModelChoice::Auto),
            name => {
                name.parse().map(ModelChoice::Of).map_err(|error: UnknownModel| format!("{error}, or auto"))
            }
        }
    }
}

/// The three maps of a plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(in super::super) enum Mode {
    /// Affine, six parameters.
    Planar,
    /// Projective, eight parameters.
    Tilted,
    /// Rotation, scale and shift, four parameters.
    Similarity,
}

impl Mode {
    /// Its word on the command line.
    pub(in super::super) fn name(self) -> &'static str {
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
    implausible_value(parameter, value).map_or(Ok((parameter, value)), Err)
}

/// `bow:SD` or `bent:SD`, the standard deviation being a positive number or `free`.
fn parse_shape(text: &str) -> Result<Board, String> {
    let wanted = || "expected bow:SD or bent:SD, such as bow:0.5 or bent:free".to_string();
    let (shape, known) = text.split_once(':').ok_or_else(wanted)?;
    let standard_deviation = match known {
        "free" => f64::INFINITY,
        number => number.parse().ok().filter(|sd: &f64| *sd > 0.0 && sd.is_finite()).ok_or_else(wanted)?,
    };
    match shape {
        "bow" => Ok(Board::Bowed { standard_deviation }),
        "bent" => Ok(Board::Bent { standard_deviation }),
        _ => Err(wanted()),
    }
}

/// `fy=fx` or `fy/fx=RATIO`: no sign in it means anything to a shell.
fn parse_tie(text: &str) -> Result<f64, String> {
    let wanted = || "expected fy=fx, or a ratio from 0.01 to 100 such as fy/fx=1.02".to_string();
    let (what, value) = text.split_once('=').ok_or_else(wanted)?;
    match (what.trim(), value.trim()) {
        ("fy", "fx") => Ok(1.0),
        ("fy/fx", number) => ratio(number).map_err(|_| wanted()),
        _ => Err(wanted()),
    }
}

fn parse_prior(text: &str) -> Result<Prior, String> {
    let wanted = || "expected NAME=VALUE+-SD, such as k1=-0.2+-0.01".to_string();
    let (name, value) = text.split_once('=').ok_or_else(wanted)?;
    let parameter: Parameter =
        name.trim().parse().map_err(|e: calibench::camera::UnknownParameter| e.to_string())?;
    let (mean, deviation) = value.split_once("+-").ok_or_else(wanted)?;
    let number = |text: &str| text.trim().parse::<f64>().map_err(|_| format!("`{text}` is not a number"));
    let prior = Prior { parameter, mean: number(mean)?, standard_deviation: number(deviation)? };
    implausible_value(parameter, prior.mean).map_or(Ok(prior), Err)
}

pub(in super::super) fn parse_size(text: &str) -> Result<(usize, usize), String> {
    let wanted = || "expected WIDTHxHEIGHT in pixels, such as 640x480".to_string();
    let (width, height) = text.split_once('x').ok_or_else(wanted)?;
    match (width.trim().parse::<usize>(), height.trim().parse::<usize>()) {
        (Ok(width), Ok(height)) if width.min(height) > 0 && width.max(height) <= MOST_SIDE_PX => {
            Ok((width, height))
        }
        (Ok(_), Ok(_)) => Err(format!("each side must have 1 to {MOST_SIDE_PX} px")),
        _ => Err(wanted()),
    }
}

fn parse_loss(text: &str) -> Result<Loss, String> {
    let wanted = "expected squares, huber:PX or cauchy:PX, such as huber:0.5; ";
    loss_from_text(text).ok_or_else(|| format!("{wanted}{}", CalibrationError::BadLoss))
}

fn parse_factor(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(factor) if factor > 1.0 && f64::is_finite(factor) => Ok(factor),
        _ => Err("expected a factor above 1, such as 3".to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn priors_and_ties_are_read_with_their_signs() {
        let prior = parse_prior("k1=-0.2+-1e-2").unwrap();
        assert_eq!((prior.parameter, prior.mean, prior.standard_deviation), (Parameter::K1, -0.2, 0.01));
        for broken in ["k1=-0.2", "k1", "k9=0+-1", "k1=a+-1", "k1=1+-"] {
            assert!(parse_prior(broken).is_err(), "{broken}");
        }
        assert_eq!((parse_tie("fy=fx"), parse_tie("fy/fx=1.02")), (Ok(1.0), Ok(1.02)));
        for broken in ["fx=fy", "fy", "fy/fx=0", "fy/fx=nan", "fy/fx=inf", "k1=k2"] {
            assert!(parse_tie(broken).is_err(), "{broken}");
        }
    }
}
