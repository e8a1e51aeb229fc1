//! Boards of which marks are hidden: each costs itself and not the photograph, where it is certain which it
//! is; and the first mark is the board's own wherever its pattern fixes it.

use calibench::board::Board;
use calibench::detect::{BlobOptions, Orientation, blobs, chessboard, seen_chessboard, seen_circle_grid_of};
use calibench::geometry::Vec2;
use calibench::io::Grey;
use calibench::photos::BoardSpec;
use calibench::raster::Raster;
use calibench::synth::Truth;
use calibench::synth::render::{Imaging, Photograph, photograph};
use calibench::synth::scene::looking_at_centre;

fn photo(board: &Board, degrees: [f64; 3]) -> Photograph {
    let imaging = Imaging { blur_px: 0.6, ..Imaging::default() };
    let pose = looking_at_centre(degrees, 165.0);
    photograph(&Truth::example_camera(), Truth::EXAMPLE_IMAGE, board, &pose, &imaging).expect("it is seen")
}

/// Paints over a square about a place.
fn cover(image: &mut Raster<f32>, at: Vec2, half_px: f64) {
    for y in 0..image.height() {
        for x in 0..image.width() {
            if (Vec2::new(x as f64, y as f64) - at).amax() < half_px {
                image.set(x, y, 0.5);
            }
        }
    }
}

#[test]
fn the_first_corner_is_the_physical_one_at_every_roll() {
    let board = Board::chessboard(9, 6, 10.0).expect("a board");
    for roll in (0..360).step_by(15) {
        let photo = photo(&board, [20.0, -10.0, f64::from(roll)]);
        let found = chessboard(&photo.image, 9, 6).expect("it is seen");
        assert_eq!(found.orientation(), Orientation::Fixed);
        let worst = found.corners_px().iter().zip(&photo.centres_true).map(|(a, b)| (a - b).norm());
        assert!(worst.fold(0.0, f64::max) < 0.2, "roll {roll}");
        // So it is where the first corner is covered.
        let mut image = photo.image.clone();
        cover(&mut image, photo.centres_true[0], 16.0);
        let seen = seen_chessboard(&image, 9, 6).expect("fifty-three are seen");
        assert_eq!((seen.orientation(), seen.places_px()[0]), (Orientation::Fixed, None));
        let far = seen.seen().map(|(mark, place)| (place - photo.centres_true[mark]).norm());
        assert!(far.fold(0.0, f64::max) < 0.2, "roll {roll}, first corner covered");
    }
}

#[test]
fn boards_that_look_alike_after_a_turn_say_so() {
    let of = |columns, rows| {
        let photo = photo(&Board::chessboard(columns, rows, 8.0).expect("a board"), [15.0, 5.0, 20.0]);
        chessboard(&photo.image, columns, rows).expect("it is seen").orientation()
    };
    assert_eq!(
        (of(8, 6), of(7, 7), of(6, 6)),
        (Orientation::HalfTurn, Orientation::HalfTurn, Orientation::QuarterTurn)
    );
    let discs = photo(&Truth::example_board(), [15.0, 5.0, 20.0]);
    let seen = seen_circle_grid_of(&blobs(&discs.image, &BlobOptions::default()), 9, 7).expect("it is seen");
    assert_eq!((seen.orientation(), seen.missing()), (Orientation::HalfTurn, 0));
}

#[test]
fn covered_corners_and_discs_cost_themselves() {
    // A corner of the board, one of its side, three inside.
    let chess = photo(&Board::chessboard(9, 6, 10.0).expect("a board"), [20.0, -10.0, 30.0]);
    let discs = photo(&Truth::example_board(), [20.0, -10.0, 30.0]);
    for (is_chess, photo, hidden) in [(true, &chess, [0, 4, 21, 31, 53]), (false, &discs, [0, 5, 21, 32, 62])]
    {
        let mut image = photo.image.clone();
        let half_px = if is_chess { 16.0 } else { 8.0 };
        hidden.iter().for_each(|&mark: &usize| cover(&mut image, photo.centres_true[mark], half_px));
        let seen = match is_chess {
            true => seen_chessboard(&image, 9, 6).expect("forty-nine are seen"),
            false => {
                seen_circle_grid_of(&blobs(&image, &BlobOptions::default()), 9, 7).expect("most are seen")
            }
        };
        let last = photo.centres_true.len() - 1;
        let first = seen.seen().next().expect("some are seen");
        let turned = (first.1 - photo.centres_true[first.0]).norm() > 5.0;
        assert!(!(is_chess && turned));
        let truth = |mark: usize| if turned { last - mark } else { mark };
        for (mark, place) in seen.seen() {
            assert!(!hidden.contains(&truth(mark)), "mark {mark} is covered");
            // The bias of discs is in it.
            assert!((place - photo.centres_true[truth(mark)]).norm() < 0.3, "mark {mark}");
        }
        // A corner that is seen, but whose window of 14 px a cover touches, may be lost too; a disc not.
        let reach_px = if is_chess { 16.0 * std::f64::consts::SQRT_2 + 14.0 } else { 1.0 };
        for mark in (0..=last).filter(|&mark| seen.places_px()[mark].is_none()) {
            let place = photo.centres_true[truth(mark)];
            assert!(
                hidden.iter().any(|&hidden| (photo.centres_true[hidden] - place).norm() < reach_px),
                "{mark}"
            );
        }
    }
}

