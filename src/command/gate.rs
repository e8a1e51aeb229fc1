//! `calibench gate`: is a solver to be trusted, ours or anyone's?

mod certified;
mod compare;
mod detector;
mod hand_eye;
mod power;

use super::calibrate::Format;
use super::said::{refuse_standard_output, say_written};
use super::terminal::warn_lines;
use super::{Exit, print, program, warn};
use calibench::camera::Model;
use calibench::io::{ShownPath, keep_files, write_atomically};
use calibench_gate::faults::{Faulty, planted};
use calibench_gate::files::{self, FilesError, Recorded};
use calibench_gate::{
    Allowance, Asked, Builtin, EXPECTED_FALSE_ALARMS, Plan, PlanError, Property, QUICK, Recorder, Report,
    Solver, THOROUGH, Terms, plan, protocol,
};
use calibench_harness::{Build, ProgressDisplay};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// How many problems.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Size {
    /// 128 samples a scenario: every gross fault
    Quick,
    /// 8192 samples a scenario: a bias of a tenth of a standard deviation, a variance 5 % too large
    Thorough,
}

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Program to judge: reads problems, writes answers, one JSON object a line (see adapters/PROTOCOL.md)
    /// [default: this library's solver]
    #[arg(long, value_name = "COMMAND")]
    solver: Option<String>,
    /// Copies of the program that run at the same time
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = super::said::whole::<usize>)]
    jobs: usize,
    /// Seconds that the program may take for a problem
    #[arg(long, value_name = "SECONDS", default_value_t = 20.0)]
    timeout: f64,
    /// Number of problems
    #[arg(long, value_enum, default_value_t = Size::Quick)]
    size: Size,
    /// Samples a scenario, in place of --size
    #[arg(long, value_name = "N", conflicts_with = "size", value_parser = super::said::whole::<usize>)]
    samples: Option<usize>,
    /// Seed of the noise
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = super::said::whole::<u64>)]
    seed: u64,
    /// Lens models whose scenes are asked, such as brown-conrady,rational [default: those that the solver
    /// says it knows; brown-conrady of a program that says nothing, and in files]
    #[arg(long, value_name = "MODELS", value_delimiter = ',', conflicts_with_all = ["judge", "power", "certified", "hand_eye", "detector"])]
    models: Vec<Model>,
    /// The only scene or bad input to ask, by its name in reports; may be repeated
    #[arg(long = "scene", value_name = "SCENE", conflicts_with_all = ["judge", "power", "certified", "hand_eye", "detector"])]
    scenes: Vec<String>,
    /// Chance that a correct solver fails the run
    #[arg(long, value_name = "RATE", default_value_t = EXPECTED_FALSE_ALARMS)]
    false_alarms: f64,
    /// Longest median time for a problem in any scenario; without it, time is told and not judged
    #[arg(long, value_name = "SECONDS")]
    median_time: Option<f64>,
    /// Property whose failure is known and does not fail the run; may be repeated
    #[arg(long, value_name = "PROPERTY", value_parser = property)]
    accept: Vec<Property>,
    /// File of failures that are known, by property and scene, with a reason each (see adapters/PROTOCOL.md)
    #[arg(long, value_name = "FILE", conflicts_with_all = ["export", "power", "certified", "hand_eye", "detector"])]
    allow: Option<PathBuf>,
    /// The verdict as text for people, or the report as JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text, conflicts_with_all = [
        "export", "record", "against", "power", "certified", "planted", "methods",
    ])]
    format: Format,
    /// Writes the report as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Writes the report as JUnit XML
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    /// Writes the report as a page
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Compares with a reference on the same problems: `builtin`, a program, or a folder written by --record;
    /// with --judge what is compared are the answers in that folder
    #[arg(long, value_name = "REF", conflicts_with_all = ["export", "power"])]
    against: Option<String>,
    /// Writes the problems to a folder, truth kept apart, for programs that cannot be driven by a pipe
    #[arg(long, value_name = "DIR", conflicts_with_all = ["solver", "json", "junit", "html", "accept"])]
    export: Option<PathBuf>,
    /// Judges as ever, and writes the problems and the solver's answers to a folder
    #[arg(long, value_name = "DIR", conflicts_with_all = ["export", "against"])]
    record: Option<PathBuf>,
    /// Judges the answers in a folder written by --export: DIR/answers.jsonl, or files in DIR/answers/
    #[arg(long, value_name = "DIR", conflicts_with_all = ["export", "record", "solver"])]
    judge: Option<PathBuf>,
    /// Judges this library's solver with a planted fault; `list` names them
    #[arg(long, value_name = "FAULT", conflicts_with_all = ["solver", "judge"])]
    planted: Option<String>,
    /// Measures the gate itself: every planted fault, false alarms over 200 clean seeds, how often textbook
    /// least squares is misled; writes three tables to a folder
    #[arg(long, value_name = "DIR", conflicts_with_all = ["solver", "judge", "export", "record", "planted", "json", "junit", "html"])]
    power: Option<PathBuf>,
    /// Prints the tables in a folder written by --power as Markdown
    #[arg(long, value_name = "DIR", exclusive = true)]
    power_table: Option<PathBuf>,
    /// Counts the digits that the solver shares with the certified values of reference/ [default solver here:
    /// this library's, polished to the last digits]
    #[arg(long, conflicts_with_all = [
        "export", "judge", "power", "planted", "record", "against", "json", "junit", "html", "seed", "samples", "size", "accept", "median_time",
        "false_alarms",
    ])]
    certified: bool,
    /// Judges a solver that finds where a camera sits on a robot (see adapters/HAND-EYE-PROTOCOL.md) [default
    /// solver here: this library's]
    #[arg(long, conflicts_with_all = [
        "export", "judge", "power", "planted", "record", "against", "junit", "html", "accept", "median_time", "certified", "jobs",
    ])]
    hand_eye: bool,
    /// Judges a detector of calibration boards, by photographs of known truth (see
    /// adapters/DETECTOR-PROTOCOL.md) [default detector here: this library's]
    #[arg(long, conflicts_with_all = [
        "export", "judge", "power", "planted", "record", "against", "junit", "html", "accept", "allow", "median_time", "certified", "jobs",
        "hand_eye",
    ])]
    detector: bool,
    /// Kinds of boards that the detector is asked for: chessboard, circles, asymmetric, hexagonal, charuco,
    /// aprilgrid [default: all]
    #[arg(long, value_name = "KINDS", value_delimiter = ',', requires = "detector", value_parser = detector::kind)]
    boards: Vec<calibench_detector_gate::protocol::Kind>,
    /// Judges this library and the hand-eye methods of the programs in adapters/, and writes the table as
    /// Markdown
    #[arg(long, value_name = "FILE", requires = "hand_eye", conflicts_with_all = ["solver", "json"])]
    methods: Option<PathBuf>,
    /// The only certified problem to put
    #[arg(long, value_name = "NAME", requires = "certified")]
    problem: Option<String>,
    /// Digits that every certified problem must reach
    #[arg(long, value_name = "N", requires = "certified")]
    least_digits: Option<f64>,
    /// Counts the digits of this library's solver and of the programs in adapters/, and writes the table as
    /// CSV
    #[arg(long, value_name = "FILE", requires = "certified", conflicts_with = "solver")]
    digits: Option<PathBuf>,
    /// Prints a table written by --digits as Markdown
    #[arg(long, value_name = "FILE", exclusive = true)]
    digits_table: Option<PathBuf>,
    /// Writes the JSON schemas of the protocol to a folder
    #[arg(long, value_name = "DIR", exclusive = true)]
    schema: Option<PathBuf>,
}

