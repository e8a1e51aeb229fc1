//! Which candidate does a criterion take, and how near to the truth is its camera?

use super::row::{Fitted, Row};
use super::truths::{CANDIDATES, Truth};
use calibench::calibrate::Candidate;

/// A way to choose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Criterion {
    /// The least RMSE of the fit.
    Rmse,
    /// The least of Schwarz's criterion.
    Bic,
    /// The least error on views that were left out.
    HoldOut,
    /// The choice of `compare_models`.
    Auto,
    /// Of those that lie in their model's range and whose Schwarz criterion exceeds the least by no more than
    /// this, the least error on views left out.
    Within(f64),
    /// No choice: Brown-Conrady's five coefficients, whatever the marks say.
    Five,
    /// No choice either: the true model is known.
    Known,
}

impl Criterion {
    /// Those that look at the marks.
    pub const JUDGED: [Criterion; 4] = [Criterion::Rmse, Criterion::Bic, Criterion::HoldOut, Criterion::Auto];
    /// Those, and what they are held against.
    pub const ALL: [Criterion; 6] = [
        Criterion::Rmse,
        Criterion::Bic,
        Criterion::HoldOut,
        Criterion::Auto,
        Criterion::Five,
        Criterion::Known,
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Criterion::Rmse => "rmse",
            Criterion::Bic => "bic",
            Criterion::HoldOut => "hold-out",
            Criterion::Auto => "auto",
            Criterion::Within(_) => "within",
            Criterion::Five => "five",
            Criterion::Known => "known",
        }
    }

    /// Its name in a legend.
    pub fn label(self) -> &'static str {
        match self {
            Criterion::Rmse => "RMSE",
            Criterion::Bic => "BIC",
            Criterion::HoldOut => "views left out",
            Criterion::Auto => "--model auto",
            Criterion::Within(_) => "within",
            Criterion::Five => "always five",
            Criterion::Known => "the true model",
        }
    }
}

/// A camera counts as one for the frame if it shows this share of it.
const SHOWN: f64 = 0.99;
/// Number of the candidate with Brown-Conrady's five coefficients.
const FIVE: usize = 3;

/// All candidates in one trial.
#[derive(Debug)]
pub struct Trial<'a> {
    /// The truth.
    pub truth: &'static Truth,
    /// Marks of all views.
    pub marks: usize,
    /// Its number.
    pub number: u64,
    fitted: Vec<Option<&'a Fitted>>,
}

impl<'a> Trial<'a> {
    /// A truth's trials, of its rows in order; `None` if one of them lacks a candidate.
    pub fn all(truth: &'static Truth, rows: &'a [Row]) -> Option<Vec<Trial<'a>>> {
        let one = |rows: &'a [Row]| {
            let Row { marks, trial, .. } = rows.first()?;
            let in_order =
                |(i, row): (usize, &Row)| (row.marks, row.trial, row.candidate) == (*marks, *trial, i);
            let whole = rows.len() == CANDIDATES.len() && rows.iter().enumerate().all(in_order);
            let fitted = rows.iter().map(|row| row.fitted.as_ref()).collect();
            whole.then_some(Trial { truth, marks: *marks, number: *trial, fitted })
        };
        rows.chunks(CANDIDATES.len()).map(one).collect()
    }

    /// A candidate; `None` where it was refused.
    pub fn fitted(&self, candidate: usize) -> Option<&'a Fitted> {
        self.fitted[candidate]
    }

    /// What a criterion takes; `None` where nothing can be taken.
    pub fn chosen(&self, criterion: Criterion) -> Option<usize> {
        let least = |value: &dyn Fn(&Fitted) -> f64| {
            let known = self.fitted.iter().enumerate().filter_map(|(i, fitted)| Some((i, value((*fitted)?))));
            known.min_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(i, _)| i)
        };
        let predicted = |f: &Fitted| f.hold_out_px.unwrap_or(f64::INFINITY);
        match criterion {
            Criterion::Rmse => least(&|f| f.rmse_px),
            Criterion::Bic => least(&|f| f.bic),
            Criterion::HoldOut => least(&predicted),
            Criterion::Auto => least(&|f| f.place as f64),
            Criterion::Within(difference) => {
                let in_range = || self.fitted.iter().flatten().filter(|f| !self.is_put_behind(f));
                let least_bic = in_range().map(|f| f.bic).fold(f64::INFINITY, f64::min);
                let is_near = |f: &Fitted| f.bic - least_bic <= difference && !self.is_put_behind(f);
                // Where no part of the views can be left out, the criterion is alone.
                let is_predicted = in_range().any(|f| is_near(f) && f.hold_out_px.is_some());
                let error = |f: &Fitted| if is_near(f) { predicted(f) } else { f64::INFINITY };
                let bic = |f: &Fitted| if self.is_put_behind(f) { f64::INFINITY } else { f.bic };
                if is_predicted { least(&error) } else { least(&bic) }
            }
            Criterion::Five => Some(FIVE).filter(|&i| self.fitted[i].is_some()),
            Criterion::Known => self.truth.right().filter(|&i| self.fitted[i].is_some()),
        }
    }

    /// Whether a candidate stands behind one of a higher criterion that is not the choice: the comparison
    /// does so with coefficients that lie where their model is not defined.
    fn is_put_behind(&self, fitted: &Fitted) -> bool {
        let is_before = |other: &Fitted| (1..fitted.place).contains(&other.place);
        self.fitted.iter().flatten().any(|other| is_before(other) && other.bic > fitted.bic)
    }

    /// Difference of a candidate's camera from the truth over the frame, px; infinite where it does not show
    /// the frame or was refused.
    pub fn frame_px(&self, candidate: usize) -> f64 {
        self.fitted[candidate].filter(|f| f.shown >= SHOWN).map_or(f64::INFINITY, |f| f.rms_px)
    }

    /// That of what a criterion takes, over the least of all candidates in this trial.
    pub fn ratio(&self, criterion: Criterion) -> Option<f64> {
        let least = (0..CANDIDATES.len()).map(|i| self.frame_px(i)).fold(f64::INFINITY, f64::min);
        self.chosen(criterion).map(|i| self.frame_px(i) / least)
    }

    /// How a criterion's choice stands to the truth.
    pub fn verdict(&self, criterion: Criterion) -> Verdict {
        match self.chosen(criterion) {
            None => Verdict::Other,
            chosen if chosen == self.truth.right() => Verdict::Right,
            Some(i) if self.truth.is_within(&Candidate::usual()[i]) => Verdict::TooRich,
            Some(_) => Verdict::Other,
        }
    }
}

