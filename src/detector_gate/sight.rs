//! What else may stand before a camera? Boards that are cut off, doubled, on a tiled floor or beside others,
//! and patterns that are no board.

use super::look::{Look, Photo};
use super::observed::Truth;
use super::protocol::Kind;
use super::scene::{Demand, Scene, scenes};
use calibench::board::Pattern;
use calibench::camera::{BrownConrady, Camera};
use calibench::detect::disc_biases;
use calibench::geometry::{Pose, Vec2, Vec3, rotation};
use calibench::photos::BoardSpec;
use calibench::raster::Raster;
use calibench::synth::render::{
    Appearance, Imaging, SensorNoise, Shading, Surround, photograph, photograph_dark,
};
use calibench::synth::{Stream, StreamKey};

/// What a photograph shows.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Picture {
    /// What the scene of the gate shows.
    Scene,
    /// The board, and another beside it.
    Beside,
    /// The board twice.
    Twice,
    /// Two boards of another kind or size.
    Others,
    /// The board, partly outside of the image.
    Cut,
    /// A pattern as on the board that goes on beyond the image on all sides.
    Endless,
    /// The board on a tiled floor.
    OnFloor,
    /// A tiled floor.
    Tiles,
    /// A keyboard.
    Keys,
    /// The board in a mirror.
    Mirrored,
    /// A grid of tags that are nearer to each other, or farther, than is asked.
    Respaced,
}

/// A scene of the gate, or one of those that were added to look for wrong boards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
    scene: Scene,
    picture: Picture,
}

/// A photograph, and the boards in it that may be found.
pub(super) struct Shown {
    pub image: Raster<u8>,
    pub boards: Vec<Truth>,
}

/// What is added to the gate's scenes: name, for people, what is asked of the answers, and what is seen.
const ADDED: [(&str, &str, Demand, Picture); 10] = [
    ("beside", "beside another board", Demand::Right, Picture::Beside),
    ("twice", "twice in one photograph", Demand::Right, Picture::Twice),
    ("cut", "partly outside of the image", Demand::Right, Picture::Cut),
    ("on-floor", "on a tiled floor", Demand::Right, Picture::OnFloor),
    ("others", "two boards of another kind or size", Demand::Nothing, Picture::Others),
    ("endless", "a pattern that goes on beyond the image on all sides", Demand::Nothing, Picture::Endless),
    ("tiles", "a tiled floor alone", Demand::Nothing, Picture::Tiles),
    ("keys", "a keyboard", Demand::Nothing, Picture::Keys),
    ("mirrored", "the board in a mirror", Demand::Nothing, Picture::Mirrored),
    ("respaced", "tags nearer to each other, or farther, than is asked", Demand::Nothing, Picture::Respaced),
];

/// Focal length and size of the image, as in the gate's scenes.
const FOCAL_PX: f64 = 600.0;
const SIZE: (usize, usize) = (640, 480);
/// Spacing of the marks, as in the gate's scenes.
const SPACING: f64 = 10.0;

/// The gate's scenes and the added ones, of every kind of board.
pub fn sights() -> Vec<Sight> {
    let of_gate = scenes().into_iter().map(|scene| Sight { scene, picture: Picture::Scene });
    let added = Kind::ALL.into_iter().flat_map(|kind| {
        ADDED.into_iter().filter(move |(.., picture)| picture.is_of(kind)).map(
            move |(id, about, demand, picture)| {
                let scene = Scene { id, about, demand, ..named(kind, "clean") };
                Sight { scene, picture }
            },
        )
    });
    of_gate.chain(added).collect()
}

impl Picture {
    /// Whether there is such a picture of a kind of board: a board without markers is one in a mirror too,
    /// and one with markers ends with their number.
    fn is_of(self, kind: Kind) -> bool {
        match self {
            Picture::Mirrored => kind.is_coded(),
            Picture::Endless => !kind.is_coded(),
            Picture::Respaced => kind == Kind::AprilGrid,
            _ => true,
        }
    }
}

