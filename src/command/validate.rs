//! `calibench validate RESULT.json PHOTOS|CSV`: does a calibration hold on views that it has not seen, do its
//! own views predict each other, and do repeated calibrations agree?

use super::calibrate::{Views, parse_size, views_of};
use super::diff::{NOT_DECIDED, doubts_of, parse_rate};
use super::format::Format;
use super::report::table;
use super::said::{Said, say, written_by};
use super::{Exit, warn};
use crate::board::board_or_file;
use calibench::board::View;
use calibench::calibrate::Settings;
use calibench::io::input::MOST_TABLE_BYTES;
use calibench::io::memory::{DEFAULT_MEMORY, parse_bytes};
use calibench::io::{
    Known, KnownCalibration, ShownPath, message, parse_known, read_regular_text, significant,
};
use calibench::photos::{BoardSpec, without_disc_bias};
use calibench::validate::{
    Agreement, CameraTest, Estimate, Fold, HoldOut, Outcome, folds, hold_out, repeated,
};
use clap::Args;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// What the exit codes mean here.
const EXIT_CODES: &str = "\
Exit codes:
  0  it holds: nothing is rarer than the rate of false alarms
  1  it does not: an error is larger than its prediction allows, or calibrations disagree
  2  wrong usage or input
  3  incomplete";

