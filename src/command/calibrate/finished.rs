//! What is said of a finished calibration, in the terminal and on the page?

use calibench::calibrate::{Calibration, Certificate};
use calibench::camera::Parameter;
use calibench::io::{LeftOut, significant};
use calibench::photos::Fit;
use std::collections::BTreeMap;
use std::fmt::Write;

/// A finished calibration with all that is said of it.
pub(super) struct Finished {
    pub(super) source: String,
    pub(super) fit: Fit,
    /// Names of the views that were fitted.
    pub(super) names: Vec<String>,
    pub(super) image_size: Option<(usize, usize)>,
    pub(super) left_out: Vec<LeftOut>,
    pub(super) overlays: BTreeMap<String, String>,
    pub(super) notes: Vec<String>,
    pub(super) advice: Vec<String>,
}

/// Parameters worth a line: name, value, standard deviation or `held`, unit.
pub(super) fn parameter_rows(finished: &Finished) -> Vec<[String; 4]> {
    let calibration = &finished.fit.calibration;
    let row = |parameter: Parameter| {
        let deviation = match calibration.standard_deviation(parameter) {
            Some(sd) => significant(sd, 3),
            None if calibration.camera.get(parameter) == 0.0 => return None,
            None => "held".to_string(),
        };
        let value = significant(calibration.camera.get(parameter), 10);
        Some([parameter.name().to_string(), value, deviation, parameter.unit().to_string()])
    };
    Parameter::ALL.into_iter().filter_map(row).collect()
}

/// The weakest direction in words; `None` if nothing but poses was free.
pub(super) fn weakest(finished: &Finished) -> Option<String> {
    let conditioning = finished.fit.calibration.conditioning.as_ref()?;
    let members: Vec<String> =
        conditioning.weakest.iter().map(|m| format!("{} {:+.2}", m.unknown, m.weight)).collect();
    Some(members.join(", "))
}

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
    if let Some(sentence) = calibration.certificate.as_ref().and_then(certificate) {
        text.push_str(&sentence);
    }
    text.push_str(&beforehand(calibration));
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

/// What was tied and what was known, a line each.
fn beforehand(calibration: &Calibration) -> String {
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
