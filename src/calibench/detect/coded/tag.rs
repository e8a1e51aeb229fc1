//! What is in a dark quadrangle, and which tag of a grid is that?

use super::cells::{Patch, read};
use super::dictionary::{Cells, Dictionary, mirrored, turned};
use super::layout::AprilGrid;
use crate::detect::chessboard::level::Pyramid;
use crate::geometry::{Homography, Vec2};
use crate::raster::Level;

/// Cells of a tag's border: Kalibr's two, and one of AprilTag's own.
const BORDERS: [usize; 2] = [2, 1];

/// Least difference of a tag's white and black, as part of the corners' contrast.
const LEAST_CONTRAST: f64 = 0.3;

/// Least part of a tag that must be inside of the image: its number is told by less than all cells.
const LEAST_INSIDE: f64 = 0.5;

/// A tag's corners about its middle, y down, in halves of its side.
const CORNERS: [(i32, i32); 4] = [(-1, -1), (1, -1), (1, 1), (-1, 1)];

/// Quarter turns of OpenCV's table against the tags as they are printed.
const TABLE_TURNS: u8 = 2;

/// How far apart tags tell of each other, in places of the grid: farther, the lens bends what a homography
/// says.
pub const FARTHEST: usize = 2;

/// What the inside of a quadrangle shows, whether or not it is a tag.
#[derive(Debug, Clone)]
pub struct Reading {
    /// Its corners, turning as from u to v, px of the photograph.
    pub corners_px: [Vec2; 4],
    /// Bright minus dark at the corner where they differ least.
    pub contrast: f64,
    /// The cells for each border, plain and sharpened.
    cells: Vec<Cells>,
}

impl Reading {
    /// `None` where no border of a tag is.
    pub fn of<T: Level>(
        pyramid: &Pyramid<'_, T>,
        corners_px: [Vec2; 4],
        contrast: f64,
        grid: &AprilGrid,
    ) -> Option<Reading> {
        let unit = [Vec2::zeros(), Vec2::new(1.0, 0.0), Vec2::new(1.0, 1.0), Vec2::new(0.0, 1.0)];
        let photo_from_marker = Homography::fit(&unit, &corners_px).ok()?.homography;
        let mut cells = Vec::with_capacity(2 * BORDERS.len());
        for border in BORDERS {
            let patch = Patch { photo_from_marker, border, white: grid.spacing(), inside: LEAST_INSIDE };
            let side = Dictionary::april_36h11().side();
            if let Some(inside) = read(pyramid, &patch, side, LEAST_CONTRAST * contrast) {
                cells.extend([inside.plain, inside.sharpened]);
            }
        }
        (!cells.is_empty()).then_some(Reading { corners_px, contrast, cells })
    }

    /// The tag that is read, if the code alone says which.
    pub fn tag(&self, grid: &AprilGrid) -> Option<Tag> {
        let dictionary = Dictionary::april_36h11();
        let read = self.cells.iter().find_map(|&cells| dictionary.recognise(cells, dictionary.len()))?;
        Some(self.taken_as(read.id, read.turns, grid))
    }

    /// Whether it is a tag as a mirror shows it.
    pub fn is_mirrored(&self) -> bool {
        let dictionary = Dictionary::april_36h11();
        let as_printed = |cells: &Cells| mirrored(*cells, dictionary.side());
        self.cells.iter().any(|cells| dictionary.recognise(as_printed(cells), dictionary.len()).is_some())
    }

    /// The least number of cells that differ from those of a tag, turned by so many quarters.
    pub fn wrong(&self, id: usize, turns: u8) -> Option<u32> {
        let dictionary = Dictionary::april_36h11();
        self.cells.iter().filter_map(|&cells| dictionary.wrong(cells, id, turns)).min()
    }

    /// The same of a quadrangle that begins at the tag's top left corner.
    pub fn wrong_upright(&self, id: usize) -> Option<u32> {
        self.wrong(id, TABLE_TURNS)
    }

    /// The tag of a number that is seen turned by so many quarters.
    pub fn taken_as(&self, id: usize, turns: u8, grid: &AprilGrid) -> Tag {
        let mut upright = self.corners_px;
        for (corner, at) in self.corners_px.iter().zip(CORNERS) {
            let stands_at = on_board(at, turns);
            if let Some(index) = CORNERS.iter().position(|&corner| corner == stands_at) {
                upright[index] = *corner;
            }
        }
        let at = (id % grid.columns(), id / grid.columns());
        Tag { id, at, corners_px: upright, contrast: self.contrast }
    }
}

/// A way in the quadrangle as it is seen, as it is on the board with y down, if its tag is seen turned by so
/// many quarters.
pub fn on_board(way: (i32, i32), turns: u8) -> (i32, i32) {
    turned(way, turns + TABLE_TURNS)
}

/// A tag of which it is known which it is.
#[derive(Debug, Clone)]
pub struct Tag {
    /// Its number.
    pub id: usize,
    /// Its place on the grid: column, and row from below.
    pub at: (usize, usize),
    /// Its corners as it stands on the board, px of the photograph: top left, top right, bottom right, bottom
    /// left.
    pub corners_px: [Vec2; 4],
    /// Bright minus dark at the corner where they differ least.
    pub contrast: f64,
}

impl Tag {
    /// From its own plane, in its sides about its middle with y down, to the photograph.
    pub fn unit(&self) -> Option<Homography> {
        Homography::fit(&unit_corners(), &self.corners_px).ok().map(|fit| fit.homography)
    }

    /// The way from the middle of the tag at a place to this one's, in sides of a tag, y down.
    pub fn way_from(&self, (column, row): (usize, usize), grid: &AprilGrid) -> Vec2 {
        let step = |to: usize, from: usize| (to as f64 - from as f64) * (1.0 + grid.spacing());
        // Rows are counted upwards.
        Vec2::new(step(self.at.0, column), -step(self.at.1, row))
    }

    /// How many places of the grid lie between a place and this tag's.
    pub fn apart(&self, at: (usize, usize)) -> usize {
        self.at.0.abs_diff(at.0).max(self.at.1.abs_diff(at.1))
    }
}

/// Mean of a tag's corners.
pub fn middle_px(corners_px: &[Vec2; 4]) -> Vec2 {
    corners_px.iter().sum::<Vec2>() / 4.0
}

/// Side of a tag by a diagonal, as if it were seen from the front.
pub fn side_px(corners_px: &[Vec2; 4]) -> f64 {
    (corners_px[0] - corners_px[2]).norm() / std::f64::consts::SQRT_2
}

/// The corners of a tag about its middle, in its sides, y down, in the order of [`Tag::corners_px`].
pub fn unit_corners() -> [Vec2; 4] {
    CORNERS.map(|(x, y)| 0.5 * Vec2::new(f64::from(x), f64::from(y)))
}
