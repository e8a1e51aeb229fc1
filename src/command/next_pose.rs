//! `calibench next-pose RESULT.json --want fx`: which photograph should be taken next, so that what is wanted
//! is known best?

mod words;

use super::calibrate::parse_size;
use super::format::Format;
use super::said::{Said, noise_px, number_that, positive, say};
use super::{Exit, warn};
use crate::board::board_or_file;
use calibench::camera::Parameter;
use calibench::geometry::{Pose, Vec2, Vec3};
use calibench::io::{Known, KnownCalibration, ShownPath, read_corners, read_known};
use calibench::photos::BoardSpec;
use calibench::planning::{
    Estimated, Found, Gain, Knowledge, Reach, Wanted, Wish, best_repeated, marks_against_covariance,
    next_pose,
};
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// result.json of `calibench calibrate`, with a lens of any model
    result: PathBuf,
    /// The board, as for `calibench calibrate`
    #[arg(long, value_name = "BOARD", value_parser = board_or_file, required_unless_present = "corners")]
    board: Option<BoardSpec>,
    /// The corner file of the calibration in place of a board: its marks are those of the target
    #[arg(long, value_name = "FILE", conflicts_with = "board")]
    corners: Option<PathBuf>,
    /// What is to be known better: a parameter (fx, k1, ...), `pixel` (where a direction is seen, over the
    /// whole image) or `length` (see --at); may be repeated, and then what remains of all together counts
    #[arg(long, value_name = "QUANTITY", value_parser = parse_quantity, required = true)]
    want: Vec<Quantity>,
    /// For `length`: place of its middle in the camera's frame, in the board's unit; it lies along the
    /// image's rows
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_place, requires = "length")]
    at: Option<Vec3>,
    /// For `length`: the length, in the board's unit
    #[arg(long, value_name = "LENGTH", value_parser = positive, requires = "at")]
    length: Option<f64>,
    /// Nearest and farthest distance of the board's middle, in the board's unit [default: a fifth beyond
    /// those of the photographs taken]
    #[arg(long, value_name = "NEAR,FAR", value_parser = parse_distances)]
    distance: Option<(f64, f64)>,
    /// Largest tilt of the board against its line of sight, degrees: less than 80
    #[arg(long, value_name = "DEG", value_parser = parse_tilt, default_value_t = 45.0)]
    most_tilt: f64,
    /// How far from the image's border a mark has to stay, px [default: a fiftieth of the image's shorter
    /// side]
    #[arg(long, value_name = "PX", value_parser = parse_margin)]
    margin: Option<f64>,
    /// Standard deviation of a coordinate of a mark in the next photograph, px [default: the noise that the
    /// calibration found]
    #[arg(long, value_name = "PX", value_parser = noise_px)]
    mark_sd: Option<f64>,
    /// Size of the image, where the result does not say it
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    image_size: Option<(usize, usize)>,
    /// How many poses are told, the best first
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=50), default_value_t = 4)]
    poses: u8,
    /// Folder for next-pose.json
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Quantity {
    Parameter(Parameter),
    Pixel,
    Length,
}

fn parse_quantity(text: &str) -> Result<Quantity, String> {
    match text {
        "pixel" => Ok(Quantity::Pixel),
        "length" => Ok(Quantity::Length),
        name => {
            name.parse().map(Quantity::Parameter).map_err(|error| format!("{error}; or pixel, or length"))
        }
    }
}

fn parse_place(text: &str) -> Result<Vec3, String> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|part| part.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
    match numbers.as_deref() {
        Some(&[x, y, z]) if z > 0.0 => Ok(Vec3::new(x, y, z)),
        _ => Err("expected three numbers X,Y,Z with Z above 0".into()),
    }
}

fn parse_distances(text: &str) -> Result<(f64, f64), String> {
    let wanted = "expected NEAR,FAR, two numbers above 0, the nearer first";
    let (near, far) = text.split_once(',').ok_or(wanted)?;
    let (near, far) = (positive(near)?, positive(far)?);
    if near <= far { Ok((near, far)) } else { Err(wanted.into()) }
}

fn parse_tilt(text: &str) -> Result<f64, String> {
    number_that(text, |x| (0.0..80.0).contains(&x), "degrees, 0 or more and less than 80")
}

fn parse_margin(text: &str) -> Result<f64, String> {
    number_that(text, |x| x >= 0.0, "a number of 0 or more")
}

pub(super) fn run(arguments: &Arguments) -> Exit {
    let said = plan(arguments).map(|plan| Said { text: plan.text(), json: plan.json(arguments) });
    say(said, arguments.out.as_deref(), "next-pose.json", arguments.format)
}

/// What was found, with what it is told by.
struct Plan {
    known: KnownCalibration,
    wishes: Vec<Wish>,
    /// Marks of the target, and its unit: empty where a corner file does not say.
    points: Vec<Vec2>,
    unit: String,
    sigma_px: f64,
    image_size: (usize, usize),
    reach: Reach,
    found: Found,
    /// The best of the views that exist, once more.
    repeated: Option<(usize, Vec<Gain>)>,
}

