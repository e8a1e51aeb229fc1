//! The report as a page: one HTML file with its plots in it; of photographs with pictures beside it.

use super::before_after::BeforeAfter;
use super::finished::{Finished, parameter_rows, summary, warnings, weakest};
use super::html::{self, escaped, heading, note, number, paragraph, table};
use super::optics::Optics;
use super::{gallery, worst};
use calibench::calibrate::LensCalibration;
use calibench_harness::Figure;
use std::fmt::Write;

/// The page.
pub(super) fn html(finished: &Finished, figures: &[Figure], before_after: Option<&BeforeAfter>) -> String {
    let mut page = html::begin(&format!("Calibration from {}", finished.title));
    paragraph(&mut page, &used(finished));
    for line in summary(finished).lines() {
        paragraph(&mut page, line);
    }
    for line in warnings(finished) {
        html::warning(&mut page, &finished.names.shortened(&line));
    }
    parameters(&mut page, &finished.fit.calibration);
    optics(&mut page, &finished.optics);
    views(&mut page, finished);
    left_out(&mut page, finished);
    worst_marks(&mut page, finished);
    heading(&mut page, "Figures");
    html::figures(&mut page, figures);
    if let Some(before_after) = before_after {
        before_after.section(&mut page, finished);
    }
    gallery::section(&mut page, finished);
    html::end(&mut page);
    page
}

/// How much of what was given was used.
fn used(finished: &Finished) -> String {
    let (given, used) = (finished.names.given(), finished.fit.views.len());
    let what = if finished.photos.is_empty() { "views" } else { "photographs" };
    match given - used.min(given) {
        0 => format!("All {given} {what} were used."),
        1 => format!("{used} of {given} {what} were used; 1 was left out, see below."),
        left => format!("{used} of {given} {what} were used; {left} were left out, see below."),
    }
}

/// The parameters with their standard deviations, and the weakest direction.
pub(super) fn parameters(page: &mut String, calibration: &LensCalibration) {
    heading(page, "Parameters");
    let rows: Vec<Vec<String>> = parameter_rows(calibration)
        .into_iter()
        .map(|row| row.iter().map(|cell| escaped(cell)).collect())
        .collect();
    table(page, 1, &["parameter", "value", "standard deviation", "unit"], &rows);
    let mut notes = Vec::new();
    if rows.iter().any(|row| row[3].is_empty()) {
        notes.push("A dash as unit: a pure number.");
    }
    if rows.iter().any(|row| row[2] == "held") {
        notes.push("Held: not estimated, so without standard deviation.");
    }
    note(page, &notes.join(" "));
    if let Some(weakest) = weakest(calibration) {
        let line = format!("Weakest direction, the combination that the data say least about: {weakest}.");
        paragraph(page, &line);
    }
}

/// Field of view and focal length in mm, where they are known.
pub(super) fn optics(page: &mut String, optics: &Optics) {
    heading(page, "Field of view and focal length");
    let mut rows = Vec::new();
    let row = |name: &str, value: f64, digits: usize, sd: Option<f64>, unit: &str| {
        let sd = sd.map_or(String::new(), |sd| number(sd, 2));
        vec![name.to_string(), number(value, digits), sd, unit.to_string()]
    };
    let mut notes = Vec::new();
    match &optics.field_of_view {
        Some(view) => {
            let angles = [
                ("horizontal field of view", view.horizontal),
                ("vertical field of view", view.vertical),
                ("diagonal field of view", view.diagonal),
            ];
            rows.extend(angles.map(|(name, angle)| row(name, angle.unwrap_or(f64::NAN), 5, None, "degrees")));
            notes.push(
                "Field of view: between the rays at opposite edges of the image, in the row and the column of the principal point \
                 and along the wider diagonal; no standard deviation is computed for it.",
            );
            if angles.iter().any(|(_, angle)| angle.is_none()) {
                notes.push(
                    "An angle without value: the lens model is not one-to-one up to that edge of the image.",
                );
            }
        }
        None => notes.push("The field of view needs the image's size: give --image-size."),
    }
    match &optics.focal_length {
        Some(focal) => {
            let [x, y] = focal.standard_deviations;
            rows.push(row("focal length along u", focal.x, 6, x, "mm"));
            rows.push(row("focal length along v", focal.y, 6, y, "mm"));
            if x.is_none() || y.is_none() {
                notes.push("A focal length without standard deviation was held.");
            }
        }
        None => notes
            .push("The focal length in mm needs the distance of the sensor's pixels: give --pixel-pitch."),
    }
    let pitch = optics.focal_length.as_ref().map(|focal| {
        format!("Focal length: for pixels of {} \u{b5}m, taken as exact.", focal.pixel_pitch_um)
    });
    if !rows.is_empty() {
        table(page, 1, &["quantity", "value", "standard deviation", "unit"], &rows);
    }
    notes.extend(pitch.as_deref());
    note(page, &notes.join(" "));
}

