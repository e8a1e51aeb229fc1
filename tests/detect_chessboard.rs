//! Chessboards on exact renders: found under every condition that a person sees them in, in their own order,
//! and no other board.

#[path = "../benches/chess/cases.rs"]
mod cases;
#[path = "../benches/chess/scene.rs"]
mod scene;

use calibench::detect::{ChessboardError, Orientation, chessboard, refine_corner};
use calibench::geometry::Vec2;
use calibench::raster::Raster;
use cases::{CASES, Case};

/// Corners along a row, rows.
pub const BOARD: (usize, usize) = (9, 6);

fn case(name: &str) -> &'static Case {
    CASES.iter().find(|case| case.name == name).unwrap_or_else(|| panic!("no case {name}"))
}

/// Root of the mean squared distance from the truth, in the board's own order.
fn rms_px(found: &[Vec2], truth: &[Vec2]) -> f64 {
    let square: f64 = found.iter().zip(truth).map(|(found, truth)| (found - truth).norm_squared()).sum();
    (square / truth.len() as f64).sqrt()
}

#[test]
fn corners_are_near_the_truth_and_the_first_is_the_boards_own() {
    // Twice what `cargo run --example chess -- --trials 25` measures over the case.
    for (name, limit_px) in [
        ("clean", 0.01),
        ("far", 0.01),
        ("noise 4 %", 0.06),
        ("blur 3 px", 0.03),
        ("tilt 65-70", 0.03),
        ("contrast .06 beside bright", 0.07),
        ("uneven light", 0.02),
        ("wide lens", 0.02),
    ] {
        for trial in 100..103 {
            let Some(photo) = scene::photo(case(name), trial) else { continue };
            let found = chessboard(&photo.image, 9, 6).unwrap_or_else(|e| panic!("{name} {trial}: {e}"));
            assert_eq!(found.orientation(), Orientation::Fixed);
            let rms = rms_px(found.corners_px(), &photo.truth_px);
            assert!(rms < limit_px, "{name} {trial}: {rms} px");
        }
    }
}

#[test]
fn a_board_of_another_size_is_named_and_none_is_made_of_it() {
    for trial in 100..103 {
        let photo = scene::photo(case("noise 2 %"), trial).expect("the pose fits");
        for (columns, rows) in [(8, 6), (9, 5), (10, 7), (7, 5), (8, 8)] {
            let named = ChessboardError::WrongSize { columns, rows, found_columns: 9, found_rows: 6 };
            assert_eq!(chessboard(&photo.image, columns, rows), Err(named));
        }
        let turned = chessboard(&photo.image, 6, 9).expect("rows and columns exchanged");
        assert_eq!(turned.orientation(), Orientation::Fixed);
    }
}

#[test]
fn images_without_a_board_have_none() {
    let flat = Raster::filled(320, 240, 90u8);
    let nothing = ChessboardError::Partial { columns: 9, rows: 6, found: 0, expected: 54, seen: 0 };
    assert_eq!(chessboard(&flat, 9, 6), Err(nothing));
    assert!(matches!(chessboard(&flat, 1, 6), Err(ChessboardError::TooSmall { .. })));
    for (width, height) in [(0, 0), (1, 1), (3, 200), (11, 11)] {
        assert!(chessboard(&Raster::filled(width, height, 5u8), 4, 4).is_err());
    }
    let not_numbers = Raster::filled(200, 200, f32::NAN);
    assert!(chessboard(&not_numbers, 4, 4).is_err());
    // A wall of tiles goes on beyond any board.
    let wall = Raster::from_fn(640, 480, |x, y| if (x / 25 + y / 25) % 2 == 0 { 20u8 } else { 220 });
    assert!(chessboard(&wall, 9, 6).is_err());
}

#[test]
fn samples_of_all_types_give_the_same_corners() {
    let photo = scene::photo(case("clean"), 100).expect("the pose fits");
    let of_bytes = chessboard(&photo.image, 9, 6).unwrap();
    let of_words = chessboard(&photo.image.map(|&x| u16::from(x) * 257), 9, 6).unwrap();
    let of_intensities = chessboard(&photo.image.to_f32(), 9, 6).unwrap();
    for other in [of_words, of_intensities] {
        // Rounding of intermediate sums, and the step at which the fit is at rest.
        assert!(rms_px(other.corners_px(), of_bytes.corners_px()) < 1e-3);
    }
}

#[test]
fn the_fit_agrees_with_the_refinement_of_single_corners() {
    let photo = scene::photo(case("clean"), 101).expect("the pose fits");
    for corner in chessboard(&photo.image, 9, 6).unwrap().corners_px() {
        let refined = refine_corner(&photo.image, corner + Vec2::new(0.4, -0.3), 5).unwrap();
        assert!((refined - corner).norm() < 0.05);
    }
}
