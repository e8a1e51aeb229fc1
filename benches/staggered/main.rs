//! What is found of boards whose rows are staggered, beside rows in line? Exact renders under random poses,
//! lenses, blur and noise: boards found, in a wrong order, errors of the centres; boards of other sizes and
//! kinds that are asked for and not there.
//!
//! `cargo run --release --bin staggered -- [--trials N] [--write FOLDER]`. The folder is for `opencv.py
//! FOLDER`, which asks OpenCV.
#![allow(clippy::print_stdout, reason = "a program whose output is its result")]

use calibench::board::{Arrangement, Board, Pattern};
use calibench::camera::{BrownConrady, Camera};
use calibench::detect::{
    Blob, BlobOptions, GridError, Orientation, SeenBoard, blobs, disc_biases, searched_blobs,
    seen_circle_grid_of, seen_staggered_grid_of,
};
use calibench::geometry::{Pose, Vec2, Vec3, rotation};
use calibench::raster::Raster;
use calibench::synth::render::{Appearance, Imaging, SensorNoise, Surround, photograph};
use calibench::synth::{Stream, StreamKey};
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

const SIZE: (usize, usize) = (640, 480);
/// A mark farther than this from its place, in steps to the nearest, is another: the board is wrong.
const MISPLACED: f64 = 0.4;
/// Least distance of a mark from the image's edge, px.
const MARGIN_PX: f64 = 14.0;

/// What is asked for: whether rows are staggered, columns and rows.
type Asked = (bool, usize, usize);

/// A board and what it is photographed as.
struct Case {
    arrangement: Arrangement,
    columns: usize,
    rows: usize,
    /// Largest tilt, degrees.
    tilt: f64,
    /// Standard deviation of the noise, of a range of 1.
    noise: f64,
}

const fn case(arrangement: Arrangement, columns: usize, rows: usize) -> Case {
    Case { arrangement, columns, rows, tilt: 60.0, noise: 0.01 }
}

const CASES: [Case; 8] = [
    case(Arrangement::Square, 9, 7),
    case(Arrangement::Asymmetric, 4, 11),
    case(Arrangement::Asymmetric, 5, 8),
    case(Arrangement::Hexagonal, 9, 9),
    case(Arrangement::Hexagonal, 7, 8),
    Case { noise: 0.0, ..case(Arrangement::Square, 9, 7) },
    Case { noise: 0.0, ..case(Arrangement::Asymmetric, 4, 11) },
    Case { noise: 0.0, ..case(Arrangement::Hexagonal, 9, 9) },
];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let (mut trials, mut folder) = (200u64, None);
    for pair in words.chunks(2) {
        match pair {
            [option, number] if option == "--trials" => trials = number.parse()?,
            [option, path] if option == "--write" => folder = Some(PathBuf::from(path)),
            _ => return Err("--trials N and --write FOLDER are the options".into()),
        }
    }
    if let Some(folder) = &folder {
        fs::create_dir_all(folder)?;
    }
    println!(
        "{:<34} {:>6} {:>6} {:>6} {:>8} {:>8} {:>6}",
        "board", "photos", "found", "wrong", "rms px", "worst px", "other"
    );
    for case in &CASES {
        let mut tally = Tally::default();
        for trial in 0..trials {
            let scene = case.draw(trial).ok_or("no pose fits the image")?;
            if let Some(folder) = &folder {
                scene.write(folder, &format!("{}-{trial:04}", case.file_name()))?;
            }
            tally.add(case, &scene, trial);
        }
        println!("{:<34} {}", case.name(), tally.row());
    }
    Ok(())
}

/// What became of the photographs of a case.
#[derive(Default)]
struct Tally {
    photos: usize,
    found: usize,
    wrong: usize,
    marks: usize,
    square_px2: f64,
    worst_px: f64,
    other: usize,
}

impl Tally {
    fn row(&self) -> String {
        let rms = (self.square_px2 / self.marks.max(1) as f64).sqrt();
        format!(
            "{:>6} {:>6} {:>6} {:>8.4} {:>8.3} {:>6}",
            self.photos, self.found, self.wrong, rms, self.worst_px, self.other
        )
    }

    fn add(&mut self, case: &Case, scene: &Scene, trial: u64) {
        self.photos += 1;
        for other in case.others() {
            if scene.see(&other).is_ok() {
                self.other += 1;
                println!("OTHER {} {trial}: {other:?}", case.name());
            }
        }
        let asked = (case.arrangement.is_staggered(), case.columns, case.rows);
        let seen = match scene.see(&asked) {
            Ok(seen) => seen,
            Err(reason) => {
                println!("MISSED {} {trial}: {reason}", case.name());
                return;
            }
        };
        let errors = scene.errors_px(&seen);
        let worst = errors.iter().copied().fold(0.0, f64::max);
        if worst > MISPLACED * scene.step_px() {
            self.wrong += 1;
            println!("WRONG {} {trial}: {worst:.1} px", case.name());
            return;
        }
        self.found += 1;
        self.marks += errors.len();
        self.square_px2 += errors.iter().map(|error| error * error).sum::<f64>();
        self.worst_px = self.worst_px.max(worst);
    }
}

/// A photograph of which the truth is known.
struct Scene {
    image: Raster<u8>,
    /// Where the discs' centroids are.
    places_px: Vec<Vec2>,
}

