//! Where can the board be held? Every pose of a grid over the image, the distance, the tilt and the turn, at
//! which each mark is seen.

use crate::camera::{Camera, Imaging, Lens};
use crate::geometry::{Mat3, Pose, Vec2, Vec3, rotation};
use std::f64::consts::{PI, TAU};

/// Where the board may be held, and how fine the grid is.
#[derive(Debug, Clone, PartialEq)]
pub struct Reach {
    /// Width and height of the image, px.
    pub image_size: (usize, usize),
    /// How far from the image's border a mark has to stay, px.
    pub margin_px: f64,
    /// Distances of the board's middle from the camera, along its ray, in the target's unit.
    pub distances: Vec<f64>,
    /// Places of its middle in the image: columns and rows of a grid.
    pub places: (usize, usize),
    /// Tilts of the board against its line of sight, rad.
    pub tilts_rad: Vec<f64>,
    /// Number of directions in which it is tilted, evenly around.
    pub directions: usize,
    /// Number of turns in its own plane, evenly over half a turn: a board's other end tells the same.
    pub turns: usize,
}

/// Why nothing can be reached.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReachError {
    /// A number is none, or not one that can be.
    #[error("{what} must be {need}, got {got}")]
    Value {
        /// Which.
        what: &'static str,
        /// What it must be.
        need: &'static str,
        /// What it is.
        got: f64,
    },
    /// Fewer marks than fix a pose.
    #[error("a target needs at least 4 marks that are not on a line, got {0}")]
    TooFewMarks(usize),
    /// More poses than a search should try.
    #[error(
        "{poses} poses of {marks} marks are more than the {most} marks that are tried: describe the board by fewer marks, or take fewer poses"
    )]
    TooMany {
        /// Poses of the grid.
        poses: usize,
        /// Marks of the target.
        marks: usize,
        /// Most marks in all poses together.
        most: usize,
    },
    /// No pose shows every mark.
    #[error(
        "no pose of {tried} shows every mark of the board at least {margin_px} px inside the image: hold it further away, or turn it less"
    )]
    Nowhere {
        /// Poses tried.
        tried: usize,
        /// The margin, px.
        margin_px: f64,
    },
}

/// Most marks in all poses together: some minutes.
const MOST_MARKS: usize = 200_000_000;

/// A plane that is seen more flatly than this, rad from its face, shows marks that nobody finds.
const FLATTEST: f64 = 80.0 * PI / 180.0;

/// How many times as far from the axis, as an angle, the lens has to be one-to-one as a mark is seen: near
/// the angle at which it folds back nothing was calibrated, and the smallest error of the camera takes the
/// mark beyond it.
const FOLD_MARGIN: f64 = 1.1;

/// A pose of the board that can be reached.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Candidate {
    /// The pose.
    pub cam_from_target: Pose,
    /// Where the board's middle is seen, px.
    pub middle_px: Vec2,
    /// Its distance from the camera, in the target's unit.
    pub distance: f64,
    /// Tilt against the line of sight, rad.
    pub tilt_rad: f64,
    /// Direction in the image, rad from u to v, of the side that is tilted away from the camera.
    pub away_rad: f64,
    /// Turn in its own plane, rad, clockwise in the image.
    pub turn_rad: f64,
    /// Its place in the grid: distance, column, row, tilt, direction, turn.
    pub(super) step: [usize; 6],
}

impl Candidate {
    /// Whether the other is at most one step away in every respect, so that it says nothing new.
    pub(super) fn is_next_to(&self, other: &Candidate, reach: &Reach) -> bool {
        let around = [None, None, None, None, Some(reach.directions), Some(reach.turns)];
        let upright = |c: &Candidate| c.tilt_rad == 0.0;
        (0..6).all(|i| {
            let apart = self.step[i].abs_diff(other.step[i]);
            let apart = around[i].map_or(apart, |count| apart.min(count - apart.min(count)));
            // What faces the camera is tilted in no direction.
            apart <= 1 || (i == 4 && (upright(self) || upright(other)))
        })
    }
}

impl Reach {
    fn check(&self, marks: usize) -> Result<(), ReachError> {
        let wrong = |what, need, got| Err(ReachError::Value { what, need, got });
        if let Some(&got) = self.distances.iter().find(|d| !(d.is_finite() && **d > 0.0)) {
            return wrong("a distance", "above 0", got);
        }
        if let Some(&got) = self.tilts_rad.iter().find(|t| !(0.0..FLATTEST).contains(*t)) {
            return wrong("a tilt", "0 or more and less than 80 degrees (1.396 rad)", got);
        }
        if !(self.margin_px.is_finite() && self.margin_px >= 0.0) {
            return wrong("the margin", "0 px or more", self.margin_px);
        }
        if marks < 4 {
            return Err(ReachError::TooFewMarks(marks));
        }
        let counts = [self.distances.len(), self.places.0, self.places.1, self.turns];
        let tilted = self.tilts_rad.len().checked_mul(self.directions.max(1));
        let poses = counts.iter().try_fold(tilted.unwrap_or(usize::MAX), |all, n| all.checked_mul(*n));
        let poses = poses.unwrap_or(usize::MAX);
        if poses.checked_mul(marks).is_none_or(|all| all > MOST_MARKS) {
            return Err(ReachError::TooMany { poses, marks, most: MOST_MARKS });
        }
        Ok(())
    }