fn views(page: &mut String, finished: &Finished) {
    heading(page, "Views");
    let distance = format!("distance ({})", finished.unit);
    let header = ["no.", "view", "points", "RMSE (px)", "largest (px)", &distance, "tilt (deg)"];
    let rows: Vec<Vec<String>> = (0..finished.fit.views.len()).map(|view| view_row(finished, view)).collect();
    // Names that are numbers need no others.
    let first = usize::from(finished.names.are_numbers());
    let rows: Vec<Vec<String>> = rows.iter().map(|row| row[first..].to_vec()).collect();
    table(page, 2 - first, &header[first..], &rows);
    let counted = match first {
        0 => "The number of a view is its place in what was given, here, in the plots and in the warnings. ",
        _ => "",
    };
    note(
        page,
        &format!(
            "{counted}Distance: of the board's origin, along the optical axis. Tilt: between the board's normal and the optical axis."
        ),
    );
}

fn view_row(finished: &Finished, view: usize) -> Vec<String> {
    let calibration = &finished.fit.calibration;
    let residuals = &calibration.residuals[view];
    let largest = residuals.iter().map(|r| r.norm()).fold(0.0, f64::max);
    let pose = &calibration.cam_from_target[view];
    // Angle between the board's normal and the optical axis, whichever side of the board is called its
    // front.
    let normal = pose.rotation.column(2);
    let tilt = libm::atan2(libm::hypot(normal.x, normal.y), normal.z.abs()).to_degrees();
    vec![
        finished.names.number(view).to_string(),
        finished.linked(finished.names.place(view)),
        residuals.len().to_string(),
        number(calibration.view_rmse_px(view).unwrap_or(f64::NAN), 4),
        number(largest, 3),
        number(pose.translation.norm(), 5),
        format!("{tilt:.1}"),
    ]
}

fn left_out(page: &mut String, finished: &Finished) {
    if finished.left_out.is_empty() {
        return;
    }
    heading(page, "Left out");
    let mut left: Vec<_> = finished.left_out.iter().zip(&finished.left_out_places).collect();
    left.sort_by_key(|(_, place)| **place);
    let row = |(left, &place): (&calibench::io::LeftOut, &usize)| {
        let reason = escaped(&finished.names.shortened(&left.reason));
        format!("<li>{}: {reason}</li>\n", finished.called(place))
    };
    let rows: String = left.into_iter().map(row).collect();
    // Writing to a string cannot fail.
    let _ = write!(page, "<ul>\n{rows}</ul>\n");
}

fn worst_marks(page: &mut String, finished: &Finished) {
    let header = worst::header(finished);
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    let rows = worst::rows(finished);
    heading(page, &format!("The {} marks that fit worst", rows.len()));
    table(page, if finished.names.are_numbers() { 1 } else { 2 }, &header, &rows);
    let weight = if finished.is_weighted() { " times the mark's weight" } else { "" };
    note(
        page,
        &format!(
            "Point: the mark's place in its view, from 0. X, Y: on the board. u, v: where it was seen. du, dv: predicted \u{2212} \
             observed. In sigma: the length{weight} over the estimated noise of a coordinate; of normal noise one mark in 100 \
             exceeds 3, one in 3000 exceeds 4."
        ),
    );
}
