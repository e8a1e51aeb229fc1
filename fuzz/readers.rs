//! Which readers meet untrusted bytes? Each as a function of bytes that must end, and must not panic,
//! whatever they are.

use calibench::calibrate::{Loss, Settings, calibrate};
use calibench::camera::FreeParameters;
use calibench::downstream::{MapModel, register};
use calibench::geometry::Vec2;
use calibench::io::extent::parse_extent;
use calibench::io::formats::{
    FORMATS, VnlBoard, Wishes, detect, parse_target, parse_vnl, read_camera_file, write_camera_file,
};
use calibench::io::image::parse_image;
use calibench::io::measured::parse_target as parse_measured_target;
use calibench::io::result_camera::{parse_camera, parse_lens_camera};
use calibench::io::robot::parse_robot;
use calibench::io::scene_tables::{parse_target_marks, parse_target_poses};
use calibench::io::{
    Grey, memory, misplaced_marks, parse_checks, parse_corners, parse_known, parse_marks, parse_pixel_ends,
    parse_point_pairs, parse_seen, parse_spatial, table,
};
use calibench::photos::{BoardSpec, parse_board_file};
use calibench::planar::{PlaneModel, calibrate_plane};
use calibench::raster::Raster;
use calibench::rectify::{Projection, RectifyMap};
use calibench::tsai::{Assumed, two_stage};
use calibench_detector_gate::protocol as detector;
use calibench_gate::Allowance;
use calibench_gate::accept::{accept, id_in, read_line};
use calibench_gate::certified::{DigitsTable, read_with};
use calibench_gate::greeting::Greeting;
use calibench_gate::power::Measured;
use calibench_gate::protocol::{Problem, ProblemView};
use calibench_hand_eye_gate::protocol as hand_eye;
use calibench_harness::{golden, published};
use calibench_study::{Checkpoint, Inputs, Manifest, Shard, Spec, trial_of_line};

/// A reader under its name: it is given bytes, and must return.
pub type Reader = (&'static str, fn(&[u8]));

/// The readers by name; the seeds of each stand in `fuzz/seeds/<name>/`.
pub const READERS: [Reader; 16] = [
    ("corners", corners),
    ("pairs", pairs),
    ("solved", solved),
    ("camera", camera),
    ("formats", formats),
    ("study", study),
    ("manifest", manifest),
    ("checkpoint", checkpoint),
    ("trials", trials),
    ("answer", answer),
    ("tables", tables),
    ("image", image),
    ("photograph", photograph),
    ("words", words),
    ("snapshot", snapshot),
    ("page", page),
];

/// Corner files.
pub fn corners(bytes: &[u8]) {
    let _ = table::columns(bytes);
    let _ = parse_corners("corners", bytes);
    let _ = misplaced_marks("corners", bytes);
    let _ = parse_spatial("spatial", bytes);
    let _ = parse_seen("seen", bytes);
    let _ = parse_measured_target("target", bytes);
}

/// Point pairs, marks of a part, pixels at both ends of lengths, poses of a robot, checks of a reference, and
/// marks and poses of a scene.
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

/// Most points of a table that these tests calibrate from.
const FEW_MARKS: usize = 60;

/// What is computed from tables that can be read: a camera, Tsai's camera, the map of a plane, where a part
/// lies.
pub fn solved(bytes: &[u8]) {
    if let Ok(corners) = parse_corners("corners", bytes)
        && corners.views.iter().map(|view| view.len()).sum::<usize>() <= FEW_MARKS
    {
        let _ = calibrate(&corners.views, &Settings::standard());
    }
    if let Ok(spatial) = parse_spatial("spatial", bytes) {
        for view in spatial.views.iter().filter(|view| view.len() <= FEW_MARKS).take(2) {
            let _ = two_stage(view, &Assumed::centre_of((640, 480)));
            let _ = two_stage(view, &Assumed { principal_point_px: Vec2::zeros(), fy_per_fx: None });
        }
    }
    if let Ok(pairs) = parse_point_pairs("pairs", bytes)
        && pairs.pixels.len() <= FEW_MARKS
    {
        for model in [PlaneModel::Affine, PlaneModel::Projective, PlaneModel::Similarity] {
            let _ = calibrate_plane(model, &pairs.pixels, &pairs.world);
        }
    }
    if let Ok(marks) = parse_marks("marks", bytes)
        && marks.marks.len() <= FEW_MARKS
    {
        let turned: Vec<_> = marks.marks.iter().rev().copied().collect();
        for loss in [Loss::Squares, Loss::Huber { delta_px: 1.0 }] {
            let _ = register(MapModel::Rigid, &marks.marks, &turned, loss);
            let _ = register(MapModel::Affine, &marks.marks, &turned, loss);
        }
    }
}

/// Results and cameras, and where the pixels of a small image lie through those.
pub fn camera(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let _ = parse_camera("camera", &text);
    let _ = parse_known("known", &text);
    let Ok((camera, _)) = parse_lens_camera("camera", &text) else { return };
    for projection in [Projection::Pinhole, Projection::Equidistant, Projection::Equirectangular] {
        let _ = RectifyMap::through_lens(&camera, (16, 12), projection);
    }
}

/// Cameras, corners and boards in the files of other programs: the same bytes as every format, and what is
/// read written as every one.
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
    // Too large is refused before any work, as small is done at once; between them, poses that are drawn anew
    // take long.
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

/// Lines of trials, and the files that a study named, as they stand in a run's folder.
pub fn trials(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    for quantities in [0, 3] {
        text.lines().for_each(|line| _ = trial_of_line(line, quantities));
    }
    let _ = Inputs::parse(&text);
}

/// Answers of a solver, a detector or a hand-eye solver, read and checked.
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
    if let Ok(answer) = serde_json::from_str::<detector::Answer>(&line) {
        let (kind, markers) = (detector::Kind::Circles, None);
        let _ = answer.places(&detector::Wanted { kind, columns: 2, rows: 2, markers });
    }
    if let Ok(answer) = serde_json::from_str::<hand_eye::Answer>(&line) {
        let _ = (answer.pose(), answer.covariance());
    }
}