#[derive(Debug, Args)]
#[command(after_help = EXIT_CODES)]
pub(super) struct Arguments {
    /// result.json of `calibench calibrate`, with a lens of any model
    result: PathBuf,
    /// Views that the calibration has not seen: a corner file (view,point,X,Y,u,v), or with --board
    /// photographs
    #[arg(required_unless_present = "again")]
    files: Vec<PathBuf>,
    /// The board in the photographs, as for `calibench calibrate`
    #[arg(long, value_name = "BOARD", value_parser = board_or_file)]
    board: Option<BoardSpec>,
    /// The files are the calibration's own views: leaves out each of K parts in turn, calibrates what the
    /// result estimates from the rest, and validates with the part
    #[arg(long, value_name = "K", requires = "files", value_parser = super::said::whole::<usize>)]
    k_fold: Option<usize>,
    /// Results of the same camera from other photographs: do all agree within what each says of itself?
    #[arg(long, value_name = "RESULT", num_args = 1..)]
    again: Vec<PathBuf>,
    /// Size of the frame in which repetitions are compared, and of the photographs [default: the result's]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    image_size: Option<(usize, usize)>,
    /// Rate of false alarms of each of the three questions
    #[arg(long, value_name = "RATE", value_parser = parse_rate, default_value_t = 0.01)]
    rate: f64,
    /// Memory that photographs may take together [default: 2GiB]
    #[arg(long, value_name = "BYTES", value_parser = parse_bytes, default_value_t = DEFAULT_MEMORY, hide_default_value = true)]
    memory: u64,
    /// Folder for validation.json
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

pub(super) fn run(arguments: &Arguments) -> Exit {
    let found = found(arguments);
    let holds = found.as_ref().is_ok_and(Found::holds);
    let said = found.map(|found| Said { text: found.text(), json: found.json(arguments) });
    match say(said, arguments.out.as_deref(), "validation.json", arguments.format) {
        Exit::Held if !holds => Exit::Deviates,
        exit => exit,
    }
}

/// What was found.
struct Found {
    /// Names of the views.
    names: Vec<String>,
    hold_out: Option<HoldOut>,
    folds: Option<Vec<Fold>>,
    /// Files of the repetitions, the result first.
    repetitions: Vec<String>,
    agreement: Option<Agreement>,
    /// What the repetitions themselves say against their comparison.
    doubts: Vec<String>,
}

fn found(arguments: &Arguments) -> Result<Found, String> {
    let known = read(&arguments.result)?;
    refuse_another_size(arguments.image_size, &known)?;
    let mut found = Found {
        names: Vec::new(),
        hold_out: None,
        folds: None,
        repetitions: Vec::new(),
        agreement: None,
        doubts: Vec::new(),
    };
    if !arguments.files.is_empty() {
        refuse_bent_board(arguments, &known)?;
        known.noise_px(&arguments.result.shown()).map_err(|error| {
            format!("{error}, nor that of views to validate it by (--again compares cameras)")
        })?;
        let size = arguments.image_size.or(known.image_size);
        let views = views_of(&arguments.files, arguments.board.as_ref(), size, arguments.memory)?;
        match arguments.k_fold {
            Some(parts) => found.folds = Some(in_parts(arguments, &known, &views, parts)?),
            None => found.hold_out = Some(on_new(arguments, &known, &views)?),
        }
        found.names = views.names;
    }
    if !arguments.again.is_empty() {
        let others = arguments.again.iter().map(|path| read(path)).collect::<Result<Vec<_>, _>>()?;
        refuse_other_sizes(arguments, &known, &others)?;
        let all: Vec<&KnownCalibration> = std::iter::once(&known).chain(&others).collect();
        warn_of_copies(arguments, &all);
        let files = std::iter::once(&arguments.result).chain(&arguments.again);
        found.doubts = doubts_of(files.zip(all.iter().map(|known| known.doubts.clone())));
        let size = arguments.image_size.or(known.image_size);
        let size = size.ok_or("the frame is not known: give --image-size WxH")?;
        let estimates: Vec<Estimate> = all.iter().copied().map(Estimate::from).collect();
        found.agreement =
            Some(repeated(&estimates, size, arguments.rate).map_err(|error| error.to_string())?);
        found.repetitions =
            std::iter::once(&arguments.result).chain(&arguments.again).map(|p| p.shown()).collect();
    }
    Ok(found)
}

/// A camera's result with its covariance.
fn read(path: &Path) -> Result<KnownCalibration, String> {
    let file = path.shown();
    let text = read_regular_text(path, MOST_TABLE_BYTES).map_err(|error| error.to_string())?;
    match parse_known(&file, &text).map_err(|error| error.to_string())? {
        Known::Plane(_) => Err(format!("{file}: the map of a plane has no camera to validate")),
        Known::Camera(known) => Ok(*known),
    }
}

/// A result says of which images it is; what is given is for those that do not.
fn refuse_another_size(given: Option<(usize, usize)>, known: &KnownCalibration) -> Result<(), String> {
    match (given, known.image_size) {
        (Some(given), Some(size)) if given != size => Err(format!(
            "--image-size {}x{}: the result is of images of {}x{}; leave the option out",
            given.0, given.1, size.0, size.1
        )),
        _ => Ok(()),
    }
}

/// Parameters of images of two sizes are not those of one camera.
fn refuse_other_sizes(
    arguments: &Arguments,
    known: &KnownCalibration,
    others: &[KnownCalibration],
) -> Result<(), String> {
    let other = |(path, other): (&PathBuf, &KnownCalibration)| {
        let (size, given) = (known.image_size?, other.image_size?);
        (size != given).then(|| {
            format!(
                "{}: {} x {} px, and the result's image has {} x {}: bring both to one size first, with calibench convert --resize",
                path.shown(),
                given.0,
                given.1,
                size.0,
                size.1
            )
        })
    };
    arguments.again.iter().zip(others).find_map(other).map_or(Ok(()), Err)
}

fn warn_of_copies(arguments: &Arguments, all: &[&KnownCalibration]) {
    for (i, path) in arguments.again.iter().enumerate() {
        if all[..=i].iter().any(|earlier| earlier.camera == all[i + 1].camera) {
            warn(&format!(
                "warning: {} has the camera of an earlier file to the last digit: a copy agrees with itself",
                path.shown()
            ));
        }
    }
}

/// Views are located by the marks of a plane.
fn refuse_bent_board(arguments: &Arguments, known: &KnownCalibration) -> Result<(), String> {
    let refused = known.refuse_bent_board(&arguments.result.shown());
    refused.map_err(|error| {
        format!("{error}: views are validated on flat boards only (--again compares cameras)")
    })
}

fn on_new(arguments: &Arguments, known: &KnownCalibration, views: &Views) -> Result<HoldOut, String> {
    let of_calibration: BTreeSet<&String> = known.views.iter().collect();
    let seen: Vec<&String> = views.names.iter().filter(|name| of_calibration.contains(name)).collect();
    if !seen.is_empty() {
        let names = seen.iter().map(|name| name.as_str()).collect::<Vec<_>>().join(", ");
        warn(&format!(
            "warning: the calibration has views of the same names ({names}): if they are the same photographs, their error says nothing (see --k-fold)"
        ));
    }
    let corrected = without_bias(known, views);
    hold_out(&Estimate::from(known), &corrected, arguments.rate)
        .map_err(|error| format!("{}: {error}", views.source))
}

/// The views, the bias of discs taken off as the camera predicts it.
fn without_bias(known: &KnownCalibration, views: &Views) -> Vec<View> {
    let Some(board) = &views.discs else { return views.views.clone() };
    let camera = &known.camera;
    views
        .views
        .iter()
        .map(|view| without_disc_bias(camera, view, board).unwrap_or_else(|| view.clone()))
        .collect()
}

fn in_parts(
    arguments: &Arguments,
    known: &KnownCalibration,
    views: &Views,
    parts: usize,
) -> Result<Vec<Fold>, String> {
    if known.has_priors {
        return Err(format!(
            "{}: it rests on priors, which every part would count again: parts are for calibrations without",
            arguments.result.shown()
        ));
    }
    folds(&without_bias(known, views), &settings(known), parts, arguments.rate)
        .map_err(|error| format!("{}: {}", views.source, message(&error)))
}

/// What was estimated once, to be estimated again.
fn settings(known: &KnownCalibration) -> Settings {
    let (free, ratio) = (known.covariance.free, known.covariance.fy_per_fx);
    let held = known.camera.values().filter(|(parameter, _)| !free.contains(*parameter));
    let of_model = Settings::new(free).with_model(known.camera.distortion.model());
    let mut settings = held.fold(of_model, |settings, (parameter, value)| settings.hold(parameter, value));
    settings.image_size = known.image_size;
    ratio.map_or(settings.clone(), |ratio| settings.tie_focal_lengths(ratio))
}

fn verdict(holds: bool, good: &str, bad: &str, rate: f64) -> String {
    format!("{} (false alarms at {rate})\n", if holds { good } else { bad })
}

fn outcome_row(name: String, outcome: &Outcome) -> [String; 6] {
    [
        name,
        outcome.points.to_string(),
        significant(outcome.rmse_px, 4),
        significant(outcome.predicted_px, 4),
        format!(
            "{} to {}",
            significant(outcome.interval_px.low, 4),
            significant(outcome.interval_px.high, 4)
        ),
        significant(outcome.p_value, 2),
    ]
}

const OUTCOME: [&str; 6] = ["view", "points", "RMSE (px)", "predicted", "allowed", "probability of more"];

fn camera_text(test: Option<&CameraTest>) -> String {
    let Some(test) = test else { return String::new() };
    format!(
        "camera: the views ask for another by chi-squared {} on {} degrees of freedom, by chance with probability {}\n",
        significant(test.chi_squared, 4),
        test.degrees_of_freedom,
        significant(test.p_value, 2)
    )
}

impl Found {
    fn holds(&self) -> bool {
        self.hold_out.as_ref().is_none_or(HoldOut::holds)
            && self.folds.iter().flatten().all(|fold| fold.hold_out.holds())
            && self.agreement.as_ref().is_none_or(|agreement| agreement.holds() || !self.doubts.is_empty())
    }

