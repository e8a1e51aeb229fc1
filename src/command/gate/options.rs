//! Options that several ways of judging share, a group each.

use super::super::format::Format;
use super::super::said::{print_either, refuse_standard_output, unless_unwritten, whole};
use super::super::{Exit, program};
use super::{Stop, incomplete, usage};
use calibench::camera::Model;
use calibench::io::atomic::refuse_unwritable_place;
use calibench::io::{ShownPath, write_atomically};
use calibench_gate::{Allowance, Asked, EXPECTED_FALSE_ALARMS, Plan, PlanError, Property, Solver, Terms};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// How many problems.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Size {
    /// Every gross fault: of calibrations 128 samples a scene
    Quick,
    /// Small ones too: of calibrations 8192 samples a scene, for a bias of a tenth of a standard deviation or
    /// a variance 5 % too large
    Thorough,
}

#[derive(Debug, clap::Args)]
pub(super) struct Amount {
    /// Number of problems
    #[arg(long, value_enum, default_value_t = Size::Quick)]
    size: Size,
    /// Samples a scene, in place of --size
    #[arg(long, value_name = "N", conflicts_with = "size", value_parser = whole::<usize>)]
    samples: Option<usize>,
    /// Seed of the noise
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<u64>)]
    pub seed: u64,
}

impl Amount {
    /// Samples a scene, of a quick run and a thorough one as stated, and `most` at the most.
    pub fn samples(&self, [quick, thorough]: [usize; 2], most: usize) -> Result<usize, Stop> {
        let samples = self.samples.unwrap_or(match self.size {
            Size::Quick => quick,
            Size::Thorough => thorough,
        });
        match samples {
            0 => Err(usage("--samples must be at least 1")),
            _ if samples > most => {
                Err(usage(format!("{samples} samples a scene, and the limit is {most}: ask for fewer")))
            }
            _ => Ok(samples),
        }
    }
}

#[derive(Debug, clap::Args)]
pub(super) struct Problems {
    #[command(flatten)]
    amount: Amount,
    /// Lens models whose scenes are asked, such as brown-conrady,rational [default: those that the solver
    /// says it knows; brown-conrady of a program that says nothing, and in files]
    #[arg(long, value_name = "MODELS", value_delimiter = ',')]
    models: Vec<Model>,
    /// The only scene or bad input to ask, by its name in reports; may be repeated
    #[arg(long = "scene", value_name = "SCENE")]
    scenes: Vec<String>,
}

impl Problems {
    /// Refuses what can never be asked.
    pub fn check(&self) -> Result<(), Stop> {
        self.samples().map(drop)
    }

    fn samples(&self) -> Result<usize, Stop> {
        self.amount
            .samples([calibench_gate::QUICK, calibench_gate::THOROUGH], calibench_gate::plan::MOST_SAMPLES)
    }

    /// The plan, with the lens models that are `known` unless some are named.
    pub fn plan(&self, known: impl FnOnce() -> Vec<Model>) -> Result<Plan, Stop> {
        let models = if self.models.is_empty() { known() } else { self.models.clone() };
        if models.is_empty() {
            let known: Vec<&str> = Model::ALL.iter().map(|model| model.name()).collect();
            return Err((
                Exit::Deviates,
                format!(
                    "NOT TRUSTED: the program's greeting names no lens model that the gate knows, so that nothing can be asked; there are: {}",
                    known.join(", ")
                ),
            ));
        }
        if let Some(twice) = named_twice(&models) {
            return Err(usage(format!("--models names {twice} twice: name each model once")));
        }
        if let Some(twice) = named_twice(&self.scenes) {
            return Err(usage(format!("--scene names {twice} twice: name each scene once")));
        }
        let asked = Asked { models, scenes: self.scenes.clone() };
        Plan::of(self.amount.seed, self.samples()?, asked).map_err(|error| match error {
            PlanError::UnknownScene { .. } | PlanError::TooManySamples { .. } => usage(error),
            _ => incomplete(error),
        })
    }
}

/// The first of a list that was there before.
fn named_twice<T: PartialEq>(list: &[T]) -> Option<&T> {
    list.iter().enumerate().find(|(i, item)| list[..*i].contains(item)).map(|(_, item)| item)
}

#[derive(Debug, clap::Args)]
pub(super) struct Copies {
    /// Copies of the program that run at the same time
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<usize>)]
    jobs: usize,
    /// Seconds that the program may take for a problem
    #[arg(long, value_name = "SECONDS", default_value_t = 20.0)]
    pub timeout: f64,
}

impl Copies {
    /// Refuses numbers that no program can be asked with, whether one is asked or not.
    pub fn check(&self) -> Result<(), Stop> {
        program::limits(self.timeout, self.jobs).map(drop).map_err(usage)
    }

    pub fn process(&self, command: &str) -> Result<Box<dyn Solver>, Stop> {
        Ok(Box::new(program::process(command, self.timeout, self.jobs).map_err(usage)?))
    }
}