impl Sight {
    /// The scene, with what is asked.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The photograph of a trial; `None` where no pose fits the image.
    pub(super) fn shown(&self, seed: u64, trial: u64) -> Option<Shown> {
        let name = self.scene.name();
        let open = |purpose: &'static str| Stream::open(StreamKey { seed, scenario: &name, trial, purpose });
        let mut random = open("sight");
        let board = self.scene.board();
        let whole = |board: &BoardSpec, look: &Look, part: &str| {
            look.photo(board, seed, &format!("{name}{part}"), trial)
        };
        // What no board may be found in.
        let empty = |image| Some(Shown { image, boards: Vec::new() });
        match self.picture {
            Picture::Scene => {
                let photo = whole(&board, &self.scene.look, "")?;
                let boards =
                    if self.scene.demand == Demand::Nothing { vec![] } else { vec![truth(&photo, &board)] };
                Some(Shown { image: photo.image, boards })
            }
            Picture::Beside | Picture::Twice | Picture::Others => {
                let half = Look { size: (SIZE.0 / 2, SIZE.1), ..self.scene.look };
                let [left, right] = self.pair(trial);
                let (mut one, other) = (whole(&left, &half, " left")?, whole(&right, &half, " right")?);
                let mut both = Shown { image: side_by_side(&one.image, &other.image), boards: Vec::new() };
                if self.picture != Picture::Others {
                    both.boards.push(truth(&one, &left));
                }
                if self.picture == Picture::Twice {
                    let shift = Vec2::new(half.size.0 as f64, 0.0);
                    one = Photo {
                        places_px: other.places_px.iter().map(|place| place + shift).collect(),
                        ..other
                    };
                    both.boards.push(truth(&one, &right));
                }
                Some(both)
            }
            Picture::Cut => {
                let pose = pose(&mut random, (0.0, 40.0), width_of(&board), (0.9, 1.5), 0.3);
                let clean = on_ground(&board, &pose, 0.5, &mut random)?;
                Some(Shown { boards: vec![truth(&clean, &board)], image: noisy(clean.clean, &mut random) })
            }
            Picture::OnFloor => {
                let floor = floor(&mut random)?;
                let pose = pose(&mut random, (0.0, 40.0), width_of(&board), (0.35, 0.6), 0.1);
                let clean = on_ground(&board, &pose, 0.0, &mut random)?;
                let sheet = sheet_of(&board, &pose)?;
                let level = |x, y| clean.clean.get(x, y) + (1.0 - sheet.get(x, y)) * floor.get(x, y);
                let image = noisy(Raster::from_fn(SIZE.0, SIZE.1, level), &mut random);
                Some(Shown { image, boards: vec![truth(&clean, &board)] })
            }
            Picture::Endless => {
                let wide = self.endless();
                let across = random.uniform_in(0.4, 0.75);
                let pose = pose(&mut random, (0.0, 40.0), across * width_of(&wide), (1.0, 1.0), 0.05);
                empty(noisy(on_ground(&wide, &pose, 0.5, &mut random)?.clean, &mut random))
            }
            Picture::Tiles => empty(noisy(floor(&mut random)?, &mut random)),
            Picture::Keys => empty(noisy(keys(&mut random)?, &mut random)),
            Picture::Mirrored => {
                let image = whole(&board, &self.scene.look, "")?.image;
                let last = image.width() - 1;
                empty(Raster::from_fn(image.width(), image.height(), |x, y| image.get(last - x, y)))
            }
            Picture::Respaced => {
                let wider = random.uniform_in(0.02, 0.12)
                    * if random.uniform_in(0.0, 1.0) < 0.5 { 1.0 } else { -1.0 };
                let mut other = self.scene.wanted(trial);
                other.markers = other.markers.map(|markers| super::protocol::Markers {
                    gap: markers.gap.map(|gap| gap + wider),
                    ..markers
                });
                empty(whole(&other.board(SPACING, None), &self.scene.look, "")?.image)
            }
        }
    }

    /// The boards of two halves of an image.
    fn pair(&self, trial: u64) -> [BoardSpec; 2] {
        let kinds: Vec<Kind> = Kind::ALL.into_iter().filter(|kind| *kind != self.scene.kind).collect();
        let of_kind = named(kinds[trial as usize % kinds.len()], "clean").board();
        let diameter = diameter(&self.scene.board());
        let of_size = named(self.scene.kind, "another-size").wanted(trial).board(SPACING, diameter);
        let another = if trial.is_multiple_of(2) { of_kind.clone() } else { of_size.clone() };
        match self.picture {
            Picture::Twice => [self.scene.board(), self.scene.board()],
            Picture::Beside => [self.scene.board(), another],
            _ => [of_kind, of_size],
        }
    }

