//! Do discs stand where a board's next row would, in light in which none is found? In a hard shadow discs and their ground may both be
//! darker than the ground beside it, so that no threshold parts them; each is still as much darker than the ground about it as the board's
//! own discs are.

use super::beyond::{Next, Side, sides};
use super::grid_error::GridError;
use super::seen::SeenBoard;
use crate::geometry::Vec2;
use crate::raster::{Level, Raster};

/// Discs beyond that may be chance, as part of a side: fewer than of the marks that other means find, as contrast on all sides is seldom one.
const CHANCE: f64 = 0.2;
/// A disc beyond has at least this part of the contrast of the board's own, each over the light about it.
const LEAST_OF_OWN: f64 = 0.5;
/// Half the side of the square over which a level is averaged, in steps of the board: well within a disc.
const WITHIN: f64 = 0.1;
/// Places about a disc of which this many must lie in the image.
const LEAST_ABOUT: usize = 3;

/// Refuses a board of discs that goes on beyond a side: it is a part of a larger one. `period` is 1 or, where rows are staggered, 2.
///
/// # Errors
/// [`GridError::Larger`].
pub fn refuse_larger<T: Level>(
    image: &Raster<T>,
    board: SeenBoard,
    period: usize,
) -> Result<SeenBoard, GridError> {
    let (columns, rows) = (board.columns(), board.rows());
    let goes_on = |side: Side| discs_go_on(image, &side, period);
    let is_part = sides(board.places_px(), columns, period).any(goes_on);
    if is_part { Err(GridError::Larger { columns, rows }) } else { Ok(board) }
}

fn discs_go_on<T: Level>(image: &Raster<T>, side: &Side, period: usize) -> bool {
    let lit = |next: &Next| Lit::of(image, next, period);
    let own: Vec<Lit> = side.outer.iter().filter_map(lit).collect();
    // Dark marks on bright ground, or the reverse.
    let sign = own.iter().map(|lit| lit.mean - lit.disc).sum::<f64>().signum();
    let mut contrasts: Vec<f64> = own.iter().map(|lit| lit.contrast(sign)).collect();
    contrasts.sort_by(f64::total_cmp);
    let Some(middle) = contrasts.get(contrasts.len() / 2).filter(|middle| **middle > 0.0) else {
        return false;
    };
    side.goes_on(CHANCE, |next| lit(next).is_some_and(|lit| lit.contrast(sign) >= LEAST_OF_OWN * middle))
}

/// Levels of a disc and of the ground about it.
struct Lit {
    disc: f64,
    mean: f64,
    least: f64,
    most: f64,
}

impl Lit {
    /// `None` where a level is not in the image, or too few of the ground are.
    fn of<T: Level>(image: &Raster<T>, next: &Next, period: usize) -> Option<Lit> {
        let Next { place, outwards, along } = *next;
        let half = WITHIN * outwards.norm().min(along.norm());
        let (u, v) = (0.5 * outwards, 0.5 * along);
        let diagonals = if period == 1 { &[u + v, u - v, -u + v, -u - v][..] } else { &[] };
        let about = [u, -u, v, -v];
        let ground: Vec<f64> =
            (about.iter().chain(diagonals)).filter_map(|offset| level(image, place + offset, half)).collect();
        if ground.len() < LEAST_ABOUT {
            return None;
        }
        let fold = |pick: fn(f64, f64) -> f64| ground.iter().copied().reduce(pick);
        Some(Lit {
            disc: level(image, place, half)?,
            mean: ground.iter().sum::<f64>() / ground.len() as f64,
            least: fold(f64::min)?,
            most: fold(f64::max)?,
        })
    }

    /// How much darker the disc is than all of the ground, over the light of both; with `sign` -1 how much brighter.
    fn contrast(&self, sign: f64) -> f64 {
        let ground = if sign > 0.0 { self.least } else { self.most };
        sign * (ground - self.disc) / (ground + self.disc).abs().max(f64::MIN_POSITIVE)
    }
}

