//! Boards with markers in rendered photographs, of which every mark's place is known.

use calibench::board::Board;
use calibench::camera::{BrownConrady, Camera};
use calibench::detect::{
    AprilGrid, Charuco, CodedError, Orientation, SeenBoard, seen_april_grid, seen_charuco,
};
use calibench::geometry::{Pose, Vec2, Vec3};
use calibench::raster::Raster;
use calibench::synth::render::{Appearance, Imaging, Photograph, SensorNoise, Surround, photograph_dark};
use calibench::synth::{Stream, StreamKey};

const SIZE: (usize, usize) = (640, 480);

/// Squares, or sides of a tag, per width of the image.
fn photo_of(dark: &[[Vec2; 2]], marks: &[Vec2], across: f64, pose: &Pose, blur_px: f64) -> Photograph {
    let camera =
        Camera::pinhole(600.0, 600.0, 320.0, 240.0).with_distortion(BrownConrady::radial(-0.12, 0.03));
    let surround = Some(Surround { level: 0.4, margin: 0.4 });
    let imaging = Imaging {
        blur_px,
        appearance: Appearance { surround, ..Appearance::default() },
        ..Imaging::default()
    };
    // As far away as the width asks.
    let away = Vec3::new(0.0, 0.0, across * 600.0 / 640.0);
    let pose = Pose { translation: pose.translation + away, ..*pose };
    photograph_dark(&camera, SIZE, dark, marks, &pose, &imaging).expect("a board before the camera")
}

/// Turned about the line of sight by `roll`, tilted about an axis in the image, moved in it.
fn pose(roll: f64, tilt: [f64; 2], moved: [f64; 2]) -> Pose {
    let turned = Pose::identity().perturbed(&[0.0, 0.0, roll, 0.0, 0.0, 0.0].into());
    turned.perturbed(&[tilt[0], tilt[1], 0.0, moved[0], moved[1], 0.0].into())
}

/// The poses of the tests: two whole boards in any turn, one with a third outside.
fn poses(third: f64) -> [Pose; 4] {
    [
        pose(0.1, [0.3, -0.2], [0.1, 0.0]),
        pose(1.9, [-0.5, 0.4], [0.0, 0.1]),
        pose(3.3, [0.2, 0.6], [-0.1, 0.1]),
        pose(-0.2, [0.2, 0.1], [third, 0.2]),
    ]
}

fn noisy(photo: Photograph, sigma: f64, trial: u64) -> Photograph {
    let mut stream =
        Stream::open(StreamKey { seed: 5, scenario: "coded", trial: trial as _, purpose: "noise" });
    photo.with_noise(&SensorNoise::constant(sigma), &mut stream)
}

/// Marks that are seen, and the largest error, px; none may be another.
fn judged(seen: &SeenBoard, truth: &[Vec2]) -> (usize, f64) {
    assert_eq!((seen.orientation(), seen.places_px().len()), (Orientation::Fixed, truth.len()));
    let errors = seen.seen().map(|(mark, place)| (place - truth[mark]).norm());
    (seen.seen().count(), errors.fold(0.0, f64::max))
}

/// Marks inside of the image.
fn visible(truth: &[Vec2]) -> usize {
    inside_by(truth, 6.0)
}

/// Marks that are so many pixels inside of the image.
fn inside_by(truth: &[Vec2], px: f64) -> usize {
    let inside = |p: &&Vec2| p.x > px && p.y > px && p.x < 640.0 - px && p.y < 480.0 - px;
    truth.iter().filter(inside).count()
}

fn charuco_scene(board: &Charuco) -> (Vec<[Vec2; 2]>, Vec<Vec2>) {
    let middle = 0.5 * Vec2::new(board.columns() as f64, board.rows() as f64);
    let dark = board.dark().into_iter().map(|square| square.map(|p| p - middle)).collect();
    (dark, Board::chessboard(board.columns() - 1, board.rows() - 1, 1.0).unwrap().points())
}

fn april_scene(grid: &AprilGrid) -> (Vec<[Vec2; 2]>, Vec<Vec2>) {
    let points = grid.points();
    let middle = 0.5 * points[points.len() - 1];
    let down = |p: Vec2| Vec2::new(p.x - middle.x, middle.y - p.y);
    let turned = |[low, high]: [Vec2; 2]| {
        let (a, b) = (down(low), down(high));
        [Vec2::new(a.x, b.y), Vec2::new(b.x, a.y)]
    };
    (grid.dark().into_iter().map(turned).collect(), points.into_iter().map(down).collect())
}

