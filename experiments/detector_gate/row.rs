//! What became of a photograph? A line each, as it is committed in golden/detector-gate/.

use calibench_detector_gate::protocol::Kind;
use calibench_detector_gate::{Marks, Outcome};

/// The columns of a line. `squares` is the sum of the squared distances of the marks from their places
/// (px^2), `worst` the largest distance (px), `bound` what the sum is at the bound (px^2). What there is none
/// of is empty.
pub const HEADER: &str = "board,scene,trial,ending,mirrored,confused,missing,marks,squares,worst,bound";

const BROKEN: &str = "broken";
const NOT_FOUND: &str = "not-found";
const INVENTED: &str = "invented";
const FOUND: &str = "found";

/// A photograph that was shown to a program.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The kind of board.
    pub kind: Kind,
    /// Name of the scene.
    pub scene: String,
    /// Number of the photograph in it.
    pub trial: u64,
    /// What became of it.
    pub outcome: Outcome,
}

impl Row {
    /// The line; numbers have as many digits as bring the same bits back.
    pub fn text(&self) -> String {
        let head = format!("{},{},{}", self.kind.name(), self.scene, self.trial);
        let ending = match self.outcome {
            Outcome::Broken => BROKEN,
            Outcome::NotFound => NOT_FOUND,
            Outcome::Invented => INVENTED,
            Outcome::Found(_) => FOUND,
        };
        let Outcome::Found(marks) = self.outcome else { return format!("{head},{ending},,,,,,,") };
        let Marks { is_mirrored, confused, missing, count, squares_px2, worst_px, bound_px2 } = marks;
        let bound = bound_px2.map_or_else(String::new, |bound| format!("{bound:e}"));
        format!(
            "{head},{ending},{},{confused},{missing},{count},{squares_px2:e},{worst_px:e},{bound}",
            u8::from(is_mirrored)
        )
    }

    /// Reads [`Row::text`].
    pub fn read(text: &str) -> Option<Row> {
        let cells: Vec<&str> = text.split(',').collect();
        let [kind, scene, trial, ending, mirrored, confused, missing, count, squares, worst, bound] =
            cells.as_slice()
        else {
            return None;
        };
        let outcome = match *ending {
            BROKEN => Outcome::Broken,
            NOT_FOUND => Outcome::NotFound,
            INVENTED => Outcome::Invented,
            FOUND => Outcome::Found(Marks {
                is_mirrored: *mirrored == "1",
                confused: confused.parse().ok()?,
                missing: missing.parse().ok()?,
                count: count.parse().ok()?,
                squares_px2: squares.parse().ok()?,
                worst_px: worst.parse().ok()?,
                bound_px2: if bound.is_empty() { None } else { Some(bound.parse().ok()?) },
            }),
            _ => return None,
        };
        let kind = Kind::ALL.into_iter().find(|known| known.name() == *kind)?;
        Some(Row { kind, scene: (*scene).to_string(), trial: trial.parse().ok()?, outcome })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_read_as_it_was_written() {
        let marks = Marks {
            is_mirrored: true,
            confused: 0,
            missing: 2,
            count: 61,
            squares_px2: 0.1 + 0.2,
            worst_px: 1.0 / 3.0,
            bound_px2: None,
        };
        let bounded = Marks { is_mirrored: false, bound_px2: Some(2e-7), ..marks };
        for outcome in [
            Outcome::Broken,
            Outcome::NotFound,
            Outcome::Invented,
            Outcome::Found(marks),
            Outcome::Found(bounded),
        ] {
            let row = Row { kind: Kind::Circles, scene: "dark-surround".into(), trial: 17, outcome };
            assert_eq!(Row::read(&row.text()).as_ref(), Some(&row), "{}", row.text());
            assert_eq!(row.text().split(',').count(), HEADER.split(',').count());
        }
        for broken in
            ["", "circles,clean,1,lost,,,,,,,", "circles,clean,1,found,,,,,,,", "stars,clean,1,broken,,,,,,,"]
        {
            assert_eq!(Row::read(broken), None, "{broken}");
        }
    }
}
