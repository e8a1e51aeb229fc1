//! A camera from views, wherever they come from: the fit, how it is printed, and the files it leaves.

use super::super::report::table;
use super::super::said::{print_either, unless_unwritten};
use super::super::{Exit, warn};
use super::before_after::BeforeAfter;
use super::finished::{Finished, parameter_rows, summary, warnings, weakest};
use super::models::{self, Comparison};
use super::observed::Observed;
use super::optics::Optics;
use super::options::{Arguments, ModelChoice};
use super::scatter::Residuals;
use super::view_names::ViewNames;
use super::{advice, maps, page, plots, poses, scatter};
use calibench::board::View;
use calibench::calibrate::{Loss, ProfileInterval};
use calibench::camera::{Camera, Lens};
use calibench::detect::Orientation;
use calibench::geometry::Vec2;
use calibench::io::formats::corner_text;
use calibench::io::{
    CalibrationFields, CornerFile, LeftOut, ShownPath, implausible_value, is_kept, message, significant,
    write_together,
};
use calibench::photos::{Fit, Fitter};
use calibench_harness::Figure;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// A mark may lie this part of the image's longer side beyond the centres of the outermost pixels, one pixel
/// at least: its border is half a pixel away, files that count pixels from 1 add half a pixel, and what noise
/// adds to marks at the border is no other image's size.
const BEYOND: f64 = 0.02;

/// Whether a mark lies in an image, or as little outside as noise puts it.
fn within(pixel: &Vec2, (width, height): (usize, usize)) -> bool {
    let beyond = (BEYOND * width.max(height) as f64).max(1.0);
    let on_side = |at: f64, length: usize| (-beyond..=length as f64 - 1.0 + beyond).contains(&at);
    on_side(pixel.x, width) && on_side(pixel.y, height)
}

/// Marks outside of the image are those of another camera or another size, most often of one whose sides were
/// swapped. `marks` are the view's name and the pixel of each.
pub(super) fn refuse_marks_outside(
    source: &str,
    image_size: Option<(usize, usize)>,
    marks: &[(&str, Vec2)],
) -> Result<(), String> {
    let Some(size) = image_size else { return Ok(()) };
    let outside = marks.iter().filter(|(_, pixel)| !within(pixel, size)).count();
    let Some((name, first)) = marks.iter().find(|(_, pixel)| !within(pixel, size)) else { return Ok(()) };
    let (width, height) = size;
    let swapped = width != height && marks.iter().all(|(_, pixel)| within(pixel, (height, width)));
    let help = match swapped {
        true => format!("all lie in {height}x{width}: were the sides swapped?"),
        false => "check --image-size and the columns u and v".to_string(),
    };
    Err(format!(
        "{source}: {outside} of {} marks lie outside of the image of {width} x {height} px, the first, of view {name}, at ({}, {}): {help}",
        marks.len(),
        significant(first.x, 6),
        significant(first.y, 6),
    ))
}

/// The same of the marks of views with their names.
pub(crate) fn refuse_views_outside<'a>(
    source: &str,
    image_size: Option<(usize, usize)>,
    views: impl Iterator<Item = (&'a String, &'a [Vec2])>,
) -> Result<(), String> {
    let marks = views.flat_map(|(name, pixels)| pixels.iter().map(move |pixel| (name.as_str(), *pixel)));
    refuse_marks_outside(source, image_size, &marks.collect::<Vec<_>>())
}

/// Numbers that no verb takes for a camera's are not told as one.
pub(super) fn refuse_no_camera(source: &str, camera: &Camera<Lens>) -> Result<(), String> {
    let odd = camera.values().find_map(|(parameter, value)| implausible_value(parameter, value));
    odd.map_or(Ok(()), |reason| {
        Err(format!(
            "{source}: the cost falls towards what is no camera: {reason}; check the marks, and what is held"
        ))
    })
}

impl Observed {
    fn refuse_marks_outside(&self) -> Result<(), String> {
        let views = self.names.iter().zip(self.views.iter().map(View::pixels));
        refuse_views_outside(&self.source, self.image_size, views)
    }
}

