//! What does the user say of a board, and where are its marks in a photograph? `chess:9x6:25mm`,
//! `circles:9x7:10mm:3mm`, `charuco:7x5:30mm:22mm:DICT_4X4_50`.

use super::coded::{self, Coded};
use super::discs::{NotFound, alone, ordered_discs};
use crate::board::{Arrangement, Board, BoardError, Pattern};
use crate::detect::{
    AprilGrid, ChessboardError, CodedError, GridError, LayoutError, SeenBoard, UnknownDictionary, chessboard,
    circle_grid_of, seen_chessboard, seen_circle_grid_of, seen_staggered_grid_of, sparse_dots_of,
    staggered_grid_of,
};
use crate::geometry::Vec2;
use crate::io::Grey;
use std::fmt;
use std::str::FromStr;

/// How the marks look, and with it which detector finds them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MarkKind {
    /// Inner corners of a chessboard.
    Chess,
    /// A dense grid of discs, at least 4 on a side.
    Circles,
    /// Discs in staggered rows, as OpenCV's asymmetric grid has them: the marks of a row two spacings apart,
    /// rows one.
    Asymmetric,
    /// Discs in staggered rows, each with six neighbours at one spacing.
    Hexagonal,
    /// A few dots, such as 3 x 3.
    Dots,
    /// Inner corners of a chessboard with markers in its white squares, OpenCV's ChArUco board.
    Charuco,
    /// Corners of AprilTags with small squares between them, Kalibr's `aprilgrid`.
    AprilGrid,
}

impl MarkKind {
    /// Those whose words are `KIND:COLUMNSxROWS:SPACING[:DIAMETER]`.
    const PLAIN: [MarkKind; 5] =
        [MarkKind::Chess, MarkKind::Circles, MarkKind::Asymmetric, MarkKind::Hexagonal, MarkKind::Dots];

    /// Its word on the command line.
    pub fn name(self) -> &'static str {
        match self {
            MarkKind::Chess => "chess",
            MarkKind::Circles => "circles",
            MarkKind::Asymmetric => "asymmetric",
            MarkKind::Hexagonal => "hexagonal",
            MarkKind::Dots => "dots",
            MarkKind::Charuco => "charuco",
            MarkKind::AprilGrid => "aprilgrid",
        }
    }

    /// Whether its marks are discs.
    pub fn is_of_discs(self) -> bool {
        use MarkKind::{Asymmetric, Circles, Dots, Hexagonal};
        matches!(self, Circles | Asymmetric | Hexagonal | Dots)
    }

    /// How its marks lie to each other.
    pub fn arrangement(self) -> Arrangement {
        match self {
            MarkKind::Asymmetric => Arrangement::Asymmetric,
            MarkKind::Hexagonal => Arrangement::Hexagonal,
            _ => Arrangement::Square,
        }
    }
}

/// A board as it stands on the command line: `KIND:COLUMNSxROWS:SPACING[:DIAMETER]`,
/// `charuco:SQUARESXxSQUARESY:SQUARE:MARKER:DICTIONARY[:legacy]` or `aprilgrid:COLUMNSxROWS:TAG:SPACING`.
///
/// ```
/// use calibench::board::View;
/// use calibench::io::Grey;
/// use calibench::photos::BoardSpec;
/// use calibench::synth::Truth;
/// use calibench::synth::render::{Imaging, photograph};
///
/// let spec: BoardSpec = "circles:9x7:10mm:3mm".parse()?;
/// // A photograph of that board; yours comes from `calibench::io::read_image`.
/// let pose = Truth::example_poses()[0];
/// let photo = photograph(&Truth::example_camera(), Truth::EXAMPLE_IMAGE, spec.board(), &pose, &Imaging::default())?;
/// let pixels = spec.detect(&Grey::F32(photo.image))?;
/// let view = View::new(spec.points(), pixels)?;
/// assert_eq!((view.len(), spec.to_string().as_str()), (63, "circle grid of 9 x 7 discs, 10 mm apart"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct BoardSpec {
    /// Look of the marks.
    pub kind: MarkKind,
    /// Unit of lengths on the board, empty if none was given.
    pub unit: String,
    /// Whether the discs' diameter is known, without which their bias cannot be corrected.
    pub diameter_known: bool,
    board: Board,
    coded: Option<Coded>,
}

