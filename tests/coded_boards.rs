//! Boards with markers, from files to a camera: photographs that OpenCV drew (`tests/coded_boards/draw.py`),
//! Kalibr's targets, and the command that a user types.

use crate::program::{calibench, folder};
use calibench::detect::Orientation;
use calibench::geometry::Vec2;
use calibench::io::{read_image, write_png};
use calibench::photos::BoardSpec;
use calibench::synth::Truth;
use calibench::synth::render::{Imaging, photograph_dark};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// Where OpenCV's `projectPoints` has the corners of a photograph, px.
fn truth(photo: &str) -> Vec<[f64; 2]> {
    let table = include_str!("coded_boards/marks.csv");
    let rows = table.lines().filter_map(|line| line.strip_prefix(photo)?.strip_prefix(','));
    let numbers = |row: &str| row.split(',').map(|n| n.parse().expect("a number")).collect::<Vec<f64>>();
    rows.map(numbers).map(|row| [row[1], row[2]]).collect()
}

#[test]
fn boards_that_opencv_drew_have_their_corners_where_opencv_projects_them() {
    for (photo, board, seen_at_least) in [
        ("whole", "charuco:7x5:30mm:22mm:DICT_4X4_50", 24),
        ("part", "charuco:7x5:30mm:22mm:DICT_4X4_50", 15),
        ("legacy", "charuco:5x6:20mm:15mm:DICT_6X6_250:legacy", 20),
    ] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/coded_boards/{photo}.png"));
        let spec: BoardSpec = board.parse().expect("a board");
        let seen = spec.see(&read_image(&path).expect("an image")).unwrap_or_else(|e| panic!("{photo}: {e}"));
        assert_eq!(seen.orientation(), Orientation::Fixed);
        let truth = truth(photo);
        assert_eq!(truth.len(), spec.points().len());
        for (mark, place) in seen.seen() {
            let off = (place - Vec2::from(truth[mark])).norm();
            // Eight samples along a pixel leave an edge some hundredths of a pixel uncertain.
            assert!(off < 0.05, "{photo}: corner {mark} is off by {off} px");
        }
        assert!(seen.seen().count() >= seen_at_least, "{photo}: {}", seen.seen().count());
    }
}

#[test]
fn a_board_without_its_markers_place_is_refused_with_what_was_seen() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/coded_boards/whole.png");
    let photo = read_image(&path).expect("an image");
    let refused =
        |board: &str| board.parse::<BoardSpec>().expect("a board").see(&photo).unwrap_err().to_string();
    assert!(refused("charuco:7x5:30mm:22mm:DICT_5X5_100").contains("DICT_4X4_50"));
    let width = refused("charuco:9x5:30mm:22mm:DICT_4X4_50");
    assert!(width.contains("7 wide"), "{width}");
    assert!(refused("aprilgrid:6x6:88mm:0.3").contains("DICT_APRILTAG_36h11"));
}

/// Photographs of a board, moved so that a part of it lies outside of some.
fn photographs(folder: &Path, spec: &BoardSpec) -> Vec<String> {
    let dark = spec.dark().expect("a board with markers");
    let poses = Truth::example_poses();
    let photo = |k: usize| {
        let mut pose = poses[k % poses.len()];
        pose.translation.x += [0.0, 25.0, -25.0][k % 3];
        let imaging = Imaging { blur_px: 0.6, ..Imaging::default() };
        let photo = photograph_dark(
            &Truth::example_camera(),
            Truth::EXAMPLE_IMAGE,
            &dark,
            &spec.points(),
            &pose,
            &imaging,
        );
        let name = format!("photo{k}.png");
        let image = photo.expect("a board before the camera").image.to_u8();
        write_png(&folder.join(&name), &image).expect("written");
        name
    };
    (0..6).map(photo).collect()
}

#[test]
fn photographs_of_parts_of_a_board_make_a_camera() {
    for (kind, board) in
        [("charuco", "charuco:10x7:10mm:7.4mm:DICT_4X4_50"), ("april", "aprilgrid:6x4:13mm:0.3")]
    {
        let folder = folder(&format!("coded-{kind}"));
        let spec: BoardSpec = board.parse().expect("a board");
        let photos = photographs(&folder, &spec);
        let mut arguments = vec!["calibrate", "--board", board, "--format", "json"];
        arguments.extend(photos.iter().map(String::as_str));
        let run = calibench(&folder, &arguments);
        let result: Value = serde_json::from_slice(&run.stdout).unwrap_or_else(|_| panic!("{run:?}"));
        let fx = result["camera"]["fx"].as_f64().expect("a focal length");
        assert!((fx - 600.0).abs() < 0.5, "{kind}: fx = {fx}");
        let rmse = result["rmse_px"].as_f64().expect("an RMSE");
        assert!(rmse < 0.03, "{kind}: {rmse}");
    }
}

#[test]
fn a_page_of_a_board_with_markers_is_drawn_and_read() {
    let folder = folder("coded-page");
    for (board, rectangles) in [("charuco:7x5:35mm:26mm:DICT_4X4_50", 18), ("aprilgrid:5x3:35mm:0.3", 24)] {
        let run = calibench(&folder, &["board", board, "--svg", "A4", "--pdf", "A4"]);
        assert_eq!(run.status.code(), Some(0), "{run:?}");
        let page = fs::read_to_string(folder.join("board.svg")).expect("a page");
        // One path has all squares and cells.
        assert!(page.matches('Z').count() > rectangles && page.matches("<path").count() == 1);
        let named = fs::read_to_string(folder.join("board.toml")).expect("a file");
        assert!(named.contains(board), "{named}");
    }
}

#[test]
fn kalibrs_aprilgrid_becomes_a_board_and_back() {
    let folder = folder("coded-kalibr");
    let target =
        "target_type: 'aprilgrid' #gridtype\ntagCols: 6\ntagRows: 7\ntagSize: 0.088\ntagSpacing: 0.3\n";
    fs::write(folder.join("april.yaml"), target).expect("written");
    let board = calibench(&folder, &["convert", "april.yaml", "board.txt"]);
    let said = String::from_utf8_lossy(&board.stdout).into_owned();
    assert!(said.contains("--board aprilgrid:6x7:0.088m:0.3"), "{said} {board:?}");
    let back = calibench(&folder, &["convert", "aprilgrid:6x7:88mm:0.3", "target.yaml"]);
    assert_eq!(back.status.code(), Some(0), "{back:?}");
    let text = fs::read_to_string(folder.join("target.yaml")).expect("read");
    assert_eq!(text, target.replace(" #gridtype", ""));
}
