//! What follows from the answers of a scene? One check a property, and the figures of the report.

use super::check::{Check, Property};
use super::observed::{Found, Truth};
use super::scene::{Demand, Scene};
use calibench::distribution::{fisher_tail, normal_cdf};
use calibench::geometry::Vec2;
use calibench::io::significant;
use calibench_gate::judge::{Basis, Verdict};
use serde::Serialize;

/// An error that many photographs do not average out matters from here on, px: a tenth of what a good
/// detector errs by in one mark of one photograph, and what a calibration from a hundred photographs still
/// sees.
pub const MATTERS_PX: f64 = 0.02;
/// A mark is astray that is farther from its place than so many standard deviations of the bound, and than
/// half a pixel.
const FAR_SD: f64 = 10.0;
const FAR_PX: f64 = 0.5;

/// An answer to a photograph: nothing found, or a board.
pub(super) type Answered = Result<Option<Vec<Option<Vec2>>>, String>;

/// What a scene showed.
pub(super) struct Shown {
    pub scene: Scene,
    /// Photographs that were asked, with what is true of them.
    pub truths: Vec<Truth>,
    pub answers: Vec<Answered>,
    /// The first ones once more.
    pub again: Vec<Answered>,
    /// And turned by half a turn, their places turned back.
    pub turned: Vec<Answered>,
}

/// The figures of a scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figures {
    /// The kind of board.
    pub kind: super::protocol::Kind,
    /// The scene.
    pub scene: &'static str,
    /// What it is.
    pub about: &'static str,
    /// Photographs.
    pub photos: usize,
    /// Boards found.
    pub found: usize,
    /// Boards of which a mark is at another's place, or that are not there.
    pub wrong: usize,
    /// Marks of the boards found that are not seen.
    pub missing: usize,
    /// Root mean squared error of a coordinate, px.
    pub rms_px: Option<f64>,
    /// The same over that of the bound.
    pub over_bound: Option<f64>,
    /// Largest distance of a mark from its place, px.
    pub worst_px: Option<f64>,
    /// Mean error, px.
    pub bias_px: Option<[f64; 2]>,
    /// Amplitude of the part of the error that follows the place within a pixel, px.
    pub phase_px: Option<f64>,
}

impl Shown {
    /// The boards found, and that are there.
    fn found(&self) -> Vec<Found> {
        if self.scene.demand == Demand::Nothing {
            return Vec::new();
        }
        let each = self.truths.iter().zip(&self.answers);
        each.filter_map(|(truth, answer)| Some(Found::of(truth, answer.as_ref().ok()?.as_ref()?))).collect()
    }

    pub fn figures(&self) -> Figures {
        let found = self.found();
        let right: Vec<&Found> = found.iter().filter(|board| !board.is_wrong()).collect();
        let errors = || right.iter().flat_map(|board| &board.errors);
        let marks = errors().count();
        let some = |value: f64| (marks > 0).then_some(value);
        let square: f64 = errors().map(|e| e.px.norm_squared()).sum();
        let bounded = || errors().filter_map(|e| Some((e.px.norm_squared(), e.variance_px2?)));
        let over =
            (bounded().map(|(e, _)| e).sum::<f64>() / (2.0 * bounded().map(|(_, v)| v).sum::<f64>())).sqrt();
        let answered = self.answers.iter().filter(|a| matches!(a, Ok(Some(_)))).count();
        let mean = mean_errors(&right);
        Figures {
            kind: self.scene.kind,
            scene: self.scene.id,
            about: self.scene.about,
            photos: self.answers.len(),
            found: answered,
            wrong: answered - right.len(),
            missing: right.iter().map(|board| board.missing).sum(),
            rms_px: some((square / (2 * marks) as f64).sqrt()),
            over_bound: some(over).filter(|over| over.is_finite()),
            worst_px: some(errors().map(|e| e.px.norm()).fold(0.0, f64::max)),
            bias_px: (!mean.is_empty()).then(|| {
                let bias = mean.iter().sum::<Vec2>() / mean.len() as f64;
                [bias.x, bias.y]
            }),
            phase_px: pixel_phase(&right).map(|(amplitude, _)| amplitude),
        }
    }