/// Part by which a distance may be smaller or larger than those of the photographs taken: they are in focus
/// there.
const BEYOND: f64 = 1.2;
/// Steps of distance, places along the image's longer side, steps of the tilt, directions of it, and turns.
const DISTANCES: usize = 6;
const PLACES: usize = 9;
const TILTS: usize = 4;
const DIRECTIONS: usize = 8;
const TURNS: usize = 4;

/// How many times the standard deviation of a pose may be that of the marks before they are taken for another
/// board: marks that were hidden, or counted less, make it larger.
const OTHER_BOARD: f64 = 1.1;

fn plan(arguments: &Arguments) -> Result<Plan, String> {
    let file = arguments.result.shown();
    let known = known(arguments)?;
    for doubt in &known.doubts {
        warn(&format!("warning: {file}: {doubt}: what is promised here rests on these standard deviations"));
    }
    let image_size = image_size(arguments, &known)?;
    let (points, unit) = marks(arguments)?;
    let noise_px = || known.noise_px(&file).map_err(|error| format!("{error}: give it, --mark-sd PX"));
    let sigma_px = match arguments.mark_sd.map_or_else(noise_px, Ok)? {
        sigma if sigma > 0.0 => sigma,
        _ => {
            return Err(format!(
                "{file}: its marks have no noise: give that of the next photograph, --mark-sd PX"
            ));
        }
    };
    let estimated = Estimated { free: known.covariance.free, fy_per_fx: known.covariance.fy_per_fx };
    let knowledge =
        Knowledge::of(estimated, &known.covariance.intrinsics).map_err(|error| format!("{file}: {error}"))?;
    let wish = |quantity: &Quantity| {
        let wanted = wanted(*quantity, arguments, image_size)?;
        refuse_outside(&wanted, &known, image_size)?;
        Wish::of(wanted, &known.camera, &estimated).map_err(|error| format!("{file}: {error}"))
    };
    if arguments.at.is_some() && !arguments.want.contains(&Quantity::Length) {
        return Err("--at and --length are for --want length".into());
    }
    let wishes = arguments.want.iter().map(wish).collect::<Result<Vec<_>, _>>()?;
    refuse_twice(&wishes)?;
    let reach = reach(arguments, &known, &points, image_size)?;
    let most = usize::from(arguments.poses);
    let found = next_pose(&known.camera, &knowledge, &wishes, (&points, sigma_px), &reach, most)
        .map_err(|error| error.to_string())?;
    if found.ranked.is_empty() {
        return Err("the marks of the board do not fix its pose: are they on a line?".into());
    }
    let whose = whose(&known, &points);
    let repeated = match whose {
        Whose::Other => None,
        Whose::Result | Whose::Untold => {
            let marks = (&points[..], sigma_px);
            best_repeated(&known.camera, &knowledge, &wishes, marks, &known.cam_from_target)
        }
    };
    match (whose, &repeated) {
        (Whose::Untold, Some(_)) => warn(&format!(
            "{file}: it was calibrated with a robust loss, whose covariance does not tell whether these marks are its board: views taken are \
             compared as if they were"
        )),
        (_, None) if !known.views.is_empty() => warn(&format!(
            "{file}: these marks, at the poses of the result, would not have given its covariance: another board, another unit, \
             or an origin elsewhere on it (--corners FILE takes the marks from the calibration's own corner file). Views taken are \
             not compared"
        )),
        _ => {}
    }
    Ok(Plan { known, wishes, points, unit, sigma_px, image_size, reach, found, repeated })
}

/// The size of the image, of which there is one.
fn image_size(arguments: &Arguments, known: &KnownCalibration) -> Result<(usize, usize), String> {
    let file = arguments.result.shown();
    match (known.image_size, arguments.image_size) {
        (Some((width, height)), Some(given)) if given != (width, height) => Err(format!(
            "{file}: its image has {width} x {height} px: --image-size is for results that do not say theirs"
        )),
        (of_result, given) => of_result
            .or(given)
            .ok_or_else(|| format!("{file}: it does not say how large the image is: give --image-size WxH")),
    }
}

/// A camera's result on a flat board.
fn known(arguments: &Arguments) -> Result<KnownCalibration, String> {
    let file = arguments.result.shown();
    match read_known(&arguments.result).map_err(|error| error.to_string())? {
        Known::Plane(_) => {
            Err(format!("{file}: the map of a plane has no camera: no pose is better than another"))
        }
        Known::Camera(known) if !known.camera.is_possible() => {
            Err(format!("{file}: its camera is none: every parameter must be finite, fx and fy above 0"))
        }
        Known::Camera(known) => {
            known
                .refuse_bent_board(&file)
                .map_err(|error| format!("{error}: poses are planned for flat boards only"))?;
            Ok(*known)
        }
    }
}

