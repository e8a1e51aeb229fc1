//! A camera from a corner file and the measured places of its marks: `calibrate CORNERS.csv --target
//! TARGET.csv`.

use super::finished::{parameter_rows, weakest};
use super::optics::Optics;
use super::{Arguments, Exit, Failure, Format, measured_page, print, table, unended};
use calibench::calibrate::in_words;
use calibench::geometry::{Vec2, Vec3};
use calibench::io::input::{MOST_TABLE_BYTES, read_named};
use calibench::io::{
    MeasuredFields, SeenFile, ShownPath, parse_seen, parse_target, refusal_by_names, significant,
    write_together,
};
use calibench::measured::{
    CorrectedMark, FALSE_ALARM, MeasuredCalibration, Noise, SumTest, calibrate_measured,
};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Marks that a table for people has.
const MARKS_SHOWN: usize = 10;

pub(super) fn run(arguments: &Arguments, corners: &Path, target: &Path) -> Result<Exit, Failure> {
    let (target_name, target_bytes) = read(target)?;
    let (name, bytes) = read(corners)?;
    let measured = parse_target(&target_name, &target_bytes).map_err(|error| error.to_string())?;
    let seen = parse_seen(&name, &bytes).map_err(|error| error.to_string())?;
    super::camera::refuse_marks_outside(&name, arguments.image_size, &pixels(&seen))?;
    let noise = arguments.sigma.map_or(Noise::Estimated, |sigma_px| Noise::Known { sigma_px });
    let found = calibrate_measured(&measured, &seen.views, &arguments.settings(arguments.image_size), noise)
        .map_err(|error| format!("{name}: {}", refusal_by_names(&error, &seen.view_names)))?;
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
    if let Some(folder) = &arguments.out {
        write_together(&files(folder, &report, arguments.image_size, &json)).map_err(Failure::unwritten)?;
    }
    match arguments.format {
        Format::Json => print(&json),
        Format::Text => print(&text(&report)),
    }
    Ok(if found.calibration.is_usable() { Exit::Held } else { Exit::Incomplete })
}

/// A finished calibration with all that is said of it.
pub(super) struct Report<'a> {
    /// What the corner file is called.
    pub(super) corners: String,
    /// What the target's file is called.
    pub(super) target: String,
    pub(super) found: &'a MeasuredCalibration,
    pub(super) seen: &'a SeenFile,
    pub(super) optics: Optics,
    pub(super) notes: Vec<String>,
}

impl Report<'_> {
    /// What to be careful about.
    pub(super) fn warnings(&self) -> impl Iterator<Item = String> {
        let own = in_words(&self.found.calibration.warnings).into_iter().chain(self.found.doubts());
        own.chain(self.notes.iter().cloned())
    }
}

fn read(file: &Path) -> Result<(String, Vec<u8>), String> {
    let bytes = read_named(file, MOST_TABLE_BYTES).map_err(|error| error.to_string())?;
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

fn text(report: &Report<'_>) -> String {
    let Report { found, seen, optics, .. } = report;
    let calibration = &found.calibration;
    let mut parameters = table(&["parameter", "value", "standard deviation", "unit"]);
    parameter_rows(calibration).into_iter().for_each(|row| {
        parameters.add_row(row);
    });
    let mut views = table(&["view", "points", "RMSE (px)", "distance"]);
    for (i, name) in seen.view_names.iter().enumerate() {
        let rmse = calibration.view_rmse_px(i).unwrap_or(f64::NAN);
        let distance = calibration.cam_from_target[i].translation.norm();
        let points = calibration.residuals[i].len().to_string();
        views.add_row([name.clone(), points, significant(rmse, 4), significant(distance, 5)]);
    }
    let mut text = format!("{}\n\n{}\n\n", parameters.trim_fmt(), views.trim_fmt());
    text += &corrections(found);
    text += &summary(found);
    if let Some(weakest) = weakest(calibration) {
        let _ = writeln!(text, "weakest direction: {weakest}");
    }
    text += &optics.text();
    for warning in report.warnings() {
        let _ = writeln!(text, "warning: {warning}");
    }
    text
}

/// Columns of [`correction_rows`].
pub(super) const CORRECTION_COLUMNS: [&str; 7] =
    ["mark", "views", "dX", "dY", "dZ", "in deviations", "by chance"];

/// The least probable corrections, and how many there are besides; of marks that are known exactly there are
/// none.
pub(super) fn correction_rows(found: &MeasuredCalibration) -> (Vec<[String; 7]>, usize) {
    let mut uncertain: Vec<&CorrectedMark> = found.marks.iter().filter(|m| m.expected.norm() > 0.0).collect();
    uncertain.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
    let row = |mark: &&CorrectedMark| {
        let length = |k: usize| significant(mark.correction[k], 3);
        let normalised: Vec<String> = mark.normalised.iter().map(|w| format!("{w:+.1}")).collect();
        [
            mark.id.clone(),
            mark.views.to_string(),
            length(0),
            length(1),
            length(2),
            normalised.join(" "),
            significant(mark.p_value, 2),
        ]
    };
    let rows = uncertain.iter().take(MARKS_SHOWN).map(row).collect();
    (rows, uncertain.len().saturating_sub(MARKS_SHOWN))
}

fn corrections(found: &MeasuredCalibration) -> String {
    let (corrected, more) = correction_rows(found);
    if corrected.is_empty() {
        return String::new();
    }
    let mut rows = table(&CORRECTION_COLUMNS);
    corrected.into_iter().for_each(|row| {
        rows.add_row(row);
    });
    let more = match more {
        0 => String::new(),
        more => format!("and {more} marks whose corrections are more probable\n"),
    };
    format!("{}\n{more}\n", rows.trim_fmt())
}

/// The fit in sentences.
pub(super) fn summary(found: &MeasuredCalibration) -> String {
    let calibration = &found.calibration;
    let noise = match found.noise {
        Noise::Estimated => "estimated",
        Noise::Known { .. } => "given",
    };
    let mut text = format!(
        "RMSE {} px over {} points; noise of a coordinate {} px ({noise}) on {} degrees of freedom\n{} after {} steps, lens model {}, starts refined: {}, \
         not certified\n",
        significant(calibration.rmse_px, 7),
        calibration.points(),
        significant(calibration.sigma_px, 4),
        calibration.degrees_of_freedom,
        calibration.termination.name(),
        calibration.iterations,
        calibration.camera.distortion.model(),
        calibration.starts,
    );
    let tested = |what: &str, test: &SumTest| {
        format!(
            "{what} {}: {} times what was expected, sum of squares {} for {}, by chance with probability {} (asked at {FALSE_ALARM})\n",
            if test.holds() { "can be believed" } else { "cannot be believed" },
            significant(test.factor(), 3),
            significant(test.sum, 4),
            significant(test.expected, 4),
            significant(test.p_value, 2),
        )
    };
    text += &found
        .credibility
        .map_or(String::new(), |t| tested("corrections: the marks' standard deviations", &t));
    text += &found.noise_test.map_or(String::new(), |t| tested("residuals: the noise that was given", &t));
    if !found.unseen.is_empty() {
        let _ = writeln!(text, "marks of the target that no view shows: {}", found.unseen.len());
    }
    text
}
