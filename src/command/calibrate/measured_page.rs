//! The report of a calibration from measured marks as a page: the camera, how the marks were corrected, and
//! plots.

use super::html::{self, escaped, heading, note, number, paragraph, table};
use super::measured_report::{CORRECTION_COLUMNS, Report, correction_rows, summary};
use super::page::{optics, parameters};
use super::scatter::{self, Residuals};
use super::{maps, plots};
use calibench::geometry::Vec2;
use calibench_harness::Figure;

/// The plots of the page.
pub(super) fn figures(report: &Report<'_>, image_size: Option<(usize, usize)>) -> Vec<Figure> {
    let calibration = &report.found.calibration;
    let marks = || report.seen.views.iter().flat_map(|view| view.marks());
    let pixels: Vec<Vec2> = marks().map(|mark| mark.pixel).collect();
    let numbers: Vec<usize> = (1..=report.seen.views.len()).collect();
    let weighted = marks().zip(calibration.residuals.iter().flatten()).map(|(mark, r)| mark.weight * r);
    let mut figures = plots::figures(calibration, &pixels, &numbers, image_size);
    figures.extend(scatter::figures(&Residuals {
        all: weighted.map(|r| (r.x, r.y)).collect(),
        sigma_px: calibration.sigma_px,
        is_weighted: marks().any(|mark| mark.weight != 1.0),
    }));
    figures.extend(image_size.into_iter().flat_map(|size| maps::figures(calibration, &pixels, size)));
    figures
}

/// The page.
pub(super) fn html(report: &Report<'_>, figures: &[Figure]) -> String {
    let title = format!("Calibration from {} and the marks measured in {}", report.corners, report.target);
    let mut page = html::begin(&title);
    summary(report.found).lines().for_each(|line| paragraph(&mut page, line));
    report.warnings().for_each(|line| html::warning(&mut page, &line));
    parameters(&mut page, &report.found.calibration);
    optics(&mut page, &report.optics);
    views(&mut page, report);
    corrections(&mut page, report);
    heading(&mut page, "Figures");
    html::figures(&mut page, figures);
    html::end(&mut page);
    page
}

fn views(page: &mut String, report: &Report<'_>) {
    let calibration = &report.found.calibration;
    let row = |(view, name): (usize, &String)| {
        let residuals = &calibration.residuals[view];
        let largest = residuals.iter().map(|r| r.norm()).fold(0.0, f64::max);
        vec![
            (view + 1).to_string(),
            escaped(name),
            residuals.len().to_string(),
            number(calibration.view_rmse_px(view).unwrap_or(f64::NAN), 4),
            number(largest, 3),
            number(calibration.cam_from_target[view].translation.norm(), 5),
        ]
    };
    let rows: Vec<Vec<String>> = report.seen.view_names.iter().enumerate().map(row).collect();
    heading(page, "Views");
    let header = ["no.", "view", "points", "RMSE (px)", "largest (px)", "distance (target units)"];
    table(page, 2, &header, &rows);
    note(
        page,
        "The number of a view is its place here and in the plots. Distance: of the target's origin, along the optical axis.",
    );
}

fn corrections(page: &mut String, report: &Report<'_>) {
    let (rows, more) = correction_rows(report.found);
    heading(page, "Corrections of the marks");
    if rows.is_empty() {
        paragraph(page, "All marks were taken as exact.");
        return;
    }
    let rows: Vec<Vec<String>> =
        rows.iter().map(|row| row.iter().map(|cell| escaped(cell)).collect()).collect();
    table(page, 1, &CORRECTION_COLUMNS, &rows);
    let more = match more {
        0 => String::new(),
        more => format!("{more} more marks have corrections that are more probable. "),
    };
    note(
        page,
        &format!(
            "{more}dX, dY, dZ: from where the mark was measured to where the photographs put it, in target units. In deviations: the same over \
             what was expected of a right mark. By chance: the probability that a right mark is corrected so much. All marks: marks.csv."
        ),
    );
}