#[derive(Debug, clap::Args)]
pub(super) struct FalseAlarms {
    /// Chance that what is correct fails the run
    #[arg(long = "false-alarms", value_name = "RATE", default_value_t = EXPECTED_FALSE_ALARMS, value_parser = chance)]
    pub rate: f64,
}

fn chance(text: &str) -> Result<f64, String> {
    super::super::said::number_that(text, |x| x > 0.0 && x < 1.0, "a number between 0 and 1")
}

#[derive(Debug, clap::Args)]
pub(super) struct Judgement {
    #[command(flatten)]
    pub false_alarms: FalseAlarms,
    /// Longest median time for a problem in any scenario; without it, time is told and not judged
    #[arg(long, value_name = "SECONDS", value_parser = super::super::said::positive)]
    pub median_time: Option<f64>,
    /// Property whose failure is known and does not fail the run; may be repeated
    #[arg(long, value_name = "PROPERTY", value_parser = property)]
    accept: Vec<Property>,
    /// File of failures that are known, by property and scene, with a reason each (see adapters/PROTOCOL.md)
    #[arg(long, value_name = "FILE")]
    allow: Option<PathBuf>,
}

impl Judgement {
    pub fn terms(&self) -> Result<Terms, Stop> {
        let allowances = self.allow.as_deref().map_or(Ok(Vec::new()), Allowance::read).map_err(usage)?;
        Ok(Terms {
            false_alarm_rate: self.false_alarms.rate,
            accepted: self.accept.clone(),
            allowances,
            median_seconds: self.median_time,
        })
    }
}

fn property(name: &str) -> Result<Property, String> {
    let known = || Property::ALL.iter().map(|p| p.name()).collect::<Vec<_>>().join(", ");
    Property::ALL
        .iter()
        .copied()
        .find(|p| p.name() == name)
        .ok_or_else(|| format!("no property `{name}`; there are: {}", known()))
}

/// What a gate of its own kind, for what finds marks or mountings, is asked with.
#[derive(Debug, clap::Args)]
pub(super) struct OwnKind {
    /// Seconds that the program may take for an answer
    #[arg(long, value_name = "SECONDS", default_value_t = 20.0)]
    timeout: f64,
    #[command(flatten)]
    pub amount: Amount,
    #[command(flatten)]
    pub false_alarms: FalseAlarms,
    #[command(flatten)]
    pub told: Told,
}

impl OwnKind {
    /// How long a program may take, once what can never be told or asked is refused.
    pub fn timeout(&self, command: Option<&str>) -> Result<Duration, Stop> {
        self.told.check()?;
        command.map_or(Ok(()), program::refuse_missing).map_err(usage)?;
        program::timeout(self.timeout).map_err(usage)
    }
}

#[derive(Debug, clap::Args)]
pub(super) struct Told {
    /// The verdict as text for people, or the report as JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
    /// Writes the report as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

impl Told {
    /// Refuses where no file can be written.
    fn check(&self) -> Result<(), Stop> {
        self.json.as_deref().map_or(Ok(()), refuse_unwritable)
    }

    /// The answer in the form that is asked for, and JSON where it is wanted.
    pub fn tell(&self, json: &str, text: &str, trusted: bool) -> Exit {
        print_either(self.format, text, json);
        let written = self.json.as_ref().map_or(Ok(()), |path| write_atomically(path, json.as_bytes()));
        unless_unwritten(written, if trusted { Exit::Held } else { Exit::Deviates })
    }
}

#[derive(Debug, clap::Args)]
pub(super) struct Reports {
    #[command(flatten)]
    pub told: Told,
    /// Writes the report as JUnit XML
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
    /// Writes the report as a page
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
}

impl Reports {
    /// Refuses where no file can be written, and two reports in one file, of which the last would be left.
    pub fn check(&self) -> Result<(), Stop> {
        let reports = [("--json", &self.told.json), ("--junit", &self.junit), ("--html", &self.html)];
        let mut named: Vec<(&str, PathBuf)> = Vec::new();
        for (option, path) in reports {
            let Some(path) = path else { continue };
            refuse_unwritable(path)?;
            let place = place_of(path);
            if let Some((other, _)) = named.iter().find(|(_, known)| *known == place) {
                return Err(usage(format!(
                    "{other} and {option} name one file, {}: give each report a file of its own",
                    place.shown()
                )));
            }
            named.push((option, place));
        }
        Ok(())
    }
}

/// Refuses a place where no file can be written: a solver may take hours, and its report must not be lost
/// then.
pub(super) fn refuse_unwritable(path: &Path) -> Result<(), Stop> {
    refuse_standard_output(path).map_err(usage)?;
    refuse_unwritable_place(path).map_err(incomplete)
}

/// Where a file that is written would stand, by whatever way it is named.
fn place_of(path: &Path) -> PathBuf {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let folder = absolute.parent().and_then(|folder| folder.canonicalize().ok());
    match (folder, absolute.file_name()) {
        (Some(folder), Some(name)) => folder.join(name),
        _ => absolute,
    }
}