/// How a choice stands to the truth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The candidate that can be the truth with the fewest coefficients.
    Right,
    /// One that can be the truth, with more.
    TooRich,
    /// One that cannot.
    Other,
}

#[cfg(test)]
mod tests {
    use super::super::truths::TRUTHS;
    use super::*;

    fn row(candidate: usize, numbers: Option<(usize, f64, f64, f64, f64)>) -> Row {
        let fitted = numbers.map(|(place, rmse_px, bic, hold_out, rms_px)| Fitted {
            place,
            rmse_px,
            bic,
            hold_out_px: Some(hold_out),
            errors_px: [0.0; 4],
            rms_px,
            worst_px: 2.0 * rms_px,
            shown: 1.0,
            told: false,
        });
        Row { marks: 48, trial: 0, candidate, fitted }
    }

    #[test]
    fn each_criterion_takes_what_is_least_in_it() {
        let mut rows: Vec<Row> = (0..8).map(|i| row(i, None)).collect();
        rows[0] = row(0, Some((0, 0.14, -100.0, 0.1503, 0.3)));
        rows[1] = row(1, Some((2, 0.13, -90.0, 0.1500, 0.2)));
        rows[3] = row(3, Some((3, 0.12, -80.0, 0.1600, 0.4)));
        rows[7] = row(7, Some((1, 0.15, -110.0, 0.1510, 0.6)));
        let trials = Trial::all(&TRUTHS[0], &rows).unwrap();
        let taken = |criterion| trials[0].chosen(criterion);
        assert_eq!(Criterion::JUDGED.map(taken), [Some(3), Some(7), Some(1), Some(0)]);
        assert_eq!(
            [0.0, 10.0, 20.0].map(|difference| taken(Criterion::Within(difference))),
            [Some(7), Some(0), Some(1)]
        );
        assert_eq!((taken(Criterion::Five), taken(Criterion::Known)), (Some(3), Some(0)));
        assert_eq!(trials[0].ratio(Criterion::Rmse), Some(2.0));
        let verdicts = Criterion::JUDGED.map(|c| trials[0].verdict(c));
        assert_eq!(verdicts, [Verdict::TooRich, Verdict::Other, Verdict::TooRich, Verdict::Right]);
        assert!(Trial::all(&TRUTHS[0], &rows[..7]).is_none());
        // Behind those of a higher criterion: out of its model's range.
        rows[7] = row(7, Some((3, 0.15, -110.0, 0.1510, 0.6)));
        rows[1] = row(1, Some((1, 0.13, -90.0, 0.1500, 0.2)));
        rows[3] = row(3, Some((2, 0.12, -80.0, 0.1600, 0.4)));
        let trials = Trial::all(&TRUTHS[0], &rows).unwrap();
        let taken = [0.0, 10.0].map(|difference| trials[0].chosen(Criterion::Within(difference)));
        assert_eq!(taken, [Some(0), Some(1)]);
    }
}
