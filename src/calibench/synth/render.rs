//! What image does the virtual camera take of a board? Exact area sampling of the projected marks.
//!
//! A pixel is the mean of the continuous image over its unit square (fill factor 1), not a point sample.
//! Marks are plane regions of one level with piecewise smooth outlines, so the mean needs only the outlines:
//! each is projected through the full camera model and the area it covers in every pixel is summed along it
//! (Green's theorem). With blur, the continuous image is convolved with a Gaussian before the pixel's square
//! is averaged, again along the outline and in closed form across it. Nothing is supersampled. The error of a
//! noise-free sample is below 1e-6 of the contrast without blur and below 1e-7 with it, before rounding to
//! `f32` (3e-8).

mod blur;
mod coverage;
mod outline;
mod sensor;
mod window;

pub use sensor::{SensorNoise, Shading};

use crate::board::{Board, Pattern};
use crate::camera::{Camera, Lens};
use crate::geometry::{Pose, Vec2, Vec3};
use crate::raster::Raster;
use coverage::Coverage;
use outline::{Arc, Outline, Piece};
use window::Window;

/// Levels of a board, and what surrounds it. Intensity is linear: black 0, white 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Appearance {
    /// Level of the board's ground.
    pub paper: f64,
    /// Level of the marks.
    pub ink: f64,
    /// Where the board ends; `None`: it fills the whole image.
    pub surround: Option<Surround>,
}

/// The edge of the board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surround {
    /// Level of everything that is not board.
    pub level: f64,
    /// Width of the paper around the outermost marks (circles: their centres; chessboard: the outer squares'
    /// edges), in the board's unit.
    pub margin: f64,
}

impl Default for Appearance {
    /// Black marks on white paper that reflect 10 % and 85 %: neither end of the range clips under noise.
    fn default() -> Appearance {
        Appearance { paper: 0.85, ink: 0.1, surround: None }
    }
}

/// The optics and the light, apart from the camera's geometry.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Imaging {
    /// The board's levels.
    pub appearance: Appearance,
    /// Standard deviation of the Gaussian point spread function, px; 0 is a perfectly sharp lens.
    pub blur_px: f64,
    /// Uneven light or vignetting.
    pub shading: Shading,
}

/// A rendered image and its truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Photograph {
    /// Linear intensity; [`Raster::to_u8`] and [`Raster::to_u16`] quantise it.
    pub image: Raster<f32>,
    /// The projections of the board's marks, in the order of [`Board::points`], px.
    pub centres_true: Vec<Vec2>,
}

/// Why a board cannot be photographed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// Part of the board is not in front of the camera.
    #[error(
        "board point ({x:.3}, {y:.3}) is not in front of the camera; increase the distance or reduce the tilt"
    )]
    BehindCamera {
        /// Board X.
        x: f64,
        /// Board Y.
        y: f64,
    },
    /// Part of the board lies where the lens model folds back.
    #[error(
        "board point ({x:.3}, {y:.3}) is seen at undistorted radius {radius:.4}, but the lens model folds back at \
         {limit:.4}; move the board towards the image centre"
    )]
    BeyondMonotoneRadius {
        /// Board X.
        x: f64,
        /// Board Y.
        y: f64,
        /// Its undistorted normalised radius.
        radius: f64,
        /// Radius up to which the model is one-to-one.
        limit: f64,
    },
    /// Part of the board lies further from the optical axis than a lens of another model is one-to-one.
    #[error(
        "board point ({x:.3}, {y:.3}) is seen {angle_deg:.2} degrees from the optical axis, but the lens is one-to-one up to \
         {limit_deg:.2}; move the board towards the image centre"
    )]
    BeyondMonotoneAngle {
        /// Board X.
        x: f64,
        /// Board Y.
        y: f64,
        /// Its angle from the optical axis, degrees.
        angle_deg: f64,
        /// Angle up to which the model is one-to-one, degrees.
        limit_deg: f64,
    },
    /// Part of the board lies so close to the plane of the camera that its pixel is beyond all numbers, or is
    /// known to no part of a pixel.
    #[error(
        "board point ({x:.3}, {y:.3}) is too close to the plane of the camera for a pixel; increase the distance"
    )]
    TooNear {
        /// Board X.
        x: f64,
        /// Board Y.
        y: f64,
    },
    /// A setting is out of its domain.
    #[error("{name} = {value} cannot be rendered: {need}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Its domain.
        need: &'static str,
    },
}