/// Why a text is no board.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BoardSpecError {
    /// The text has another form.
    #[error(
        "expected KIND:COLUMNSxROWS:SPACING[:DIAMETER], such as chess:9x6:25mm, circles:9x7:10mm:3mm, \
         asymmetric:4x11:20mm:15mm, hexagonal:9x9:10mm:5mm or dots:3x3:1, or charuco:7x5:30mm:22mm:DICT_4X4_50 or \
         aprilgrid:6x6:88mm:0.3, got `{0}`"
    )]
    Form(String),
    /// A ChArUco board in another form.
    #[error(
        "expected charuco:SQUARESXxSQUARESY:SQUARE:MARKER:DICTIONARY, such as charuco:7x5:30mm:22mm:DICT_4X4_50, with :legacy behind it \
         for OpenCV's legacy pattern, got `charuco:{0}`"
    )]
    Charuco(String),
    /// A grid of AprilTags in another form.
    #[error(
        "expected aprilgrid:COLUMNSxROWS:TAG:SPACING, Kalibr's tagCols, tagRows, tagSize and tagSpacing, such as aprilgrid:6x6:88mm:0.3, \
         got `aprilgrid:{0}`"
    )]
    AprilGrid(String),
    /// No such board with markers exists.
    #[error(transparent)]
    Layout(LayoutError),
    /// No such markers exist.
    #[error(transparent)]
    Dictionary(#[from] UnknownDictionary),
    /// A length is not a number with a known unit.
    #[error("`{0}` is not a length: give a number, with mm, cm, m or no unit behind it")]
    Length(String),
    /// Two lengths cannot be compared.
    #[error("the spacing has no unit, but the diameter is in {0}: give both in one unit")]
    Unit(String),
    /// A chessboard's corners have no extent.
    #[error("the corners of a chessboard have no diameter: give chess:{columns}x{rows}:SQUARE")]
    CornerDiameter {
        /// Corners along a row.
        columns: usize,
        /// Rows of corners.
        rows: usize,
    },
    /// No such board exists.
    #[error(transparent)]
    Board(#[from] BoardError),
}

/// Why a photograph gives no marks.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DetectError {
    /// The board is not seen whole and clearly.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// The chessboard is not seen whole and clearly.
    #[error(transparent)]
    Chessboard(#[from] ChessboardError),
    /// The board with markers is not seen, or it is not certain which part of it is.
    #[error(transparent)]
    Coded(#[from] CodedError),
    /// Some marks are not seen, and all were asked for.
    #[error("{missing} of {marks} marks are not seen")]
    Hidden {
        /// Marks that are not seen.
        missing: usize,
        /// Marks of the board.
        marks: usize,
    },
}

/// A length in a unit: its value in millimetres a unit, if the unit is known.
pub(super) struct Length {
    pub(super) value: f64,
    pub(super) unit: &'static str,
}

/// Units and their length, mm.
const UNITS: [(&str, f64); 3] = [("mm", 1.0), ("cm", 10.0), ("m", 1000.0)];

fn millimetres(unit: &str) -> Option<f64> {
    UNITS.iter().find(|(name, _)| *name == unit).map(|(_, length)| *length)
}

impl FromStr for Length {
    type Err = BoardSpecError;

    fn from_str(text: &str) -> Result<Length, BoardSpecError> {
        let (number, unit) =
            UNITS.iter().find_map(|(name, _)| Some((text.strip_suffix(name)?, *name))).unwrap_or((text, ""));
        let value = number.trim().parse().map_err(|_| BoardSpecError::Length(text.to_string()))?;
        Ok(Length { value, unit })
    }
}

impl Length {
    /// The value in another unit; a length without a unit is in any.
    pub(super) fn in_unit(&self, unit: &str) -> Result<f64, BoardSpecError> {
        match (millimetres(self.unit), millimetres(unit)) {
            (Some(own), Some(other)) => Ok(self.value * own / other),
            (Some(_), None) => Err(BoardSpecError::Unit(self.unit.to_string())),
            (None, _) => Ok(self.value),
        }
    }
}

impl FromStr for BoardSpec {
    type Err = BoardSpecError;

    fn from_str(text: &str) -> Result<BoardSpec, BoardSpecError> {
        let form = || BoardSpecError::Form(text.to_string());
        let parts: Vec<&str> = text.split(':').map(str::trim).collect();
        if let Some(parsed) = coded::parse(&parts) {
            let (coded, board, unit) = parsed?;
            let kind = match coded {
                Coded::Charuco(..) => MarkKind::Charuco,
                Coded::AprilGrid(..) => MarkKind::AprilGrid,
            };
            let (unit, coded) = (unit.to_string(), Some(coded));
            return Ok(BoardSpec { kind, unit, diameter_known: false, board, coded });
        }
        let (kind, size, spacing, diameter) = match parts[..] {
            [kind, size, spacing] => (kind, size, spacing, None),
            [kind, size, spacing, diameter] => (kind, size, spacing, Some(diameter)),
            _ => return Err(form()),
        };
        let kind = MarkKind::PLAIN.into_iter().find(|known| known.name() == kind).ok_or_else(form)?;
        let (columns, rows) = size.split_once('x').ok_or_else(form)?;
        let columns = columns.parse().map_err(|_| form())?;
        let rows = rows.parse().map_err(|_| form())?;
        let spacing: Length = spacing.parse()?;
        let pattern = match (kind, diameter) {
            (MarkKind::Chess, Some(_)) => return Err(BoardSpecError::CornerDiameter { columns, rows }),
            (_, Some(diameter)) => {
                Pattern::Circles { diameter: diameter.parse::<Length>()?.in_unit(spacing.unit)? }
            }
            // A disc of unknown size is taken for a point, as a corner is: its bias cannot be told.
            (_, None) => Pattern::Chessboard,
        };
        let board = Board::arranged(columns, rows, spacing.value, pattern, kind.arrangement())?;
        let unit = spacing.unit.to_string();
        Ok(BoardSpec { kind, unit, diameter_known: diameter.is_some(), board, coded: None })
    }
}

impl fmt::Display for BoardSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(coded) = &self.coded {
            return f.write_str(&coded.described(&self.board, &self.unit));
        }
        let (name, marks) = match self.kind {
            MarkKind::Circles => ("circle grid", "discs"),
            MarkKind::Asymmetric => ("staggered grid", "discs, rows"),
            MarkKind::Hexagonal => ("hexagonal grid", "discs"),
            MarkKind::Dots => ("dots", "marks"),
            MarkKind::Chess | MarkKind::Charuco | MarkKind::AprilGrid => ("chessboard", "inner corners"),
        };
        let (board, unit) = (&self.board, &self.unit);
        let comma = if marks.contains(',') { "" } else { "," };
        write!(f, "{name} of {} x {} {marks}{comma} {}", board.columns(), board.rows(), board.spacing())?;
        if !unit.is_empty() {
            write!(f, " {unit}")?;
        }
        f.write_str(" apart")
    }
}