/// Mean level of a square about a place; `None` where it is not wholly in the image.
fn level<T: Level>(image: &Raster<T>, place: Vec2, half: f64) -> Option<f64> {
    let range = |at: f64, size: usize| {
        let (low, high) = ((at - half).round(), (at + half).round());
        (low >= 0.0 && high <= (size - 1) as f64).then(|| low as usize..=high as usize)
    };
    let (across, down) = (range(place.x, image.width())?, range(place.y, image.height())?);
    let count = (across.clone().count() * down.clone().count()) as f64;
    let sum: f64 = down.map(|y| across.clone().map(|x| image.get(x, y).to_f64()).sum::<f64>()).sum();
    Some(sum / count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::Orientation;

    /// A sheet with discs of diameter 12 px, 24 px apart, of which the first is at (40, 40); light beyond `shadow_x` is 0.4.
    fn photo(columns: usize, rows: usize, shadow_x: f64, frame_x: f64) -> Raster<f32> {
        Raster::from_fn(340, 260, |x, y| {
            let (x, y) = (x as f64, y as f64);
            let (i, j) = (((x - 40.0) / 24.0).round(), ((y - 40.0) / 24.0).round());
            let is_board = (0.0..columns as f64).contains(&i) && (0.0..rows as f64).contains(&j);
            let distance = libm::hypot(x - 40.0 - 24.0 * i, y - 40.0 - 24.0 * j);
            let is_dark = is_board && distance < 6.0 || (x - frame_x).abs() < 4.0;
            let light = if x > shadow_x { 0.4 } else { 1.0 };
            (light * if is_dark { 0.1 } else { 0.8 }) as f32
        })
    }

    /// The first `columns x rows` discs.
    fn board(columns: usize, rows: usize) -> SeenBoard {
        let place =
            |k: usize| Vec2::new(40.0 + 24.0 * (k % columns) as f64, 40.0 + 24.0 * (k / columns) as f64);
        let places = (0..columns * rows).map(|k| Some(place(k))).collect();
        SeenBoard::new(columns, rows, places, Orientation::of_discs(columns, rows))
    }

    #[test]
    fn a_column_in_a_shadow_is_seen() {
        for shadow_x in [1e9, 40.0 + 24.0 * 8.5, 40.0 + 24.0 * 8.3] {
            let larger = photo(10, 7, shadow_x, 1e9);
            let refused = refuse_larger(&larger, board(9, 7), 1);
            assert_eq!(refused, Err(GridError::Larger { columns: 9, rows: 7 }), "{shadow_x}");
            assert!(refuse_larger(&larger, board(10, 7), 1).is_ok());
            assert!(refuse_larger(&photo(9, 8, shadow_x, 1e9), board(9, 7), 1).is_err());
        }
    }

    #[test]
    fn the_edge_of_a_shadow_and_a_frame_about_the_board_are_no_discs() {
        for shadow_x in [40.0 + 24.0 * 8.5, 40.0 + 24.0 * 8.3, 40.0 + 24.0 * 7.5] {
            assert!(refuse_larger(&photo(9, 7, shadow_x, 1e9), board(9, 7), 1).is_ok(), "{shadow_x}");
        }
        assert!(refuse_larger(&photo(9, 7, 1e9, 40.0 + 24.0 * 9.0), board(9, 7), 1).is_ok());
    }

    #[test]
    fn a_column_that_the_image_cuts_is_seen() {
        let whole = photo(10, 7, 1e9, 1e9);
        // The last column's centres at 256 px, 3 px from the end.
        let cut = Raster::from_fn(260, 260, |x, y| whole.get(x, y));
        assert!(refuse_larger(&cut, board(9, 7), 1).is_err());
    }

    #[test]
    fn bright_discs_are_discs() {
        let negative = |photo: Raster<f32>| photo.map(|level| 0.9 - level);
        assert!(refuse_larger(&negative(photo(10, 7, 1e9, 1e9)), board(9, 7), 1).is_err());
        assert!(refuse_larger(&negative(photo(9, 7, 1e9, 1e9)), board(9, 7), 1).is_ok());
    }
}
