//! How well are chessboards found? Exact renders with known corners, by condition: recall, wrong boards,
//! error of the corners.
//!
//! `cargo run --release --no-default-features --example chess -- [--trials N] [--write FOLDER] [--cases PART]
//! [--wrong-sizes N]`; `benches/chess/opencv.py FOLDER` then measures OpenCV's finders on the same images.
#![allow(clippy::print_stdout, reason = "a program whose output is its result")]

mod cases;
mod scene;

use calibench::detect::{Orientation, chessboard};
use calibench::geometry::Vec2;
use calibench::raster::Raster;
use cases::{CASES, Case};
use scene::Photo;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Corners along a row, rows.
pub const BOARD: (usize, usize) = (9, 6);

/// A corner farther than this from its place, px, belongs to another place: the board is wrong. Twice the
/// widest blur; squares are larger.
const WRONG_PX: f64 = 6.0;

struct Arguments {
    trials: u64,
    folder: Option<PathBuf>,
    part: String,
    wrong_sizes: u64,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments = arguments()?;
    println!(
        "{:<34} {:>6} {:>6} {:>6} {:>10} {:>10} {:>9}",
        "case", "photos", "found", "wrong", "rms px", "worst px", "ms"
    );
    let mut totals = [0u64; 3];
    for case in CASES.iter().filter(|case| case.name.contains(&arguments.part)) {
        let tally = measure(case, &arguments)?;
        println!("{}", tally.row(case.name));
        totals = [totals[0] + tally.photos, totals[1] + tally.found, totals[2] + tally.wrong];
    }
    println!("{} photos, {} boards found, {} wrong", totals[0], totals[1], totals[2]);
    if arguments.wrong_sizes > 0 {
        wrong_sizes(&arguments)?;
    }
    Ok(())
}

fn arguments() -> Result<Arguments, Box<dyn std::error::Error>> {
    let mut arguments = Arguments { trials: 6, folder: None, part: String::new(), wrong_sizes: 0 };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let value = words.next().ok_or("every option takes a value")?;
        match word.as_str() {
            "--trials" => arguments.trials = value.parse()?,
            "--write" => arguments.folder = Some(value.into()),
            "--cases" => arguments.part = value,
            "--wrong-sizes" => arguments.wrong_sizes = value.parse()?,
            _ => return Err(format!("no option {word}").into()),
        }
    }
    Ok(arguments)
}

#[derive(Default)]
struct Tally {
    photos: u64,
    found: u64,
    wrong: u64,
    square_px2: f64,
    worst_px: f64,
    seconds: f64,
}

impl Tally {
    fn row(&self, name: &str) -> String {
        let corners = (self.found * (BOARD.0 * BOARD.1) as u64) as f64;
        format!(
            "{name:<34} {:>6} {:>6} {:>6} {:>10.4} {:>10.3} {:>9.2}",
            self.photos,
            self.found,
            self.wrong,
            (self.square_px2 / corners).sqrt(),
            self.worst_px,
            1e3 * self.seconds / self.photos as f64
        )
    }
}

fn measure(case: &Case, arguments: &Arguments) -> Result<Tally, Box<dyn std::error::Error>> {
    let mut tally = Tally::default();
    for trial in 0..arguments.trials {
        let Some(photo) = scene::photo(case, trial) else { continue };
        if let Some(folder) = &arguments.folder {
            write(folder, &format!("{}-{trial}", case.name.replace([' ', '.', '/'], "_")), &photo)?;
        }
        tally.photos += 1;
        let start = seconds();
        let found = chessboard(&photo.image, BOARD.0, BOARD.1);
        tally.seconds += seconds() - start;
        match found {
            Ok(board) => {
                let errors = errors_px(board.corners_px(), &photo.truth_px, board.orientation());
                let worst = errors.iter().copied().fold(0.0, f64::max);
                if worst > WRONG_PX {
                    tally.wrong += 1;
                    eprintln!("WRONG {} {trial}: {worst:.1} px", case.name);
                    continue;
                }
                tally.found += 1;
                tally.square_px2 += errors.iter().map(|e| e * e).sum::<f64>();
                tally.worst_px = tally.worst_px.max(worst);
            }
            Err(error) => eprintln!("{} {trial}: {error}", case.name),
        }
    }
    Ok(tally)
}

/// Distances from the truth; the order must be the board's own where the colours fix it.
fn errors_px(found: &[Vec2], truth: &[Vec2], orientation: Orientation) -> Vec<f64> {
    let distances = |reversed: bool| -> Vec<f64> {
        let count = truth.len();
        (0..count).map(|i| (found[i] - truth[if reversed { count - 1 - i } else { i }]).norm()).collect()
    };
    let (same, turned) = (distances(false), distances(true));
    let is_nearer = turned.iter().sum::<f64>() < same.iter().sum::<f64>();
    if orientation == Orientation::HalfTurn && is_nearer { turned } else { same }
}

/// Boards of other sizes asked for: every one that is found is wrong.
fn wrong_sizes(arguments: &Arguments) -> Result<(), Box<dyn std::error::Error>> {
    let (mut asked, mut wrong) = (0, 0);
    for case in CASES.iter().filter(|case| case.name.contains(&arguments.part)) {
        for trial in 1000..1000 + arguments.wrong_sizes {
            let Some(photo) = scene::photo(case, trial) else { continue };
            for (columns, rows) in [(8, 6), (9, 5), (8, 5), (10, 6), (9, 7), (7, 6), (6, 6)] {
                asked += 1;
                if chessboard(&photo.image, columns, rows).is_ok() {
                    wrong += 1;
                    eprintln!("WRONG SIZE {} {trial}: {columns} x {rows}", case.name);
                }
            }
        }
    }
    println!("{asked} boards of a wrong size asked for, {wrong} found");
    Ok(())
}

/// The image as PGM and its true corners as CSV.
fn write(folder: &Path, name: &str, photo: &Photo) -> std::io::Result<()> {
    fs::create_dir_all(folder)?;
    fs::write(folder.join(format!("{name}.pgm")), pgm(&photo.image))?;
    let mut csv = String::from("u,v\n");
    for corner in &photo.truth_px {
        let _ = writeln!(csv, "{},{}", corner.x, corner.y);
    }
    fs::write(folder.join(format!("{name}.csv")), csv)
}

fn pgm(image: &Raster<u8>) -> Vec<u8> {
    let mut bytes = format!("P5\n{} {}\n255\n", image.width(), image.height()).into_bytes();
    bytes.extend_from_slice(image.samples());
    bytes
}

/// This thread's time on a processor where the system tells it, so that other work on the machine does not
/// count; else the clock's.
fn seconds() -> f64 {
    let told = fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = told.and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
    let clock = || SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0.0, |t| t.as_secs_f64());
    nanoseconds.map_or_else(clock, |ns| 1e-9 * ns)
}