pub(super) fn run(arguments: &Arguments, observed: Observed) -> Result<Exit, String> {
    observed.refuse_marks_outside()?;
    let mut settings = arguments.settings(observed.image_size);
    let comparison = match arguments.model {
        Some(ModelChoice::Auto) => Some(models::compare(&observed, &mut settings)?),
        _ => None,
    };
    let fitter =
        Fitter { settings: &settings, discs: observed.discs.as_ref(), reject_factor: arguments.reject_views };
    let fit =
        fitter.fit(&observed.views).map_err(|error| format!("{}: {}", observed.source, message(&error)))?;
    refuse_no_camera(&observed.source, &fit.calibration.camera)?;
    let unwritten = observed.unwritten.clone();
    let mut finished = finish(observed, fit, arguments.pixel_pitch, settings.loss);
    finished.advice.extend(models::freedoms(&finished.fit, &settings));
    finished.comparison = comparison;
    let mut fields =
        CalibrationFields::of(&finished.fit.calibration, &finished.whole_names, finished.image_size)
            .with_loss(settings.loss);
    finished.loss = fields.loss.clone();
    fields.left_out = finished.left_out.clone();
    fields.orientation = finished.orientation.map(Orientation::name);
    fields.models = finished.comparison.iter().flat_map(|c| c.fields()).collect();
    fields.warnings = warnings(&finished);
    let json = finished.optics.with(&fields);
    let written = arguments.out.as_ref().map_or(Ok(()), |folder| {
        write_files(folder, &json, &finished, arguments.memory()).inspect(|()| {
            of_earlier_runs(folder, &finished).iter().for_each(|file| {
                warn(&format!("{} is of an earlier run, not of this result", folder.join(file).shown()));
            });
        })
    });
    print_either(arguments.format, &text(&finished), &json);
    let exit = if finished.fit.calibration.is_usable() { Exit::Held } else { Exit::Incomplete };
    let exit = unless_unwritten(written, exit);
    // The result and its page are whole without one of the pictures.
    Ok(unwritten.map_or(exit, |error| {
        warn(&error);
        Exit::Incomplete
    }))
}

