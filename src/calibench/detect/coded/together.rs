//! Which tags are these, if hardly one can be read by itself? A blurred photograph shows of each tag some
//! cells wrong, more than its code corrects; of all tags together one place and one turn of the grid explains
//! far more cells than any other.

use super::layout::AprilGrid;
use super::tag::{FARTHEST, Reading, Tag, middle_px, on_board, side_px, unit_corners};
use crate::detect::lattice::Place;
use crate::geometry::{Homography, Vec2};

/// Fewest quadrangles that are told together.
const FEWEST: usize = 4;

/// How far from where another puts it a quadrangle's middle may lie, in its sides, for each place between the
/// two; and how much larger it may be than the other.
const MOST_OFF: f64 = 0.25;
const MOST_LARGER: f64 = 1.6;

/// Cells of a tag.
const CELLS: f64 = 36.0;

/// Part of the cells that differ from those of a tag by chance, and the standard deviation of one tag's. Of
/// one reading they are 1/2 and 1/12, of the best of four that have nothing in common 0.41 and 0.06; those of
/// a tag have much in common.
const BY_CHANCE: f64 = 0.46;
const DEVIATION: f64 = 0.09;

/// How far below chance all must lie, and each row by itself, in standard deviations. All: a grid of 24 tags
/// has 96 places and turns. Rows: on a grid of another width some row may fit, and the others do not.
const ALL_BELOW: f64 = 6.0;
const ROW_BELOW: f64 = 3.0;

/// Most cells that may differ, as part of all.
const MOST_WRONG: f64 = 0.3;

/// A quadrangle with its place in the lattice of the first one.
struct Placed<'a> {
    reading: &'a Reading,
    place: Place,
    /// Corners that its first corner lies behind the first one's, in quarter turns.
    turns: u8,
}

/// The tags of a grid whose cells, all together, say where on it they are; of more than one row, for one row
/// of tags looks alike on grids of any width.
pub fn together(readings: &[Reading], grid: &AprilGrid) -> Vec<Tag> {
    let lattice = largest_lattice(readings, grid);
    if lattice.len() < FEWEST {
        return Vec::new();
    }
    let places = (0..grid.rows()).flat_map(|row| (0..grid.columns()).map(move |column| (column, row)));
    let stands = (0..4).flat_map(|turns| places.clone().map(move |at| (turns, at)));
    let taken = stands.filter_map(|(turns, at)| Some((turns, taken_as(&lattice, at, turns, grid)?)));
    let best = taken.min_by(|(_, a), (_, b)| part_wrong(a).total_cmp(&part_wrong(b)));
    let Some((turns, taken)) = best.filter(|(_, taken)| is_certain(taken, grid)) else { return Vec::new() };
    let tags = lattice.iter().zip(taken);
    tags.map(|(placed, (id, _))| placed.reading.taken_as(id, turned_by(turns, placed.turns), grid)).collect()
}

/// The turns of a quadrangle whose first corner lies `behind` that of one with `turns`.
fn turned_by(turns: u8, behind: u8) -> u8 {
    (turns + 4 - behind) % 4
}

/// Numbers, and cells that differ, if the first quadrangle is the tag at a place, turned so; `None` where one
/// would lie beside the grid.
fn taken_as(
    lattice: &[Placed<'_>],
    (column, row): (usize, usize),
    turns: u8,
    grid: &AprilGrid,
) -> Option<Vec<(usize, u32)>> {
    let of = |placed: &Placed<'_>| {
        let (x, y) = on_board(placed.place, turns);
        let column = column.checked_add_signed(x as isize).filter(|column| *column < grid.columns())?;
        // Rows are counted upwards.
        let row = row.checked_add_signed(-y as isize).filter(|row| *row < grid.rows())?;
        let id = row * grid.columns() + column;
        Some((id, placed.reading.wrong(id, turned_by(turns, placed.turns))?))
    };
    lattice.iter().map(of).collect()
}

fn part_wrong(taken: &[(usize, u32)]) -> f64 {
    let wrong: u32 = taken.iter().map(|(_, wrong)| wrong).sum();
    f64::from(wrong) / (CELLS * taken.len() as f64)
}

/// Whether the cells fit so well as chance, or a grid of another width, does not.
fn is_certain(taken: &[(usize, u32)], grid: &AprilGrid) -> bool {
    let fits = |taken: &[(usize, u32)], below: f64| {
        let most = BY_CHANCE - below * DEVIATION / (taken.len() as f64).sqrt();
        part_wrong(taken) <= most.min(MOST_WRONG)
    };
    let mut rows: Vec<Vec<(usize, u32)>> = vec![Vec::new(); grid.rows()];
    for tag in taken {
        rows[tag.0 / grid.columns()].push(*tag);
    }
    let mut rows = rows.iter().filter(|row| !row.is_empty());
    let is_wide_enough = grid.rows() == 1 || rows.clone().count() > 1;
    is_wide_enough && fits(taken, ALL_BELOW) && rows.all(|row| fits(row, ROW_BELOW))
}