impl BoardSpec {
    /// The board; discs of unknown diameter count as points. Of tags it has as many marks, all at their mean
    /// distance: where they are, [`BoardSpec::points`] says.
    pub fn board(&self) -> &Board {
        &self.board
    }

    /// The marks in their order, in the board's unit, about its middle.
    pub fn points(&self) -> Vec<Vec2> {
        self.coded.map_or_else(|| self.board.points(), |coded| coded.points(&self.board))
    }

    /// What is black on a board with markers, as upright rectangles of which no two overlap, each by its
    /// corners of least and of greatest coordinates; `None` for other boards.
    pub fn dark(&self) -> Option<Vec<[Vec2; 2]>> {
        self.coded.map(|coded| coded.dark(&self.board))
    }

    /// The grid of a board of AprilTags, and the side of a tag in the board's unit.
    pub fn april_grid(&self) -> Option<(AprilGrid, f64)> {
        match self.coded {
            Some(Coded::AprilGrid(grid, tag)) => Some((grid, tag)),
            _ => None,
        }
    }

    /// Whether the marks are discs whose bias cannot be told, since their diameter is not known.
    pub fn lacks_diameter(&self) -> bool {
        self.kind.is_of_discs() && !self.diameter_known
    }

    /// The same board `factor` times as large, as a printer may make it.
    ///
    /// # Errors
    /// No such board exists.
    pub fn scaled(&self, factor: f64) -> Result<BoardSpec, BoardSpecError> {
        if let Some(coded) = &self.coded {
            let (coded, board) = coded.scaled(&self.board, factor)?;
            return Ok(BoardSpec { board, coded: Some(coded), ..self.clone() });
        }
        let pattern = match self.board.pattern() {
            Pattern::Circles { diameter } => Pattern::Circles { diameter: factor * diameter },
            Pattern::Chessboard => Pattern::Chessboard,
        };
        let (columns, rows) = (self.board.columns(), self.board.rows());
        let spacing = factor * self.board.spacing();
        let board = Board::arranged(columns, rows, spacing, pattern, self.board.arrangement())?;
        Ok(BoardSpec { board, ..self.clone() })
    }