#[test]
fn a_board_without_an_end_is_refused() {
    let photo = photo(&Board::chessboard(9, 6, 10.0).expect("a board"), [20.0, -10.0, 30.0]);
    let mut image = photo.image.clone();
    (0..6).for_each(|row| cover(&mut image, photo.centres_true[9 * row + 8], 16.0));
    assert!(seen_chessboard(&image, 9, 6).is_err());
}

/// The upper part of an image.
fn upper(image: &Raster<f32>, height: usize) -> Raster<f32> {
    let samples = (0..height).flat_map(|y| image.row(y).iter().copied()).collect();
    Raster::from_samples(image.width(), height, samples).expect("rows of one width")
}

#[test]
fn a_board_whose_last_row_is_near_the_images_end_is_not_taken_for_a_smaller_one() {
    // Squares of 35 px. At half the size the last row is too near the end to be searched.
    let photo = photo(&Board::chessboard(9, 7, 8.0).expect("a board"), [15.0, 5.0, 0.0]);
    let last_v = photo.centres_true[54..].iter().map(|place| place.y).fold(0.0, f64::max);
    for below_px in 6..24 {
        let image = upper(&photo.image, last_v as usize + below_px);
        let smaller = seen_chessboard(&image, 9, 6);
        assert!(smaller.is_err(), "{below_px} px: {smaller:?}");
    }
}

#[test]
fn discs_in_shadow_are_still_of_the_board() {
    let board = Board::circles(11, 7, 8.0, 5.0).expect("a board");
    let photo = photo(&board, [15.0, 5.0, 0.0]);
    let mut image = photo.image.clone();
    let from = photo.centres_true[9].x.min(photo.centres_true[75].x) - 8.0;
    for y in 0..image.height() {
        for x in from as usize..image.width() {
            image.set(x, y, 0.6 * image.row(y)[x]);
        }
    }
    // Nothing is a complete board of another size.
    cover(&mut image, photo.centres_true[10], 10.0);
    let smaller = seen_circle_grid_of(&blobs(&image, &BlobOptions::default()), 9, 7);
    assert!(smaller.is_err(), "{smaller:?}");
}

/// Discs in a hard shadow are found by no threshold of the whole, and are seen to stand where the next column
/// would.
#[test]
fn a_board_with_a_column_in_a_hard_shadow_is_not_taken_for_a_smaller_one() {
    let asked = |text: &str| text.parse::<BoardSpec>().expect("a board");
    let (smaller, whole) = (asked("circles:9x7:8mm:5mm"), asked("circles:10x7:8mm:5mm"));
    let photo = photo(whole.board(), [15.0, 5.0, 0.0]);
    let [inner, outer] = [8, 9].map(|column| photo.centres_true[column]);
    let mut found_whole = 0;
    for light in [0.35, 0.5, 0.7] {
        for between in [0.3, 0.5, 0.7] {
            let edge = (inner + between * (outer - inner)).x as usize;
            let mut image = photo.image.clone();
            for y in 0..image.height() {
                for x in edge..image.width() {
                    image.set(x, y, light * image.row(y)[x]);
                }
            }
            let grey = Grey::U8(image.to_u8());
            let taken = smaller.see(&grey);
            assert!(taken.is_err(), "{light} of the light from {between} on");
            found_whole += usize::from(whole.see(&grey).is_ok());
        }
    }
    assert!(found_whole > 0);
}