    /// Every pose of the grid, in its order, at which each mark is seen where the lens is one-to-one to a
    /// tenth further out, inside of the image's margin and not too flatly; with how many were tried.
    ///
    /// # Errors
    /// [`ReachError`].
    pub fn candidates(
        &self,
        camera: &Camera<Lens>,
        points: &[Vec2],
    ) -> Result<(Vec<Candidate>, usize), ReachError> {
        self.check(points.len())?;
        let is_one_to_one = camera.distortion.one_to_one();
        let middle = middle(points);
        let (mut found, mut tried) = (Vec::new(), 0);
        for (place, pixel) in self.pixels() {
            // A place that the lens does not see holds no board.
            let Ok(ray) = camera.ray(&pixel) else { continue };
            for (turned, step, tilt_rad, away_rad, turn_rad) in self.rotations() {
                let rotation = towards(&ray) * turned;
                for (at, &distance) in self.distances.iter().enumerate() {
                    tried += 1;
                    let translation = distance * ray - rotation * Vec3::new(middle.x, middle.y, 0.0);
                    let pose = Pose { rotation, translation };
                    if points.iter().all(|point| self.sees(camera, &is_one_to_one, &pose, point)) {
                        found.push(Candidate {
                            cam_from_target: pose,
                            middle_px: pixel,
                            distance,
                            tilt_rad,
                            away_rad,
                            turn_rad,
                            step: [at, place.0, place.1, step[0], step[1], step[2]],
                        });
                    }
                }
            }
        }
        match found.is_empty() {
            true => Err(ReachError::Nowhere { tried, margin_px: self.margin_px }),
            false => Ok((found, tried)),
        }
    }

    /// Places of the board's middle, in the middle of equal parts of the image.
    fn pixels(&self) -> impl Iterator<Item = ((usize, usize), Vec2)> + '_ {
        let (columns, rows) = self.places;
        let (width, height) = (self.image_size.0 as f64, self.image_size.1 as f64);
        let along = |i: usize, n: usize, side: f64| (i as f64 + 0.5) * side / n as f64 - 0.5;
        (0..rows).flat_map(move |row| {
            (0..columns).map(move |column| {
                ((column, row), Vec2::new(along(column, columns, width), along(row, rows, height)))
            })
        })
    }

    /// Rotations of a board on the optical axis: its turn, then its tilt; with its steps and their angles.
    /// What faces the camera is tilted in no direction.
    fn rotations(&self) -> impl Iterator<Item = (Mat3, [usize; 3], f64, f64, f64)> + '_ {
        let directions = |tilt: f64| if tilt == 0.0 { 1 } else { self.directions };
        self.tilts_rad.iter().enumerate().flat_map(move |(i, &tilt)| {
            (0..directions(tilt)).flat_map(move |j| {
                let away = TAU * j as f64 / self.directions as f64;
                let (sin, cos) = libm::sincos(away);
                let tilted = rotation::exp(&(tilt * Vec3::new(sin, -cos, 0.0)));
                (0..self.turns).map(move |k| {
                    let turn = PI * k as f64 / self.turns as f64;
                    (tilted * rotation::exp(&Vec3::new(0.0, 0.0, turn)), [i, j, k], tilt, away, turn)
                })
            })
        })
    }

    fn sees(
        &self,
        camera: &Camera<Lens>,
        is_one_to_one: &impl Fn(&Vec3) -> bool,
        pose: &Pose,
        point: &Vec2,
    ) -> bool {
        let seen = pose.apply(&Vec3::new(point.x, point.y, 0.0));
        let is_flat = pose.rotation.column(2).dot(&seen) < libm::cos(FLATTEST) * seen.norm();
        let inside =
            |x: f64, side: usize| (self.margin_px - 0.5..=side as f64 - 0.5 - self.margin_px).contains(&x);
        !is_flat
            && is_one_to_one(&further_out(&seen))
            && Lens::image(camera, &seen)
                .is_some_and(|p| inside(p.x, self.image_size.0) && inside(p.y, self.image_size.1))
    }
}

/// A point in the direction [`FOLD_MARGIN`] times as far from the axis.
fn further_out(point: &Vec3) -> Vec3 {
    let radius = point.xy().norm();
    if radius == 0.0 {
        return *point;
    }
    let (sin, cos) = libm::sincos((FOLD_MARGIN * libm::atan2(radius, point.z)).min(PI));
    Vec3::new(point.x / radius * sin, point.y / radius * sin, cos)
}

/// Middle of the rectangle that holds all marks.
fn middle(points: &[Vec2]) -> Vec2 {
    let low = points.iter().fold(Vec2::repeat(f64::INFINITY), |low, p| low.inf(p));
    let high = points.iter().fold(Vec2::repeat(f64::NEG_INFINITY), |high, p| high.sup(p));
    0.5 * (low + high)
}

/// The shortest rotation that takes the optical axis to a ray of length 1.
fn towards(ray: &Vec3) -> Mat3 {
    let axis = Vec3::new(-ray.y, ray.x, 0.0);
    let sin = axis.norm();
    if sin == 0.0 {
        return Mat3::identity();
    }
    rotation::exp(&(axis * (libm::atan2(sin, ray.z) / sin)))
}