    /// The board as it stands on the command line: what is read from it is this board again.
    pub fn words(&self) -> String {
        let (board, unit) = (&self.board, &self.unit);
        if let Some(coded) = &self.coded {
            return coded.words(board, unit);
        }
        let kind = self.kind.name();
        let words = format!("{kind}:{}x{}:{}{unit}", board.columns(), board.rows(), board.spacing());
        match board.pattern() {
            Pattern::Circles { diameter } => format!("{words}:{diameter}{unit}"),
            Pattern::Chessboard => words,
        }
    }

    /// Millimetres a unit of the board; `None` if no unit was given.
    pub fn unit_mm(&self) -> Option<f64> {
        millimetres(&self.unit)
    }

    /// The marks in a photograph, px, in the order of the board's points.
    ///
    /// # Errors
    /// See [`DetectError`].
    pub fn detect(&self, photo: &Grey) -> Result<Vec<Vec2>, NotFound> {
        let (columns, rows) = (self.board.columns(), self.board.rows());
        let no_candidates = |reason| NotFound { reason, candidates_px: Vec::new() };
        match self.kind {
            MarkKind::Chess => self.corners(photo).map_err(no_candidates),
            MarkKind::Charuco | MarkKind::AprilGrid => {
                let seen = self.see(photo)?;
                let (missing, marks) = (seen.missing(), seen.places_px().len());
                let all = seen.places_px().iter().copied().collect::<Option<Vec<Vec2>>>();
                all.ok_or_else(|| no_candidates(DetectError::Hidden { missing, marks }))
            }
            MarkKind::Dots => ordered_discs(photo, |discs| sparse_dots_of(discs, columns, rows))
                .map(|grid| grid.centres_px()),
            MarkKind::Circles | MarkKind::Asymmetric | MarkKind::Hexagonal => {
                let seen = self.whole_discs(photo).and_then(|seen| alone(photo, seen, self.period()))?;
                Ok(seen.seen().map(|(_, place)| place).collect())
            }
        }
    }