    fn text(&self) -> String {
        let of_new = self.hold_out.as_ref().map(|hold_out| self.hold_out_text(hold_out));
        let of_folds = self.folds.as_ref().map(|folds| self.folds_text(folds));
        let of_agreement = self.agreement.as_ref().map(|agreement| self.agreement_text(agreement));
        [of_new, of_folds, of_agreement].into_iter().flatten().collect::<Vec<_>>().join("\n")
    }

    fn hold_out_text(&self, hold_out: &HoldOut) -> String {
        let mut rows = table(&OUTCOME);
        for (name, view) in self.names.iter().zip(&hold_out.views) {
            rows.add_row(outcome_row(name.clone(), &view.outcome));
        }
        rows.add_row(outcome_row("all".into(), &hold_out.together));
        let mut text = format!("{}\n\n", rows.trim_fmt());
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "of the predicted {} px the noise alone leaves {}",
            significant(hold_out.together.predicted_px, 4),
            significant(hold_out.together.noise_alone_px, 4)
        );
        text += &camera_text(hold_out.camera.as_ref());
        if hold_out.together.rmse_px < hold_out.together.interval_px.low {
            text += "the error is smaller than allowed: these views have less noise than those of the calibration\n";
        }
        text + &verdict(
            hold_out.holds(),
            "the calibration holds on these views",
            "the calibration does not hold on these views",
            hold_out.false_alarm,
        )
    }

    fn folds_text(&self, folds: &[Fold]) -> String {
        let mut rows = table(&[
            "part left out",
            "points",
            "RMSE (px)",
            "predicted",
            "allowed",
            "probability of more",
            "camera",
        ]);
        for fold in folds {
            let names: Vec<&str> =
                fold.left_out.iter().filter_map(|&i| Some(self.names.get(i)?.as_str())).collect();
            let [name, points, rmse, predicted, allowed, p_value] =
                outcome_row(names.join(", "), &fold.hold_out.together);
            let camera = fold.hold_out.camera.map_or("-".to_string(), |test| significant(test.p_value, 2));
            rows.add_row([name, points, rmse, predicted, allowed, p_value, camera]);
        }
        let failed = folds.iter().filter(|fold| !fold.hold_out.holds()).count();
        let rate: f64 = folds.iter().map(|fold| fold.hold_out.false_alarm).sum();
        format!("{}\n\n", rows.trim_fmt())
            + &verdict(
                failed == 0,
                "the views predict each other as well as their calibrations say",
                &format!("{failed} of {} parts are predicted worse than their calibrations say", folds.len()),
                (1e9 * rate).round() / 1e9,
            )
    }