#[test]
fn corners_of_charuco_boards_are_found_in_any_turn_and_in_part() {
    for (board, legacy) in [("DICT_4X4_50", false), ("DICT_5X5_100", true), ("DICT_APRILTAG_36h11", false)] {
        let board = Charuco::new(8, 6, 0.74, board.parse().unwrap(), legacy).unwrap();
        let (dark, marks) = charuco_scene(&board);
        for (pose, trial) in poses(3.6).iter().zip(0..) {
            for (blur_px, sigma, most_px) in [(0.6, 0.0, 0.02), (0.7, 0.02, 0.1), (1.2, 0.01, 0.1)] {
                let photo = noisy(photo_of(&dark, &marks, 10.0, pose, blur_px), sigma, trial);
                let seen = seen_charuco(&photo.image, &board).unwrap();
                let (found, worst_px) = judged(&seen, &photo.centres_true);
                let visible = visible(&photo.centres_true);
                assert!(worst_px < most_px, "{trial}: {worst_px} px with noise of {sigma}");
                assert!(found + 2 >= visible, "{trial}: {found} of {visible} with a blur of {blur_px}");
            }
        }
    }
}

#[test]
fn what_is_covered_costs_only_itself() {
    let board = Charuco::new(8, 6, 0.74, "DICT_4X4_50".parse().unwrap(), false).unwrap();
    let (dark, marks) = charuco_scene(&board);
    let photo = noisy(photo_of(&dark, &marks, 10.0, &poses(0.0)[0], 0.6), 0.01, 9);
    let is_covered = |x: f64, y: f64| (250.0..430.0).contains(&x) && (150.0..330.0).contains(&y);
    let covered = Raster::from_fn(SIZE.0, SIZE.1, |x, y| {
        if is_covered(x as f64, y as f64) { 0.5 } else { photo.image.get(x, y) }
    });
    let seen = seen_charuco(&covered, &board).unwrap();
    let (found, worst_px) = judged(&seen, &photo.centres_true);
    let open = photo.centres_true.iter().filter(|p| !is_covered(p.x, p.y)).count();
    // A corner beside the cover has squares that the cover cuts.
    assert!(worst_px < 0.1 && 3 * found >= 2 * open, "{found} of {open} corners, {worst_px} px");
    assert!(seen.seen().all(|(_, place)| !is_covered(place.x, place.y)));
}

#[test]
fn another_board_is_named_and_one_marker_is_not_enough() {
    let board = Charuco::new(8, 6, 0.74, "DICT_5X5_50".parse().unwrap(), false).unwrap();
    let (dark, marks) = charuco_scene(&board);
    let photo = photo_of(&dark, &marks, 10.0, &poses(0.0)[0], 0.6);
    let error = |columns, rows, name: &str| {
        let asked = Charuco::new(columns, rows, 0.74, name.parse().unwrap(), false).unwrap();
        seen_charuco(&photo.image, &asked).unwrap_err()
    };
    let dictionary = error(8, 6, "DICT_4X4_50");
    assert!(dictionary.to_string().contains("DICT_5X5_50"), "{dictionary}");
    let size = error(7, 6, "DICT_5X5_50");
    assert!(matches!(size, CodedError::Disagree { other: Some((8, false)), .. }), "{size}");
    // As wide, but OpenCV's other pattern: one marker of nine stands elsewhere, the others one square beside.
    let legacy = Charuco::new(9, 6, 0.74, "DICT_5X5_50".parse().unwrap(), true).unwrap();
    let (dark, marks) = charuco_scene(&legacy);
    let of_legacy = photo_of(&dark, &marks, 11.0, &poses(0.0)[0], 0.6);
    let present = Charuco::new(9, 6, 0.74, "DICT_5X5_50".parse().unwrap(), false).unwrap();
    let refused = seen_charuco(&of_legacy.image, &present).unwrap_err();
    assert!(matches!(refused, CodedError::Disagree { .. } | CodedError::GoesOn { .. }), "{refused}");
    // As wide, but fewer rows.
    assert!(matches!(error(8, 4, "DICT_5X5_50"), CodedError::GoesOn { .. } | CodedError::Disagree { .. }));
    // All but the first marker out of sight.
    let around = photo.centres_true[0];
    let one = Raster::from_fn(SIZE.0, SIZE.1, |x, y| {
        let off = Vec2::new(x as f64, y as f64) - around;
        if off.amax() < 75.0 { photo.image.get(x, y) } else { 0.5 }
    });
    assert!(seen_charuco(&one, &board).is_err());
    let empty = Raster::from_fn(SIZE.0, SIZE.1, |_, _| 0.5f32);
    assert_eq!(seen_charuco(&empty, &board), Err(CodedError::NoCorners { seen: 0 }));
}

