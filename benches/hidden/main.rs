//! What becomes of boards of which marks are hidden? Exact renders of chessboards and grids of discs, in line
//! and staggered, covered in part, cut by the frame, or in glare: boards found, marks kept, marks out of
//! place, boards of another size.
//!
//! `cargo run --release --bin hidden -- [--trials N]`; every trial asks for the board that is there and for
//! three that are not.
#![allow(clippy::print_stdout, reason = "a program whose output is its result")]

use calibench::board::{Arrangement, Board, Pattern};
use calibench::camera::{BrownConrady, Camera};
use calibench::detect::{
    BlobOptions, Orientation, SeenBoard, blobs, disc_biases, seen_chessboard, seen_circle_grid_of,
    seen_staggered_grid_of,
};
use calibench::geometry::{Pose, Vec2, Vec3, rotation};
use calibench::raster::Raster;
use calibench::synth::render::{Appearance, Imaging, SensorNoise, Surround, photograph};
use calibench::synth::{Stream, StreamKey};

const SIZE: (usize, usize) = (640, 480);
const SPACING: f64 = 10.0;
/// A mark farther than this part of the spacing from its place is another: the board is wrong.
const MISPLACED: f64 = 0.4;
/// A mark farther than this from its place, px, would spoil a calibration.
const BAD_PX: f64 = 0.5;
/// Boards by their words.
const BOARDS: [&str; 4] = ["chess", "discs", "asymmetric", "hexagonal"];
/// How marks are hidden.
const WAYS: [&str; 5] = ["nothing", "covered", "frame", "glare", "all three"];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let trials: u64 = match &words[..] {
        [] => 200,
        [option, number] if option == "--trials" => number.parse()?,
        _ => return Err("--trials N is the only option".into()),
    };
    println!(
        "{:<10} {:<10} {:>6} {:>6} {:>6} {:>6} {:>8} {:>8} {:>5} {:>8} {:>8} {:>6}",
        "board",
        "hidden by",
        "photos",
        "whole",
        "part",
        "wrong",
        "in view",
        "kept",
        "bad",
        "rms px",
        "worst px",
        "other"
    );
    let mut total = Tally::default();
    for kind in BOARDS {
        for way in WAYS {
            let mut tally = Tally::default();
            (0..trials).for_each(|trial| tally.add(kind, way, trial));
            println!("{kind:<10} {way:<10} {}", tally.row());
            total.join(&tally);
        }
    }
    println!("{:<21} {}", "all", total.row());
    let most = 3.0 / total.photos as f64;
    println!("0 of {} photographs: at most {most:.5} at 95 %", total.photos);
    Ok(())
}

#[derive(Default)]
struct Tally {
    photos: usize,
    whole: usize,
    part: usize,
    /// Boards with a mark that is another.
    wrong: usize,
    /// Marks that are open to view in photographs of which a board was found, and those found.
    in_view: usize,
    kept: usize,
    /// Marks out of place.
    bad: usize,
    square_px2: f64,
    worst_px: f64,
    /// Boards of another size that were found.
    other: usize,
}

impl Tally {
    fn row(&self) -> String {
        format!(
            "{:>6} {:>6} {:>6} {:>6} {:>8} {:>8} {:>5} {:>8.4} {:>8.3} {:>6}",
            self.photos,
            self.whole,
            self.part,
            self.wrong,
            self.in_view,
            self.kept,
            self.bad,
            (self.square_px2 / self.kept.max(1) as f64).sqrt(),
            self.worst_px,
            self.other
        )
    }

    fn join(&mut self, other: &Tally) {
        self.photos += other.photos;
        self.whole += other.whole;
        self.part += other.part;
        self.wrong += other.wrong;
        self.in_view += other.in_view;
        self.kept += other.kept;
        self.bad += other.bad;
        self.square_px2 += other.square_px2;
        self.worst_px = self.worst_px.max(other.worst_px);
        self.other += other.other;
    }