    /// The marks that are seen in a photograph. Of a board with markers they are those that are seen,
    /// wherever on the board ([`seen_charuco`](crate::detect::seen_charuco)). Of a chessboard or a dense grid
    /// of discs some may be hidden, outside of the image or in glare, where it is certain which
    /// ([`seen_chessboard`], [`seen_circle_grid_of`], [`seen_staggered_grid_of`]); a few dots must all be
    /// there.
    ///
    /// # Errors
    /// See [`DetectError`].
    pub fn see(&self, photo: &Grey) -> Result<SeenBoard, NotFound> {
        let (columns, rows) = (self.board.columns(), self.board.rows());
        if let Some(coded) = &self.coded {
            let no_candidates =
                |reason: CodedError| NotFound { reason: reason.into(), candidates_px: Vec::new() };
            return coded.see(photo).map_err(no_candidates);
        }
        match self.kind {
            MarkKind::Chess | MarkKind::Charuco | MarkKind::AprilGrid => {
                let seen = match photo {
                    Grey::U8(image) => seen_chessboard(image, columns, rows),
                    Grey::U16(image) => seen_chessboard(image, columns, rows),
                    Grey::F32(image) => seen_chessboard(image, columns, rows),
                };
                seen.map_err(|reason| NotFound { reason: reason.into(), candidates_px: Vec::new() })
            }
            MarkKind::Dots => {
                ordered_discs(photo, |discs| sparse_dots_of(discs, columns, rows)).map(SeenBoard::from)
            }
            // A whole board of either kind of discs comes before a part of one.
            MarkKind::Circles | MarkKind::Asymmetric | MarkKind::Hexagonal => {
                let in_part = |_| match self.kind {
                    MarkKind::Circles => {
                        ordered_discs(photo, |discs| seen_circle_grid_of(discs, columns, rows))
                    }
                    _ => ordered_discs(photo, |discs| seen_staggered_grid_of(discs, columns, rows)),
                };
                let seen = self.whole_discs(photo).or_else(in_part)?;
                alone(photo, seen, self.period())
            }
        }
    }

    /// A dense grid of discs, all seen.
    fn whole_discs(&self, photo: &Grey) -> Result<SeenBoard, NotFound> {
        let (columns, rows) = (self.board.columns(), self.board.rows());
        let grid = match self.kind {
            MarkKind::Circles => ordered_discs(photo, |discs| circle_grid_of(discs, columns, rows)),
            _ => ordered_discs(photo, |discs| staggered_grid_of(discs, columns, rows)),
        };
        grid.map(SeenBoard::from)
    }

    /// After so many rows discs stand above each other again.
    fn period(&self) -> usize {
        if self.kind == MarkKind::Circles { 1 } else { 2 }
    }