fn property(name: &str) -> Result<Property, String> {
    let known = || Property::ALL.iter().map(|p| p.name()).collect::<Vec<_>>().join(", ");
    Property::ALL
        .iter()
        .copied()
        .find(|p| p.name() == name)
        .ok_or_else(|| format!("no property `{name}`; there are: {}", known()))
}

pub(super) fn run(arguments: &Arguments, build: &Build) -> Exit {
    calibench_gate::program::adopt_orphans();
    let exit = dispatch(arguments, build).unwrap_or_else(|(exit, message)| {
        warn(&message);
        exit
    });
    calibench_gate::program::end_all();
    exit
}

/// A way to end before there is a verdict.
type Stop = (Exit, String);

fn usage(message: impl ToString) -> Stop {
    (Exit::Usage, message.to_string())
}

fn incomplete(message: impl ToString) -> Stop {
    (Exit::Incomplete, message.to_string())
}

fn of_files(error: FilesError) -> Stop {
    match error {
        FilesError::Plan(PlanError::TooManySamples { .. } | PlanError::UnknownScene { .. }) => usage(error),
        FilesError::Write(_) | FilesError::Plan(_) => incomplete(error),
        _ => usage(error),
    }
}

/// Refuses two reports in one file, of which the last would be left.
fn refuse_one_file_for_two(arguments: &Arguments) -> Result<(), Stop> {
    let reports = [("--json", &arguments.json), ("--junit", &arguments.junit), ("--html", &arguments.html)];
    let named: Vec<(&str, PathBuf)> =
        reports.into_iter().filter_map(|(option, path)| Some((option, place_of(path.as_ref()?)))).collect();
    for report in [&arguments.json, &arguments.junit, &arguments.html].into_iter().flatten() {
        refuse_standard_output(report).map_err(usage)?;
    }
    for (i, (option, place)) in named.iter().enumerate() {
        if let Some((other, _)) = named[..i].iter().find(|(_, other)| other == place) {
            return Err(usage(format!(
                "{other} and {option} name one file, {}: give each report a file of its own",
                place.shown()
            )));
        }
    }
    Ok(())
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

fn dispatch(arguments: &Arguments, build: &Build) -> Result<Exit, Stop> {
    refuse_one_file_for_two(arguments)?;
    if let Some(folder) = &arguments.schema {
        for (name, text) in protocol::schemas() {
            write_atomically(&folder.join(name), text.as_bytes()).map_err(incomplete)?;
        }
        return Ok(Exit::Held);
    }
    let samples = arguments.samples.unwrap_or(match arguments.size {
        Size::Quick => QUICK,
        Size::Thorough => THOROUGH,
    });
    if samples > plan::MOST_SAMPLES {
        return Err(usage(PlanError::TooManySamples { samples }));
    }
    if samples == 0 || !(arguments.false_alarms > 0.0 && arguments.false_alarms < 1.0) {
        return Err(usage("--samples must be at least 1 and --false-alarms between 0 and 1"));
    }
    // Told before anything else is done, whether a program is asked or not.
    program::process("", arguments.timeout, arguments.jobs).map_err(usage)?;
    if arguments.least_digits.is_some_and(|digits| !digits.is_finite()) {
        return Err(usage("--least-digits must be a number"));
    }
    if arguments.median_time.is_some_and(|s| !(s > 0.0 && s.is_finite())) {
        return Err(usage("--median-time must be a positive number of seconds"));
    }
    if arguments.planted.as_deref() == Some("list") {
        if arguments.json.is_some() || arguments.junit.is_some() || arguments.html.is_some() {
            return Err(usage("--planted list judges nothing, so that there is no report to write"));
        }
        planted().iter().for_each(|fault| print(&format!("{:<26} {}\n", fault.id, fault.about)));
        return Ok(Exit::Held);
    }
    if let Some(path) = &arguments.digits_table {
        return certified::print_table(path);
    }
    if let Some(path) = &arguments.digits {
        return certified::write_table(arguments, path, build);
    }
    if arguments.certified {
        return certified::run(arguments);
    }
    if arguments.hand_eye {
        return hand_eye::run(arguments);
    }
    if arguments.detector {
        return detector::run(arguments);
    }
    if let Some(folder) = &arguments.power_table {
        return power::print_table(folder);
    }
    if let Some(folder) = &arguments.power {
        return power::measure(arguments, folder, samples, build);
    }
    if let Some(folder) = &arguments.export {
        let plan = plan_of(arguments, samples, || vec![Model::BrownConrady])?;
        files::export(&plan, folder).map_err(of_files)?;
        say_written(std::slice::from_ref(folder), arguments.format, || {
            format!("{} problems written to {}\n", plan.cases.len(), folder.shown())
        });
        return Ok(Exit::Held);
    }
    let judged = [arguments.judge.as_deref(), arguments.against.as_deref().map(Path::new)];
    judged.into_iter().flatten().for_each(keep_recorded);
    if let Some(folder) = &arguments.judge {
        if let Some(reference) = &arguments.against {
            return compare::of_answers(arguments, folder, reference);
        }
        let (plan, answers) = recorded(folder)?;
        return judge(arguments, &plan, &answers, build);
    }
    let solver = solver(arguments)?;
    if let Some(folder) = &arguments.record {
        let plan = plan_of(arguments, samples, || solver.models())?;
        files::export(&plan, folder).map_err(of_files)?;
        let recorder = Recorder::new(solver.as_ref());
        let report = asked(arguments, &plan, &recorder, build)?;
        // Before the report: where that cannot be written the answers are kept.
        files::file_answers(&plan, folder, &recorder).map_err(of_files)?;
        let exit = told(arguments, &report)?;
        // The report is the one object on standard output.
        if arguments.format == Format::Text {
            print(&format!("{} problems and answers written to {}\n", plan.cases.len(), folder.shown()));
        }
        return Ok(exit);
    }
    if let Some(reference) = &arguments.against {
        return compare::run(arguments, solver.as_ref(), reference, samples);
    }
    let plan = plan_of(arguments, samples, || solver.models())?;
    judge(arguments, &plan, solver.as_ref(), build)
}

/// Problems and answers of a folder, with a word on what in it answers none of them.
fn recorded(folder: &Path) -> Result<(Plan, Recorded), Stop> {
    let (plan, answers) = files::recorded(folder).map_err(of_files)?;
    if let Some(stray) = answers.stray() {
        warn(&format!("not all lines are answers to the problems of {}: {stray}", folder.shown()));
    }
    Ok((plan, answers))
}

/// Keeps the answers of a folder, which are judged, from being replaced by a report on them.
fn keep_recorded(folder: &Path) {
    for folder in [folder.to_path_buf(), folder.join("answers")] {
        let files: Vec<PathBuf> =
            std::fs::read_dir(folder).into_iter().flatten().flatten().map(|f| f.path()).collect();
        keep_files(files.iter().map(PathBuf::as_path));
    }
}

/// The plan of the arguments, with the lens models that are `known` unless they name some.
fn plan_of(arguments: &Arguments, samples: usize, known: impl FnOnce() -> Vec<Model>) -> Result<Plan, Stop> {
    let models = if arguments.models.is_empty() { known() } else { arguments.models.clone() };
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
    if let Some(twice) = named_twice(&arguments.scenes) {
        return Err(usage(format!("--scene names {twice} twice: name each scene once")));
    }
    let asked = Asked { models, scenes: arguments.scenes.clone() };
    Plan::of(arguments.seed, samples, asked).map_err(|error| match error {
        PlanError::UnknownScene { .. } | PlanError::TooManySamples { .. } => usage(error),
        _ => incomplete(error),
    })
}

/// The first of a list that was there before.
fn named_twice<T: PartialEq>(list: &[T]) -> Option<&T> {
    list.iter().enumerate().find(|(i, item)| list[..*i].contains(item)).map(|(_, item)| item)
}

/// The command that asks all scenes again, to which some may be added; none for answers in files.
fn repeat(arguments: &Arguments, plan: &Plan) -> Option<String> {
    let solver = match (&arguments.judge, &arguments.solver, &arguments.planted) {
        (Some(_), ..) => return None,
        (None, Some(command), _) => format!(" --solver '{}'", command.replace('\'', "'\\''")),
        (None, None, Some(fault)) => format!(" --planted {fault}"),
        (None, None, None) => String::new(),
    };
    let models: Vec<&str> = plan.asked.models.iter().map(|model| model.name()).collect();
    let limit = arguments.median_time.map_or(String::new(), |seconds| format!(" --median-time {seconds}"));
    Some(format!(
        "calibench gate{solver} --models {} --samples {} --seed {}{limit}",
        models.join(","),
        plan.samples,
        plan.seed
    ))
}

fn solver(arguments: &Arguments) -> Result<Box<dyn Solver>, Stop> {
    match (&arguments.solver, &arguments.planted) {
        (Some(command), _) => process(arguments, command),
        (None, Some(id)) => {
            let fault = planted().into_iter().find(|fault| fault.id == id);
            let fault =
                fault.ok_or_else(|| usage(format!("no planted fault `{id}`; see `--planted list`")))?;
            Ok(Box::new(Faulty::new(fault)))
        }
        (None, None) => Ok(Box::new(Builtin)),
    }
}

fn process(arguments: &Arguments, command: &str) -> Result<Box<dyn Solver>, Stop> {
    Ok(Box::new(program::process(command, arguments.timeout, arguments.jobs).map_err(usage)?))
}

fn terms(arguments: &Arguments) -> Result<Terms, Stop> {
    let allowances = arguments.allow.as_deref().map_or(Ok(Vec::new()), Allowance::read).map_err(usage)?;
    Ok(Terms {
        false_alarm_rate: arguments.false_alarms,
        accepted: arguments.accept.clone(),
        allowances,
        median_seconds: arguments.median_time,
    })
}

/// Asks every problem of the plan, showing progress.
fn asked(arguments: &Arguments, plan: &Plan, solver: &dyn Solver, build: &Build) -> Result<Report, Stop> {
    // A mistake in a file is told before anything is asked.
    let terms = terms(arguments)?;
    let progress = ProgressDisplay::stderr().start("gate", plan.cases.len());
    let started = Instant::now();
    let seen = calibench_gate::run(plan, solver, &|done| progress.advance(done));
    let seconds = started.elapsed().as_secs_f64();
    let report = Report::new(plan, &solver.name(), &seen, &terms, seconds);
    let report = report.with_program_ends(solver.finish()).with_commit(build.commit.as_ref());
    match repeat(arguments, plan) {
        Some(command) => Ok(report.with_repeat(&command)),
        None => Ok(report),
    }
}

/// A report in one form, and where it goes if it is wanted.
type Output<'a> = (&'a Option<PathBuf>, fn(&Report) -> String);

