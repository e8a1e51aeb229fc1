//! Did the detector find what a person sees? A small picture of each photograph, which opens the whole one.

use super::finished::Finished;
use super::html::{escaped, heading, note, number, picture};

/// The pictures of all photographs that could be read; nothing of a corner file.
pub(super) fn section(page: &mut String, finished: &Finished) {
    if finished.overlays.is_empty() {
        return;
    }
    heading(page, "Photographs and the marks found");
    note(
        page,
        "Rows of marks in the colours of their order, a circle around the first mark. Where the board was not found, a red cross \
         stands on each disc that was seen. A picture opens in full size.",
    );
    page.push_str("<div class=\"pictures\">\n");
    for (&place, file) in &finished.overlays {
        let name = finished.names.label_at(place);
        let caption = format!("{}<br>{}", finished.called(place), escaped(&fate(finished, place)));
        picture(page, file, &format!("marks found in {name}"), &caption);
    }
    page.push_str("</div>\n");
}

/// How a photograph was used.
fn fate(finished: &Finished, place: usize) -> String {
    let calibration = &finished.fit.calibration;
    let fitted = (0..calibration.residuals.len()).find(|&view| finished.names.place(view) == place);
    match fitted {
        Some(view) => {
            let rmse = number(calibration.view_rmse_px(view).unwrap_or(f64::NAN), 3);
            format!("{} marks, RMSE {rmse} px", calibration.residuals[view].len())
        }
        None => "left out".to_string(),
    }
}