impl Case {
    fn kind(&self) -> &'static str {
        match self.arrangement {
            Arrangement::Asymmetric => "asymmetric",
            Arrangement::Hexagonal => "hexagonal",
            _ => "circles",
        }
    }

    fn name(&self) -> String {
        format!("{} {} x {}, noise {}", self.kind(), self.columns, self.rows, self.noise)
    }

    fn file_name(&self) -> String {
        format!("{}_{}x{}_{}", self.kind(), self.columns, self.rows, self.noise)
    }

    /// Boards that are not there: of other sizes, and of the other kind.
    fn others(&self) -> Vec<Asked> {
        let (c, r, is_staggered) = (self.columns, self.rows, self.arrangement.is_staggered());
        let sizes = [(c - 1, r), (c, r - 1), (c + 1, r), (c, r + 1), (r, c)];
        let same_kind = sizes.into_iter().filter(|size| *size != (c, r) && (is_staggered || *size != (r, c)));
        same_kind.map(|(c, r)| (is_staggered, c, r)).chain([(!is_staggered, c, r)]).collect()
    }

    fn draw(&self, trial: u64) -> Option<Scene> {
        let scenario = self.name();
        let mut random =
            Stream::open(StreamKey { seed: 23, scenario: &scenario, trial, purpose: "photograph" });
        let share = random.uniform_in(0.35, 0.65);
        let unit =
            Board::arranged(self.columns, self.rows, 1.0, Pattern::Chessboard, self.arrangement).ok()?;
        let to_next = (unit.points()[self.columns] - unit.points()[0]).norm();
        let board = Board::arranged(
            self.columns,
            self.rows,
            1.0,
            Pattern::Circles { diameter: share * to_next },
            self.arrangement,
        )
        .ok()?;
        let lens = BrownConrady::radial(random.uniform_in(-0.3, 0.15), 0.0);
        let camera = Camera::pinhole(600.0, 600.0, 326.0, 243.0).with_distortion(lens);
        let pose =
            (0..500).map(|_| self.pose(&board, &mut random)).find(|pose| fits(&board, &camera, pose))?;
        let surround = Surround { level: random.uniform_in(0.2, 0.7), margin: to_next };
        let imaging = Imaging {
            appearance: Appearance { paper: 0.85, ink: 0.1, surround: Some(surround) },
            blur_px: random.uniform_in(0.4, 1.2),
            ..Imaging::default()
        };
        let photo = photograph(&camera, SIZE, &board, &pose, &imaging).ok()?;
        let mut places_px = photo.centres_true;
        let biases = disc_biases(&camera, &pose, &board).ok()?;
        places_px.iter_mut().zip(biases).for_each(|(place, bias)| *place += bias);
        let mut image = photo.image;
        SensorNoise::constant(self.noise).add_to(&mut image, &mut random);
        Some(Scene { image: image.to_u8(), places_px })
    }

    /// Any turn, any direction of a tilt, and a distance at which the board fills a good part of the image.
    fn pose(&self, board: &Board, random: &mut Stream) -> Pose {
        let tilt = random.uniform_in(0.0, self.tilt).to_radians();
        let axis = random.uniform_in(0.0, std::f64::consts::TAU);
        let roll = random.uniform_in(0.0, std::f64::consts::TAU);
        let about = |angle: f64| rotation::from_xyz_rad(0.0, 0.0, angle);
        let rotation = about(roll) * about(axis) * rotation::from_xyz_rad(tilt, 0.0, 0.0) * about(-axis);
        let reach = board.points().iter().map(|point| point.norm()).fold(0.0, f64::max);
        let distance = reach * random.uniform_in(2.4, 4.0);
        let (x, y) = (random.uniform_in(-0.2, 0.2), random.uniform_in(-0.15, 0.15));
        Pose { rotation, translation: Vec3::new(x * distance, y * distance, distance) }
    }
}

/// Whether all of a board is within the image.
fn fits(board: &Board, camera: &Camera, pose: &Pose) -> bool {
    board.points().iter().all(|point| {
        camera.project(&pose.apply(&Vec3::new(point.x, point.y, 0.0))).is_some_and(|p| {
            let inside = |v: f64, size: usize| v > MARGIN_PX && v < size as f64 - MARGIN_PX;
            inside(p.x, SIZE.0) && inside(p.y, SIZE.1)
        })
    })
}

impl Scene {
    /// The board as the command looks for it: a harder look where the first finds none.
    fn see(&self, board: &Asked) -> Result<SeenBoard, GridError> {
        let (is_staggered, columns, rows) = *board;
        let order = |discs: &[Blob]| match is_staggered {
            true => seen_staggered_grid_of(discs, columns, rows),
            false => seen_circle_grid_of(discs, columns, rows),
        };
        let options = BlobOptions::default();
        order(&blobs(&self.image, &options)).or_else(|first| match first {
            other if other.is_other_board() => Err(other),
            _ => order(&searched_blobs(&self.image, &options)).map_err(|_| first),
        })
    }

    /// Distance of the nearest two marks, px.
    fn step_px(&self) -> f64 {
        let places = &self.places_px;
        let pairs = (0..places.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
        pairs.map(|(i, j)| (places[i] - places[j]).norm()).fold(f64::INFINITY, f64::min)
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

    /// The image, and where its marks are.
    fn write(&self, folder: &Path, name: &str) -> std::io::Result<()> {
        let mut pgm = format!("P5\n{} {}\n255\n", SIZE.0, SIZE.1).into_bytes();
        pgm.extend_from_slice(self.image.samples());
        fs::write(folder.join(format!("{name}.pgm")), pgm)?;
        let mut csv = "u,v\n".to_string();
        for place in &self.places_px {
            let _ = writeln!(csv, "{},{}", place.x, place.y);
        }
        fs::write(folder.join(format!("{name}.csv")), csv)
    }
}