/// The board's points through the camera, with the reasons why some have no pixel.
struct Projector<'a> {
    optics: Optics,
    cam_from_target: &'a Pose,
}

/// A camera with how far from its axis it is one-to-one.
enum Optics {
    /// Brown-Conrady's, which sees what is before it.
    Plain { camera: Camera, monotone_radius: f64 },
    /// Any other; fisheyes see beside and behind themselves.
    Any { camera: Camera<Lens>, monotone_angle: f64 },
}

impl Optics {
    fn of(camera: Camera<Lens>) -> Optics {
        match camera.brown_conrady() {
            Some(camera) => Optics::Plain { camera, monotone_radius: camera.distortion.monotone_radius() },
            None => Optics::Any { camera, monotone_angle: camera.distortion.monotone_angle() },
        }
    }
}

impl Projector<'_> {
    fn pixel(&self, point: &Vec2) -> Result<Vec2, RenderError> {
        let (x, y) = (point.x, point.y);
        let seen = self.cam_from_target.apply(&Vec3::new(x, y, 0.0));
        let pixel = match &self.optics {
            Optics::Plain { camera, monotone_radius } => {
                if seen.z.is_nan() || seen.z <= 0.0 {
                    return Err(RenderError::BehindCamera { x, y });
                }
                let (ideal, limit) = (seen.xy() / seen.z, *monotone_radius);
                let radius = ideal.norm();
                if radius >= limit {
                    return Err(RenderError::BeyondMonotoneRadius { x, y, radius, limit });
                }
                Some(camera.pixel_from_normalised(&camera.distortion.distort(&ideal)))
            }
            Optics::Any { camera, monotone_angle } => {
                let angle = libm::atan2(seen.xy().norm(), seen.z);
                if angle.is_nan() || angle >= *monotone_angle {
                    let [angle_deg, limit_deg] = [angle, *monotone_angle].map(f64::to_degrees);
                    return Err(RenderError::BeyondMonotoneAngle { x, y, angle_deg, limit_deg });
                }
                camera.pixel(&seen)
            }
        };
        let is_finite = |pixel: &Vec2| pixel.x.is_finite() && pixel.y.is_finite();
        pixel.filter(is_finite).ok_or(RenderError::TooNear { x, y })
    }
}

/// Photographs a board through a lens of any model: the noise-free image of `image_size` (width, height) px
/// and the true pixels of its marks.
///
/// Chessboards have `(columns + 1) x (rows + 1)` squares; the square towards the board's origin corner (least
/// X, least Y) is dark.
///
/// # Errors
/// Any outline that reaches further from the axis than the lens is one-to-one (behind a Brown-Conrady camera,
/// or beyond its monotone radius), and settings out of domain.
///
/// ```
/// use calibench::board::Board;
/// use calibench::synth::Truth;
/// use calibench::synth::render::{Imaging, photograph};
/// use calibench::synth::scene::looking_at_centre;
///
/// // The board 20 degrees tilted, 150 mm before the camera, through a slightly blurred lens.
/// let board = Board::circles(9, 7, 10.0, 3.0)?;
/// let imaging = Imaging { blur_px: 0.7, ..Imaging::default() };
/// let (camera, pose) = (Truth::example_camera(), looking_at_centre([20.0, 0.0, 0.0], 150.0));
/// let photo = photograph(&camera, (640, 480), &board, &pose, &imaging)?;
/// assert_eq!((photo.image.width(), photo.centres_true.len()), (640, 63));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn photograph<C: Copy + Into<Camera<Lens>>>(
    camera: &C,
    image_size: (usize, usize),
    board: &Board,
    cam_from_target: &Pose,
    imaging: &Imaging,
) -> Result<Photograph, RenderError> {
    let marks = board.points();
    let sheet = imaging.appearance.surround.map(|surround| sheet_outline(board, surround.margin));
    photographed(
        &(*camera).into(),
        image_size,
        cam_from_target,
        imaging,
        &mark_outlines(board),
        sheet,
        &marks,
    )
}