#[test]
fn corners_of_tags_are_found_in_kalibrs_order() {
    let grid = AprilGrid::new(5, 4, 0.3).unwrap();
    let (dark, marks) = april_scene(&grid);
    for (pose, trial) in poses(2.4).iter().zip(0..) {
        for (blur_px, sigma, most_px) in [(0.6, 0.0, 0.02), (0.7, 0.02, 0.15)] {
            let photo = noisy(photo_of(&dark, &marks, 8.2, pose, blur_px), sigma, trial);
            let seen = seen_april_grid(&photo.image, &grid).unwrap();
            let (found, worst_px) = judged(&seen, &photo.centres_true);
            assert!(worst_px < most_px, "{trial}: {worst_px} px with noise of {sigma}");
            // A window of the fit beside a corner reaches 14 px.
            let visible = inside_by(&photo.centres_true, 14.0);
            assert!(found + 1 >= visible, "{trial}: {found} of {visible}");
        }
    }
}

/// The image with a square of grey about a place.
fn covered(photo: &Photograph, at: Vec2, half_px: f64) -> Raster<f32> {
    Raster::from_fn(SIZE.0, SIZE.1, |x, y| {
        let off = Vec2::new(x as f64, y as f64) - at;
        if off.amax() < half_px { 0.5 } else { photo.image.get(x, y) }
    })
}

#[test]
fn a_covered_corner_of_a_tag_costs_only_itself() {
    let grid = AprilGrid::new(5, 4, 0.3).unwrap();
    let (dark, marks) = april_scene(&grid);
    let photo = noisy(photo_of(&dark, &marks, 8.2, &poses(0.0)[0], 0.6), 0.01, 3);
    let truth = &photo.centres_true;
    for corner in [0, 33, 47, 79] {
        let seen = seen_april_grid(&covered(&photo, truth[corner], 9.0), &grid).unwrap();
        let (found, worst_px) = judged(&seen, truth);
        assert!(seen.places_px()[corner].is_none() && worst_px < 0.15, "{corner}: {worst_px} px");
        // One more lies beside the image's edge.
        assert_eq!((inside_by(truth, 14.0), found), (79, 78), "{corner}");
    }
}

#[test]
fn tags_of_twenty_pixels_are_read() {
    let grid = AprilGrid::new(5, 4, 0.3).unwrap();
    let (dark, marks) = april_scene(&grid);
    for (pose, trial) in poses(0.0)[..3].iter().zip(0..) {
        let photo = noisy(photo_of(&dark, &marks, 26.0, pose, 0.6), 0.005, trial);
        let seen = seen_april_grid(&photo.image, &grid).unwrap();
        let (found, worst_px) = judged(&seen, &photo.centres_true);
        assert!(found == 80 && worst_px < 0.1, "{trial}: {found} of 80, {worst_px} px");
    }
}

#[test]
fn one_row_of_tags_is_not_enough() {
    let grid = AprilGrid::new(5, 4, 0.3).unwrap();
    let (dark, marks) = april_scene(&grid);
    let photo = photo_of(&dark, &marks, 8.2, &pose(0.0, [0.1, 0.0], [0.0, 0.0]), 0.6);
    // Corners of a row of tags from the lower left one upwards.
    let row: Vec<Vec2> = photo.centres_true[..20].to_vec();
    let highest = row.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
    let below =
        Raster::from_fn(
            SIZE.0,
            SIZE.1,
            |x, y| {
                if (y as f64) < highest - 5.0 { 0.5 } else { photo.image.get(x, y) }
            },
        );
    for columns in [4, 5, 6] {
        let error = seen_april_grid(&below, &AprilGrid::new(columns, 4, 0.3).unwrap()).unwrap_err();
        assert!(
            matches!(error, CodedError::OneRow { .. } | CodedError::Disagree { .. }),
            "{columns}: {error}"
        );
    }
    let five = seen_april_grid(&below, &grid).unwrap_err();
    assert_eq!(five, CodedError::OneRow { tags: 5 });
    assert_eq!(seen_april_grid(&below, &AprilGrid::new(5, 1, 0.3).unwrap()).unwrap().missing(), 0);
}

#[test]
fn tags_too_blurred_to_be_read_by_themselves_are_told_together() {
    let grid = AprilGrid::new(5, 4, 0.3).unwrap();
    let (dark, marks) = april_scene(&grid);
    let photo = noisy(photo_of(&dark, &marks, 11.0, &poses(0.0)[0], 2.4), 0.005, 1);
    let seen = seen_april_grid(&photo.image, &grid).unwrap();
    let (found, worst_px) = judged(&seen, &photo.centres_true);
    assert!(found >= 60 && worst_px < 0.5, "{found} of 80, {worst_px} px");
}

#[test]
fn another_grid_of_tags_is_refused() {
    let grid = AprilGrid::new(5, 4, 0.3).unwrap();
    let (dark, marks) = april_scene(&grid);
    let photo = photo_of(&dark, &marks, 8.2, &poses(0.0)[0], 0.6);
    let error = |columns, rows| seen_april_grid(&photo.image, &AprilGrid::new(columns, rows, 0.3).unwrap());
    assert!(matches!(error(4, 5), Err(CodedError::Disagree { .. })), "{:?}", error(4, 5));
    assert!(matches!(error(3, 2), Err(CodedError::GoesOn { .. } | CodedError::Disagree { .. })));
}

