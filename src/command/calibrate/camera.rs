//! A camera from views, wherever they come from: the fit, what it is told as, and the files it leaves.

use super::finished::{Told, parameter_rows, summary, weakest};
use super::{Arguments, Exit, Format, advice, maps, page, plots, print, table};
use calibench::board::{Board, View};
use calibench::calibrate::{Settings, Termination};
use calibench::io::{CalibrationFields, LeftOut, significant, write_atomically};
use calibench::photos::{Fit, Fitter};
use calibench_harness::Figure;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

/// Views and where they come from.
#[derive(Debug, Default)]
pub(super) struct Observed {
    /// What errors and the page call the input.
    pub(super) source: String,
    /// One name a view.
    pub(super) names: Vec<String>,
    pub(super) views: Vec<View>,
    pub(super) image_size: Option<(usize, usize)>,
    /// The board whose discs' bias is to be corrected.
    pub(super) discs: Option<Board>,
    /// Input that gave no view.
    pub(super) left_out: Vec<LeftOut>,
    /// Pictures of views, by the views' names: paths relative to the output folder.
    pub(super) overlays: BTreeMap<String, String>,
    /// What a reader must know about the input.
    pub(super) notes: Vec<String>,
}

pub(super) fn run(arguments: &Arguments, observed: Observed) -> Result<Exit, String> {
    let mut settings = Settings::new(arguments.free).with_loss(arguments.loss);
    settings.image_size = observed.image_size;
    for &(parameter, value) in &arguments.fix {
        settings = settings.hold(parameter, value);
    }
    let fitter =
        Fitter { settings: &settings, discs: observed.discs.as_ref(), reject_factor: arguments.reject_views };
    let fit = fitter.fit(&observed.views).map_err(|error| format!("{}: {error}", observed.source))?;
    let told = told(observed, fit);
    let mut fields = CalibrationFields::of(&told.fit.calibration, &told.names, told.image_size);
    fields.left_out = told.left_out.clone();
    fields.warnings.extend(told.notes.iter().chain(&told.advice).cloned());
    if let Some(folder) = &arguments.out {
        write_files(folder, &fields, &told).map_err(|error| error.to_string())?;
    }
    match arguments.format {
        Format::Json => print(&fields.to_json()),
        Format::Text => print(&text(&told)),
    }
    let converged = told.fit.calibration.termination == Termination::Converged;
    Ok(if converged { Exit::Held } else { Exit::Incomplete })
}

fn told(observed: Observed, fit: Fit) -> Told {
    let mut left_out = observed.left_out;
    left_out.extend(fit.rejected.iter().map(|rejected| LeftOut {
        name: observed.names[rejected.view].clone(),
        reason: rejected.reason.clone(),
    }));
    let names: Vec<String> = fit.kept.iter().map(|&view| observed.names[view].clone()).collect();
    let mut notes = observed.notes;
    notes.extend(bias_note(&fit));
    let advice = advice::of(&fit, &names, observed.image_size);
    let (image_size, overlays, source) = (observed.image_size, observed.overlays, observed.source);
    Told { source, fit, names, image_size, left_out, overlays, notes, advice }
}

/// A correction that did not settle is no correction to trust.
fn bias_note(fit: &Fit) -> Option<String> {
    let bias = fit.bias.filter(|bias| !bias.settled())?;
    Some(format!(
        "the correction of the discs' bias still changes by {} px after {} rounds: check the board's diameter and the photographs",
        significant(bias.last_change_px, 2),
        bias.rounds
    ))
}

fn write_files(folder: &Path, fields: &CalibrationFields, told: &Told) -> std::io::Result<()> {
    write_atomically(&folder.join("result.json"), fields.to_json().as_bytes())?;
    let figures = figures(told);
    for figure in &figures {
        write_atomically(&folder.join(figure.file_name()), &figure.bytes)?;
    }
    write_atomically(&folder.join("report.html"), page::html(told, &figures).as_bytes())
}

fn figures(told: &Told) -> Vec<Figure> {
    let calibration = &told.fit.calibration;
    let mut figures = plots::figures(calibration, &told.fit.views, told.image_size);
    figures.extend(
        told.image_size.into_iter().flat_map(|size| maps::figures(calibration, &told.fit.views, size)),
    );
    figures
}

fn text(told: &Told) -> String {
    let calibration = &told.fit.calibration;
    let mut parameters = table(&["parameter", "value", "standard deviation", "unit"]);
    parameter_rows(told).into_iter().for_each(|row| {
        parameters.add_row(row);
    });
    let mut views = table(&["view", "points", "RMSE (px)", "distance"]);
    for (i, name) in told.names.iter().enumerate() {
        let rmse = calibration.view_rmse_px(i).unwrap_or(f64::NAN);
        let distance = calibration.cam_from_target[i].translation.z;
        let points = calibration.residuals[i].len().to_string();
        views.add_row([name.clone(), points, significant(rmse, 4), significant(distance, 5)]);
    }
    let mut text = format!("{}\n\n{}\n\n{}", parameters.trim_fmt(), views.trim_fmt(), summary(told));
    // Writing to a string cannot fail, here and below.
    if let Some(weakest) = weakest(told) {
        let _ = writeln!(text, "weakest direction: {weakest}");
    }
    for LeftOut { name, reason } in &told.left_out {
        let _ = writeln!(text, "left out: {name}: {reason}");
    }
    let warnings = calibration.warnings.iter().map(ToString::to_string);
    for warning in warnings.chain(told.notes.iter().chain(&told.advice).cloned()) {
        let _ = writeln!(text, "warning: {warning}");
    }
    text
}