/// Photographs a board of upright black rectangles, such as one with markers
/// ([`Charuco::dark`](crate::detect::Charuco::dark)): no two may overlap, and each is given by its corners of
/// least and of greatest coordinates. Its sheet reaches `margin` beyond the outermost.
///
/// # Errors
/// As for [`photograph`].
///
/// ```
/// use calibench::board::Board;
/// use calibench::detect::{Charuco, Orientation, seen_charuco};
/// use calibench::geometry::Vec2;
/// use calibench::synth::Truth;
/// use calibench::synth::render::{Imaging, photograph_dark};
///
/// let board = Charuco::new(8, 6, 0.72, "DICT_4X4_50".parse()?, false)?;
/// // Squares of 9 mm about the board's middle.
/// let dark: Vec<[Vec2; 2]> =
///     board.dark().into_iter().map(|square| square.map(|p| 9.0 * (p - Vec2::new(4.0, 3.0)))).collect();
/// let marks = Board::chessboard(7, 5, 9.0)?.points();
/// let (camera, pose) = (Truth::example_camera(), Truth::example_poses()[1]);
/// let photo = photograph_dark(&camera, Truth::EXAMPLE_IMAGE, &dark, &marks, &pose, &Imaging::default())?;
/// let seen = seen_charuco(&photo.image, &board)?;
/// assert_eq!((seen.places_px().len(), seen.missing(), seen.orientation()), (35, 0, Orientation::Fixed));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn photograph_dark<C: Copy + Into<Camera<Lens>>>(
    camera: &C,
    image_size: (usize, usize),
    dark: &[[Vec2; 2]],
    marks: &[Vec2],
    cam_from_target: &Pose,
    imaging: &Imaging,
) -> Result<Photograph, RenderError> {
    let outlines: Vec<Outline> = dark.iter().map(|[low, high]| Outline::rectangle(*low, *high)).collect();
    let sheet = imaging.appearance.surround.map(|surround| {
        let corners = || dark.iter().flatten().copied();
        let (low, high) = (corners().reduce(|a, b| a.inf(&b)), corners().reduce(|a, b| a.sup(&b)));
        let margin = Vec2::repeat(surround.margin);
        Outline::rectangle(low.unwrap_or_default() - margin, high.unwrap_or_default() + margin)
    });
    photographed(&(*camera).into(), image_size, cam_from_target, imaging, &outlines, sheet, marks)
}

fn photographed(
    camera: &Camera<Lens>,
    image_size: (usize, usize),
    cam_from_target: &Pose,
    imaging: &Imaging,
    dark: &[Outline],
    sheet: Option<Outline>,
    marks: &[Vec2],
) -> Result<Photograph, RenderError> {
    check(camera, imaging)?;
    check_pose(cam_from_target)?;
    let projector = Projector { optics: Optics::of(*camera), cam_from_target };
    let covered_by = |outlines: &[Outline]| -> Result<Coverage, RenderError> {
        let mut coverage = Coverage::new(image_size.0, image_size.1);
        for outline in outlines {
            for piece in &outline.pieces {
                add_piece(&mut coverage, piece, &projector, imaging.blur_px)?;
            }
        }
        coverage.finish();
        Ok(coverage)
    };
    let appearance = &imaging.appearance;
    let ink = covered_by(dark)?;
    let sheet = (appearance.surround.zip(sheet))
        .map(|(surround, sheet)| Ok((surround, covered_by(&[sheet])?)))
        .transpose()?;
    let image = Raster::from_fn(image_size.0, image_size.1, |x, y| {
        let ground = sheet.as_ref().map_or(appearance.paper, |(surround, sheet)| {
            surround.level + (appearance.paper - surround.level) * sheet.at(x, y)
        });
        let level = ground + (appearance.ink - appearance.paper) * ink.at(x, y);
        (level * imaging.shading.gain(x, y, image_size)) as f32
    });
    let centres_true = marks.iter().map(|point| projector.pixel(point)).collect::<Result<_, _>>()?;
    Ok(Photograph { image, centres_true })
}

