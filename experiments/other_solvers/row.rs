//! What became of a trial? A line each, as it is committed in golden/other-solvers/.

/// The columns of a line. `cell` counts through the cells of all studies; `fx` (px) and `k2` are errors,
/// `sd_` what the program states; `cost` is the sum of squared residuals over the noise variance. What a
/// program does not state is empty.
pub const HEADER: &str = "cell,trial,ending,warned,fx,k2,sd_fx,sd_k2,nees,cost";

/// How a program ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// It gave a camera.
    Answered,
    /// It said that it has none.
    Refused,
    /// It is not made for what is asked.
    Unsupported,
    /// No answer, or no camera.
    Broken,
}

impl Ending {
    const ALL: [Ending; 4] = [Ending::Answered, Ending::Refused, Ending::Unsupported, Ending::Broken];

    /// The word for it.
    pub fn name(self) -> &'static str {
        ["answered", "refused", "unsupported", "broken"][self as usize]
    }
}

/// A camera that was answered, judged against the truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    /// Estimate - truth of fx, px, and of k2.
    pub errors: [f64; 2],
    /// Standard deviations that are stated of them.
    pub stated: Option<[f64; 2]>,
    /// Squared error of all intrinsics under the stated covariance.
    pub nees: Option<f64>,
    /// Sum of squared residuals at the stated camera and poses, over the noise variance.
    pub cost: Option<f64>,
}

/// A trial of a program.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Number of the cell, through all studies.
    pub cell: usize,
    /// Number of the trial in it.
    pub trial: u64,
    /// How it ended.
    pub ending: Ending,
    /// Whether the answer came with a warning.
    pub warned: bool,
    /// The camera, if one was answered.
    pub answer: Option<Answer>,
}

impl Row {
    /// The line.
    pub fn text(&self) -> String {
        let head = format!("{},{},{},{}", self.cell, self.trial, self.ending.name(), u8::from(self.warned));
        let Some(Answer { errors: [fx, k2], stated, nees, cost }) = self.answer else {
            return format!("{head},,,,,,");
        };
        let [sd_fx, sd_k2] = stated.map_or_else(Default::default, |sds| sds.map(|sd| format!("{sd:.4e}")));
        let nees = nees.map_or_else(String::new, |nees| format!("{nees:.4}"));
        let cost = cost.map_or_else(String::new, |cost| format!("{cost:.6}"));
        format!("{head},{fx:.9},{k2:.12},{sd_fx},{sd_k2},{nees},{cost}")
    }

    /// Reads [`Row::text`].
    pub fn read(text: &str) -> Option<Row> {
        let cells: Vec<&str> = text.split(',').collect();
        let [cell, trial, ending, warned, fx, k2, sd_fx, sd_k2, nees, cost] = cells.as_slice() else {
            return None;
        };
        let ending = Ending::ALL.into_iter().find(|e| e.name() == *ending)?;
        let given = |text: &str| if text.is_empty() { Some(None) } else { text.parse().ok().map(Some) };
        let answer = match ending {
            Ending::Answered => Some(Answer {
                errors: [fx.parse().ok()?, k2.parse().ok()?],
                stated: given(sd_fx)?.zip(given(sd_k2)?).map(|(fx, k2)| [fx, k2]),
                nees: given(nees)?,
                cost: given(cost)?,
            }),
            _ => None,
        };
        let (cell, trial) = (cell.parse().ok()?, trial.parse().ok()?);
        Some(Row { cell, trial, ending, warned: *warned == "1", answer })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_read_as_it_was_written() {
        let answer =
            Answer { errors: [-1.25, 0.001], stated: Some([1.5, 0.01]), nees: None, cost: Some(354.25) };
        let answered =
            Row { cell: 3, trial: 7, ending: Ending::Answered, warned: true, answer: Some(answer) };
        let refused = Row { cell: 0, trial: 1, ending: Ending::Refused, warned: false, answer: None };
        for row in [answered, refused] {
            assert_eq!(Row::read(&row.text()).as_ref(), Some(&row), "{}", row.text());
            assert_eq!(row.text().split(',').count(), HEADER.split(',').count());
        }
        for broken in ["", "0,1,refused,0,,,,,", "0,1,lost,0,,,,,,", "0,1,answered,0,,,,,,"] {
            assert_eq!(Row::read(broken), None, "{broken}");
        }
    }
}
