//! What stands on the printed page? The board in the middle, a ruler below it and one on its left, and a line
//! of words, all in millimetres from the page's top left corner, y down.

use super::paper::Paper;
use calibench::board::Pattern;
use calibench::geometry::Vec2;
use calibench::photos::BoardSpec;

/// Something black on the white page.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Ink {
    /// A disc.
    Disc { centre: Vec2, diameter: f64 },
    /// An upright rectangle by its top left corner.
    Rectangle { corner: Vec2, size: Vec2 },
    /// Upright rectangles by their top left and bottom right corners, filled as one: where two touch, no line
    /// shows.
    Cells(Vec<[Vec2; 2]>),
    /// Words, by the left end of their base line and the height of the type.
    Words { at: Vec2, height: f64, text: String },
}

/// A page.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sheet {
    /// Width and height.
    pub size: Vec2,
    pub ink: Vec<Ink>,
    /// Lengths of the lower and the left ruler.
    pub rulers: [f64; 2],
}

/// Why a board cannot be printed on a page.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum SheetError {
    #[error(
        "the board's lengths have no unit, so nobody knows how large it is: say mm, cm or m, as in circles:9x7:10mm:3mm"
    )]
    NoUnit,
    #[error("the discs have no diameter, so they cannot be drawn: add it, as in circles:9x7:10mm:3mm")]
    NoDiameter,
    #[error(
        "its marks would be {size:.2e} mm wide, and no printer draws less than {LEAST_MARK} mm: is the unit right?"
    )]
    TooSmall { size: f64 },
    #[error(
        "the board is {width:.0} x {height:.0} mm and {paper} has room for {room_width:.0} x {room_height:.0} mm beside the rulers: \
         {advice}"
    )]
    TooLarge { width: f64, height: f64, paper: Paper, room_width: f64, room_height: f64, advice: String },
}

/// Printers leave about 5 mm at every edge white.
const EDGE: f64 = 6.0;
/// The lower ruler with its numbers, and the words below.
const STRIP_BELOW: f64 = 13.0;
/// The left ruler with its numbers.
const STRIP_LEFT: f64 = 11.0;
/// White around the board at the least.
const QUIET: f64 = 3.0;
/// Shortest ruler: read to half a millimetre, 30 mm tell the scale to 2 %, and less is of no use.
const SHORTEST_RULER: f64 = 30.0;

/// The least width of a mark, mm: a dot of a printer with 600 dots an inch is 0.042 mm wide.
const LEAST_MARK: f64 = 0.05;

/// Helvetica's letters are about half as wide as high on average.
const LETTER_WIDTH: f64 = 0.52;
/// Height of the type: of the words, and of the rulers' numbers.
const TYPE: f64 = 2.6;
/// Width of a tick, and of a ruler's line. Its middle is meant.
const TICK: f64 = 0.2;

impl Sheet {
    /// Draws a board on a sheet of paper, turned by a quarter where the board fits so alone.
    pub fn of(board: &BoardSpec, paper: &Paper) -> Result<Sheet, SheetError> {
        let unit = board.unit_mm().ok_or(SheetError::NoUnit)?;
        if board.lacks_diameter() {
            return Err(SheetError::NoDiameter);
        }
        let extent = extent(board, unit);
        let fits = |paper: &Paper| {
            let room = room(paper);
            extent.x <= room.x && extent.y <= room.y
        };
        let Some(lying) = paper.either_way().into_iter().find(fits) else {
            let (room, larger) = (room(paper), Paper::smallest(fits));
            let advice = match larger {
                Some(larger) => format!("take {larger}, or less of a spacing"),
                None => "take less of a spacing".to_string(),
            };
            return Err(SheetError::TooLarge {
                width: extent.x,
                height: extent.y,
                paper: paper.clone(),
                room_width: room.x,
                room_height: room.y,
                advice,
            });
        };
        let size = Vec2::new(lying.width_mm, lying.height_mm);
        let middle =
            Vec2::new(0.5 * (EDGE + STRIP_LEFT + size.x - EDGE), 0.5 * (EDGE + size.y - STRIP_BELOW - EDGE));
        let ink = marks(board, unit, middle);
        let least = ink.iter().map(width).fold(f64::INFINITY, f64::min);
        if least < LEAST_MARK {
            return Err(SheetError::TooSmall { size: least });
        }
        let mut sheet = Sheet { size, ink, rulers: [0.0; 2] };
        sheet.rulers = [sheet.lower_ruler(), sheet.left_ruler()];
        let words = format!(
            "{board}. Drawn at 100 %: the rulers are {} and {} mm long. Print without scaling, measure both, and write it into board.toml.",
            sheet.rulers[0], sheet.rulers[1]
        );
        let at = Vec2::new(EDGE + STRIP_LEFT, size.y - EDGE - 0.4);
        let room = size.x - EDGE - at.x;
        sheet.ink.push(Ink::Words {
            at,
            height: TYPE.min(room / (LETTER_WIDTH * words.len() as f64)),
            text: words,
        });
        Ok(sheet)
    }

