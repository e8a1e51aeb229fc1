//! Which readers meet untrusted bytes? Each as a function of bytes that must end, and must not panic, whatever they are.

use calibench::camera::FreeParameters;
use calibench::io::formats::{
    FORMATS, VnlBoard, Wishes, detect, parse_target, parse_vnl, read_camera_file, write_camera_file,
};
use calibench::io::image::{parse_extent, parse_image};
use calibench::io::measured::parse_target as parse_measured_target;
use calibench::io::result::parse_camera;
use calibench::io::robot::parse_robot;
use calibench::io::scene_tables::{parse_target_marks, parse_target_poses};
use calibench::io::{
    memory, parse_checks, parse_corners, parse_known, parse_marks, parse_pixel_ends, parse_point_pairs,
    parse_seen, parse_spatial, table,
};
use calibench::photos::{BoardSpec, parse_board_file};
use calibench_gate::accept::{accept, id_in, read_line};
use calibench_gate::greeting::Greeting;
use calibench_gate::protocol::{Problem, ProblemView};
use calibench_harness::golden;
use calibench_study::{Checkpoint, Manifest, Shard, Spec};

/// A reader under its name: it is given bytes, and must return.
pub type Reader = (&'static str, fn(&[u8]));

/// The readers by name; the seeds of each stand in `fuzz/seeds/<name>/`.
pub const READERS: [Reader; 12] = [
    ("corners", corners),
    ("pairs", pairs),
    ("camera", camera),
    ("formats", formats),
    ("study", study),
    ("manifest", manifest),
    ("checkpoint", checkpoint),
    ("answer", answer),
    ("image", image),
    ("words", words),
    ("snapshot", snapshot),
    ("page", page),
];

/// Corner files.
pub fn corners(bytes: &[u8]) {
    let _ = table::columns(bytes);
    let _ = parse_corners("corners", bytes);
    let _ = parse_spatial("spatial", bytes);
    let _ = parse_seen("seen", bytes);
    let _ = parse_measured_target("target", bytes);
}

/// Point pairs, marks of a part, pixels at both ends of lengths, poses of a robot, checks of a reference, and marks and poses of a scene.
pub fn pairs(bytes: &[u8]) {
    let _ = parse_point_pairs("pairs", bytes);
    let _ = parse_marks("marks", bytes);
    let _ = parse_pixel_ends("ends", bytes);
    let _ = parse_robot("robot", bytes);
    let _ = parse_checks("checks", bytes);
    for cell in [None, Some(0)] {
        let _ = parse_target_marks("marks", bytes, cell);
        let _ = parse_target_poses("poses", bytes, cell);
    }
}

/// Results and cameras.
pub fn camera(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let _ = parse_camera("camera", &text);
    let _ = parse_known("known", &text);
}

/// Cameras, corners and boards in the files of other programs: the same bytes as every format, and what is read written as every one.
pub fn formats(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let wishes = Wishes { fit: true, ..Wishes::default() };
    let _ = detect("formats", &text);
    for format in &FORMATS {
        let Ok(camera) = read_camera_file(format, "formats", &text, None, &wishes) else { continue };
        for format in &FORMATS {
            let _ = write_camera_file(format, &camera, &wishes);
        }
    }
    let _ = parse_target("formats", &text);
    let _ = parse_vnl("formats", &text, &VnlBoard { columns: 3, rows: 2, spacing: 1.0 });
}

/// Most points that a study of these tests places: above, it would take long, and be right to.
const FEW_POINTS: usize = 5000;
/// Scenes that are drawn for a cell whose trials draw poses of their own.
const DRAWS: usize = 200;

/// Studies, and the cells of those that are small.
pub fn study(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let Ok(spec) = Spec::parse(&text) else { return };
    let levels = spec.factor.iter().fold(1usize, |product, f| product.saturating_mul(f.count()));
    let target = &spec.scene.target;
    let marks = target.count();
    let draws = if spec.scene.poses.redraws() { DRAWS } else { 1 };
    let size = marks.saturating_mul(spec.scene.poses.views()).saturating_mul(levels).saturating_mul(draws);
    // Too large is refused before any work, as small is done at once; between them, poses that are drawn anew take long.
    if size <= FEW_POINTS || marks > calibench::board::Board::MOST_MARKS {
        let _ = spec.cells(&text);
    }
}

/// Manifests.
pub fn manifest(bytes: &[u8]) {
    let _ = serde_json::from_slice::<Manifest>(bytes);
}

/// Checkpoints.
pub fn checkpoint(bytes: &[u8]) {
    let _ = serde_json::from_slice::<Checkpoint>(bytes);
}

/// Answers of a solver, read and checked.
pub fn answer(bytes: &[u8]) {
    let line = String::from_utf8_lossy(bytes);
    let _ = id_in(&line);
    if let Ok(Some(greeting)) = Greeting::read(&line) {
        let _ = (greeting.models(), greeting.warm_up());
    }
    let problem = Problem {
        id: "a".into(),
        image_size: [640, 480],
        model: "brown-conrady".into(),
        views: vec![ProblemView { target: vec![[0.0, 0.0]], pixels: vec![[0.0, 0.0]] }],
        free: ["fx", "fy", "cx", "cy"].map(String::from).into(),
        held: [("k1".to_string(), 0.0)].into(),
    };
    if let Ok(answer) = read_line(&line) {
        let _ = accept(&problem, answer);
    }
}

/// Memory for an image in these tests.
const MEMORY: u64 = 64 << 20;

/// Images behind the limits of size and memory.
pub fn image(bytes: &[u8]) {
    if parse_extent(bytes, "image").is_ok_and(|extent| extent.memory_to_detect() <= MEMORY) {
        let _ = parse_image(bytes, "image");
    }
}

/// Boards, parameters, shards and sizes as they stand on the command line.
pub fn words(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    if let Ok(board) = text.parse::<BoardSpec>() {
        let _ = (board.to_string(), board.board().points());
    }
    let _ = parse_board_file("board", &text);
    let _ = text.parse::<FreeParameters>();
    let _ = text.parse::<Shard>();
    let _ = memory::parse_bytes(&text);
}

/// Golden snapshots: the first half of the bytes against the second, and against itself.
pub fn snapshot(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let contents = golden::contents(&text);
    let middle = (0..=contents.len() / 2).rev().find(|at| contents.is_char_boundary(*at)).unwrap_or(0);
    let _ = golden::compare(&contents[..middle], &contents[middle..]);
    let _ = golden::compare(contents, contents);
}

/// Pages of the book with their placeholders.
pub fn page(bytes: &[u8]) {
    let _ = calibench_book::pieces_of(&String::from_utf8_lossy(bytes));
}