/// The marks of the target, and its unit.
fn marks(arguments: &Arguments) -> Result<(Vec<Vec2>, String), String> {
    if let Some(board) = &arguments.board {
        return Ok((board.points(), board.unit.clone()));
    }
    let path = arguments.corners.as_ref().ok_or("give the board: --board BOARD, or --corners FILE")?;
    let corners = read_corners(path).map_err(|error| error.to_string())?;
    let mut points: Vec<Vec2> = Vec::new();
    let mut seen = std::collections::BTreeSet::new();
    for point in corners.views.iter().flat_map(|view| view.points()) {
        // Adding 0 makes one of both zeros.
        if seen.insert([point.x + 0.0, point.y + 0.0].map(f64::to_bits)) {
            points.push(*point);
        }
    }
    Ok((points, String::new()))
}

fn wanted(quantity: Quantity, arguments: &Arguments, size: (usize, usize)) -> Result<Wanted, String> {
    match (quantity, arguments.at, arguments.length) {
        (Quantity::Parameter(parameter), ..) => Ok(Wanted::Parameter(parameter)),
        (Quantity::Pixel, ..) => Ok(Wanted::Pixel(size)),
        (Quantity::Length, Some(centre), Some(length)) => Ok(Wanted::Length { centre, length }),
        (Quantity::Length, ..) => Err("--want length: which? Give --at X,Y,Z and --length LENGTH".into()),
    }
}

/// Nothing was calibrated beyond the image.
fn refuse_outside(
    wanted: &Wanted,
    known: &KnownCalibration,
    image_size: (usize, usize),
) -> Result<(), String> {
    let Wanted::Length { centre, length } = wanted else { return Ok(()) };
    let (width, height) = image_size;
    let within = |x: f64, side: usize| (-0.5..=side as f64 - 0.5).contains(&x);
    for part in [-0.5, 0.5] {
        // What the lens does not show at all is refused with its reason elsewhere.
        let Some(p) = known.camera.pixel(&(centre + Vec3::new(part * length, 0.0, 0.0))) else { continue };
        if !(within(p.x, width) && within(p.y, height)) {
            return Err(format!(
                "an end of the length is seen at pixel ({:.0}, {:.0}), outside of the image of {width} x {height} px: give a shorter \
                 one, or one further away",
                p.x, p.y
            ));
        }
    }
    Ok(())
}

fn refuse_twice(wishes: &[Wish]) -> Result<(), String> {
    let twice =
        wishes.iter().enumerate().find(|(i, wish)| wishes[..*i].iter().any(|w| w.wanted == wish.wanted));
    twice.map_or(Ok(()), |(_, wish)| Err(format!("--want {} is given twice", wish.wanted.name())))
}

fn reach(
    arguments: &Arguments,
    known: &KnownCalibration,
    points: &[Vec2],
    image_size: (usize, usize),
) -> Result<Reach, String> {
    let (near, far) = match arguments.distance {
        Some(range) => range,
        None => distances_taken(known, points)
            .ok_or("there are no views whose distance could be kept: give --distance NEAR,FAR")?,
    };
    let step = |i: usize| near * libm::pow(far / near, i as f64 / (DISTANCES - 1) as f64);
    let (width, height) = image_size;
    let (long, short) = (width.max(height), width.min(height));
    // Odd, so that one of them is the middle.
    let across = (libm::round(PLACES as f64 * short as f64 / long as f64) as usize | 1).min(PLACES);
    Ok(Reach {
        image_size,
        margin_px: arguments.margin.unwrap_or(short as f64 / 50.0),
        distances: if near == far { vec![near] } else { (0..DISTANCES).map(step).collect() },
        places: if width >= height { (PLACES, across) } else { (across, PLACES) },
        tilts_rad: match arguments.most_tilt.to_radians() {
            0.0 => vec![0.0],
            most => (0..TILTS).map(|i| most * i as f64 / (TILTS - 1) as f64).collect(),
        },
        directions: DIRECTIONS,
        turns: TURNS,
    })
}

/// Distances of the board's middle in the views, a little widened.
fn distances_taken(known: &KnownCalibration, points: &[Vec2]) -> Option<(f64, f64)> {
    let middle = points.iter().sum::<Vec2>() / points.len() as f64;
    let of = |pose: &Pose| pose.apply(&Vec3::new(middle.x, middle.y, 0.0)).norm();
    let all: Vec<f64> = known.cam_from_target.iter().map(of).collect();
    let near = all.iter().copied().min_by(f64::total_cmp)?;
    let far = all.iter().copied().max_by(f64::total_cmp)?;
    Some((near / BEYOND, far * BEYOND))
}

/// Whose marks are they, by the covariance of the result's views?
#[derive(Clone, Copy)]
enum Whose {
    /// One view at least has the covariance that these marks give it.
    Result,
    /// None has.
    Other,
    /// Under a robust loss it is another one whatever the board.
    Untold,
}

fn whose(known: &KnownCalibration, points: &[Vec2]) -> Whose {
    if known.loss.is_some() {
        return Whose::Untold;
    }
    let marks = (points, known.sigma_px);
    let of_view = |view| marks_against_covariance(&known.camera, &known.covariance, view, marks);
    let is_of = |view| of_view(view).is_some_and(|ratio| ratio < OTHER_BOARD);
    if known.cam_from_target.iter().enumerate().any(is_of) { Whose::Result } else { Whose::Other }
}