    /// Draws the ruler below the board; says how long it is.
    fn lower_ruler(&mut self) -> f64 {
        let length = ruler_length(self.size.x - 2.0 * EDGE - STRIP_LEFT);
        let (left, line) = (EDGE + STRIP_LEFT, self.size.y - EDGE - STRIP_BELOW + 2.0);
        self.rectangle(left - 0.5 * TICK, line, length + TICK, TICK);
        for (at, height) in ticks(length) {
            self.rectangle(left + at - 0.5 * TICK, line, TICK, height);
        }
        for number in numbers(length) {
            // Right of its tick, the last one left of it: beyond lies the edge that no printer reaches.
            let beside = if number < length { 0.6 } else { -6.0 };
            self.number(Vec2::new(left + number + beside, line + 5.0), number);
        }
        length
    }

    /// Draws the ruler on the left of the board; says how long it is.
    fn left_ruler(&mut self) -> f64 {
        let length = ruler_length(self.size.y - 2.0 * EDGE - STRIP_BELOW - TYPE);
        let (line, top) = (EDGE + STRIP_LEFT - 2.0, EDGE + TYPE);
        self.rectangle(line, top - 0.5 * TICK, TICK, length + TICK);
        for (at, width) in ticks(length) {
            self.rectangle(line + TICK - width, top + at - 0.5 * TICK, width, TICK);
        }
        for number in numbers(length) {
            self.number(Vec2::new(line - 7.4, top + number - 0.9), number);
        }
        length
    }

    fn rectangle(&mut self, x: f64, y: f64, width: f64, height: f64) {
        self.ink.push(Ink::Rectangle { corner: Vec2::new(x, y), size: Vec2::new(width, height) });
    }

    fn number(&mut self, at: Vec2, number: f64) {
        self.ink.push(Ink::Words { at, height: TYPE, text: format!("{number}") });
    }
}

/// By how much a board could grow on a sheet of paper: the largest factor for its lengths.
pub(super) fn growth(board: &BoardSpec, paper: &Paper) -> Option<f64> {
    let extent = extent(board, board.unit_mm()?);
    let growth = |paper: Paper| {
        let room = room(&paper);
        (room.x / extent.x).min(room.y / extent.y)
    };
    Some(paper.either_way().map(growth).into_iter().fold(0.0, f64::max))
}

/// What is left for the board.
fn room(paper: &Paper) -> Vec2 {
    Vec2::new(
        paper.width_mm - 2.0 * EDGE - STRIP_LEFT - 2.0 * QUIET,
        paper.height_mm - 2.0 * EDGE - STRIP_BELOW - 2.0 * QUIET,
    )
}

/// Width and height of a board's ink.
pub(super) fn extent(board: &BoardSpec, unit: f64) -> Vec2 {
    if let Some(dark) = board.dark() {
        // About the board's middle.
        return dark.iter().fold(Vec2::zeros(), |extent, [_, high]| extent.sup(&(2.0 * unit * high)));
    }
    let board = board.board();
    // The outermost marks lie as far on both sides of the origin.
    let reach = board.points().iter().fold(Vec2::zeros(), |reach, point| reach.sup(&point.abs()));
    let around = match board.pattern() {
        Pattern::Circles { diameter } => diameter,
        // The outermost corners have squares on both sides.
        _ => 2.0 * board.spacing(),
    };
    unit * (2.0 * reach + Vec2::new(around, around))
}

