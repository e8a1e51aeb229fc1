//! What is asked, and what is answered? One JSON object a line; `adapters/DETECTOR-PROTOCOL.md` says it in words.

use calibench::geometry::Vec2;
use calibench::photos::BoardSpec;
use calibench_gate::{Question, Reply};
use serde::{Deserialize, Serialize};

/// A question: a line on the detector's standard input.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Problem {
    /// The answer repeats it.
    pub id: String,
    /// Path of the photograph, a grey PNG of 8 bits.
    pub image: String,
    /// The board that is looked for.
    pub board: Wanted,
}

/// The board that is looked for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Wanted {
    /// What its marks are.
    pub kind: Kind,
    /// Marks in a row; of a chessboard inner corners.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
}

/// What the marks of a board are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Inner corners of a chessboard.
    Chessboard,
    /// Dark discs on a square grid.
    Circles,
}

impl Kind {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Chessboard => "chessboard",
            Kind::Circles => "circles",
        }
    }
}

impl Wanted {
    /// The same as this library's photographs are asked for.
    pub fn spec(&self) -> BoardSpec {
        let Wanted { kind, columns, rows } = self;
        let text = match kind {
            Kind::Chessboard => format!("chess:{columns}x{rows}:1"),
            Kind::Circles => format!("circles:{columns}x{rows}:1"),
        };
        text.parse().expect("a board of two rows or more")
    }
}

/// What became of a question.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// The board was found.
    Ok,
    /// It was not.
    NotFound,
    /// The detector does not know such boards.
    Unsupported,
}

/// An answer: a line on the detector's standard output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// The question's.
    pub id: String,
    /// What became of it.
    pub status: Status,
    /// With `ok`: the place of every mark, `[u, v]` in px, row by row; `null` for one that is not seen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub marks: Option<Vec<Option<[f64; 2]>>>,
    /// Why nothing was found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub message: Option<String>,
}

impl Question for Problem {
    fn id(&self) -> &str {
        &self.id
    }

    fn to_line(&self) -> String {
        serde_json::to_string(self).expect("a question has text keys only")
    }
}

impl Reply for Answer {
    fn id(&self) -> &str {
        &self.id
    }
}

impl Answer {
    /// The places found; `None` without a board.
    ///
    /// # Errors
    /// What is wrong with the answer.
    pub fn places(&self, wanted: &Wanted) -> Result<Option<Vec<Option<Vec2>>>, String> {
        let count = wanted.columns * wanted.rows;
        match (self.status, &self.marks) {
            (Status::Ok, None) => Err("`ok` without marks".to_string()),
            (Status::Ok, Some(marks)) if marks.len() != count => {
                Err(format!("{} marks, and the board has {count}", marks.len()))
            }
            (Status::Ok, Some(marks)) if marks.iter().flatten().flatten().any(|x| !x.is_finite()) => {
                Err("a place is not finite".to_string())
            }
            (Status::Ok, Some(marks)) if marks.iter().all(Option::is_none) => {
                Err("`ok` without a mark that is seen".to_string())
            }
            (Status::Ok, Some(marks)) => {
                Ok(Some(marks.iter().map(|mark| mark.map(|[u, v]| Vec2::new(u, v))).collect()))
            }
            _ => Ok(None),
        }
    }
}
