//! Do discs stand where a board's next row would, in light in which none is found? In a hard shadow discs and
//! their ground may both be darker than the ground beside it, so that no threshold parts them; they still
//! look like the board's own, only darker.

use super::beyond::{Next, Side, sides};
use super::bilinear::bilinear;
use super::grid_error::GridError;
use super::seen::SeenBoard;
use crate::geometry::Vec2;
use crate::raster::{Level, Raster};

/// What is compared of a disc and the ground about it reaches so far, in steps of the board: not to the next
/// disc, also where rows are staggered.
const REACH: f64 = 0.35;
/// Samples along each axis.
const SAMPLES: usize = 11;
/// Samples of the own discs count as disc, or as ground, up to this part of the way to the other: at an edge
/// they are neither.
const CLEARLY: f64 = 0.25;
/// Part of the samples, of a disc and of its ground, that must lie in the image.
const LEAST_INSIDE: f64 = 0.5;
/// Part of the samples that may be on the wrong side: noise.
const ASTRAY: f64 = 0.1;
/// Contrast of a disc beyond, as part of the own discs': the edge of a shadow through it, where a fifth of
/// the light is left, leaves more.
const LEAST_CONTRAST: f64 = 0.25;

/// Refuses a board of discs that goes on beyond a side: it is a part of a larger one. `period` is 1 or, where
/// rows are staggered, 2.
///
/// # Errors
/// [`GridError::Larger`].
pub fn refuse_larger<T: Level>(
    image: &Raster<T>,
    board: SeenBoard,
    period: usize,
) -> Result<SeenBoard, GridError> {
    let (columns, rows) = (board.columns(), board.rows());
    let more = sides(board.places_px(), columns, period).find_map(|side| discs_beyond(image, &side));
    match more {
        Some((found, of)) => Err(GridError::Larger { columns, rows, found, of }),
        None => Ok(board),
    }
}

/// How many places beyond a side look like discs, of how many, where these are too many for chance.
fn discs_beyond<T: Level>(image: &Raster<T>, side: &Side) -> Option<(usize, usize)> {
    // Of the inner neighbours: beside the outer discs the board may end.
    let inner = |outer: &Next| levels(image, &Next { place: outer.place - outer.outwards, ..*outer });
    let own: Vec<Vec<Option<f64>>> = side.outer.iter().map(inner).collect();
    let shape = Shape::of(&own)?;
    let mut contrasts: Vec<f64> = own.iter().filter_map(|disc| shape.contrast(disc)).collect();
    contrasts.sort_by(f64::total_cmp);
    let usual = *contrasts.get(contrasts.len() / 2).filter(|usual| **usual > 0.0)?;
    let is_disc = |levels: &[Option<f64>]| {
        shape.contrast(levels).is_some_and(|contrast| contrast >= LEAST_CONTRAST * usual)
    };
    side.more_than_chance(|next| is_disc(&levels(image, next)))
}

/// Levels about a place, row by row along the board; `None` outside of the image.
fn levels<T: Level>(image: &Raster<T>, about: &Next) -> Vec<Option<f64>> {
    let offset = |k: usize| REACH * (2.0 * k as f64 / (SAMPLES - 1) as f64 - 1.0);
    let place = |k: usize| -> Vec2 {
        about.place + offset(k / SAMPLES) * about.outwards + offset(k % SAMPLES) * about.along
    };
    (0..SAMPLES * SAMPLES).map(|k| bilinear(image, &place(k))).collect()
}

/// Which samples are of a disc, and which of its ground.
struct Shape {
    disc: Vec<usize>,
    ground: Vec<usize>,
    /// 1 where discs are darker than the ground, else -1.
    sign: f64,
}

impl Shape {
    /// By the mean of discs that are wholly in the image; `None` where none is.
    fn of(discs: &[Vec<Option<f64>>]) -> Option<Shape> {
        let whole: Vec<Vec<f64>> = discs.iter().filter_map(|disc| disc.iter().copied().collect()).collect();
        let sum = |k: usize| whole.iter().map(|disc| disc[k]).sum::<f64>();
        let mean: Vec<f64> = (0..SAMPLES * SAMPLES).map(sum).collect();
        let centre = mean[mean.len() / 2];
        let farthest =
            |far: f64, level: &f64| if (level - centre).abs() > (far - centre).abs() { *level } else { far };
        let far = mean.iter().fold(centre, farthest);
        let towards = |level: &f64| (level - centre) / (far - centre);
        let those = |is_one: &dyn Fn(f64) -> bool| {
            (0..mean.len()).filter(|&k| is_one(towards(&mean[k]))).collect::<Vec<usize>>()
        };
        let (disc, ground) = (those(&|t| t < CLEARLY), those(&|t| t > 1.0 - CLEARLY));
        (!whole.is_empty()).then(|| Shape { disc, ground, sign: (far - centre).signum() })
    }