    fn corners(&self, photo: &Grey) -> Result<Vec<Vec2>, DetectError> {
        let (columns, rows) = (self.board.columns(), self.board.rows());
        let board = match photo {
            Grey::U8(image) => chessboard(image, columns, rows),
            Grey::U16(image) => chessboard(image, columns, rows),
            Grey::F32(image) => chessboard(image, columns, rows),
        };
        Ok(board?.corners_px().to_vec())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_is_read_with_its_units() {
        let spec: BoardSpec = "circles:9x7:1cm:3mm".parse().unwrap();
        assert_eq!(*spec.board(), Board::circles(9, 7, 1.0, 0.3).unwrap());
        assert_eq!((spec.kind, spec.unit.as_str()), (MarkKind::Circles, "cm"));
        let spec: BoardSpec = "chess:9x6:25mm".parse().unwrap();
        assert_eq!(*spec.board(), Board::chessboard(9, 6, 25.0).unwrap());
        let spec: BoardSpec = "dots:3x3:1".parse().unwrap();
        assert!(!spec.diameter_known && spec.kind == MarkKind::Dots);
        assert_eq!(
            "dots:3x3:2mm".parse::<BoardSpec>().unwrap().to_string(),
            "dots of 3 x 3 marks, 2 mm apart"
        );
        let spec: BoardSpec = "asymmetric:4x11:20mm:15mm".parse().unwrap();
        assert_eq!(spec.to_string(), "staggered grid of 4 x 11 discs, rows 20 mm apart");
    }

    #[test]
    fn the_words_of_a_board_make_it_again() {
        for text in [
            "circles:9x7:10mm:3mm",
            "chess:9x6:2.5cm",
            "dots:3x3:1",
            "circles:4x4:0.3:0.1",
            "asymmetric:4x11:20mm:15mm",
            "hexagonal:9x9:1cm:0.5cm",
            "asymmetric:4x11:20mm",
            "charuco:7x5:30mm:22mm:DICT_4X4_50",
            "charuco:5x8:3cm:2cm:DICT_APRILTAG_36h11:legacy",
            "aprilgrid:6x6:88mm:0.3",
        ] {
            let spec: BoardSpec = text.parse().unwrap();
            assert_eq!(spec.words(), text);
            assert_eq!(spec.scaled(1.0).unwrap(), spec);
            assert_eq!(spec.scaled(2.0).unwrap().board().arrangement(), spec.board().arrangement());
        }
    }

    #[test]
    fn a_board_with_markers_is_counted_in_opencvs_and_kalibrs_way() {
        let spec: BoardSpec = "charuco:7x5:3cm:22mm:4x4_50".parse().unwrap();
        assert_eq!((spec.board().columns(), spec.board().rows(), spec.points().len()), (6, 4, 24));
        assert_eq!(spec.words(), "charuco:7x5:3cm:2.2cm:DICT_4X4_50");
        let spec: BoardSpec = "aprilgrid:6x7:88mm:0.3".parse().unwrap();
        let points = spec.points();
        assert_eq!(points.len(), 12 * 14);
        // The first tag stands at the lower left; y points downwards, and rows go upwards.
        assert!((points[1] - points[0] - Vec2::new(88.0, 0.0)).norm() < 1e-9);
        assert!((points[12] - points[0] - Vec2::new(0.0, -88.0)).norm() < 1e-9);
        assert!((points[2] - points[0] - Vec2::new(114.4, 0.0)).norm() < 1e-9);
        assert!(points.iter().sum::<Vec2>().norm() < 1e-9);
    }

    #[test]
    fn what_is_no_board_is_refused_with_what_was_expected() {
        let refused = |text: &str| text.parse::<BoardSpec>().unwrap_err();
        for text in ["", "chess", "chess:9:25mm", "rings:9x7:1mm", "chess:9x-6:1", "circles:9x7:1:2:3"] {
            assert!(matches!(refused(text), BoardSpecError::Form(_)), "{text}");
        }
        assert!(matches!(refused("chess:9x6:wide"), BoardSpecError::Length(_)));
        assert!(matches!(refused("circles:9x7:10:3mm"), BoardSpecError::Unit(_)));
        assert!(matches!(refused("chess:9x6:25mm:3mm"), BoardSpecError::CornerDiameter { .. }));
        assert!(matches!(refused("circles:9x7:10mm:2cm"), BoardSpecError::Board(_)));
        assert!(matches!(refused("chess:1x6:25mm"), BoardSpecError::Board(_)));
        for text in
            ["charuco:7x5:30mm", "charuco:7:30mm:22mm:DICT_4X4_50", "charuco:7x5:30mm:22mm:DICT_4X4_50:old"]
        {
            assert!(matches!(refused(text), BoardSpecError::Charuco(_)), "{text}");
        }
        assert!(matches!(refused("charuco:7x5:30mm:22mm:DICT_9X9_50"), BoardSpecError::Dictionary(_)));
        assert!(matches!(refused("charuco:7x5:22mm:30mm:DICT_4X4_50"), BoardSpecError::Layout(_)));
        assert!(matches!(refused("aprilgrid:6x6:88mm"), BoardSpecError::AprilGrid(_)));
        assert!(matches!(refused("aprilgrid:6x6:88mm:26mm"), BoardSpecError::AprilGrid(_)));
    }
}
