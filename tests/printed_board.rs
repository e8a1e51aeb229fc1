//! Is a printed board as large as it says, and does the way from its page to a camera lead anywhere? The page
//! as PDF and as SVG, read back; and photographs of the whole page, rulers and all, through the command that
//! a newcomer types.

use crate::program::{calibench, folder};
use calibench::camera::Camera;
use calibench::geometry::{Pose, Vec2, Vec3};
use calibench::io::write_png;
use calibench::raster::Raster;
use calibench::synth::Truth;
use calibench::synth::scene::looking_at_centre;
use serde_json::Value;
use std::fs;
use std::path::Path;

/// The page that the command draws, as text.
fn drawn(folder: &Path, board: &str, form: &str) -> String {
    let run = calibench(folder, &["board", board, &format!("--{form}"), "A4"]);
    assert_eq!(run.status.code(), Some(0), "{run:?}");
    fs::read_to_string(folder.join(format!("board.{form}"))).expect("a page of text")
}

/// Numbers before a word of a PDF's page.
fn numbers_before<'a>(content: &'a str, word: &'a str) -> impl Iterator<Item = Vec<f64>> + 'a {
    let line = move |line: &'a str| {
        let (numbers, _) = line.split_once(word)?;
        numbers.split(' ').map(|n| n.parse().ok()).collect::<Option<Vec<f64>>>()
    };
    content.lines().filter_map(line)
}

/// A point is a 72nd of an inch of 25.4 mm.
const POINTS: f64 = 72.0 / 25.4;

#[test]
fn a_pdf_has_the_distances_in_points() {
    let page = drawn(&folder("board-pdf"), "circles:9x7:10mm:3mm", "pdf");
    assert!(page.contains("/MediaBox [0 0 841.8898 595.2756]") && page.contains("/PrintScaling /None"));
    let matrix = numbers_before(&page, " cm").next().expect("a matrix");
    let in_points = |x: f64, y: f64| Vec2::new(matrix[0] * x + matrix[4], matrix[3] * y + matrix[5]);
    // A disc's path begins at its rightmost point, a radius beside its centre.
    let discs: Vec<Vec2> = numbers_before(&page, " m ").map(|p| in_points(p[0], p[1])).collect();
    assert_eq!(discs.len(), 63);
    // Coordinates are written to 1e-4 mm.
    let near = |a: Vec2, b: Vec2| (a - b).norm() < 1e-3;
    assert!(near(discs[1] - discs[0], Vec2::new(10.0 * POINTS, 0.0)), "{}", discs[1] - discs[0]);
    assert!(near(discs[9] - discs[0], Vec2::new(0.0, -10.0 * POINTS)));
    assert!(near(discs[62] - discs[0], POINTS * Vec2::new(80.0, -60.0)));
    // The first disc's path spans three millimetres.
    let path = page.lines().find(|line| line.contains(" m ")).expect("a disc");
    let across: Vec<f64> = path
        .split(' ')
        .filter_map(|word| word.parse().ok())
        .collect::<Vec<f64>>()
        .chunks(2)
        .map(|p| p[0])
        .collect();
    let span =
        across.iter().fold(f64::MIN, |a, b| a.max(*b)) - across.iter().fold(f64::MAX, |a, b| a.min(*b));
    assert!((span - 3.0).abs() < 1e-3, "{span}");
}

#[test]
fn the_rulers_are_as_long_as_the_file_beside_the_page_says() {
    let folder = folder("board-rulers");
    let page = drawn(&folder, "chess:9x6:25mm", "pdf");
    let file = fs::read_to_string(folder.join("board.toml")).expect("a file beside the page");
    let file: toml::Table = file.parse().expect("TOML");
    let rulers: Vec<f64> = numbers(&file, "drawn_mm");
    assert_eq!(rulers, numbers(&file, "measured_mm"));
    let rectangles: Vec<Vec<f64>> = numbers_before(&page, " re").collect();
    // Squares are wide and high; what is thin are the rulers' lines, which reach from edge to edge of their
    // last ticks.
    let longest = |side: usize, thin: usize| {
        let lines = rectangles.iter().filter(|r| r[thin] < 1.0).map(|r| r[side]);
        lines.fold(0.0, f64::max)
    };
    let tick = rectangles.iter().map(|r| r[2].min(r[3])).fold(f64::MAX, f64::min);
    assert!(
        (longest(2, 3) - tick - rulers[0]).abs() < 1e-3 && (longest(3, 2) - tick - rulers[1]).abs() < 1e-3
    );
    assert_eq!(rectangles.iter().filter(|r| r[2..] == [25.0, 25.0]).count(), 35);
}