impl Photograph {
    /// The photograph with sensor noise, one normal draw a pixel, row by row.
    pub fn with_noise(mut self, noise: &SensorNoise, stream: &mut super::Stream) -> Photograph {
        noise.add_to(&mut self.image, stream);
        self
    }
}

/// A photograph of a nine-point board: 1571 x 1053 px, 3 x 3 dark dots, undistorted, column spacing 236.23
/// px, row spacing 236.19 px, centre (714.708, 565.993), which follows from the published matrix. The dots'
/// diameter is not published; a quarter of the spacing is taken.
pub fn nine_dot_stand_in() -> Photograph {
    let board = Board::circles(3, 3, 1.0, 0.25).expect("a quarter of the spacing is a disc");
    let camera = Camera::pinhole(236.23, 236.19, 714.708, 565.993);
    let cam_from_target = Pose { translation: Vec3::new(0.0, 0.0, 1.0), ..Pose::identity() };
    photograph(&camera, (1571, 1053), &board, &cam_from_target, &Imaging::default())
        .expect("a fronto-parallel board at distance 1 is in front of the camera")
}

fn check(camera: &Camera<Lens>, imaging: &Imaging) -> Result<(), RenderError> {
    let setting = |name, value, holds: bool, need| {
        if holds { Ok(()) } else { Err(RenderError::Setting { name, value, need }) }
    };
    let appearance = &imaging.appearance;
    let focal_px = camera.fx.min(camera.fy);
    setting(
        "focal length",
        focal_px,
        camera.is_possible(),
        "a camera has finite parameters and positive focal lengths",
    )?;
    let blur_px = imaging.blur_px;
    setting("blur_px", blur_px, (0.0..=MAX_BLUR_PX).contains(&blur_px), "need 0 ... 50 px")?;
    setting("paper", appearance.paper, appearance.paper.is_finite(), "a level is a finite number")?;
    setting("ink", appearance.ink, appearance.ink.is_finite(), "a level is a finite number")?;
    if let Some(Surround { level, margin }) = appearance.surround {
        setting("surround level", level, level.is_finite(), "a level is a finite number")?;
        setting("margin", margin, margin >= 0.0 && margin.is_finite(), "a margin is not negative")?;
    }
    setting(
        "shading",
        imaging.shading.first_bad().unwrap_or(0.0),
        imaging.shading.first_bad().is_none(),
        "need finite",
    )
}

fn check_pose(pose: &Pose) -> Result<(), RenderError> {
    let mut entries = pose.rotation.iter().chain(pose.translation.iter());
    match entries.find(|entry| !entry.is_finite()) {
        Some(&value) => Err(RenderError::Setting { name: "pose", value, need: "need finite" }),
        None => Ok(()),
    }
}

/// A blur wider than any board's marks is a mistake of units, and its cost grows with the square.
const MAX_BLUR_PX: f64 = 50.0;

/// How far the end of a closed outline may lie from its begin, px: what is between them is covered wrongly.
const CLOSED_PX: f64 = 1e-5;

