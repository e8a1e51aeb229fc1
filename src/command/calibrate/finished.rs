//! What is said of a finished calibration, in the terminal and on the page?

use super::html::escaped;
use super::models::Comparison;
use super::optics::Optics;
use super::view_names::ViewNames;
use calibench::board::View;
use calibench::calibrate::{BoardShape, Certificate, LensCalibration, Outliers, Warning, in_words};
use calibench::camera::Parameter;
use calibench::detect::Orientation;
use calibench::geometry::Vec2;
use calibench::io::{LeftOut, significant};
use calibench::photos::Fit;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::PathBuf;

/// A finished calibration with all that is said of it.
pub(super) struct Finished {
    /// What the page calls the input.
    pub(super) title: String,
    /// Unit of lengths on the board.
    pub(super) unit: String,
    pub(super) fit: Fit,
    /// Whole names of the views that were fitted.
    pub(super) whole_names: Vec<String>,
    /// Numbers and short names of all that were given.
    pub(super) names: ViewNames,
    /// The photographs that were given, if the input is photographs.
    pub(super) photos: Vec<PathBuf>,
    pub(super) image_size: Option<(usize, usize)>,
    pub(super) left_out: Vec<LeftOut>,
    /// The place of each that was left out among those given.
    pub(super) left_out_places: Vec<usize>,
    /// Pictures by the views' places: paths relative to the output folder.
    pub(super) overlays: BTreeMap<usize, String>,
    pub(super) optics: Optics,
    pub(super) notes: Vec<String>,
    pub(super) advice: Vec<String>,
    /// How far photographs tell which mark is the board's first.
    pub(super) orientation: Option<Orientation>,
    /// Of lens models, if one was to be chosen.
    pub(super) comparison: Option<Comparison>,
    /// What residuals counted by, where not by their squares.
    pub(super) loss: Option<String>,
}

impl Finished {
    /// The name at a place as HTML, which leads to its picture if there is one.
    pub(super) fn linked(&self, place: usize) -> String {
        let name = escaped(self.names.label_at(place));
        match self.overlays.get(&place) {
            Some(overlay) => format!("<a href=\"{}\">{name}</a>", escaped(overlay)),
            None => name,
        }
    }

    /// Whether marks have weights.
    pub(super) fn is_weighted(&self) -> bool {
        self.fit.views.iter().any(|view| view.weights().is_some())
    }

    /// The residuals, each times its mark's weight: the noise is that of a coordinate of these, px.
    pub(super) fn weighted_residuals(&self) -> Vec<Vec<Vec2>> {
        let of_view = |(view, residuals): (&View, &Vec<Vec2>)| match view.weights() {
            Some(weights) => residuals.iter().zip(weights).map(|(r, w)| r * *w).collect(),
            None => residuals.clone(),
        };
        self.fit.views.iter().zip(&self.fit.calibration.residuals).map(of_view).collect()
    }

    /// How a view is called in running text: its number, and its name where that says more.
    pub(super) fn called(&self, place: usize) -> String {
        let number = self.names.number_at(place);
        if self.names.are_numbers() {
            number.to_string()
        } else {
            format!("{number} \u{b7} {}", self.linked(place))
        }
    }
}

/// What to be careful about: the fit's own warnings, what concerns the input, and advice.
pub(super) fn warnings(finished: &Finished) -> Vec<String> {
    let own = in_words(&finished.names.numbered(&finished.fit.calibration.warnings));
    let own = own.into_iter().chain(stray(finished));
    own.chain(finished.notes.iter().chain(&finished.advice).cloned()).collect()
}

/// Where the worst of the marks is that are too far off to be noise: by its number in the fit nobody finds it
/// in a file that numbers its points otherwise.
fn stray(finished: &Finished) -> Option<String> {
    let found = finished.fit.calibration.warnings.iter().find_map(|warning| match warning {
        Warning::Outliers(Outliers { view, point, .. }) => Some((*view, *point)),
        _ => None,
    });
    let (view, point) = found?;
    let seen = finished.fit.views.get(view)?;
    let (at, pixel) = (seen.points().get(point)?, seen.pixels().get(point)?);
    // As the file has them, so that they can be searched for.
    let [x, y, u, v] = [at.x, at.y, pixel.x, pixel.y];
    let view = finished.names.label_at(finished.names.place(view));
    Some(format!(
        "that mark is the one at X {x}, Y {y} in view {view}, seen at u {u}, v {v}: points are counted from 0 in each view"
    ))
}