fn numbers(file: &toml::Table, name: &str) -> Vec<f64> {
    let list = file[name].as_array().expect("a list");
    list.iter().map(|x| x.as_float().or(x.as_integer().map(|n| n as f64)).expect("a number")).collect()
}

/// A printed page: black discs and rectangles, in millimetres from its middle.
struct Page {
    discs: Vec<(Vec2, f64)>,
    rectangles: Vec<(Vec2, Vec2)>,
    half: Vec2,
    /// Shapes that reach into each cell, by row and column: discs, then rectangles.
    cells: Vec<Vec<usize>>,
    columns: usize,
}

/// Side of a cell, mm.
const CELL: f64 = 5.0;

impl Page {
    /// Reads the SVG of a page. Words are left out.
    fn read(svg: &str) -> Page {
        let attribute = |line: &str, name: &str| -> f64 {
            let (_, rest) = line.split_once(&format!(" {name}=\"")).expect("an attribute");
            rest.split('"').next().expect("it ends").trim_end_matches("mm").parse().expect("a number")
        };
        let first = svg.lines().next().expect("a page");
        let size = Vec2::new(attribute(first, "width"), attribute(first, "height"));
        let at = |line: &str, x: &str, y: &str| Vec2::new(attribute(line, x), attribute(line, y));
        let shapes = |kind: &'static str| svg.lines().filter(move |line| line.starts_with(kind));
        let discs: Vec<_> = shapes("<circle ")
            .map(|line| (at(line, "cx", "cy") - 0.5 * size, attribute(line, "r")))
            .collect();
        let rectangles: Vec<_> = shapes("<rect x")
            .map(|line| (at(line, "x", "y") - 0.5 * size, at(line, "width", "height")))
            .collect();
        let (columns, rows) = ((size.x / CELL) as usize + 1, (size.y / CELL) as usize + 1);
        let mut page =
            Page { discs, rectangles, half: 0.5 * size, cells: vec![Vec::new(); columns * rows], columns };
        for (i, (low, high)) in page.bounds().into_iter().enumerate() {
            let cell = |p: f64, half: f64| ((p + half) / CELL) as usize;
            for row in cell(low.y, page.half.y)..=cell(high.y, page.half.y) {
                for column in cell(low.x, page.half.x)..=cell(high.x, page.half.x) {
                    page.cells[row * columns + column].push(i);
                }
            }
        }
        page
    }

    fn bounds(&self) -> Vec<(Vec2, Vec2)> {
        let around = |(centre, radius): &(Vec2, f64)| {
            let reach = Vec2::new(*radius, *radius);
            (centre - reach, centre + reach)
        };
        let rectangles = self.rectangles.iter().map(|(corner, size)| (*corner, corner + size));
        self.discs.iter().map(around).chain(rectangles).collect()
    }

    /// The level at a place: ink, paper, and the table around the page.
    fn level(&self, p: Vec2) -> f64 {
        if p.x.abs() >= self.half.x || p.y.abs() >= self.half.y {
            return 0.4;
        }
        let cell = |p: f64, half: f64| ((p + half) / CELL) as usize;
        let shapes = &self.cells[cell(p.y, self.half.y) * self.columns + cell(p.x, self.half.x)];
        let inside = |i: &usize| match self.discs.get(*i) {
            Some((centre, radius)) => (p - centre).norm() < *radius,
            None => {
                let (corner, size) = self.rectangles[i - self.discs.len()];
                let q = p - corner;
                q.x > 0.0 && q.y > 0.0 && q.x < size.x && q.y < size.y
            }
        };
        if shapes.iter().any(inside) { 0.1 } else { 0.85 }
    }

    /// The board's centre, mm from the page's.
    fn board_centre(&self) -> Vec2 {
        self.discs.iter().map(|(centre, _)| centre).sum::<Vec2>() / self.discs.len() as f64
    }

    /// A photograph of the page, printed at `scale`: each pixel the mean of a few points of it. The pose is
    /// the board's.
    fn photograph(
        &self,
        camera: &Camera,
        (width, height): (usize, usize),
        cam_from_board: &Pose,
        scale: f64,
    ) -> Raster<u8> {
        const SIDE: usize = 4;
        let centre = self.board_centre();
        let board_from_cam = cam_from_board.inverse();
        let eye = board_from_cam.apply(&Vec3::zeros());
        let at = |u: f64, v: f64| {
            let ray = camera.normalised_ray(&Vec2::new(u, v)).expect("the lens sees its own pixels");
            let towards = board_from_cam.apply(&Vec3::new(ray.x, ray.y, 1.0)) - eye;
            let hit = eye - towards * (eye.z / towards.z);
            self.level(Vec2::new(hit.x, hit.y) / scale + centre)
        };
        let offset = |k: usize| (k as f64 + 0.5) / SIDE as f64 - 0.5;
        Raster::from_fn(width, height, |x, y| {
            let points =
                (0..SIDE * SIDE).map(|k| at(x as f64 + offset(k % SIDE), y as f64 + offset(k / SIDE)));
            (255.0 * points.sum::<f64>() / (SIDE * SIDE) as f64).round() as u8
        })
    }
}