    fn agreement_text(&self, agreement: &Agreement) -> String {
        let mut rows = table(&["parameter", "weighted mean", "standard deviation"]);
        for (parameter, mean, sd) in &agreement.mean {
            rows.add_row([parameter.name().to_string(), significant(*mean, 8), significant(*sd, 3)]);
        }
        let mut text = format!(
            "{}\n\nparameters: chi-squared {} on {} degrees of freedom, by chance with probability {}\n",
            rows.trim_fmt(),
            significant(agreement.chi_squared, 4),
            agreement.degrees_of_freedom,
            significant(agreement.p_value, 2)
        );
        for (name, (difference, test)) in self.repetitions[1..].iter().zip(&agreement.in_pixels) {
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "{name} against {}: {} px RMS over the frame, by chance with probability {}",
                self.repetitions[0],
                significant(difference.rms_px, 3),
                significant(test.p_value, 2)
            );
        }
        let bad = match self.doubts.is_empty() {
            true => "the calibrations do not agree: the camera changed, or their covariances are too small",
            false => NOT_DECIDED,
        };
        text += &verdict(agreement.holds(), "the calibrations agree", bad, agreement.false_alarm);
        text + &self.doubts.iter().map(|doubt| format!("{doubt}\n")).collect::<String>()
    }

    fn json(&self, arguments: &Arguments) -> Value {
        json!({
            "written_by": written_by(),
            "result": arguments.result.display().to_string(),
            "rate": arguments.rate,
            "holds": self.holds(),
            "hold_out": self.hold_out.as_ref().map(|hold_out| hold_out_json(hold_out, &self.names)),
            "folds": self.folds.as_ref().map(|folds| folds.iter().map(|fold| self.fold_json(fold)).collect::<Vec<_>>()),
            "repetitions": self.agreement.as_ref().map(|agreement| self.agreement_json(agreement)),
        })
    }

    fn fold_json(&self, fold: &Fold) -> Value {
        let names: Vec<String> = fold.left_out.iter().filter_map(|&i| self.names.get(i).cloned()).collect();
        json!({ "left_out": names, "hold_out": hold_out_json(&fold.hold_out, &names) })
    }

    fn agreement_json(&self, agreement: &Agreement) -> Value {
        let pairs = self.repetitions[1..].iter().zip(&agreement.in_pixels);
        json!({
            "files": self.repetitions,
            "chi_squared": agreement.chi_squared,
            "degrees_of_freedom": agreement.degrees_of_freedom,
            "p_value": agreement.p_value,
            "mean": agreement.mean.iter().map(|(parameter, mean, sd)| json!({
                "parameter": parameter.name(), "mean": mean, "standard_deviation": sd,
            })).collect::<Vec<_>>(),
            "in_pixels": pairs.map(|(file, (difference, test))| json!({
                "file": file,
                "rms_px": difference.rms_px,
                "chi_squared": test.chi_squared,
                "degrees_of_freedom": test.degrees_of_freedom,
                "p_value": test.p_value,
            })).collect::<Vec<_>>(),
            "holds": (agreement.holds() || self.doubts.is_empty()).then_some(agreement.holds()),
            "doubts": self.doubts,
        })
    }
}

fn outcome_json(outcome: &Outcome) -> Value {
    json!({
        "points": outcome.points,
        "rmse_px": outcome.rmse_px,
        "predicted_px": outcome.predicted_px,
        "noise_alone_px": outcome.noise_alone_px,
        "interval_px": [outcome.interval_px.low, outcome.interval_px.high],
        "p_value": outcome.p_value,
    })
}

fn hold_out_json(hold_out: &HoldOut, names: &[String]) -> Value {
    let of_view = |(name, view): (&String, &calibench::validate::Unseen)| {
        json!({
            "view": name,
            "outcome": outcome_json(&view.outcome),
            "residuals_px": view.residuals_px.iter().map(|r| [r.x, r.y]).collect::<Vec<_>>(),
        })
    };
    json!({
        "views": names.iter().zip(&hold_out.views).map(of_view).collect::<Vec<_>>(),
        "together": outcome_json(&hold_out.together),
        "camera": hold_out.camera.map(|test| json!({
            "chi_squared": test.chi_squared,
            "degrees_of_freedom": test.degrees_of_freedom,
            "p_value": test.p_value,
        })),
        "false_alarm": hold_out.false_alarm,
        "holds": hold_out.holds(),
    })
}