    pub fn checks(&self) -> Vec<Check> {
        let mut checks = vec![self.protocol()];
        if self.scene.demand == Demand::Nothing {
            checks.push(self.nothing_invented());
            return checks;
        }
        let found = self.found();
        checks.push(self.recall(found.len()));
        if found.is_empty() {
            return checks;
        }
        checks.extend([self.places(&found), self.order(&found)]);
        if self.scene.demand == Demand::Found {
            let right: Vec<&Found> = found.iter().filter(|board| !board.is_wrong()).collect();
            checks.extend([self.strays(&right), self.bias(&right), self.phase(&right)]);
            checks.extend([self.turned(), self.determinism()]);
        }
        checks
    }

    fn check(&self, property: Property, basis: Basis, photos: usize, evidence: String) -> Check {
        let Scene { id, kind, .. } = self.scene;
        Check { property, kind, scene: id, basis, evidence, photos, verdict: Verdict::NotJudged }
    }

    fn protocol(&self) -> Check {
        let all = || self.answers.iter().chain(&self.again).chain(&self.turned);
        let broken: Vec<&String> = all().filter_map(|answer| answer.as_ref().err()).collect();
        let asked = all().count();
        let evidence = match broken.first() {
            None => format!("all {asked} answers are well formed"),
            Some(first) => format!("{} of {asked} broken, first: {first}", broken.len()),
        };
        self.check(Property::Protocol, Basis::Certain(broken.is_empty()), asked, evidence)
    }

    fn recall(&self, found: usize) -> Check {
        let asked = self.answers.len();
        let basis = match self.scene.demand {
            Demand::Found => Basis::Certain(found == asked),
            _ => Basis::Told,
        };
        self.check(Property::Found, basis, asked, format!("{found} of {asked} boards found"))
    }

    fn nothing_invented(&self) -> Check {
        let asked = self.answers.len();
        let invented = self.answers.iter().filter(|answer| matches!(answer, Ok(Some(_)))).count();
        let evidence = format!("{invented} boards in {asked} photographs without the one that was asked for");
        self.check(Property::NothingInvented, Basis::Certain(invented == 0), asked, evidence)
    }

    fn places(&self, found: &[Found]) -> Check {
        let wrong = found.iter().filter(|board| board.is_wrong()).count();
        let evidence = format!("{wrong} of {} boards with a mark at another's place", found.len());
        self.check(Property::Places, Basis::Certain(wrong == 0), found.len(), evidence)
    }

    fn order(&self, found: &[Found]) -> Check {
        let mirrored = found.iter().filter(|board| board.order.is_mirrored()).count();
        let evidence = format!("{mirrored} of {} boards numbered as in a mirror", found.len());
        self.check(Property::Order, Basis::Certain(mirrored == 0), found.len(), evidence)
    }

    fn strays(&self, right: &[&Found]) -> Check {
        let marks = || right.iter().flat_map(|board| &board.errors);
        let is_astray = |px: f64, variance: f64| px > FAR_PX && px > FAR_SD * variance.sqrt();
        let bounded = marks().filter_map(|e| Some((e.px.norm(), e.variance_px2?)));
        let astray: Vec<f64> = bounded.filter(|(px, v)| is_astray(*px, *v)).map(|(px, _)| px).collect();
        let evidence = match astray.iter().copied().reduce(f64::max) {
            None => format!("none of {} marks", marks().count()),
            Some(worst) => format!(
                "{} of {} marks, the farthest by {} px",
                astray.len(),
                marks().count(),
                significant(worst, 3)
            ),
        };
        self.check(Property::Strays, Basis::Certain(astray.is_empty()), right.len(), evidence)
    }

    /// The mean of the photographs' mean errors, against their spread: one-sided t-tests of more than what
    /// matters, for the worse of two coordinates.
    fn bias(&self, right: &[&Found]) -> Check {
        let means = mean_errors(right);
        let n = means.len();
        if n < 3 {
            return self.check(Property::Bias, Basis::Told, n, "too few photographs".to_string());
        }
        let bias = means.iter().sum::<Vec2>() / n as f64;
        let p = (0..2).map(|axis| {
            let deviations = means.iter().map(|mean| mean[axis] - bias[axis]);
            let square: f64 = deviations.map(|deviation| deviation * deviation).sum();
            let sd = (square / (n - 1) as f64 / n as f64).sqrt();
            let beyond = bias[axis].abs() - MATTERS_PX;
            if beyond <= 0.0 { 1.0 } else { 0.5 * fisher_tail(beyond * beyond / (sd * sd), 1, n - 1) }
        });
        let p = (2.0 * p.fold(1.0, f64::min)).min(1.0);
        let evidence =
            format!("the mean error is ({}, {}) px", significant(bias.x, 2), significant(bias.y, 2));
        self.check(Property::Bias, Basis::Chance(p), n, evidence)
    }

