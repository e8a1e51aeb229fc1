//! A camera from a corner file and the measured places of its marks: `calibrate CORNERS.csv --target
//! TARGET.csv`.

use super::super::Exit;
use super::super::said::{print_either, unless_unwritten};
use super::super::source::unended;
use super::measured_page;
use super::measured_report::{Report, text};
use super::optics::Optics;
use super::options::Arguments;
use calibench::geometry::{Vec2, Vec3};
use calibench::io::read_named_table;
use calibench::io::{
    MeasuredFields, SeenFile, ShownPath, parse_seen, parse_target, refusal_by_names, write_together,
};
use calibench::measured::{MeasuredCalibration, Noise, calibrate_measured};
use std::fmt::Write;
use std::path::{Path, PathBuf};

pub(super) fn run(arguments: &Arguments, corners: &Path, target: &Path) -> Result<Exit, String> {
    let (target_name, target_bytes) = read(target)?;
    let (name, bytes) = read(corners)?;
    let measured = parse_target(&target_name, &target_bytes).map_err(|error| error.to_string())?;
    let seen = parse_seen(&name, &bytes).map_err(|error| error.to_string())?;
    super::camera::refuse_marks_outside(&name, arguments.image_size, &pixels(&seen))?;
    let noise = arguments.sigma.map_or(Noise::Estimated, |sigma_px| Noise::Known { sigma_px });
    let found = calibrate_measured(&measured, &seen.views, &arguments.settings(arguments.image_size), noise)
        .map_err(|error| format!("{name}: {}", refusal_by_names(&error, &seen.view_names)))?;
    super::camera::refuse_no_camera(&name, &found.calibration.camera)?;
    let mut notes: Vec<String> = [(&target_name, &target_bytes), (&name, &bytes)]
        .into_iter()
        .filter_map(|(name, bytes)| unended(name, bytes))
        .collect();
    if !seen.unread.is_empty() {
        notes.push(format!(
            "{name}: columns {} were not read: {target_name} says where the marks are",
            seen.unread.join(",")
        ));
    }
    let mut fields = MeasuredFields::of(&found, &seen.view_names, arguments.image_size);
    let optics = Optics::of(&found.calibration, arguments.image_size, arguments.pixel_pitch);
    fields.calibration.warnings.extend(notes.iter().cloned());
    let json = optics.with(&fields);
    let report = Report { corners: name, target: target_name, found: &found, seen: &seen, optics, notes };
    let written = arguments
        .out
        .as_ref()
        .map_or(Ok(()), |folder| write_together(&files(folder, &report, arguments.image_size, &json)));
    print_either(arguments.format, &text(&report), &json);
    let exit = if found.calibration.is_usable() { Exit::Held } else { Exit::Incomplete };
    Ok(unless_unwritten(written, exit))
}

fn read(file: &Path) -> Result<(String, Vec<u8>), String> {
    let bytes = read_named_table(file).map_err(|error| error.to_string())?;
    let name = if file.as_os_str() == "-" { "standard input".into() } else { file.shown() };
    Ok((name, bytes))
}

/// Name of the view and pixel of every mark.
fn pixels(seen: &SeenFile) -> Vec<(&str, Vec2)> {
    let views = seen.view_names.iter().zip(&seen.views);
    views.flat_map(|(name, view)| view.marks().iter().map(move |m| (name.as_str(), m.pixel))).collect()
}

/// All or none, `result.json` last.
fn files(
    folder: &Path,
    report: &Report<'_>,
    image_size: Option<(usize, usize)>,
    json: &str,
) -> Vec<(PathBuf, Vec<u8>)> {
    let figures = measured_page::figures(report, image_size);
    let page = measured_page::html(report, &figures);
    let plots = figures.into_iter().map(|figure| (folder.join(figure.file_name()), figure.bytes));
    let marks = marks(report.found);
    let rest = [("report.html", page.as_str()), ("marks.csv", &marks), ("result.json", json)];
    plots.chain(rest.map(|(name, text)| (folder.join(name), text.as_bytes().to_vec()))).collect()
}

/// The marks as a table: where they are now, how well that is known, and how far they were corrected.
fn marks(found: &MeasuredCalibration) -> String {
    let mut text = "point,views,X,Y,Z,sdX,sdY,sdZ,dX,dY,dZ,wX,wY,wZ,p_value\n".to_string();
    for mark in &found.marks {
        let _ = write!(text, "{},{}", quoted(&mark.id), mark.views);
        let groups = [mark.position, mark.standard_deviation(), mark.correction, mark.normalised];
        for x in groups.iter().flat_map(Vec3::iter) {
            let _ = write!(text, ",{x}");
        }
        let _ = writeln!(text, ",{}", mark.p_value);
    }
    text
}

/// A name as a field of a table.
fn quoted(name: &str) -> String {
    let is_plain = !name.contains([',', '"']);
    if is_plain { name.to_string() } else { format!("\"{}\"", name.replace('"', "\"\"")) }
}
