//! What is asked, and what is answered? One JSON object a line; `adapters/DETECTOR-PROTOCOL.md` says it in
//! words.

use calibench::geometry::Vec2;
use calibench::photos::BoardSpec;
use calibench_gate::{Question, Reply};
use serde::{Deserialize, Serialize};

/// A question: a line on the detector's standard input.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Problem {
    /// The answer repeats it.
    pub id: String,
    /// Path of the photograph, a grey PNG of 8 bits.
    pub image: String,
    /// The board that is looked for.
    pub board: Wanted,
}

/// The board that is looked for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Wanted {
    /// What its marks are.
    pub kind: Kind,
    /// Marks in a row: of a board with markers the inner corners, of a grid of tags their corners, two a tag.
    pub columns: usize,
    /// Rows of marks.
    pub rows: usize,
    /// What tells its marks apart.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub markers: Option<Markers>,
}

/// The markers of a board.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Markers {
    /// Their dictionary, by OpenCV's name.
    pub dictionary: &'static str,
    /// ChArUco: side of a marker, as part of a square's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub marker: Option<f64>,
    /// Grid of tags: distance of two tags, as part of a tag's side.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gap: Option<f64>,
}

/// What the marks of a board are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Inner corners of a chessboard.
    Chessboard,
    /// Dark discs on a square grid.
    Circles,
    /// Dark discs in staggered rows, OpenCV's asymmetric grid.
    Asymmetric,
    /// Dark discs in staggered rows, each with six neighbours.
    Hexagonal,
    /// Inner corners of a chessboard with markers in its white squares.
    Charuco,
    /// Corners of AprilTags with small squares between them, Kalibr's grid.
    AprilGrid,
}

impl Kind {
    /// All, in the order of reports.
    pub const ALL: [Kind; 6] =
        [Kind::Chessboard, Kind::Circles, Kind::Asymmetric, Kind::Hexagonal, Kind::Charuco, Kind::AprilGrid];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Chessboard => "chessboard",
            Kind::Circles => "circles",
            Kind::Asymmetric => "asymmetric",
            Kind::Hexagonal => "hexagonal",
            Kind::Charuco => "charuco",
            Kind::AprilGrid => "aprilgrid",
        }
    }

    /// Whether markers tell which marks are seen.
    pub fn is_coded(self) -> bool {
        matches!(self, Kind::Charuco | Kind::AprilGrid)
    }
}

impl Wanted {
    /// The same as this library's photographs are asked for: the diameter of discs is not told.
    pub fn spec(&self) -> BoardSpec {
        self.board(1.0, None)
    }

    /// The board with this distance of its marks, of a grid of tags with this side of one, and with discs of
    /// this diameter where it has any.
    pub fn board(&self, spacing: f64, diameter: Option<f64>) -> BoardSpec {
        let Wanted { kind, columns, rows, markers } = *self;
        let sized = |word: &str| {
            let diameter = diameter.map_or_else(String::new, |diameter| format!(":{diameter}"));
            format!("{word}:{columns}x{rows}:{spacing}{diameter}")
        };
        let text = match (kind, markers) {
            (Kind::Charuco, Some(Markers { dictionary, marker: Some(marker), .. })) => {
                let (columns, rows) = (columns + 1, rows + 1);
                format!("charuco:{columns}x{rows}:{spacing}:{}:{dictionary}", marker * spacing)
            }
            (Kind::AprilGrid, Some(Markers { gap: Some(gap), .. })) => {
                format!("aprilgrid:{}x{}:{spacing}:{gap}", columns / 2, rows / 2)
            }
            (Kind::Chessboard, _) => format!("chess:{columns}x{rows}:{spacing}"),
            _ => sized(kind.name()),
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