    /// The board with so many marks that the image shows a part of them.
    fn endless(&self) -> BoardSpec {
        let mut wanted = self.scene.wanted(0);
        (wanted.columns, wanted.rows) = (31, 31);
        wanted.board(SPACING, diameter(&self.scene.board()))
    }
}

/// A scene of the gate.
fn named(kind: Kind, id: &str) -> Scene {
    let found = scenes().into_iter().find(|scene| scene.kind == kind && scene.id == id);
    found.expect("every kind of board has the gate's scenes")
}

fn truth(photo: &Photo, board: &BoardSpec) -> Truth {
    Truth::of(photo, board, |_, _| None)
}

fn diameter(board: &BoardSpec) -> Option<f64> {
    match board.board().pattern() {
        Pattern::Circles { diameter } => Some(diameter),
        _ => None,
    }
}

/// The larger side of the board, from its first mark to its last.
fn width_of(board: &BoardSpec) -> f64 {
    let most = board.points().iter().fold(Vec2::zeros(), |most, mark| most.sup(&mark.abs()));
    2.0 * most.max()
}

/// A tilt about any axis, at a distance from which `width` takes a part of the image, off its middle by up to
/// `side` of its width.
fn pose(random: &mut Stream, tilt: (f64, f64), width: f64, part: (f64, f64), side: f64) -> Pose {
    let tilt = random.uniform_in(tilt.0, tilt.1).to_radians();
    let axis = random.uniform_in(0.0, std::f64::consts::TAU);
    let roll = random.uniform_in(0.0, std::f64::consts::TAU);
    let rotation = rotation::from_xyz_rad(0.0, 0.0, roll + axis)
        * rotation::from_xyz_rad(tilt, 0.0, 0.0)
        * rotation::from_xyz_rad(0.0, 0.0, -axis);
    let distance = FOCAL_PX * width / (SIZE.0 as f64 * random.uniform_in(part.0, part.1));
    let seen = distance * SIZE.0 as f64 / FOCAL_PX;
    let [x, y] = [0, 1].map(|_| seen * random.uniform_in(-side, side));
    Pose { rotation, translation: Vec3::new(x, y, distance) }
}

fn camera() -> Camera {
    let (width, height) = (SIZE.0 as f64, SIZE.1 as f64);
    Camera::pinhole(FOCAL_PX, FOCAL_PX, 0.507 * width, 0.492 * height)
        .with_distortion(BrownConrady::radial(-0.18, 0.05))
}

fn imaging(paper: f64, ink: f64, level: f64, margin: f64) -> Imaging {
    let appearance = Appearance { paper, ink, surround: Some(Surround { level, margin }) };
    Imaging { appearance, blur_px: 0.6, shading: Shading::default() }
}

/// Width of the paper beyond the marks.
const MARGIN: f64 = 8.0;

/// A board before a ground of a level, without noise; `None` where it is not wholly before the camera.
fn on_ground(board: &BoardSpec, pose: &Pose, level: f64, random: &mut Stream) -> Option<Photo> {
    let ink = random.uniform_in(0.05, 0.2);
    let imaging = imaging(0.85, ink, level, MARGIN);
    let camera = camera();
    let photo = match board.dark() {
        None => photograph(&camera, SIZE, board.board(), pose, &imaging),
        Some(dark) => photograph_dark(&camera, SIZE, &dark, &board.points(), pose, &imaging),
    };
    let photo = photo.ok()?;
    let mut places_px = photo.centres_true;
    let biases = disc_biases(&camera, pose, board.board()).ok()?;
    places_px.iter_mut().zip(biases).for_each(|(place, bias)| *place += bias);
    Some(Photo { image: photo.image.to_u8(), clean: photo.image, places_px })
}