fn add_piece(
    coverage: &mut Coverage,
    piece: &Piece,
    projector: &Projector<'_>,
    blur_px: f64,
) -> Result<(), RenderError> {
    let curve = |t: f64| projector.pixel(&piece.at(t));
    if let Piece::Circle { .. } = piece {
        // Both ends are the same point but for the rounding of an angle, which a lens may make large.
        let end = piece.at(1.0);
        if (curve(1.0)? - curve(0.0)?).norm() > CLOSED_PX {
            return Err(RenderError::TooNear { x: end.x, y: end.y });
        }
    }
    let size = (coverage.width(), coverage.height());
    if blur_px > 0.0 {
        let kernel = blur::Kernel::new(blur_px);
        let window = Window::of(size, kernel.reach_px());
        let add = &mut |arc: &Arc| kernel.add(coverage, arc);
        outline::trace(&curve, piece.start_parts(), &kernel.steps(), &window, add)
    } else {
        let window = Window::of(size, 0.0);
        let add = &mut |arc: &Arc| coverage.add_arc(arc);
        outline::trace(&curve, piece.start_parts(), &outline::Steps::SHARP, &window, add)
    }
}

/// Outlines of the marks, all turning the same way.
fn mark_outlines(board: &Board) -> Vec<Outline> {
    match board.pattern() {
        Pattern::Circles { diameter } => {
            board.points().into_iter().map(|centre| Outline::disc(centre, 0.5 * diameter)).collect()
        }
        Pattern::Chessboard => dark_squares(board),
    }
}

fn dark_squares(board: &Board) -> Vec<Outline> {
    let side = board.spacing();
    let first = board.points()[0] - Vec2::new(side, side);
    (0..=board.rows())
        .flat_map(|row| (0..=board.columns()).map(move |column| (column, row)))
        .filter(|(column, row)| (column + row) % 2 == 0)
        .map(|(column, row)| {
            let corner = first + Vec2::new(column as f64, row as f64) * side;
            Outline::rectangle(corner, corner + Vec2::new(side, side))
        })
        .collect()
}

/// The sheet that carries the marks.
fn sheet_outline(board: &Board, margin: f64) -> Outline {
    let beyond_mark = match board.pattern() {
        Pattern::Circles { .. } => margin,
        Pattern::Chessboard => margin + board.spacing(),
    };
    let points = board.points();
    let reach = Vec2::new(beyond_mark, beyond_mark);
    // The last mark is not the outermost one in X where rows are staggered.
    let (low, high) =
        points.iter().fold((points[0], points[0]), |(l, h), point| (l.inf(point), h.sup(point)));
    Outline::rectangle(low - reach, high + reach)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::BrownConrady;

    fn photographed(translation: Vec3) -> Result<Photograph, RenderError> {
        let camera = Camera::pinhole(58.0, 58.0, 28.5, 18.0).with_distortion(BrownConrady::radial(0.1, 0.0));
        let board = Board::chessboard(4, 3, 10.0).expect("4 x 3 corners are a board");
        let pose = Pose { translation, ..Pose::identity() };
        photograph(&camera, (58, 37), &board, &pose, &Imaging::default())
    }

    #[test]
    fn a_pose_that_is_not_finite_is_refused() {
        for translation in
            [Vec3::new(0.0, f64::NAN, 50.0), Vec3::new(0.0, 0.0, f64::INFINITY), Vec3::repeat(f64::NAN)]
        {
            let refused = photographed(translation).unwrap_err();
            assert!(matches!(refused, RenderError::Setting { name: "pose", .. }), "{refused}");
        }
    }

    #[test]
    fn a_board_whose_pixels_are_beyond_all_numbers_is_refused() {
        let refused = photographed(Vec3::new(0.0, 0.0, 1e-150)).unwrap_err();
        assert!(matches!(refused, RenderError::TooNear { .. }), "{refused}");
    }

    #[test]
    fn a_board_before_the_lens_fills_the_image_with_one_mark() {
        let image = photographed(Vec3::new(1.0, 2.0, 1e-6)).unwrap().image;
        let first = image.get(0, 0);
        assert!((0..37).all(|y| (0..58).all(|x| (image.get(x, y) - first).abs() < 1e-6)), "{first}");
    }
}