/// The most quadrangles that stand beside each other as tags of a grid do.
fn largest_lattice<'a>(readings: &'a [Reading], grid: &AprilGrid) -> Vec<Placed<'a>> {
    let mut left: Vec<bool> = vec![true; readings.len()];
    let mut largest: Vec<Placed<'a>> = Vec::new();
    for first in 0..readings.len() {
        if !left[first] {
            continue;
        }
        left[first] = false;
        let mut lattice = vec![Placed { reading: &readings[first], place: (0, 0), turns: 0 }];
        let mut next = 0;
        while next < lattice.len() {
            for (index, reading) in readings.iter().enumerate() {
                if !left[index] {
                    continue;
                }
                let Some(placed) = beside(&lattice[next], reading, grid) else { continue };
                if lattice.iter().all(|other| other.place != placed.place) {
                    left[index] = false;
                    lattice.push(placed);
                }
            }
            next += 1;
        }
        if lattice.len() > largest.len() {
            largest = lattice;
        }
    }
    largest
}

/// Where a quadrangle stands, seen from one whose place is known.
fn beside<'a>(from: &Placed<'_>, to: &'a Reading, grid: &AprilGrid) -> Option<Placed<'a>> {
    // Corners in the order of the lattice's first quadrangle.
    let corners =
        |reading: &Reading, turns: u8| [0, 1, 2, 3].map(|k| reading.corners_px[(k + usize::from(turns)) % 4]);
    let here = corners(from.reading, from.turns);
    let (other, pitch) = (middle_px(&to.corners_px), 1.0 + grid.spacing());
    let (side_here, side_there) = (side_px(&here), side_px(&to.corners_px));
    if side_there > MOST_LARGER * side_here || side_here > MOST_LARGER * side_there {
        return None;
    }
    let photo_from_tag = Homography::fit(&unit_corners(), &here).ok()?.homography;
    let way = photo_from_tag.inverse()?.apply(&other)? / pitch;
    let steps = (libm::round(way.x), libm::round(way.y));
    let apart = steps.0.abs().max(steps.1.abs());
    if !(1.0..=FARTHEST as f64).contains(&apart) {
        return None;
    }
    let expected = photo_from_tag.apply(&(pitch * Vec2::new(steps.0, steps.1)))?;
    if (expected - other).norm() > MOST_OFF * side_there * apart {
        return None;
    }
    let edge = here[1] - here[0];
    let along = |turns: &u8| {
        let there = corners(to, *turns);
        (there[1] - there[0]).normalize().dot(&edge)
    };
    let turns = (0..4).max_by(|a, b| along(a).total_cmp(&along(b)))?;
    let place = (from.place.0 + steps.0 as i32, from.place.1 + steps.1 as i32);
    Some(Placed { reading: to, place, turns })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Tags of the first columns of a grid of 5 x 4, each row with so many wrong cells a tag.
    fn taken(columns: usize, wrong: &[u32]) -> Vec<(usize, u32)> {
        let rows = wrong.iter().enumerate();
        rows.flat_map(|(row, wrong)| (0..columns).map(move |column| (5 * row + column, *wrong))).collect()
    }

    #[test]
    fn tags_with_more_wrong_cells_than_their_code_corrects_are_certain_together() {
        let grid = AprilGrid::new(5, 4, 0.3).unwrap();
        assert!(is_certain(&taken(5, &[9, 10, 8, 9]), &grid));
        assert!(is_certain(&taken(2, &[6, 6]), &grid));
        assert!(!is_certain(&taken(2, &[9, 9]), &grid));
        assert!(!is_certain(&taken(5, &[12, 12, 12, 12]), &grid));
    }

    #[test]
    fn where_one_row_does_not_fit_the_grid_is_another() {
        let grid = AprilGrid::new(5, 4, 0.3).unwrap();
        // As of a grid of another width: its first row fits, the others by chance.
        assert!(!is_certain(&taken(5, &[1, 16]), &grid));
        assert!(!is_certain(&taken(4, &[1, 1, 1, 16]), &grid));
        assert!(!is_certain(&taken(5, &[1]), &grid));
        assert!(is_certain(&taken(5, &[1]), &AprilGrid::new(5, 1, 0.3).unwrap()));
    }

    /// Cells that differ in the best of four readings that have nothing in common: fewer than any chance
    /// leaves.
    fn by_chance(random: &mut ChaCha8Rng) -> u32 {
        (0..4).map(|_| (random.next_u64() >> 28).count_ones()).min().unwrap_or(36)
    }

    #[test]
    fn cells_by_chance_are_never_certain() {
        let grid = AprilGrid::new(5, 4, 0.3).unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut parts = Vec::new();
        for columns in [2, 3, 5] {
            for _ in 0..5_000 {
                let mut tags = taken(columns, &[0; 4]);
                tags.iter_mut().for_each(|tag| tag.1 = by_chance(&mut random));
                parts.extend(tags.iter().map(|tag| f64::from(tag.1) / CELLS));
                assert!(!is_certain(&tags, &grid), "{tags:?}");
            }
        }
        let mean = parts.iter().sum::<f64>() / parts.len() as f64;
        let square = parts.iter().map(|part| (part - mean) * (part - mean)).sum::<f64>();
        let deviation = (square / parts.len() as f64).sqrt();
        assert!((mean - 0.41).abs() < 0.01 && (deviation - 0.06).abs() < 0.01, "{mean}, {deviation}");
    }
}