    fn add(&mut self, kind: &str, way: &str, trial: u64) {
        let Some(scene) = Scene::draw(kind, way, trial) else { return };
        self.photos += 1;
        let (columns, rows) = (scene.board.columns(), scene.board.rows());
        for (columns, rows) in [(columns - 1, rows), (columns, rows - 1), (columns + 1, rows + 1)] {
            if scene.see(columns, rows).is_some() {
                self.other += 1;
                println!("OTHER {kind} {way} {trial}: {columns} x {rows}");
            }
        }
        let Some(seen) = scene.see(columns, rows) else { return };
        let errors = scene.errors_px(&seen);
        let worst = errors.iter().copied().fold(0.0, f64::max);
        if worst > MISPLACED * scene.spacing_px {
            self.wrong += 1;
            println!("WRONG {kind} {way} {trial}: {worst:.1} px");
            return;
        }
        if seen.missing() == 0 {
            self.whole += 1
        } else {
            self.part += 1
        }
        self.in_view += scene.open.iter().filter(|open| **open).count();
        self.kept += errors.len();
        self.bad += errors.iter().filter(|error| **error > BAD_PX).count();
        self.square_px2 += errors.iter().map(|error| error * error).sum::<f64>();
        self.worst_px = self.worst_px.max(worst);
    }
}

/// A photograph of which the truth is known.
struct Scene {
    board: Board,
    image: Raster<u8>,
    /// Where the marks are, with the bias of their images.
    places_px: Vec<Vec2>,
    /// Whether nothing hides a mark, nor its surroundings.
    open: Vec<bool>,
    spacing_px: f64,
}

impl Scene {
    fn draw(kind: &str, way: &str, trial: u64) -> Option<Scene> {
        let scenario = format!("{kind} {way}");
        let mut random = Stream::open(StreamKey { seed: 17, scenario: &scenario, trial, purpose: "hidden" });
        let mut discs = || Pattern::Circles { diameter: random.uniform_in(3.0, 6.0) };
        // Boards of about one size.
        let board = match kind {
            "discs" => Board::new(9, 7, SPACING, discs()).ok()?,
            "asymmetric" => Board::arranged(4, 11, 0.75 * SPACING, discs(), Arrangement::Asymmetric).ok()?,
            "hexagonal" => Board::arranged(8, 7, SPACING, discs(), Arrangement::Hexagonal).ok()?,
            _ => Board::chessboard(9, 6, SPACING).ok()?,
        };
        let camera =
            Camera::pinhole(600.0, 600.0, 326.0, 243.0).with_distortion(BrownConrady::radial(-0.18, 0.05));
        let pose = pose(&mut random, way == "frame" || way == "all three");
        let surround = Surround { level: random.uniform_in(0.2, 0.7), margin: SPACING };
        let imaging = Imaging {
            appearance: Appearance { paper: 0.85, ink: 0.1, surround: Some(surround) },
            blur_px: random.uniform_in(0.4, 1.2),
            ..Imaging::default()
        };
        let photo = photograph(&camera, SIZE, &board, &pose, &imaging).ok()?;
        let mut places_px = photo.centres_true;
        let next = if board.arrangement().is_staggered() { board.columns() } else { 1 };
        let spacing_px = (places_px[next] - places_px[0]).norm();
        if matches!(board.pattern(), Pattern::Circles { .. }) {
            let biases = disc_biases(&camera, &pose, &board).ok()?;
            places_px.iter_mut().zip(biases).for_each(|(place, bias)| *place += bias);
        }
        let mut image = photo.image;
        let mut hidden = Raster::filled(SIZE.0, SIZE.1, false);
        if way == "covered" || way == "all three" {
            for _ in 0..=random.below(2) {
                cover(&mut image, &mut hidden, &places_px, &mut random);
            }
        }
        if way == "glare" || way == "all three" {
            glare(&mut image, &mut hidden, &places_px, &mut random);
        }
        SensorNoise::constant(random.uniform_in(0.002, 0.015)).add_to(&mut image, &mut random);
        let reach = 0.5 * spacing_px;
        let open = places_px.iter().map(|place| is_open(&hidden, place, reach)).collect();
        Some(Scene { board, image: image.to_u8(), places_px, open, spacing_px })
    }

    fn see(&self, columns: usize, rows: usize) -> Option<SeenBoard> {
        match self.board.pattern() {
            Pattern::Circles { .. } if self.board.arrangement().is_staggered() => {
                seen_staggered_grid_of(&blobs(&self.image, &BlobOptions::default()), columns, rows).ok()
            }
            Pattern::Circles { .. } => {
                seen_circle_grid_of(&blobs(&self.image, &BlobOptions::default()), columns, rows).ok()
            }
            _ => seen_chessboard(&self.image, columns, rows).ok(),
        }
    }

