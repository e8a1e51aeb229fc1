//! `calibench register TAUGHT.csv FOUND.csv`: where a part has moved to, and how well any point of it is
//! known.

use super::format::Format;
use super::report::table;
use super::said::{MOST, Said, say, written_by};
use super::{Exit, warn};
use calibench::calibrate::Loss;
use calibench::downstream::{MapModel, Mark, Registration, coverage_factor, register};
use calibench::geometry::Vec2;
use calibench::io::shown::on_one_line;
use calibench::io::{MarkFile, ShownPath, loss_from_text, read_marks, significant};
use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Marks of the taught part: point,X,Y and, if known, sd or sd_X,sd_Y
    taught: PathBuf,
    /// Marks of the found part, in the same unit; they are paired by name
    found: PathBuf,
    /// Map: rigid (turned and shifted), similarity (scaled too) or affine
    #[arg(long, value_enum, default_value_t = Model::Rigid)]
    model: Model,
    /// A taught point whose found position is wanted, such as 12.5,40; may be repeated
    #[arg(long, value_name = "X,Y", value_parser = parse_point)]
    at: Vec<Vec2>,
    /// Loss of a residual: squares, huber:D or cauchy:D, with D in standard deviations where the files give
    /// them, otherwise in their unit
    #[arg(long, value_name = "LOSS", value_parser = parse_loss, default_value = "squares")]
    loss: Loss,
    /// Folder for registration.json
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Model {
    Rigid,
    Similarity,
    Affine,
}

impl Model {
    fn name(self) -> &'static str {
        match self {
            Model::Rigid => "rigid",
            Model::Similarity => "similarity",
            Model::Affine => "affine",
        }
    }
}

impl From<Model> for MapModel {
    fn from(model: Model) -> MapModel {
        match model {
            Model::Rigid => MapModel::Rigid,
            Model::Similarity => MapModel::Similarity,
            Model::Affine => MapModel::Affine,
        }
    }
}

fn parse_point(text: &str) -> Result<Vec2, String> {
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.abs() <= MOST);
    let (x, y) = text.split_once(',').ok_or("expected X,Y, such as 12.5,40")?;
    match (number(x), number(y)) {
        (Some(x), Some(y)) => Ok(Vec2::new(x, y)),
        _ => Err("expected two numbers of at most 1e30, such as 12.5,40".into()),
    }
}

fn parse_loss(text: &str) -> Result<Loss, String> {
    loss_from_text(text).ok_or_else(|| "expected squares, huber:D or cauchy:D, such as huber:2".into())
}

pub(super) fn run(arguments: &Arguments) -> Exit {
    let registered = registered(arguments);
    if let Some(doubt) = registered.as_ref().ok().and_then(Registered::doubt) {
        warn(&doubt);
    }
    let said = registered.map(|map| Said { text: map.text(arguments), json: map.json(arguments) });
    say(said, arguments.out.as_deref(), "registration.json", arguments.format)
}

/// The map, and the marks that it rests on.
struct Registered {
    names: Vec<String>,
    /// Marks that stand in one of the files only.
    alone: Vec<String>,
    map: Registration,
}

fn registered(arguments: &Arguments) -> Result<Registered, String> {
    let read = |path: &Path| read_marks(path).map_err(|error| error.to_string());
    let (taught, found) = (read(&arguments.taught)?, read(&arguments.found)?);
    let (names, [taught_marks, found_marks]) = paired(&taught, &found);
    let shared: BTreeSet<&String> = names.iter().collect();
    let missing = |of: &MarkFile, path: &Path| -> Vec<String> {
        let only = of.names.iter().filter(|name| !shared.contains(name));
        only.map(|name| format!("{} of {}", on_one_line(name), path.shown())).collect()
    };
    let alone = [missing(&taught, &arguments.taught), missing(&found, &arguments.found)].concat();
    let map =
        register(arguments.model.into(), &taught_marks, &found_marks, arguments.loss).map_err(|error| {
            let hint = if alone.is_empty() {
                String::new()
            } else {
                format!("; without a partner: {}", alone.join(", "))
            };
            format!("{} and {}: {error}{hint}", arguments.taught.shown(), arguments.found.shown())
        })?;
    Ok(Registered { names, alone, map })
}

/// The marks of both files that share a name, in the order of the taught ones.
fn paired(taught: &MarkFile, found: &MarkFile) -> (Vec<String>, [Vec<Mark>; 2]) {
    let place: std::collections::BTreeMap<&String, usize> = found.names.iter().zip(0..).collect();
    let mut pairs = (Vec::new(), [Vec::new(), Vec::new()]);
    for (name, mark) in taught.names.iter().zip(&taught.marks) {
        if let Some(&other) = place.get(name) {
            pairs.0.push(name.clone());
            pairs.1[0].push(*mark);
            pairs.1[1].push(found.marks[other]);
        }
    }
    pairs
}

/// Part of all cases that an interval is to contain.
const COVERAGE: f64 = 0.95;

/// A taught point where it is found.
struct Position {
    taught: Vec2,
    found: Vec2,
    /// Standard deviations of x and y and their correlation.
    known: Option<([f64; 2], f64)>,
}

/// A deviation of the angle, degrees, from which positions beside the marks say nothing.
const UNTOLD_DEG: f64 = 5.0;

impl Registered {
    /// What is to be said where the marks do not tell the angle.
    fn doubt(&self) -> Option<String> {
        let deviation = self.map.angle_deviation_rad()?.to_degrees();
        (deviation > UNTOLD_DEG).then(|| {
            format!(
                "warning: the marks do not tell the angle (standard deviation {} degrees): have both files the same unit, and is each name the same mark in both?",
                significant(deviation, 2)
            )
        })
    }