/// The ink of the board's marks around their middle.
fn marks(board: &BoardSpec, unit: f64, middle: Vec2) -> Vec<Ink> {
    let spec = board;
    if let Some(dark) = spec.dark() {
        let place = |corners: [Vec2; 2]| corners.map(|corner| middle + unit * corner);
        return vec![Ink::Cells(dark.into_iter().map(place).collect())];
    }
    let board = spec.board();
    match board.pattern() {
        Pattern::Circles { diameter } => {
            let disc = |p: Vec2| Ink::Disc { centre: middle + unit * p, diameter: unit * diameter };
            board.points().into_iter().map(disc).collect()
        }
        _ => {
            let side = unit * board.spacing();
            let first = middle - 0.5 * extent(spec, unit);
            // A square more than corners in each direction; the first is black.
            let squares =
                (0..=board.rows()).flat_map(|row| (0..=board.columns()).map(move |column| (column, row)));
            let black = squares.filter(|(column, row)| (column + row) % 2 == 0);
            let place = |(column, row)| first + side * Vec2::new(column as f64, row as f64);
            black
                .map(|square| Ink::Rectangle { corner: place(square), size: Vec2::new(side, side) })
                .collect()
        }
    }
}

/// The width of a mark; of cells that of the narrowest one.
fn width(ink: &Ink) -> f64 {
    match ink {
        Ink::Disc { diameter, .. } => *diameter,
        Ink::Rectangle { size, .. } => size.min(),
        Ink::Cells(cells) => {
            cells.iter().map(|[first, last]| (last - first).min()).fold(f64::INFINITY, f64::min)
        }
        Ink::Words { .. } => f64::INFINITY,
    }
}

/// The longest ruler of whole centimetres on a length.
fn ruler_length(room: f64) -> f64 {
    (10.0 * libm::floor(room / 10.0)).max(SHORTEST_RULER)
}

/// Places of a ruler's ticks and their lengths, every 5 mm; those of the ends are the longest.
fn ticks(length: f64) -> impl Iterator<Item = (f64, f64)> {
    let count = (length / 5.0) as usize;
    (0..=count).map(move |i| {
        let tick = match i {
            _ if i == 0 || i == count => 5.0,
            _ if i % 2 == 0 => 3.0,
            _ => 1.8,
        };
        (5.0 * i as f64, tick)
    })
}

