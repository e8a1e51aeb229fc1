//! A board with markers as it stands on the command line: `charuco:7x5:30mm:22mm:DICT_4X4_50` and
//! `aprilgrid:6x6:88mm:0.3`.

use super::board::{BoardSpecError, Length};
use crate::board::Board;
use crate::detect::{AprilGrid, Charuco, CodedError, LayoutError, SeenBoard, seen_april_grid, seen_charuco};
use crate::geometry::Vec2;
use crate::io::Grey;

/// What tells the marks of a board apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Coded {
    /// Markers in the white squares; the marker's side in the board's unit, as it was given.
    Charuco(Charuco, f64),
    /// Tags, and the side of one in the board's unit.
    AprilGrid(AprilGrid, f64),
}

/// What a board with markers is, how large, and in which unit.
type Parsed = (Coded, Board, &'static str);

/// The word behind a ChArUco board that begins with a white square where its rows are even.
const LEGACY: &str = "legacy";

/// A board with markers; `None` for a kind without.
pub(super) fn parse(parts: &[&str]) -> Option<Result<Parsed, BoardSpecError>> {
    match parts {
        ["charuco", rest @ ..] => Some(charuco(rest)),
        ["aprilgrid", rest @ ..] => Some(april_grid(rest)),
        _ => None,
    }
}

fn size(text: &str) -> Option<(usize, usize)> {
    let (columns, rows) = text.split_once('x')?;
    Some((columns.parse().ok()?, rows.parse().ok()?))
}

fn charuco(parts: &[&str]) -> Result<Parsed, BoardSpecError> {
    let form = || BoardSpecError::Charuco(parts.join(":"));
    let (counts, square, marker, dictionary, legacy) = match *parts {
        [counts, square, marker, dictionary] => (counts, square, marker, dictionary, false),
        [counts, square, marker, dictionary, LEGACY] => (counts, square, marker, dictionary, true),
        _ => return Err(form()),
    };
    let (columns, rows) = size(counts).ok_or_else(form)?;
    let square: Length = square.parse()?;
    let marker = marker.parse::<Length>()?.in_unit(square.unit)?;
    let layout = Charuco::new(columns, rows, marker / square.value, dictionary.parse()?, legacy)?;
    let board = Board::chessboard(columns - 1, rows - 1, square.value)?;
    Ok((Coded::Charuco(layout, marker), board, square.unit))
}

fn april_grid(parts: &[&str]) -> Result<Parsed, BoardSpecError> {
    let form = || BoardSpecError::AprilGrid(parts.join(":"));
    let [counts, tag, spacing] = *parts else { return Err(form()) };
    let (columns, rows) = size(counts).ok_or_else(form)?;
    let tag: Length = tag.parse()?;
    let grid = AprilGrid::new(columns, rows, spacing.parse().map_err(|_| form())?)?;
    Ok((Coded::AprilGrid(grid, tag.value), board_of_tags(&grid, tag.value)?, tag.unit))
}

/// As many marks as the tags have corners, at their mean distance.
fn board_of_tags(grid: &AprilGrid, tag: f64) -> Result<Board, BoardSpecError> {
    Ok(Board::chessboard(2 * grid.columns(), 2 * grid.rows(), 0.5 * (1.0 + grid.spacing()) * tag)?)
}

impl Coded {
    /// The board as it stands on the command line.
    pub(super) fn words(&self, board: &Board, unit: &str) -> String {
        match self {
            Coded::Charuco(layout, marker) => {
                let (columns, rows, square) = (layout.columns(), layout.rows(), board.spacing());
                let legacy = if layout.is_legacy() { ":legacy" } else { "" };
                let dictionary = layout.dictionary();
                format!("charuco:{columns}x{rows}:{square}{unit}:{marker}{unit}:{dictionary}{legacy}")
            }
            Coded::AprilGrid(grid, tag) => {
                format!("aprilgrid:{}x{}:{tag}{unit}:{}", grid.columns(), grid.rows(), grid.spacing())
            }
        }
    }

    /// The board for a reader.
    pub(super) fn described(&self, board: &Board, unit: &str) -> String {
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        match self {
            Coded::Charuco(layout, marker) => format!(
                "ChArUco board of {} x {} squares of {}{unit} with markers of {marker}{unit} ({}{})",
                layout.columns(),
                layout.rows(),
                board.spacing(),
                layout.dictionary(),
                if layout.is_legacy() { ", legacy pattern" } else { "" }
            ),
            Coded::AprilGrid(grid, tag) => format!(
                "grid of {} x {} AprilTags of {tag}{unit}, {} of that apart",
                grid.columns(),
                grid.rows(),
                grid.spacing()
            ),
        }
    }

    /// The same `factor` times as large, with its board.
    pub(super) fn scaled(&self, board: &Board, factor: f64) -> Result<(Coded, Board), BoardSpecError> {
        match *self {
            Coded::Charuco(layout, marker) => {
                let board = Board::chessboard(board.columns(), board.rows(), factor * board.spacing())?;
                Ok((Coded::Charuco(layout, factor * marker), board))
            }
            Coded::AprilGrid(grid, tag) => {
                Ok((Coded::AprilGrid(grid, factor * tag), board_of_tags(&grid, factor * tag)?))
            }
        }
    }

    /// The marks about the board's middle, x to the right, y downwards.
    pub(super) fn points(&self, board: &Board) -> Vec<Vec2> {
        match self {
            Coded::Charuco(..) => board.points(),
            Coded::AprilGrid(grid, tag) => {
                let points = grid.points();
                let middle = 0.5 * points[points.len() - 1];
                points.iter().map(|point| upright(*tag, *point - middle)).collect()
            }
        }
    }

    /// What is black about the board's middle, x to the right, y downwards.
    pub(super) fn dark(&self, board: &Board) -> Vec<[Vec2; 2]> {
        match self {
            Coded::Charuco(layout, _) => {
                let middle = 0.5 * Vec2::new(layout.columns() as f64, layout.rows() as f64);
                let place = |point: Vec2| (point - middle) * board.spacing();
                layout.dark().into_iter().map(|corners| corners.map(place)).collect()
            }
            Coded::AprilGrid(grid, tag) => {
                let points = grid.points();
                let middle = 0.5 * points[points.len() - 1];
                let turned = |[low, high]: [Vec2; 2]| {
                    let (a, b) = (upright(*tag, low - middle), upright(*tag, high - middle));
                    [Vec2::new(a.x, b.y), Vec2::new(b.x, a.y)]
                };
                grid.dark().into_iter().map(turned).collect()
            }
        }
    }

    pub(super) fn see(&self, photo: &Grey) -> Result<SeenBoard, CodedError> {
        match (self, photo) {
            (Coded::Charuco(board, _), Grey::U8(image)) => seen_charuco(image, board),
            (Coded::Charuco(board, _), Grey::U16(image)) => seen_charuco(image, board),
            (Coded::Charuco(board, _), Grey::F32(image)) => seen_charuco(image, board),
            (Coded::AprilGrid(board, _), Grey::U8(image)) => seen_april_grid(image, board),
            (Coded::AprilGrid(board, _), Grey::U16(image)) => seen_april_grid(image, board),
            (Coded::AprilGrid(board, _), Grey::F32(image)) => seen_april_grid(image, board),
        }
    }
}

/// Kalibr's y, which points upwards, downwards; in the board's unit.
fn upright(tag: f64, point: Vec2) -> Vec2 {
    Vec2::new(tag * point.x, -tag * point.y)
}

impl From<LayoutError> for BoardSpecError {
    fn from(reason: LayoutError) -> BoardSpecError {
        BoardSpecError::Layout(reason)
    }
}