    /// How much darker the disc is than the ground, over both; of each the sample that nearly all others are
    /// farther from the other than. `None` where too little is in the image.
    fn contrast(&self, levels: &[Option<f64>]) -> Option<f64> {
        let nearest = |of: &[usize], sign: f64| {
            let mut seen: Vec<f64> = of.iter().filter_map(|&k| Some(sign * levels[k]?)).collect();
            seen.sort_by(f64::total_cmp);
            let is_enough = !seen.is_empty() && seen.len() as f64 >= LEAST_INSIDE * of.len() as f64;
            is_enough.then(|| sign * seen[(ASTRAY * seen.len() as f64) as usize])
        };
        let (disc, ground) = (nearest(&self.disc, -self.sign)?, nearest(&self.ground, self.sign)?);
        Some(self.sign * (ground - disc) / (ground + disc).abs().max(f64::MIN_POSITIVE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::Orientation;

    /// A sheet with discs of diameter 12 px, 24 px apart, of which the first is at (40, 40); light beyond
    /// `shadow_x` is 0.4.
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
        // None, between the columns, and through the last one.
        for shadow_x in [1e9, 40.0 + 24.0 * 8.5, 40.0 + 24.0 * 8.3, 40.0 + 24.0 * 9.0] {
            let larger = photo(10, 7, shadow_x, 1e9);
            let refused = refuse_larger(&larger, board(9, 7), 1);
            assert_eq!(
                refused,
                Err(GridError::Larger { columns: 9, rows: 7, found: 7, of: 7 }),
                "{shadow_x}"
            );
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
    fn a_dark_surround_is_no_row_of_discs() {
        let sheet = photo(9, 7, 1e9, 1e9);
        for margin in [0.4, 0.5, 0.6, 0.9] {
            let reach = |place: usize, marks: usize| {
                let beyond = (place as f64 - 40.0) / 24.0;
                (-margin..=(marks - 1) as f64 + margin).contains(&beyond)
            };
            // Levels as dark as the discs, uneven by a few per cent of that.
            let dark = |x: usize, y: usize| (0.1 + 0.005 * libm::sin((7 * x + 13 * y) as f64)) as f32;
            let shown = |x, y| if reach(x, 9) && reach(y, 7) { sheet.get(x, y) } else { dark(x, y) };
            let image = Raster::from_fn(340, 260, shown);
            assert!(refuse_larger(&image, board(9, 7), 1).is_ok(), "{margin}");
        }
    }

    /// A whole board, and beyond its last row, a step away, spots of a half-size that are dark where
    /// `is_dark`, at offsets in px.
    fn with_print(columns: &[usize], is_dark: impl Fn(f64, f64) -> bool) -> Raster<f32> {
        let sheet = photo(9, 7, 1e9, 1e9);
        Raster::from_fn(340, 260, |x, y| {
            let offset = |column: &usize| (x as f64 - 40.0 - 24.0 * *column as f64, y as f64 - 208.0);
            let is_print = columns.iter().map(offset).any(|(u, v)| u.abs() < 12.0 && is_dark(u, v));
            if is_print { 0.08 } else { sheet.get(x, y) }
        })
    }

    #[test]
    fn print_and_holes_beside_a_board_are_no_row_of_it() {
        let all: Vec<usize> = (0..9).collect();
        let is_whole = |image: &Raster<f32>| refuse_larger(image, board(9, 7), 1).is_ok();
        let within = |radius: f64| move |u: f64, v: f64| libm::hypot(u, v) < radius;
        assert!(!is_whole(&with_print(&all, within(6.0))));
        // Holes of the same size, but few, and smaller ones in each place.
        assert!(is_whole(&with_print(&[0, 4, 8], within(6.0))));
        assert!(is_whole(&with_print(&all, within(2.5))));
        // An H, an O and a tick of a ruler.
        let h =
            |u: f64, v: f64| v.abs() < 5.0 && ((u.abs() - 3.5).abs() < 1.0 || u.abs() < 4.5 && v.abs() < 1.0);
        let o = |u: f64, v: f64| (libm::hypot(u, v) - 4.5).abs() < 1.0;
        let tick = |u: f64, v: f64| u.abs() < 1.0 && v.abs() < 6.0;
        assert!(is_whole(&with_print(&all, h)) && is_whole(&with_print(&all, o)));
        assert!(is_whole(&with_print(&all, tick)));
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