    /// Distances of the marks from the truth, in the order that is nearer where the board does not fix it.
    fn errors_px(&self, seen: &SeenBoard) -> Vec<f64> {
        let last = self.places_px.len() - 1;
        let of = |turned: bool| -> Vec<f64> {
            let truth = |mark: usize| self.places_px[if turned { last - mark } else { mark }];
            seen.seen().map(|(mark, place)| (place - truth(mark)).norm()).collect()
        };
        let (same, turned) = (of(false), of(true));
        let is_nearer = turned.iter().sum::<f64>() < same.iter().sum::<f64>();
        if seen.orientation() != Orientation::Fixed && is_nearer { turned } else { same }
    }
}

/// A random pose; one that leaves the frame has its middle towards an edge.
fn pose(random: &mut Stream, leaves: bool) -> Pose {
    let tilt = random.uniform_in(0.0, 40.0).to_radians();
    let axis = random.uniform_in(0.0, std::f64::consts::TAU);
    let roll = random.uniform_in(0.0, std::f64::consts::TAU);
    let rotation = rotation::from_xyz_rad(0.0, 0.0, roll)
        * rotation::from_xyz_rad(0.0, 0.0, axis)
        * rotation::from_xyz_rad(tilt, 0.0, 0.0)
        * rotation::from_xyz_rad(0.0, 0.0, -axis);
    let distance = random.uniform_in(150.0, 210.0);
    let (x, y) = if leaves { (0.32, 0.26) } else { (0.1, 0.05) };
    let (x, y) = (random.uniform_in(-x, x), random.uniform_in(-y, y));
    Pose { rotation, translation: Vec3::new(x * distance, y * distance, distance) }
}

/// Covers a turned rectangle about one of the marks with one level.
fn cover(image: &mut Raster<f32>, hidden: &mut Raster<bool>, places_px: &[Vec2], random: &mut Stream) {
    let middle = places_px[random.below(places_px.len())]
        + Vec2::new(random.uniform_in(-20.0, 20.0), random.uniform_in(-20.0, 20.0));
    let turn = random.uniform_in(0.0, std::f64::consts::TAU);
    let half = Vec2::new(random.uniform_in(5.0, 50.0), random.uniform_in(5.0, 30.0));
    let level = random.uniform_in(0.0, 1.0) as f32;
    let (sine, cosine) = libm::sincos(turn);
    for y in 0..image.height() {
        for x in 0..image.width() {
            let d = Vec2::new(x as f64, y as f64) - middle;
            let along = Vec2::new(cosine * d.x + sine * d.y, cosine * d.y - sine * d.x);
            if along.x.abs() <= half.x && along.y.abs() <= half.y {
                image.set(x, y, level);
                hidden.set(x, y, true);
            }
        }
    }
}

/// Adds a round spot of light that saturates in its middle.
fn glare(image: &mut Raster<f32>, hidden: &mut Raster<bool>, places_px: &[Vec2], random: &mut Stream) {
    let middle = places_px[random.below(places_px.len())];
    let (width, height) = (random.uniform_in(8.0, 30.0), random.uniform_in(0.8, 4.0));
    for y in 0..image.height() {
        for x in 0..image.width() {
            let square = (Vec2::new(x as f64, y as f64) - middle).norm_squared();
            let light = height * libm::exp(-0.5 * square / (width * width));
            image.set(x, y, (f64::from(image.get(x, y)) + light).min(1.0) as f32);
            if light > 0.05 {
                hidden.set(x, y, true);
            }
        }
    }
}

/// Whether nothing is hidden within a distance of a place, and all of it is in the image.
fn is_open(hidden: &Raster<bool>, place: &Vec2, reach: f64) -> bool {
    let inside = |at: f64, size: usize| at - reach >= 1.0 && at + reach < size as f64 - 2.0;
    if !(inside(place.x, hidden.width()) && inside(place.y, hidden.height())) {
        return false;
    }
    let (x, y, reach) = (place.x as usize, place.y as usize, reach as usize);
    (y - reach..=y + reach).all(|y| (x - reach..=x + reach).all(|x| !hidden.get(x, y)))
}