    fn positions(&self, arguments: &Arguments) -> Vec<Position> {
        let centre = self.map.taught_centre;
        let position = |taught: &Vec2| Position {
            taught: *taught,
            found: self.map.apply(taught),
            known: self.map.covariance_at(taught).map(|c| {
                let deviations = [c[(0, 0)].sqrt(), c[(1, 1)].sqrt()];
                let product = deviations[0] * deviations[1];
                (deviations, if product > 0.0 { c[(0, 1)] / product } else { 0.0 })
            }),
        };
        std::iter::once(&centre).chain(&arguments.at).map(position).collect()
    }

    /// Factor of a standard deviation for an interval of 95 %.
    fn factor(&self) -> f64 {
        coverage_factor(COVERAGE, self.map.noise_freedom().map(|freedom| freedom as f64))
    }

    fn text(&self, arguments: &Arguments) -> String {
        let map = &self.map;
        let with = |deviation: Option<f64>| {
            deviation.map_or(String::new(), |d| format!(" +- {}", significant(d, 2)))
        };
        let angle = with(map.angle_deviation_rad().map(f64::to_degrees));
        let mut text = format!(
            "{} marks, {} map\nangle {:.6}{angle} degrees",
            self.names.len(),
            arguments.model.name(),
            map.angle_rad().to_degrees()
        );
        // Writing to a string cannot fail, here and below.
        if arguments.model != Model::Rigid {
            let _ = write!(text, "\nscale {:.8}{}", map.scale(), with(map.scale_deviation()));
        }
        let mut rows = table(&["taught", "found", "standard deviations", "correlation", ""]);
        for (i, p) in self.positions(arguments).iter().enumerate() {
            let pair = |p: &Vec2| format!("({:.4}, {:.4})", p.x, p.y);
            let (deviations, correlation) = match &p.known {
                Some(([x, y], c)) => {
                    (format!("{}, {}", significant(*x, 2), significant(*y, 2)), format!("{c:+.2}"))
                }
                None => ("unknown".into(), String::new()),
            };
            let what = if i == 0 { "mean of the marks" } else { "" };
            rows.add_row([pair(&p.taught), pair(&p.found), deviations, correlation, what.into()]);
        }
        let _ = writeln!(text, "\n\n{}\n", rows.trim_fmt());
        text += &self.noise_text();
        for (name, weight) in self.names.iter().zip(&map.weights).filter(|(_, weight)| **weight < 0.5) {
            let _ = writeln!(text, "mark {name} counts {:.0} % only: it lies astray", 100.0 * weight);
        }
        if !self.alone.is_empty() {
            let _ = writeln!(text, "left out, without a partner: {}", self.alone.join(", "));
        }
        text
    }

    fn noise_text(&self) -> String {
        let map = &self.map;
        let rms = significant(map.rms, 3);
        let of = format!("residual RMS {rms} per mark, {} degrees of freedom", map.degrees_of_freedom);
        let interval = format!("an interval of 95 % reaches {:.2} standard deviations", self.factor());
        match (map.deviations_given, map.sigma, map.p_value()) {
            (_, None, _) if !map.deviations_given => {
                format!("{of}: nothing tells the noise; give standard deviations or more marks\n")
            }
            (true, _, Some(p)) => {
                let doubt = if p < 1e-3 { ": more than the given standard deviations explain" } else { "" };
                let square = significant(map.chi_squared.unwrap_or(0.0), 3);
                format!("{of}, chi-squared {square} (p = {}){doubt}\n{interval}\n", significant(p, 2))
            }
            (false, Some(sigma), _) => {
                format!("{of}; noise of a coordinate {}, estimated\n{interval}\n", significant(sigma, 3))
            }
            _ => format!("{of}\n{interval}\n"),
        }
    }

    fn json(&self, arguments: &Arguments) -> Value {
        let map = &self.map;
        let m = map.matrix();
        let marks = self.names.iter().zip(&map.residuals).zip(&map.weights);
        json!({
            "written_by": written_by(),
            "taught": arguments.taught.display().to_string(),
            "found": arguments.found.display().to_string(),
            "model": arguments.model.name(),
            "matrix": (0..3).map(|i| (0..3).map(|j| m[(i, j)]).collect::<Vec<f64>>()).collect::<Vec<_>>(),
            "angle_rad": map.angle_rad(),
            "angle_standard_deviation_rad": map.angle_deviation_rad(),
            "scale": map.scale(),
            "scale_standard_deviation": map.scale_deviation(),
            "rms": map.rms,
            "sigma": map.sigma,
            "deviations_given": map.deviations_given,
            "chi_squared": map.chi_squared,
            "p_value": map.p_value(),
            "degrees_of_freedom": map.degrees_of_freedom,
            "coverage": COVERAGE,
            "coverage_factor": self.factor(),
            "positions": self.positions(arguments).iter().map(|p| json!({
                "taught": [p.taught.x, p.taught.y],
                "found": [p.found.x, p.found.y],
                "standard_deviations": p.known.map(|(deviations, _)| deviations),
                "correlation": p.known.map(|(_, correlation)| correlation),
            })).collect::<Vec<_>>(),
            "marks": marks.map(|((name, residual), weight)| json!({
                "point": name, "residual": [residual.x, residual.y], "weight": weight,
            })).collect::<Vec<_>>(),
            "left_out": self.alone,
        })
    }
}