/// Parameters worth a line: name, value, standard deviation or `held`, unit.
pub(super) fn parameter_rows(calibration: &LensCalibration) -> Vec<[String; 4]> {
    let row = |(parameter, value): (Parameter, f64)| {
        let deviation = match calibration.standard_deviation(parameter) {
            Some(sd) => significant(sd, 3),
            None if value == 0.0 => return None,
            None => "held".to_string(),
        };
        let value = significant(value, 10);
        Some([parameter.name().to_string(), value, deviation, parameter.unit().to_string()])
    };
    calibration.camera.values().filter_map(row).collect()
}

/// The weakest direction in words; `None` if nothing but poses was free.
pub(super) fn weakest(calibration: &LensCalibration) -> Option<String> {
    let conditioning = calibration.conditioning.as_ref()?;
    let members: Vec<String> =
        conditioning.weakest.iter().map(|m| format!("{} {:+.2}", m.unknown, m.weight)).collect();
    Some(members.join(", "))
}

/// What the pixels of a weighted fit are.
const OF_WEIGHTS: &str = "marks have weights: RMSE and noise are those of a mark of weight 1; with sigma_px they are multiples of it\n";

/// The fit in a sentence.
pub(super) fn summary(finished: &Finished) -> String {
    let calibration = &finished.fit.calibration;
    let axes = calibration.rms_per_axis_px();
    let mut text = format!(
        "RMSE {} px over {} points (u {}, v {}); noise of a coordinate {} px on {} degrees of freedom\n{} after {} steps\n",
        significant(calibration.rmse_px, 7),
        calibration.points(),
        significant(axes.x, 4),
        significant(axes.y, 4),
        significant(calibration.sigma_px, 4),
        calibration.degrees_of_freedom,
        calibration.termination.name(),
        calibration.iterations,
    );
    if finished.is_weighted() {
        text.push_str(OF_WEIGHTS);
    }
    if let Some(loss) = &finished.loss {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "residuals count by {loss}: strays are in RMSE and noise, and hardly in camera and deviations"
        );
    }
    if let Some(sentence) = calibration.certificate.as_ref().and_then(certificate) {
        text.push_str(&sentence);
    }
    text.push_str(&model(calibration));
    text.push_str(&beforehand(calibration));
    text.push_str(first_mark(finished.orientation));
    if let Some(bias) = &finished.fit.bias {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "bias of the discs' centres corrected in {} rounds: {} px RMS, {} px at most",
            bias.rounds,
            significant(bias.rms_px, 3),
            significant(bias.largest_px, 3)
        );
    }
    text
}

/// The lens model, if it is not the usual one, and the board's shape; what is not certified is said to be so.
fn model(calibration: &LensCalibration) -> String {
    let model = calibration.camera.distortion.model();
    let mut text = String::new();
    if calibration.certificate.is_none() {
        let _ = writeln!(text, "lens model {model}, starts refined: {}, not certified", calibration.starts);
    }
    if let Some(BoardShape { bow_x, bow_y, twist, standard_deviations: sd, .. }) = calibration.board {
        let known = |value: f64, sd: f64| format!("{} \u{b1} {}", significant(value, 4), significant(sd, 2));
        let twist = if sd[2] > 0.0 { format!(", twist {}", known(twist, sd[2])) } else { String::new() };
        let (x, y) = (known(bow_x, sd[0]), known(bow_y, sd[1]));
        let _ = writeln!(text, "board: bow along x {x}, along y {y}{twist}, in the target's unit");
    }
    text
}

/// Which mark is the first; nothing of marks that were given.
fn first_mark(orientation: Option<Orientation>) -> &'static str {
    match orientation {
        None => "",
        Some(Orientation::Fixed) => {
            "first mark: the same one of the board in every view, by the colours of its squares, its markers or where its rows begin\n"
        }
        Some(Orientation::HalfTurn) => {
            "first mark: not fixed by this board, which looks the same after half a turn; in each view that nearer to the top left\n"
        }
        Some(Orientation::QuarterTurn) => {
            "first mark: not fixed by this board, which looks the same after a quarter turn; in each view that nearest to the top left\n"
        }
    }
}

/// What was tied and what was known, a line each.
fn beforehand(calibration: &LensCalibration) -> String {
    let tie = calibration.covariance.fy_per_fx.map(|ratio| format!("tied: fy = {ratio} fx\n"));
    let known = calibration
        .priors
        .iter()
        .map(|p| format!("known beforehand: {} = {} +- {}\n", p.parameter, p.mean, p.standard_deviation));
    tie.into_iter().chain(known).collect()
}

/// The certificate in a sentence; none where nothing can be certified.
fn certificate(certificate: &Certificate) -> Option<String> {
    certificate.is_possible().then(|| {
        format!(
            "{}: free homographies behind the same lens reach {} px, by chance with probability {}\n",
            if certificate.holds() { "certified" } else { "not certified" },
            significant(certificate.floor_rmse_px, 7),
            significant(certificate.p_value, 2),
        )
    })
}