/// Blurred and noisy, so that some levels of the image show two or three tags only: what the others show
/// counts too.
#[test]
fn another_grid_of_tags_is_refused_however_few_tags_a_level_of_the_image_shows() {
    let grid = AprilGrid::new(5, 4, 0.3).unwrap();
    let (dark, marks) = april_scene(&grid);
    for (pose, trial) in poses(2.4).iter().zip(0..) {
        for (blur_px, sigma) in [(0.6, 0.0), (1.2, 0.02), (1.5, 0.05)] {
            for away in [8.2, 14.0] {
                let photo = noisy(photo_of(&dark, &marks, away, pose, blur_px), sigma, trial);
                // Of the same width with fewer rows it is the same board, where those beyond cannot be read.
                for (columns, rows) in [(4, 4), (6, 4), (4, 5), (10, 2), (2, 10), (3, 7)] {
                    let other = AprilGrid::new(columns, rows, 0.3).unwrap();
                    let seen = seen_april_grid(&photo.image, &other);
                    let what =
                        format!("{columns} x {rows}, pose {trial}, {away}, blur {blur_px} px, noise {sigma}");
                    assert!(seen.is_err(), "{what}: {} marks", seen.map_or(0, |seen| seen.seen().count()));
                }
            }
        }
    }
}

#[test]
fn a_grid_of_tags_that_goes_on_or_has_another_spacing_is_named() {
    let grid = AprilGrid::new(5, 4, 0.3).unwrap();
    let (dark, marks) = april_scene(&grid);
    for pose in &poses(0.0)[..3] {
        let photo = photo_of(&dark, &marks, 8.2, pose, 0.6);
        let error = |rows, spacing| {
            seen_april_grid(&photo.image, &AprilGrid::new(5, rows, spacing).unwrap()).unwrap_err()
        };
        assert_eq!(error(3, 0.3), CodedError::GoesOn { columns: 5, rows: 3 });
        for asked in [0.2, 0.25, 0.28, 0.285, 0.32, 0.4] {
            let CodedError::Spacing { seen, .. } = error(4, asked) else { panic!("{}", error(4, asked)) };
            assert!(seen.abs_diff(300) <= 10, "{seen} thousandths");
        }
    }
}

#[test]
fn the_spacing_of_tags_is_not_taken_for_another_behind_a_strong_lens() {
    // Tags of a seventh of the image's width, and a barrel that draws its corners in by a fifth.
    let grid = AprilGrid::new(4, 3, 0.3).unwrap();
    let (dark, marks) = april_scene(&grid);
    let camera =
        Camera::pinhole(320.0, 320.0, 320.0, 240.0).with_distortion(BrownConrady::radial(-0.22, 0.04));
    for pose in &poses(0.0)[..3] {
        let pose = Pose { translation: pose.translation + Vec3::new(0.0, 0.0, 3.6), ..*pose };
        let photo = photograph_dark(
            &camera,
            SIZE,
            &dark,
            &marks,
            &pose,
            &Imaging { blur_px: 0.6, ..Imaging::default() },
        )
        .unwrap();
        let seen = seen_april_grid(&photo.image, &grid).unwrap();
        let (found, worst_px) = judged(&seen, &photo.centres_true);
        assert!(found + 2 >= visible(&photo.centres_true) && worst_px < 0.1, "{found} marks, {worst_px} px");
    }
}

#[test]
fn a_mirrored_photograph_is_named() {
    let mirrored = |image: &Raster<f32>| Raster::from_fn(SIZE.0, SIZE.1, |x, y| image.get(SIZE.0 - 1 - x, y));
    for name in ["DICT_4X4_50", "DICT_5X5_50", "DICT_6X6_250"] {
        let board = Charuco::new(8, 6, 0.74, name.parse().unwrap(), false).unwrap();
        let (dark, marks) = charuco_scene(&board);
        for pose in &poses(0.0)[..3] {
            let photo = photo_of(&dark, &marks, 10.0, pose, 0.6);
            let error = seen_charuco(&mirrored(&photo.image), &board).unwrap_err();
            assert!(matches!(error, CodedError::Mirrored { count: 12.. }), "{name}: {error}");
        }
    }
    let grid = AprilGrid::new(5, 4, 0.3).unwrap();
    let (dark, marks) = april_scene(&grid);
    let photo = photo_of(&dark, &marks, 8.2, &poses(0.0)[0], 0.6);
    let error = seen_april_grid(&mirrored(&photo.image), &grid).unwrap_err();
    assert_eq!(error, CodedError::Mirrored { count: 20 });
}