fn judge(arguments: &Arguments, plan: &Plan, solver: &dyn Solver, build: &Build) -> Result<Exit, Stop> {
    told(arguments, &asked(arguments, plan, solver, build)?)
}

/// Tells what a report says, in all forms that are asked for.
fn told(arguments: &Arguments, report: &Report) -> Result<Exit, Stop> {
    let outputs: [Output<'_>; 3] = [
        (&arguments.json, Report::to_json),
        (&arguments.junit, Report::to_junit),
        (&arguments.html, Report::to_html),
    ];
    for (path, text) in outputs {
        if let Some(path) = path {
            write_atomically(path, text(report).as_bytes()).map_err(incomplete)?;
        }
    }
    match arguments.format {
        Format::Text => print(&report.to_text(columns())),
        Format::Json => print(&report.to_json()),
    }
    if !report.held() {
        warn_lines(&report.details());
    }
    Ok(if report.held() { Exit::Held } else { Exit::Deviates })
}

/// Tells what a gate of its own kind found: JSON where it is wanted, and the answer in the form that is asked
/// for.
fn tell(arguments: &Arguments, json: &str, text: &str, trusted: bool) -> Result<Exit, Stop> {
    if let Some(path) = &arguments.json {
        write_atomically(path, json.as_bytes()).map_err(incomplete)?;
    }
    print(match arguments.format {
        Format::Text => text,
        Format::Json => json,
    });
    Ok(if trusted { Exit::Held } else { Exit::Deviates })
}

/// Characters in a line: what the shell says, else what most terminals have; a file gets the whole.
fn columns() -> usize {
    let asked = std::env::var("COLUMNS").ok().and_then(|columns| columns.parse().ok());
    let most =
        if std::io::stdout().is_terminal() { TERMINAL_COLUMNS } else { calibench_gate::report::COLUMNS };
    asked.unwrap_or(most)
}

/// Characters in a line of a terminal that does not say.
const TERMINAL_COLUMNS: usize = 100;