/// Tilts of the photographs, degrees about x, y and z.
const TILTS: [[f64; 3]; 6] = [
    [30.0, 0.0, 5.0],
    [-30.0, 5.0, 0.0],
    [0.0, 30.0, -5.0],
    [5.0, -30.0, 10.0],
    [20.0, 20.0, 0.0],
    [-20.0, 25.0, 90.0],
];

#[test]
fn a_newcomer_gets_from_nothing_to_a_report() {
    for (board, distance_mm) in [("circles:9x7:20mm:8mm", 260.0), ("circles:9x7:10mm:3mm", 135.0)] {
        let folder = folder("board-walk");
        let page = Page::read(&drawn(&folder, board, "svg"));
        // The printer makes the page 3 % smaller; its owner measures both rulers to a tenth of a millimetre.
        let scale = 0.97;
        let file = fs::read_to_string(folder.join("board.toml")).expect("a file beside the page");
        let rulers = numbers(&file.parse().expect("TOML"), "drawn_mm");
        let measured = |ruler: f64| (10.0 * scale * ruler).round() / 10.0;
        let (before, _) = file.split_once("\nmeasured_mm").expect("what is measured stands last");
        let measured = format!("\nmeasured_mm = [{}, {}]\n", measured(rulers[0]), measured(rulers[1]));
        fs::write(folder.join("board.toml"), format!("{before}{measured}")).expect("it is written");
        let camera = Truth::example_camera();
        let mut arguments: Vec<String> =
            ["calibrate", "--board", "board.toml", "--out", "result", "--format", "json"]
                .map(String::from)
                .to_vec();
        for (i, tilt) in TILTS.into_iter().enumerate() {
            let pose = looking_at_centre(tilt, distance_mm);
            let photo = page.photograph(&camera, Truth::EXAMPLE_IMAGE, &pose, scale);
            write_png(&folder.join(format!("photo{i}.png")), &photo).expect("it is written");
            arguments.push(format!("photo{i}.png"));
        }
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let run = calibench(&folder, &arguments);
        let said = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(0), "{board}: {said}");
        let result: Value = serde_json::from_slice(&run.stdout).expect("JSON");
        assert_eq!(result["views"].as_array().map(Vec::len), Some(TILTS.len()), "{said}");
        // Five of the standard deviations that the result states: marks are found to some hundredths of a
        // pixel.
        let fx = result["camera"]["fx"].as_f64().expect("a focal length");
        assert!((fx - camera.fx).abs() < 3.0, "{board}: {fx}");
        // The distance is in the millimetres of the page as it came out: with the drawn sizes it would be 3 %
        // too long.
        let distance = result["views"][0]["translation"][2].as_f64().expect("a distance");
        assert!((distance / distance_mm - 1.0).abs() < 0.01, "{board}: {distance}");
        assert!(folder.join("result/report.html").is_file());
    }
}

#[test]
fn what_cannot_be_drawn_or_read_is_refused_with_a_sentence() {
    let folder = folder("board-refused");
    let refused = |arguments: &[&str], why: &str| {
        let run = calibench(&folder, arguments);
        let said = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains(why), "{arguments:?}: {said}");
    };
    refused(&["board", "chess:9x6:60mm"], "take A1");
    refused(&["board", "dots:3x3:1"], "unit");
    refused(&["board", "circles:9x7:10mm"], "diameter");
    refused(&["board", "chess:9x6:25mm", "--pdf", "B4"], "letter");
    refused(&["board", "chess:9x6:25mm", "--pdf", "A4", "--svg", "A3"], "two folders");
    refused(&["calibrate", "--board", "nothing.toml", "photo.png"], "nothing.toml");
    fs::write(
        folder.join("inches.toml"),
        "board = \"chess:9x6:25mm\"\ndrawn_mm = [270, 180]\nmeasured_mm = [10.6, 7.1]\n",
    )
    .expect("it is written");
    refused(&["calibrate", "--board", "inches.toml", "photo.png"], "in millimetres");
    assert!(!folder.join("board.pdf").exists() && !folder.join("board.toml").exists());
}