/// Where numbers stand: every 50 mm, and at the end.
fn numbers(length: f64) -> impl Iterator<Item = f64> {
    let count = (length / 50.0) as usize;
    let end = (length > 50.0 * count as f64).then_some(length);
    (0..=count).map(|i| 50.0 * i as f64).chain(end)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet(board: &str, paper: &str) -> Result<Sheet, SheetError> {
        Sheet::of(&board.parse().unwrap(), &paper.parse().unwrap())
    }

    #[test]
    fn discs_lie_apart_by_the_spacing_whatever_the_unit() {
        for board in ["circles:9x7:10mm:3mm", "circles:9x7:1cm:0.3cm", "circles:9x7:0.01m:0.003m"] {
            let sheet = sheet(board, "A4").unwrap();
            let discs: Vec<(Vec2, f64)> = sheet
                .ink
                .iter()
                .filter_map(|ink| match ink {
                    Ink::Disc { centre, diameter } => Some((*centre, *diameter)),
                    _ => None,
                })
                .collect();
            assert_eq!(discs.len(), 63);
            assert!((discs[1].0 - discs[0].0 - Vec2::new(10.0, 0.0)).norm() < 1e-12, "{board}");
            assert!((discs[9].0 - discs[0].0 - Vec2::new(0.0, 10.0)).norm() < 1e-12, "{board}");
            assert!((discs[0].1 - 3.0).abs() < 1e-12);
        }
    }

    #[test]
    fn staggered_rows_are_drawn_as_the_board_is_laid_out() {
        for (board, next_row) in [
            ("asymmetric:4x8:20mm:14mm", Vec2::new(20.0, 20.0)),
            ("hexagonal:16x11:15mm:7mm", Vec2::new(7.5, 15.0 * 0.75f64.sqrt())),
        ] {
            let columns = board.parse::<BoardSpec>().unwrap().board().columns();
            let sheet = sheet(board, "A4").unwrap();
            let centre = |k: usize| match sheet.ink[k] {
                Ink::Disc { centre, .. } => centre,
                _ => panic!("{board}: no disc"),
            };
            assert!((centre(columns) - centre(0) - next_row).norm() < 1e-12, "{board}");
        }
    }

    #[test]
    fn everything_lies_on_the_page_and_no_ruler_on_the_board() {
        for (board, paper) in [
            ("chess:9x6:25mm", "A4"),
            ("circles:30x20:5mm:2mm", "letter"),
            ("dots:3x3:20mm:8mm", "A5"),
            ("asymmetric:4x8:20mm:14mm", "A4"),
            // Upright.
            ("asymmetric:4x11:20mm:15mm", "A4"),
            ("hexagonal:16x11:15mm:7mm", "A4"),
            ("charuco:7x5:35mm:26mm:DICT_4X4_50", "A4"),
            ("aprilgrid:6x4:30mm:0.3", "A4"),
        ] {
            let sheet = sheet(board, paper).unwrap();
            let spec: BoardSpec = board.parse().unwrap();
            let board_ink = marks(&spec, 1.0, Vec2::zeros()).len();
            let bounds = |ink: &Ink| match ink {
                Ink::Disc { centre, diameter } => {
                    let radius = Vec2::new(0.5 * diameter, 0.5 * diameter);
                    (centre - radius, centre + radius)
                }
                Ink::Rectangle { corner, size } => (*corner, corner + size),
                Ink::Cells(cells) => {
                    let corners = || cells.iter().flatten().copied();
                    let low = corners().reduce(|a, b| a.inf(&b)).unwrap();
                    (low, corners().reduce(|a, b| a.sup(&b)).unwrap())
                }
                Ink::Words { at, height, text } => (
                    at - Vec2::new(0.0, *height),
                    at + Vec2::new(LETTER_WIDTH * height * text.len() as f64, 0.0),
                ),
            };
            for ink in &sheet.ink {
                let (low, high) = bounds(ink);
                let on_page = low.x >= 5.0
                    && low.y >= 5.0
                    && high.x <= sheet.size.x - 5.0
                    && high.y <= sheet.size.y - 5.0;
                assert!(on_page, "{board}: {ink:?}");
            }
            for mark in &sheet.ink[..board_ink] {
                for other in &sheet.ink[board_ink..] {
                    let ((a, b), (c, d)) = (bounds(mark), bounds(other));
                    let apart = b.x < c.x || d.x < a.x || b.y < c.y || d.y < a.y;
                    assert!(apart, "{board}: {mark:?} {other:?}");
                }
            }
        }
    }

    #[test]
    fn what_cannot_be_printed_is_refused_with_what_to_do() {
        assert_eq!(sheet("dots:3x3:1", "A4"), Err(SheetError::NoUnit));
        assert_eq!(sheet("circles:9x7:10mm", "A4"), Err(SheetError::NoDiameter));
        let large = sheet("chess:9x6:30mm", "A4").unwrap_err();
        assert!(large.to_string().contains("take A3"), "{large}");
        assert!(matches!(sheet("chess:9x6:0.02mm", "A4"), Err(SheetError::TooSmall { size: 0.02 })));
        assert!(matches!(sheet("dots:9x6:1mm:1e-320mm", "A4"), Err(SheetError::TooSmall { .. })));
        assert!(sheet("chess:9x6:0.1mm", "A4").is_ok());
        assert!(sheet("chess:9x6:3m", "A0").unwrap_err().to_string().contains("less of a spacing"));
    }

    #[test]
    fn a_chessboard_has_the_corners_it_is_named_for() {
        let sheet = sheet("chess:3x2:20mm", "A4").unwrap();
        let squares = sheet.ink.iter().filter(
            |ink| matches!(ink, Ink::Rectangle { size, .. } if (size - Vec2::new(20.0, 20.0)).norm() < 1e-12),
        );
        assert_eq!(squares.count(), 6);
    }

    #[test]
    fn a_board_with_markers_is_as_large_as_it_says() {
        for (board, width, height) in [
            ("charuco:7x5:3cm:22mm:DICT_4X4_50", 210.0, 150.0),
            ("aprilgrid:6x4:30mm:0.3", 6.0 * 39.0 + 9.0, 4.0 * 39.0 + 9.0),
        ] {
            let size = extent(&board.parse().unwrap(), if board.contains("cm") { 10.0 } else { 1.0 });
            assert!((size - Vec2::new(width, height)).norm() < 1e-9, "{size}");
        }
    }

    #[test]
    fn a_board_grows_until_it_fills_the_page() {
        let (board, paper): (BoardSpec, Paper) =
            ("circles:9x7:10mm:3mm".parse().unwrap(), "A4".parse().unwrap());
        let factor = growth(&board, &paper).unwrap();
        assert!(Sheet::of(&board.scaled(0.999 * factor).unwrap(), &paper).is_ok());
        assert!(Sheet::of(&board.scaled(1.001 * factor).unwrap(), &paper).is_err());
    }
}