    fn phase(&self, right: &[&Found]) -> Check {
        let Some((amplitude, sd)) = pixel_phase(right) else {
            return self.check(Property::PixelPhase, Basis::Told, 0, "no mark was found".to_string());
        };
        let p = 1.0 - normal_cdf((amplitude - MATTERS_PX) / sd);
        let evidence =
            format!("an error of {} px follows the place within a pixel", significant(amplitude, 2));
        self.check(Property::PixelPhase, Basis::Chance(p), right.len(), evidence)
    }

    fn turned(&self) -> Check {
        let boards = |answers: &[Answered], i: usize| -> Option<Found> {
            Some(Found::of(&self.truths[i], answers[i].as_ref().ok()?.as_ref()?))
        };
        let mut worst: f64 = 0.0;
        let (mut pairs, mut lost) = (0, 0);
        for i in 0..self.turned.len() {
            match (boards(&self.answers, i), boards(&self.turned, i)) {
                (Some(first), Some(turned)) => {
                    pairs += 1;
                    worst = worst.max(largest_step(&first, &turned));
                }
                (None, None) => {}
                _ => lost += 1,
            }
        }
        let evidence = match lost {
            0 => format!("marks move by up to {} px", significant(worst, 2)),
            _ => format!("{lost} boards found one way round only"),
        };
        let holds = lost == 0 && worst <= MATTERS_PX;
        self.check(Property::Turned, Basis::Certain(holds), pairs + lost, evidence)
    }

    fn determinism(&self) -> Check {
        let bits = |answer: &Answered| -> Option<Vec<Option<[u64; 2]>>> {
            let marks = answer.as_ref().ok()?.as_ref()?;
            Some(marks.iter().map(|mark| mark.map(|p| [p.x.to_bits(), p.y.to_bits()])).collect())
        };
        let differ = self.again.iter().zip(&self.answers).filter(|(a, b)| bits(a) != bits(b)).count();
        let asked = self.again.len();
        let evidence = format!("{differ} of {asked} photographs got other bits the second time");
        self.check(Property::Determinism, Basis::Certain(differ == 0), asked, evidence)
    }
}

/// Largest distance between the places of a mark in two answers, px.
fn largest_step(first: &Found, other: &Found) -> f64 {
    let place_of = |at: &Vec2| other.errors.iter().find(|e| e.at == *at).map(|e| e.px);
    let steps = first.errors.iter().filter_map(|e| Some((place_of(&e.at)? - e.px).norm()));
    steps.fold(0.0, f64::max)
}

fn mean_errors(boards: &[&Found]) -> Vec<Vec2> {
    let mean = |board: &&Found| board.errors.iter().map(|e| e.px).sum::<Vec2>() / board.errors.len() as f64;
    boards.iter().filter(|board| !board.errors.is_empty()).map(mean).collect()
}

/// Amplitude of `e = a sin(2 pi x) + b cos(2 pi x)`, of both coordinates of all marks together, px, and its
/// standard deviation.
fn pixel_phase(boards: &[&Found]) -> Option<(f64, f64)> {
    let errors = || {
        let marks = boards.iter().flat_map(|board| &board.errors);
        marks.flat_map(|e| [(e.at.x, e.px.x), (e.at.y, e.px.y)])
    };
    let count = errors().count();
    if count == 0 {
        return None;
    }
    let n = count as f64;
    let mean = errors().map(|(_, e)| e).sum::<f64>() / n;
    let (mut a, mut b, mut square) = (0.0, 0.0, 0.0);
    for (at, error) in errors() {
        let (sine, cosine) = libm::sincos(std::f64::consts::TAU * at);
        let error = error - mean;
        a += 2.0 / n * error * sine;
        b += 2.0 / n * error * cosine;
        square += error * error;
    }
    Some((libm::hypot(a, b), (2.0 * square / (n * n)).sqrt()))
}