fn finish(observed: Observed, fit: Fit, pixel_pitch_um: Option<f64>, loss: Loss) -> Finished {
    let (mut left_out, mut left_out_places) = (observed.left_out, observed.left_out_places);
    for rejected in &fit.rejected {
        let name = observed.names[rejected.view].clone();
        left_out.push(LeftOut { name, reason: rejected.reason.clone() });
        left_out_places.push(observed.places[rejected.view]);
    }
    let whole_names: Vec<String> = fit.kept.iter().map(|&view| observed.names[view].clone()).collect();
    let names = ViewNames::new(observed.given, fit.kept.iter().map(|&view| observed.places[view]).collect());
    let mut notes = observed.notes;
    notes.extend(bias_note(&fit));
    let advice = advice::of(&fit, &whole_names, observed.image_size, loss);
    let optics = Optics::of(&fit.calibration, observed.image_size, pixel_pitch_um);
    let Observed { title, unit, photos, image_size, overlays, orientation, .. } = observed;
    Finished {
        title,
        unit,
        fit,
        whole_names,
        names,
        photos,
        image_size,
        left_out,
        left_out_places,
        overlays,
        optics,
        notes,
        advice,
        orientation,
        comparison: None,
        loss: None,
    }
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

/// All files or none, `result.json` last: where it is new, all that belongs to it is.
fn write_files(folder: &Path, json: &str, finished: &Finished, memory: u64) -> std::io::Result<()> {
    let figures = figures(finished);
    let before_after = BeforeAfter::of(finished, memory);
    let page = page::html(finished, &figures, before_after.as_ref()).into_bytes();
    let mut files: Vec<(PathBuf, Vec<u8>)> =
        figures.into_iter().map(|figure| (folder.join(figure.file_name()), figure.bytes)).collect();
    let pictures = before_after.iter().flat_map(BeforeAfter::files);
    files.extend(pictures.map(|(name, bytes)| (folder.join(name), bytes)));
    files.push((folder.join("report.html"), page));
    if finished.orientation.is_some() {
        files.push((folder.join("corners.csv"), corners(finished).into_bytes()));
    }
    files.push((folder.join("result.json"), json.as_bytes().to_vec()));
    write_together(&files)
}

/// Files in the folder that photographs left there, and that are not of this result.
fn of_earlier_runs(folder: &Path, finished: &Finished) -> Vec<String> {
    let pictures = std::fs::read_dir(folder.join("overlay")).into_iter().flatten().flatten();
    let names = pictures.map(|file| format!("overlay/{}", file.file_name().to_string_lossy()));
    let corners = finished.orientation.is_none() && folder.join("corners.csv").exists();
    let is_of_this =
        |name: &String| finished.overlays.values().any(|own| own == name) || is_kept(&folder.join(name));
    let mut files: Vec<String> = names.collect();
    files.sort();
    files.extend(corners.then(|| "corners.csv".to_string()));
    files.retain(|name| !is_of_this(name));
    files
}

/// The marks of photographs as they were fitted, without the bias of discs: calibrated again they give the
/// same camera.
fn corners(finished: &Finished) -> String {
    let mut seen = BTreeMap::new();
    let mut name = |name: &String| {
        let times = seen.entry(name.clone()).and_modify(|times| *times += 1).or_insert(1);
        if *times == 1 { name.clone() } else { format!("{name} ({times})") }
    };
    let view_names = finished.whole_names.iter().map(&mut name).collect();
    corner_text(&CornerFile { view_names, views: finished.fit.views.clone() })
}

fn figures(finished: &Finished) -> Vec<Figure> {
    let calibration = &finished.fit.calibration;
    let numbers: Vec<usize> = (0..finished.fit.views.len()).map(|view| finished.names.number(view)).collect();
    let pixels: Vec<Vec2> = finished.fit.views.iter().flat_map(|view| view.pixels()).copied().collect();
    let mut figures = plots::figures(calibration, &pixels, &numbers, finished.image_size);
    figures.extend(scatter::figures(&Residuals {
        all: finished.weighted_residuals().iter().flatten().map(|r| (r.x, r.y)).collect(),
        sigma_px: calibration.sigma_px,
        is_weighted: finished.is_weighted(),
    }));
    figures.extend(poses::figures(finished));
    let maps = |size| maps::figures(calibration, &pixels, size);
    figures.extend(finished.image_size.into_iter().flat_map(maps));
    figures
}

/// Intervals by the profile of the cost, if they were asked for.
fn interval_table(intervals: &[ProfileInterval]) -> String {
    let Some(first) = intervals.first() else { return String::new() };
    let title = format!("{} % from", significant(100.0 * first.coverage, 3));
    let mut rows = table(&["parameter", &title, "to", "by the standard deviation from", "to"]);
    let end = |value: Option<f64>| value.map_or("open".to_string(), |value| significant(value, 7));
    for interval in intervals {
        rows.add_row([
            interval.parameter.name().to_string(),
            end(interval.low),
            end(interval.high),
            significant(interval.linear.0, 7),
            significant(interval.linear.1, 7),
        ]);
    }
    format!("{}\n\n", rows.trim_fmt())
}

fn text(finished: &Finished) -> String {
    let calibration = &finished.fit.calibration;
    let mut parameters = table(&["parameter", "value", "standard deviation", "unit"]);
    parameter_rows(calibration).into_iter().for_each(|row| {
        parameters.add_row(row);
    });
    let comparison = finished.comparison.as_ref().map(Comparison::text).unwrap_or_default();
    let intervals = interval_table(&calibration.intervals);
    let columns = ["no.", "view", "points", "RMSE (px)", "distance"];
    // Names that are numbers need no others.
    let first = usize::from(finished.names.are_numbers());
    let mut views = table(&columns[first..]);
    for (i, name) in finished.whole_names.iter().enumerate() {
        let rmse = calibration.view_rmse_px(i).unwrap_or(f64::NAN);
        let distance = calibration.cam_from_target[i].translation.norm();
        let points = calibration.residuals[i].len().to_string();
        let number = finished.names.number(i).to_string();
        let row = [number, name.clone(), points, significant(rmse, 4), significant(distance, 5)];
        views.add_row(&row[first..]);
    }
    let mut text = format!(
        "{comparison}{}\n\n{intervals}{}\n\n{}{}",
        parameters.trim_fmt(),
        views.trim_fmt(),
        summary(finished),
        finished.optics.text()
    );
    // Writing to a string cannot fail, here and below.
    if let Some(weakest) = weakest(calibration) {
        let _ = writeln!(text, "weakest direction: {weakest}");
    }
    let view = if finished.names.are_numbers() { "view " } else { "" };
    for LeftOut { name, reason } in &finished.left_out {
        let _ = writeln!(text, "left out: {view}{name}: {reason}");
    }
    for warning in warnings(finished) {
        let _ = writeln!(text, "warning: {warning}");
    }
    text
}
