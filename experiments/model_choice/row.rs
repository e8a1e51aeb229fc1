//! What became of a candidate in a trial? A line each, as it is committed in golden/model-choice/.

use super::truths::CANDIDATES;
use calibench::io::sha256_hex;

/// The columns of a line. `place` counts from the choice of `compare_models`, 0; `rmse` and `hold_out` in px,
/// `fx` to `cy` are errors in px, `rms` and `worst` the difference from the truth over the frame in px,
/// `shown` the share of the frame that the camera shows, `told` whether a warning says that the model does
/// not hold; `bits` is a fingerprint of all digits. Only the name where a candidate was refused.
pub const HEADER: &str =
    "marks,trial,candidate,place,rmse,bic,hold_out,fx,fy,cx,cy,rms,worst,shown,told,bits";

/// Hexadecimal digits of the fingerprint.
const BITS: usize = 8;

/// A candidate that the views determine.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitted {
    /// Where the comparison puts it: 0 is the choice.
    pub place: usize,
    /// Of the fit to all views.
    pub rmse_px: f64,
    /// Schwarz's criterion.
    pub bic: f64,
    /// Error on views that were left out.
    pub hold_out_px: Option<f64>,
    /// Estimate - truth of fx, fy, cx, cy.
    pub errors_px: [f64; 4],
    /// Root mean square difference from the truth over the frame.
    pub rms_px: f64,
    /// The largest.
    pub worst_px: f64,
    /// Share of the frame's nodes that the camera shows.
    pub shown: f64,
    /// Whether a warning says that residuals agree with their neighbours', or exceed what noise explains.
    pub told: bool,
}

/// A candidate in a trial.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Marks of all views, which name the layout.
    pub marks: usize,
    /// Number of the trial.
    pub trial: u64,
    /// Number of the candidate.
    pub candidate: usize,
    /// What was fitted; `None` where it was refused.
    pub fitted: Option<Fitted>,
}

impl Row {
    /// The line.
    pub fn text(&self) -> String {
        let head = format!("{},{},{}", self.marks, self.trial, CANDIDATES[self.candidate]);
        let Some(f) = &self.fitted else { return head + ",,,,,,,,,,,,," };
        let [fx, fy, cx, cy] = f.errors_px;
        let hold_out = f.hold_out_px.map_or_else(String::new, |px| format!("{px:.6}"));
        format!(
            "{head},{},{:.6},{:.3},{hold_out},{fx:.4},{fy:.4},{cx:.4},{cy:.4},{:.5},{:.4},{:.3},{},{}",
            f.place,
            f.rmse_px,
            f.bic,
            f.rms_px,
            f.worst_px,
            f.shown,
            u8::from(f.told),
            f.bits()
        )
    }

    /// Reads [`Row::text`].
    pub fn read(text: &str) -> Option<Row> {
        let cells: Vec<&str> = text.split(',').collect();
        let [marks, trial, candidate, place, rmse, bic, hold_out, fx, fy, cx, cy, rms, worst, shown, told, _] =
            cells.as_slice()
        else {
            return None;
        };
        let number = |text: &str| text.parse::<f64>().ok();
        let fitted = match *place {
            "" => None,
            place => Some(Fitted {
                place: place.parse().ok()?,
                rmse_px: number(rmse)?,
                bic: number(bic)?,
                hold_out_px: if hold_out.is_empty() { None } else { Some(number(hold_out)?) },
                errors_px: [number(fx)?, number(fy)?, number(cx)?, number(cy)?],
                rms_px: number(rms)?,
                worst_px: number(worst)?,
                shown: number(shown)?,
                told: *told == "1",
            }),
        };
        let candidate = CANDIDATES.iter().position(|name| name == candidate)?;
        Some(Row { marks: marks.parse().ok()?, trial: trial.parse().ok()?, candidate, fitted })
    }
}

impl Fitted {
    fn bits(&self) -> String {
        let numbers = [self.rmse_px, self.bic, self.hold_out_px.unwrap_or(-1.0), self.rms_px, self.worst_px];
        let bytes: Vec<u8> =
            numbers.iter().chain(&self.errors_px).flat_map(|number| number.to_bits().to_le_bytes()).collect();
        sha256_hex(&bytes)[..BITS].to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_read_as_it_was_written() {
        let fitted = Fitted {
            place: 2,
            rmse_px: 0.125,
            bic: -417.25,
            hold_out_px: Some(0.5),
            errors_px: [1.5, -0.25, 0.0, 2.0],
            rms_px: 0.25,
            worst_px: f64::INFINITY,
            shown: 0.75,
            told: true,
        };
        let row = Row { marks: 48, trial: 3, candidate: 5, fitted: Some(fitted.clone()) };
        let alone = Fitted { hold_out_px: None, ..fitted };
        for row in [row.clone(), Row { fitted: Some(alone), ..row.clone() }, Row { fitted: None, ..row }] {
            assert_eq!(Row::read(&row.text()).as_ref(), Some(&row), "{}", row.text());
            assert_eq!(row.text().split(',').count(), HEADER.split(',').count());
        }
        for broken in ["", "48,3,nothing,,,,,,,,,,,,,", "48,3,rational,0,,,,,,,,,,,,"] {
            assert_eq!(Row::read(broken), None, "{broken}");
        }
    }
}
