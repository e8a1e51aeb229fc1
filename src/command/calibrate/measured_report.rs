//! What is said of a camera from measured marks, as text and on its page?

use super::super::report::table;
use super::finished::{parameter_rows, weakest};
use super::optics::Optics;
use calibench::calibrate::in_words;
use calibench::io::{SeenFile, significant};
use calibench::measured::{CorrectedMark, FALSE_ALARM, MeasuredCalibration, Noise, SumTest};
use std::fmt::Write;

/// Marks that a table for people has.
const MARKS_SHOWN: usize = 10;

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

/// As text.
pub(super) fn text(report: &Report<'_>) -> String {
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