/// Which part of each pixel the board's paper covers.
fn sheet_of(board: &BoardSpec, pose: &Pose) -> Option<Raster<f32>> {
    let imaging = imaging(1.0, 1.0, 0.0, MARGIN);
    let photo = match board.dark() {
        None => photograph(&camera(), SIZE, board.board(), pose, &imaging),
        Some(dark) => photograph_dark(&camera(), SIZE, &dark, &[], pose, &imaging),
    };
    Some(photo.ok()?.image)
}

/// Upright rectangles, corners of least and of greatest coordinates.
type Rectangles = Vec<[Vec2; 2]>;

/// A floor of square tiles with joints between them, wider than the image: dark tiles, or dark joints.
fn floor(random: &mut Stream) -> Option<Raster<f32>> {
    let count = random.uniform_in(8.0, 28.0) as usize;
    let joint = random.uniform_in(0.04, 0.3);
    let dark = if random.uniform_in(0.0, 1.0) < 0.5 {
        tiles(count, count, |_| 0.0, joint)
    } else {
        joints(count, joint)
    };
    pattern(&dark, count as f64, (0.0, 70.0), random)
}

/// Four to six rows of keys, each a part of a key farther to the right than the one before.
fn keys(random: &mut Stream) -> Option<Raster<f32>> {
    let (columns, rows) = (random.uniform_in(11.0, 17.0) as usize, random.uniform_in(4.0, 7.0) as usize);
    let gap = random.uniform_in(0.1, 0.3);
    let dark = tiles(columns, rows, |row| 0.25 * row as f64, gap);
    pattern(&dark, columns as f64, (0.0, 60.0), random)
}

/// Squares of a pitch of 1 about the middle.
fn tiles(columns: usize, rows: usize, indent: impl Fn(usize) -> f64, gap: f64) -> Rectangles {
    let middle = 0.5 * Vec2::new(columns as f64, rows as f64);
    let place = |column: usize, row: usize| Vec2::new(column as f64 + indent(row), row as f64) - middle;
    let square = |low: Vec2| [low + Vec2::repeat(0.5 * gap), low + Vec2::repeat(1.0 - 0.5 * gap)];
    (0..rows)
        .flat_map(|row| (0..columns).map(move |column| (column, row)))
        .map(|(c, r)| square(place(c, r)))
        .collect()
}

/// What is between such squares: upright joints as long as the floor, and level ones from joint to joint.
fn joints(count: usize, width: f64) -> Rectangles {
    let (half, side) = (0.5 * width, 0.5 * count as f64);
    let at = |k: usize| k as f64 - side;
    let upright = (0..=count).map(|k| [Vec2::new(at(k) - half, -side), Vec2::new(at(k) + half, side)]);
    let level =
        (0..=count).flat_map(|row| (0..count).map(move |column| (column, row))).map(|(column, row)| {
            let high = if row == count { side } else { at(row) + half };
            let low = if row == 0 { -side } else { at(row) - half };
            [Vec2::new(at(column) + half, low), Vec2::new(at(column + 1) - half, high)]
        });
    upright.chain(level).collect()
}

/// A plane of dark rectangles, somewhat wider than the image.
fn pattern(dark: &[[Vec2; 2]], width: f64, tilt: (f64, f64), random: &mut Stream) -> Option<Raster<f32>> {
    let pose = pose(random, tilt, width, (0.9, 1.25), 0.05);
    let (ink, paper) = (random.uniform_in(0.1, 0.3), random.uniform_in(0.5, 0.8));
    let imaging = imaging(paper, ink, random.uniform_in(0.2, 0.8), 0.3);
    Some(photograph_dark(&camera(), SIZE, dark, &[], &pose, &imaging).ok()?.image)
}

fn noisy(mut image: Raster<f32>, random: &mut Stream) -> Raster<u8> {
    let sigma = random.uniform_in(0.002, 0.03);
    SensorNoise::constant(sigma).add_to(&mut image, random);
    image.to_u8()
}

fn side_by_side(left: &Raster<u8>, right: &Raster<u8>) -> Raster<u8> {
    let first = left.width();
    let level = |x: usize, y: usize| if x < first { left.get(x, y) } else { right.get(x - first, y) };
    Raster::from_fn(first + right.width(), left.height(), level)
}
