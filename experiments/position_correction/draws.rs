//! One part: taught, found somewhere else, and its gripping points corrected.

use super::{DIRECTION, DISTANCES_MM, FAR_MM, FOUND_MM, LOSSES, MODELS, TAUGHT_MM};
use calibench::calibrate::Loss;
use calibench::downstream::{MapModel, Mark, Registration, RegistrationError, register};
use calibench::geometry::Vec2;
use calibench::synth::{Stream, StreamKey};
use calibench_harness::ExperimentError;
use nalgebra::{Matrix2, Rotation2};

/// Marks of a plate of 100 x 60 mm about their middle, mm.
pub(super) fn marks() -> Vec<Vec2> {
    [(-50.0, -30.0), (50.0, -30.0), (50.0, 30.0), (-50.0, 30.0), (0.0, -30.0), (0.0, 30.0)]
        .map(|(x, y)| Vec2::new(x, y))
        .to_vec()
}

/// The mark that goes astray: a corner.
pub(super) const STRAY_MARK: usize = 2;

/// How it goes astray, in the part's directions.
pub(super) fn stray(by_mm: f64) -> Vec2 {
    Vec2::new(-0.6, 0.8) * by_mm
}

pub(super) fn marks_without_stray() -> Vec<Vec2> {
    let mut marks = marks();
    marks.remove(STRAY_MARK);
    marks
}

/// How far a part is turned and moved from where it was taught.
const TURN_RAD: f64 = 0.25;
const SHIFT_MM: f64 = 30.0;

/// What is wrong with a found part.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Part {
    /// Relative growth.
    pub growth: f64,
    /// How far [`STRAY_MARK`] is found off its place, mm.
    pub stray_mm: f64,
}

/// Whether each trial is taught with errors of its own.
#[derive(Debug, Clone, Copy)]
pub(super) enum Teaching {
    Anew,
    Once,
}

/// A gripping point's corrected position.
#[derive(Debug, Clone, Copy)]
pub(super) struct Position {
    /// Corrected less true, mm.
    pub error: Vec2,
    /// The same in the part's directions.
    pub in_part: Vec2,
    /// As stated, mm^2.
    pub covariance: Matrix2<f64>,
}

impl Position {
    /// `e^T P^-1 e`.
    pub fn nees(&self) -> f64 {
        self.covariance.try_inverse().map_or(f64::NAN, |inverse| self.error.dot(&(inverse * self.error)))
    }
}

/// What is made of one part.
pub(super) struct Corrected {
    /// By map and by distance.
    pub by_model: [[Position; DISTANCES_MM.len()]; MODELS.len()],
    /// Error at the far point by loss, rigid map, mm; `None` where the fit did not settle.
    pub by_loss: [Option<Vec2>; LOSSES.len()],
    /// Chance of the rigid map's chi-squared.
    pub rigid_p_value: f64,
}

/// Teaches and finds one part, and corrects its gripping points in every way.
pub(super) fn corrected(
    part: &Part,
    teaching: Teaching,
    seed: u64,
    scenario: &str,
    trial: u64,
) -> Result<Corrected, ExperimentError> {
    let stream = |purpose, trial| Stream::open(StreamKey { seed, scenario, trial, purpose });
    let taught_trial = match teaching {
        Teaching::Anew => trial,
        Teaching::Once => 0,
    };
    let taught = noisy(&marks(), TAUGHT_MM, &mut stream("taught", taught_trial));
    let place = Place::draw(&mut stream("place", trial));
    let mut true_marks = marks();
    true_marks[STRAY_MARK] += stray(part.stray_mm);
    let lying: Vec<Vec2> = true_marks.iter().map(|m| place.of(m, part.growth)).collect();
    let found = noisy(&lying, FOUND_MM, &mut stream("found", trial));
    let fit = |model: MapModel, loss: Loss| {
        register(model, &taught, &found, loss).map_err(ExperimentError::at("registration"))
    };
    let position = |map: &Registration, distance_mm: f64| -> Result<Position, ExperimentError> {
        let point = DIRECTION * distance_mm;
        let error = map.apply(&point) - place.of(&point, part.growth);
        let stated = map.covariance_at(&point).ok_or("nothing tells the noise");
        let covariance = stated.map_err(ExperimentError::at("stated uncertainty"))?;
        Ok(Position { error, in_part: place.turn.inverse() * error, covariance })
    };
    let rigid = fit(MapModel::Rigid, Loss::Squares)?;
    let by_model = each(MODELS, |(_, model)| {
        let map = fit(model, Loss::Squares)?;
        each(DISTANCES_MM, |distance| position(&map, distance))
    })?;
    let by_loss = each(LOSSES, |(_, _, loss)| match register(MapModel::Rigid, &taught, &found, loss) {
        Ok(map) => Ok(Some(position(&map, FAR_MM)?.error)),
        Err(RegistrationError::NotConverged { .. }) => Ok(None),
        Err(error) => Err(ExperimentError::at("registration")(error)),
    })?;
    Ok(Corrected { by_model, by_loss, rigid_p_value: rigid.p_value().unwrap_or(f64::NAN) })
}

/// An array of results, or the first error.
fn each<A: Copy, B, const N: usize>(
    of: [A; N],
    make: impl Fn(A) -> Result<B, ExperimentError>,
) -> Result<[B; N], ExperimentError> {
    let made = of.into_iter().map(make).collect::<Result<Vec<B>, _>>()?;
    made.try_into().map_err(|_| ExperimentError::Input("an array of another length".to_string()))
}

/// Where a part lies.
struct Place {
    turn: Rotation2<f64>,
    shift: Vec2,
}

impl Place {
    fn draw(stream: &mut Stream) -> Place {
        let angle = stream.uniform_in(-TURN_RAD, TURN_RAD);
        let (sin, cos) = libm::sincos(angle);
        let turn = Rotation2::from_matrix_unchecked(Matrix2::new(cos, -sin, sin, cos));
        let mut shift = || stream.uniform_in(-SHIFT_MM, SHIFT_MM);
        Place { turn, shift: Vec2::new(shift(), shift()) }
    }

    /// Where a point of the part lies.
    fn of(&self, point: &Vec2, growth: f64) -> Vec2 {
        self.turn * (point * (1.0 + growth)) + self.shift
    }
}

fn noisy(points: &[Vec2], sd_mm: f64, stream: &mut Stream) -> Vec<Mark> {
    let mut error = || sd_mm * stream.normal();
    points.iter().map(|p| Mark::at(p.x + error(), p.y + error()).with_deviation(sd_mm)).collect()
}
