//! What did the solver make of a scene? A line each, as it is committed in golden/lens-minimum/.

use super::families::Family;
use super::reference::{self, Reference};
use super::scenes::Drawn;
use crate::global_minimum::judged::Class;
use calibench::calibrate::{CalibrationError, LensCalibration, Termination, Warning, calibrate_lens};
use calibench::camera::Parameter;
use calibench::io::sha256_hex;

/// A cost is the reference's if it exceeds it by no more than this part of it, and this many noise variances.
const SAME_COST: f64 = 1e-6;
const SAME_COST_VARIANCES: f64 = 1e-6;
/// A bound on sd(fx)/fx below which the data determine the camera.
pub const DETERMINED: f64 = 0.02;
/// Hexadecimal digits of the fingerprint of the bits.
const BITS: usize = 8;

/// The columns of a line. `field` is the angle of the farthest corner from the axis, degrees; `aspect` fy
/// over fx; `bound` the Cramer-Rao bound of sd(fx) over fx; `end` whether the reference is a minimum;
/// `excess` the cost above the reference's in noise variances; `z` the error of fx over its stated deviation,
/// `square` the squared error of all parameters under the stated covariance; `bits` a fingerprint of all
/// digits.
pub const HEADER: &str =
    "index,views,marks,field,aspect,noise,bound,end,class,asks,excess,z,square,note,bits";

/// A scene in short.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Its number in the family.
    pub index: u64,
    /// Number of views.
    pub views: usize,
    /// Marks of all views.
    pub marks: usize,
    /// Angle of the farthest corner from the axis, degrees.
    pub field_deg: f64,
    /// fy over fx.
    pub aspect: f64,
    /// Noise of a coordinate, px.
    pub noise_px: f64,
    /// Cramer-Rao bound of sd(fx) over fx; infinite where the marks determine nothing.
    pub bound: f64,
    /// Whether the search from the truth ended in a minimum.
    pub reference_ends: bool,
    /// How it ended.
    pub class: Class,
    /// Whether a warning questions the result or its deviations.
    pub is_questioned: bool,
    /// Cost above the reference's over the noise variance; 0 where there is none.
    pub excess: f64,
    /// Error of fx over its stated deviation, and the squared error of all parameters; where the result is
    /// right.
    pub errors: Option<[f64; 2]>,
    /// The termination, the error, or fx where it is wrong.
    pub note: String,
    /// Fingerprint of the bits of the estimate, of its cost and of the reference.
    pub bits: String,
}

/// Draws and judges a scene; `None` if the family has no such scene.
pub fn judged(family: &'static Family, seed: u64, index: u64) -> Option<Line> {
    let drawn = Drawn::new(family, seed, index)?;
    let reference = reference::from_truth(&drawn)?;
    let answer = calibrate_lens(&drawn.views, &drawn.settings());
    let found = answer.as_ref().ok();
    let variance = drawn.noise_px * drawn.noise_px;
    let (class, note) = classify(&answer, &reference, &drawn);
    Some(Line {
        index,
        views: drawn.views.len(),
        marks: drawn.marks(),
        field_deg: drawn.half_field_deg,
        aspect: drawn.camera.fy / drawn.camera.fx,
        noise_px: drawn.noise_px,
        bound: reference.bound,
        reference_ends: reference.converged,
        class,
        is_questioned: found.is_some_and(|found| found.warnings.iter().any(questions)),
        excess: found.map_or(0.0, |found| (cost(found) - reference.cost) / variance),
        errors: found.filter(|_| class == Class::Right).and_then(|found| errors(found, &drawn)),
        note,
        bits: sha256_hex(&bits(&answer, &reference))[..BITS].to_string(),
    })
}

/// Sum of squared residuals.
fn cost(found: &LensCalibration) -> f64 {
    found.residuals.iter().flatten().map(|r| r.norm_squared()).sum()
}

fn classify(
    answer: &Result<LensCalibration, CalibrationError>,
    reference: &Reference,
    drawn: &Drawn,
) -> (Class, String) {
    let found = match answer {
        Ok(found) => found,
        Err(error) => return (Class::Refused, word(error)),
    };
    let most = reference.cost * (1.0 + SAME_COST) + SAME_COST_VARIANCES * drawn.noise_px * drawn.noise_px;
    match (found.termination == Termination::Converged, cost(found) <= most) {
        (true, true) => (Class::Right, String::new()),
        (true, false) => (Class::Wrong, format!("fx {:.1} for {:.1}", found.camera.fx, reference.camera.fx)),
        (false, _) => (Class::NotConverged, found.termination.name().to_string()),
    }
}