/// What the gate reads beside answers: failures that are known, measurements of itself, digits, certified
/// problems, and the numbers of the chapter.
pub fn tables(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let _ = Allowance::of_toml(&text);
    // Three tables in one seed.
    let mut parts = text.splitn(3, "---\n");
    let mut part = || parts.next().unwrap_or_default();
    if let Ok(measured) = Measured::of_csv([part(), part(), part()]) {
        let _ = (measured.wrong(), measured.to_markdown());
    }
    if let Ok(table) = DigitsTable::of_csv(&text) {
        let _ = (table.to_markdown(), table.to_text());
    }
    let sums = format!("{}  a.json\n", calibench::io::sha256_hex(text.as_bytes()));
    let _ = read_with(|name| Ok(if name == "SHA256SUMS" { sums.clone() } else { text.to_string() }));
    for value in published::parse(&text).unwrap_or_default() {
        let _ = (value.rounding(), value.rounds_from(0.5));
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

/// A board of every kind.
const BOARDS: [&str; 7] = [
    "chess:4x3:1",
    "circles:4x3:1",
    "asymmetric:3x4:1",
    "hexagonal:4x4:1",
    "dots:2x2:1",
    "charuco:5x4:30mm:22mm:DICT_4X4_50",
    "aprilgrid:2x2:30mm:0.3",
];
/// Most rows of a photograph of these tests.
const FEW_ROWS: usize = 128;

/// A photograph in which a board is looked for: the first byte says which, the second how wide it is, the
/// others are its levels.
pub fn photograph(bytes: &[u8]) {
    let [board, width, levels @ ..] = bytes else { return };
    let width = usize::from(*width).max(1);
    let height = (levels.len() / width).min(FEW_ROWS);
    // No file gives an image without pixels.
    if height == 0 {
        return;
    }
    let Ok(image) = Raster::from_samples(width, height, levels[..width * height].to_vec()) else { return };
    let board = BOARDS[usize::from(*board) % BOARDS.len()].parse::<BoardSpec>().expect("it is a board");
    let _ = board.see(&Grey::U8(image));
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