/// The variant's name.
fn word(value: &impl std::fmt::Debug) -> String {
    format!("{value:?}").chars().take_while(|c| c.is_alphanumeric()).collect()
}

/// Whether a warning questions the result or its deviations.
fn questions(warning: &Warning) -> bool {
    matches!(
        warning,
        Warning::NotLinear { .. }
            | Warning::Ambiguous { .. }
            | Warning::HardlySeparable { .. }
            | Warning::FocalLengthUncertain { .. }
            | Warning::OutsideRange { .. }
            | Warning::AboveFloor { .. }
            | Warning::FewDegreesOfFreedom { .. }
            | Warning::NoDegreesOfFreedom
    )
}

fn errors(found: &LensCalibration, drawn: &Drawn) -> Option<[f64; 2]> {
    let error = |p| Some(found.camera.value(p)? - drawn.camera.value(p)?);
    let errors: Option<Vec<f64>> = found.free.iter().map(error).collect();
    let z = error(Parameter::Fx)? / found.standard_deviation(Parameter::Fx)?;
    Some([z, found.covariance.normalised_error_squared(&errors?)?])
}

/// Equal exactly when solver and reference gave the same bits.
fn bits(answer: &Result<LensCalibration, CalibrationError>, reference: &Reference) -> Vec<u8> {
    let mut numbers: Vec<f64> = reference.camera.values().map(|(_, value)| value).collect();
    numbers.push(reference.cost);
    if let Ok(found) = answer {
        numbers.extend(found.camera.values().map(|(_, value)| value));
        numbers.push(cost(found));
    }
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

impl Line {
    /// Whether the data determine the camera.
    pub fn is_determined(&self) -> bool {
        self.bound < DETERMINED
    }

    /// The line as CSV, rounded to what the claims need; `bits` keeps the rest.
    pub fn text(&self) -> String {
        let excess =
            if self.class == Class::Refused { String::new() } else { format!("{:.2e}", self.excess) };
        let [z, square] =
            self.errors.map_or([String::new(), String::new()], |e| e.map(|x| format!("{x:.3}")));
        format!(
            "{},{},{},{:.1},{:.3},{:.3},{:.2e},{},{},{},{excess},{z},{square},{},{}",
            self.index,
            self.views,
            self.marks,
            self.field_deg,
            self.aspect,
            self.noise_px,
            self.bound,
            u8::from(self.reference_ends),
            self.class.name(),
            u8::from(self.is_questioned),
            self.note,
            self.bits
        )
    }

    /// Reads [`Line::text`].
    pub fn read(text: &str) -> Option<Line> {
        let cells: Vec<&str> = text.split(',').collect();
        let [
            index,
            views,
            marks,
            field,
            aspect,
            noise,
            bound,
            end,
            class,
            asks,
            excess,
            z,
            square,
            note,
            bits,
        ] = cells.as_slice()
        else {
            return None;
        };
        let number = |text: &str| text.parse::<f64>().ok();
        let flag = |text: &str| matches!(text, "0" | "1").then_some(text == "1");
        Some(Line {
            index: index.parse().ok()?,
            views: views.parse().ok()?,
            marks: marks.parse().ok()?,
            field_deg: number(field)?,
            aspect: number(aspect)?,
            noise_px: number(noise)?,
            bound: number(bound)?,
            reference_ends: flag(end)?,
            class: Class::ALL.into_iter().find(|c| c.name() == *class)?,
            is_questioned: flag(asks)?,
            excess: if excess.is_empty() { 0.0 } else { number(excess)? },
            errors: if z.is_empty() { None } else { Some([number(z)?, number(square)?]) },
            note: note.to_string(),
            bits: bits.to_string(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_read_as_it_was_written() {
        let right = Line {
            index: 7,
            views: 5,
            marks: 230,
            field_deg: 81.5,
            aspect: 1.25,
            noise_px: 0.125,
            bound: 0.0025,
            reference_ends: true,
            class: Class::Right,
            is_questioned: false,
            excess: -0.25,
            errors: Some([0.5, 7.75]),
            note: String::new(),
            bits: "0123abcd".into(),
        };
        let refused =
            Line { class: Class::Refused, excess: 0.0, errors: None, note: "View".into(), ..right.clone() };
        let nothing = Line { bound: f64::INFINITY, reference_ends: false, ..refused.clone() };
        for line in [right, refused, nothing] {
            assert_eq!(Line::read(&line.text()).as_ref(), Some(&line), "{}", line.text());
            assert_eq!(line.text().split(',').count(), HEADER.split(',').count());
        }
        assert_eq!(Line::read("1,2,3"), None);
    }
}
