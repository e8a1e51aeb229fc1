//! Can the answer be read as an estimate? Counts, names and numbers are checked before anything is judged.

use super::covariance_form::{self, CovarianceFault};
use super::protocol::{Answer, AnswerCovariance, AnswerPose, Problem, Status};
use super::quoted::quoted;
use super::strict::Object;
use calibench::camera::{Camera, FreeParameters, Lens, Parameter};
use calibench::geometry::Pose;
use nalgebra::{DMatrix, Matrix6};
use std::collections::{BTreeMap, BTreeSet};

/// An answer that keeps the protocol.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Estimate {
    /// Estimated and held parameters.
    pub camera: Camera<Lens>,
    /// One pose a view, if they were given.
    pub cam_from_target: Option<Vec<Pose>>,
    /// Standard deviations of the free parameters, in order.
    pub standard_deviations: Option<Vec<f64>>,
    /// Covariance of the free parameters, in order.
    pub covariance: Option<DMatrix<f64>>,
    /// What is wrong with its form.
    pub covariance_fault: Option<CovarianceFault>,
    /// Covariance of every pose.
    pub pose_covariances: Option<Vec<Matrix6<f64>>>,
    /// What is wrong with the form of the first of them that can be none.
    pub pose_covariance_fault: Option<CovarianceFault>,
    /// Reprojection error as the solver states it, px.
    pub rmse_px: Option<f64>,
    /// What the solver warns of.
    pub warnings: Vec<String>,
    /// A held parameter whose value was changed: name, wanted, got.
    pub held_changed: Option<(Parameter, f64, f64)>,
}

/// What became of a problem.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// An estimate that claims to be usable.
    Estimate(Box<Estimate>),
    /// The solver gave no estimate and said so.
    Refused(String),
    /// The solver is not made for problems of this kind, and said so.
    Unsupported(String),
    /// No answer, or one that breaks the protocol.
    Broken(Breakage),
}

/// How the protocol was broken.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Breakage {
    /// No answer in time; the process was ended and started again.
    #[error("no answer within {seconds} s")]
    Timeout {
        /// The limit.
        seconds: f64,
    },
    /// The process ended.
    #[error("the process ended ({how}){}", if stderr.is_empty() { String::new() } else { format!(": {stderr}") })]
    Crashed {
        /// Exit status.
        how: String,
        /// The end of its standard error.
        stderr: String,
    },
    /// A line that is no answer.
    #[error("not an answer: {reason}: `{line}`")]
    Garbage {
        /// What is wrong with it.
        reason: String,
        /// Its beginning.
        line: String,
    },
    /// A line longer than any answer.
    #[error("a line of more than {limit} bytes")]
    TooLong {
        /// Bytes that a line may have.
        limit: usize,
    },
    /// Line after line, and none of them the answer.
    #[error("{lines} lines and no answer among them; the first: {first}")]
    Flood {
        /// Lines that were read.
        lines: usize,
        /// What was wrong with the first.
        first: String,
    },
    /// The answer to another problem.
    #[error("the answer is for `{got}`")]
    WrongId {
        /// Its id.
        got: String,
    },
    /// A list has another length.
    #[error("{what}: {need} needed, got {got}")]
    Count {
        /// Of what.
        what: &'static str,
        /// Wanted.
        need: usize,
        /// Given.
        got: usize,
    },
    /// A number is NaN, infinite, or impossible.
    #[error("{what} is {value}")]
    BadNumber {
        /// Of what.
        what: String,
        /// The number.
        value: f64,
    },
    /// A value is missing.
    #[error("{what} is missing")]
    Missing {
        /// Which.
        what: String,
    },
    /// A name stands twice where every name may stand once.
    #[error("{what} stands twice")]
    Repeated {
        /// What.
        what: String,
    },
    /// Two answers to one problem, in files.
    #[error("answered more than once")]
    Twice,
    /// What a record says of a question without an answer.
    #[error("{0}")]
    Recorded(String),
    /// The solver broke too often and was not asked any more.
    #[error("not asked: {0}")]
    NotAsked(String),
}

/// The free parameters of a problem; names that are unknown are left out.
pub fn free_of(problem: &Problem) -> FreeParameters {
    problem
        .free
        .iter()
        .filter_map(|name| name.parse::<Parameter>().ok())
        .fold(FreeParameters::NONE, |free, p| free.with(p))
}

/// Characters of a wrong line that are quoted.
pub(super) const LINE_HEAD: usize = 80;

/// An answer, or why the line is none.
pub fn read_line(line: &str) -> Result<Answer, Breakage> {
    serde_json::from_str(line).map(|Object(answer)| answer).map_err(|error| {
        // JSON has no NaN; most languages write one all the same.
        for word in ["NaN", "Infinity", "-Infinity", "nan", "inf"] {
            let stands = |before: &str| line.contains(&format!("{before}{word}"));
            if line.trim_start().starts_with('{') && [": ", ":", "[", ", "].into_iter().any(stands) {
                return Breakage::BadNumber { what: "a number of the answer".into(), value: f64::NAN };
            }
        }
        let head: String = line.chars().take(LINE_HEAD).collect();
        Breakage::Garbage { reason: quoted(&error.to_string()), line: quoted(&head) }
    })
}

/// Warnings that are kept.
const MOST_WARNINGS: usize = 20;

/// Of an answer what can mean anything for its problem: names that are parameters, the beginnings of texts,
/// and lists no longer than they may be. A run holds as many answers as it asks questions, and a line may
/// have a megabyte.
///
/// # Errors
/// Lists that are too long, or a covariance that is no square.
pub(super) fn within(problem: &Problem, answer: Answer) -> Result<Answer, Breakage> {
    let message = answer.message.as_deref().map(quoted);
    if answer.status != Status::Ok {
        return Ok(Answer { message, ..Answer::without_estimate(&answer.id, answer.status, "") });
    }
    let views = problem.views.len();
    at_most("poses", views, answer.poses.as_ref().map_or(0, Vec::len))?;
    for matrix in answer.pose_covariances.iter().flatten() {
        sides(matrix).try_for_each(|length| at_most("rows and columns of a pose covariance", 6, length))?;
    }
    at_most("pose covariances", views, answer.pose_covariances.as_ref().map_or(0, Vec::len))?;
    Ok(Answer {
        parameters: of_parameters(answer.parameters),
        standard_deviations: answer.standard_deviations.map(of_parameters),
        covariance: answer.covariance.map(covariance_of_parameters).transpose()?,
        warnings: answer.warnings.iter().take(MOST_WARNINGS).map(|warning| quoted(warning)).collect(),
        message,
        ..answer
    })
}

fn at_most(what: &'static str, need: usize, got: usize) -> Result<(), Breakage> {
    if got > need { Err(Breakage::Count { what, need, got }) } else { Ok(()) }
}

/// Numbers of rows and of each row's entries.
fn sides(matrix: &[Vec<f64>]) -> impl Iterator<Item = usize> {
    std::iter::once(matrix.len()).chain(matrix.iter().map(Vec::len))
}

fn is_parameter(name: &str) -> bool {
    name.parse::<Parameter>().is_ok()
}

fn of_parameters(mut named: BTreeMap<String, f64>) -> BTreeMap<String, f64> {
    named.retain(|name, _| is_parameter(name));
    named
}

fn covariance_of_parameters(given: AnswerCovariance) -> Result<AnswerCovariance, Breakage> {
    refuse_oblong(&given)?;
    let mut known = BTreeSet::new();
    if let Some(name) = given.parameters.iter().find(|name| !known.insert(name.as_str())) {
        return Err(Breakage::Repeated { what: format!("row {} of the covariance", quoted(name)) });
    }
    let kept: Vec<usize> =
        (0..given.parameters.len()).filter(|&i| is_parameter(&given.parameters[i])).collect();
    Ok(AnswerCovariance {
        parameters: kept.iter().map(|&i| given.parameters[i].clone()).collect(),
        matrix: kept.iter().map(|&i| kept.iter().map(|&j| given.matrix[i][j]).collect()).collect(),
    })
}

fn refuse_oblong(given: &AnswerCovariance) -> Result<(), Breakage> {
    let need = given.parameters.len();
    match sides(&given.matrix).find(|&length| length != need) {
        Some(got) => Err(Breakage::Count { what: "rows and columns of the covariance", need, got }),
        None => Ok(()),
    }
}

/// For which problem a line is meant, even where it is no answer.
pub fn id_in(line: &str) -> Option<&str> {
    let after_key = line.trim_start().strip_prefix('{')?.split_once("\"id\"")?.1;
    after_key.trim_start().strip_prefix(':')?.trim_start().strip_prefix('"')?.split('"').next()
}

/// Reads an answer as the outcome of a problem.
pub fn accept(problem: &Problem, answer: Answer) -> Outcome {
    if answer.id != problem.id {
        return Outcome::Broken(Breakage::WrongId { got: quoted(&answer.id) });
    }
    match answer.status {
        Status::Ok => {
            estimate(problem, answer).map_or_else(Outcome::Broken, |e| Outcome::Estimate(Box::new(e)))
        }
        Status::Unsupported => {
            Outcome::Unsupported(quoted(answer.message.as_deref().unwrap_or("no reason given")))
        }
        Status::Refused => Outcome::Refused(quoted(answer.message.as_deref().unwrap_or("refused"))),
        Status::NotConverged => Outcome::Refused(format!(
            "not converged: {}",
            quoted(answer.message.as_deref().unwrap_or_default())
        )),
    }
}

fn estimate(problem: &Problem, answer: Answer) -> Result<Estimate, Breakage> {
    let free = free_of(problem);
    let (camera, held_changed) = camera(problem, &answer, free)?;
    let covariance = covariance(&answer, free)?;
    let stated = answer.standard_deviations.as_ref().map(|named| deviations(named, free)).transpose()?;
    let covariance_fault = covariance.as_ref().and_then(|c| covariance_form::fault(c, stated.as_deref()));
    let of_diagonal = |c: &DMatrix<f64>| c.diagonal().iter().map(|v| v.sqrt()).collect();
    let standard_deviations = stated.or_else(|| covariance.as_ref().map(of_diagonal));
    let rmse_px = answer.rmse.map(|x| positive("rmse", x)).transpose()?;
    let pose_covariances = answer.pose_covariances.as_deref();
    let pose_covariances =
        pose_covariances.map(|given| self::pose_covariances(given, problem.views.len())).transpose()?;
    let form = |c: &Matrix6<f64>| covariance_form::fault(&DMatrix::from_fn(6, 6, |i, j| c[(i, j)]), None);
    let pose_covariance_fault = pose_covariances.iter().flatten().find_map(form);
    let cam_from_target = answer.poses.map(|poses| self::poses(&poses, problem.views.len())).transpose()?;
    Ok(Estimate {
        camera,
        cam_from_target,
        standard_deviations,
        covariance,
        covariance_fault,
        pose_covariances,
        pose_covariance_fault,
        rmse_px,
        warnings: answer.warnings,
        held_changed,
    })
}

type HeldChange = Option<(Parameter, f64, f64)>;

fn camera(
    problem: &Problem,
    answer: &Answer,
    free: FreeParameters,
) -> Result<(Camera<Lens>, HeldChange), Breakage> {
    let model = problem.lens_model();
    let mut camera = Camera::with_lens(0.0, 0.0, 0.0, 0.0, Lens::ideal(model));
    let mut changed = None;
    for parameter in model.parameters() {
        let given = answer.parameters.get(parameter.name()).copied();
        let held = problem.held.get(parameter.name()).copied();
        let value = match (free.contains(parameter), given, held) {
            (true, Some(value), _) => finite(parameter.name(), value)?,
            (true, None, _) => return Err(Breakage::Missing { what: format!("parameter {parameter}") }),
            (false, given, held) => {
                let wanted = held.unwrap_or(0.0);
                if let Some(got) = given.filter(|got| *got != wanted) {
                    changed = Some((parameter, wanted, finite(parameter.name(), got)?));
                }
                given.unwrap_or(wanted)
            }
        };
        camera = camera.with_value(parameter, value).unwrap_or(camera);
    }
    Ok((camera, changed))
}

fn covariance(answer: &Answer, free: FreeParameters) -> Result<Option<DMatrix<f64>>, Breakage> {
    let Some(given) = &answer.covariance else { return Ok(None) };
    refuse_oblong(given)?;
    let place = |parameter: Parameter| {
        given
            .parameters
            .iter()
            .position(|name| name == parameter.name())
            .ok_or_else(|| Breakage::Missing { what: format!("covariance of {parameter}") })
    };
    let places = free.iter().map(place).collect::<Result<Vec<usize>, _>>()?;
    let matrix = DMatrix::from_fn(places.len(), places.len(), |i, j| given.matrix[places[i]][places[j]]);
    match matrix.iter().find(|x| !x.is_finite()) {
        Some(&value) => Err(Breakage::BadNumber { what: "an entry of the covariance".into(), value }),
        None => Ok(Some(matrix)),
    }
}

fn deviations(named: &BTreeMap<String, f64>, free: FreeParameters) -> Result<Vec<f64>, Breakage> {
    free.iter()
        .map(|parameter| {
            let what = format!("standard deviation of {parameter}");
            let value = named.get(parameter.name()).ok_or(Breakage::Missing { what: what.clone() })?;
            positive(&what, *value)
        })
        .collect()
}

fn poses(given: &[AnswerPose], need: usize) -> Result<Vec<Pose>, Breakage> {
    if given.len() != need {
        return Err(Breakage::Count { what: "poses", need, got: given.len() });
    }
    given
        .iter()
        .enumerate()
        .map(|(i, pose)| {
            let pose = pose.pose();
            let bad = Breakage::BadNumber { what: format!("a number of pose {i}"), value: f64::NAN };
            pose.is_finite().then_some(pose).ok_or(bad)
        })
        .collect()
}

fn pose_covariances(given: &[Vec<Vec<f64>>], need: usize) -> Result<Vec<Matrix6<f64>>, Breakage> {
    if given.len() != need {
        return Err(Breakage::Count { what: "pose covariances", need, got: given.len() });
    }
    let of_pose = |(i, matrix): (usize, &Vec<Vec<f64>>)| {
        if let Some(got) = sides(matrix).find(|&length| length != 6) {
            return Err(Breakage::Count { what: "rows and columns of a pose covariance", need: 6, got });
        }
        let read = Matrix6::from_fn(|row, column| matrix[row][column]);
        match read.iter().find(|x| !x.is_finite()) {
            Some(&value) => {
                Err(Breakage::BadNumber { what: format!("an entry of pose covariance {i}"), value })
            }
            None => Ok(read),
        }
    };
    given.iter().enumerate().map(of_pose).collect()
}

fn finite(what: &str, value: f64) -> Result<f64, Breakage> {
    if value.is_finite() { Ok(value) } else { Err(Breakage::BadNumber { what: what.to_string(), value }) }
}

fn positive(what: &str, value: f64) -> Result<f64, Breakage> {
    finite(what, value)?;
    if value >= 0.0 { Ok(value) } else { Err(Breakage::BadNumber { what: what.to_string(), value }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::ProblemView;

    fn problem() -> Problem {
        Problem {
            id: "a".into(),
            image_size: [640, 480],
            model: "brown-conrady".into(),
            views: vec![ProblemView { target: vec![[0.0, 0.0]], pixels: vec![[0.0, 0.0]] }],
            free: vec!["fx".into()],
            held: [("cx".to_string(), 320.0)].into(),
        }
    }

    fn read(line: &str) -> Outcome {
        accept(&problem(), serde_json::from_str(line).unwrap())
    }

    #[test]
    fn broken_answers_are_named() {
        let broken = |line: &str| match read(line) {
            Outcome::Broken(breakage) => breakage.to_string(),
            other => panic!("{other:?}"),
        };
        assert_eq!(broken(r#"{"id":"b","status":"ok"}"#), "the answer is for `b`");
        assert_eq!(broken(r#"{"id":"a","status":"ok"}"#), "parameter fx is missing");
        assert_eq!(
            broken(r#"{"id":"a","status":"ok","parameters":{"fx":1},"poses":[]}"#),
            "poses: 1 needed, got 0"
        );
        assert_eq!(broken(r#"{"id":"a","status":"ok","parameters":{"fx":1},"rmse":-1}"#), "rmse is -1");
        let line = r#"{"id":"a","status":"ok","parameters":{"fx":1},"covariance":{"parameters":["fx"],"matrix":[]}}"#;
        assert_eq!(broken(line), "rows and columns of the covariance: 1 needed, got 0");
        let posed = |covariances: &str| {
            let start = r#"{"id":"a","status":"ok","parameters":{"fx":1},"pose_covariances":"#;
            broken(&format!("{start}{covariances}}}"))
        };
        assert_eq!(posed("[]"), "pose covariances: 1 needed, got 0");
        assert_eq!(posed("[[[1]]]"), "rows and columns of a pose covariance: 6 needed, got 1");
    }

    #[test]
    fn a_line_that_is_no_json_tells_its_problem_and_its_fault() {
        for line in [
            r#"{"id": "a.1", "rmse": NaN}"#,
            r#"{"rmse":NaN,"id":"a.1"}"#,
            r#"{"x":[1,-Infinity],"id" : "a.1""#,
        ] {
            assert_eq!(id_in(line), Some("a.1"), "{line}");
        }
        assert!(matches!(read_line(r#"{"id":"a","x":[NaN]}"#), Err(Breakage::BadNumber { .. })));
        assert!(matches!(read_line(r#"{"id":"a","x":}"#), Err(Breakage::Garbage { .. })));
        assert_eq!((id_in("hello"), id_in(r#"{"id":7}"#)), (None, None));
    }

    #[test]
    fn what_no_problem_asks_for_is_not_held() {
        let read = |line: &str| within(&problem(), serde_json::from_str(line).unwrap());
        let long = "x".repeat(900_000);
        let warned = format!("[{}]", vec![format!("\"{long}\""); 30].join(","));
        let line = format!(
            r#"{{"id":"a","status":"ok","parameters":{{"fx":1,"{long}":2}},"standard_deviations":{{"fx":0.5,"q":1}},
                "covariance":{{"parameters":["q","fx","r"],"matrix":[[1,2,3],[2,0.25,5],[3,5,6]]}},"warnings":{warned},"message":"{long}"}}"#
        );
        let kept = read(&line).unwrap();
        assert_eq!(kept.parameters, [("fx".to_string(), 1.0)].into());
        assert_eq!(kept.standard_deviations, Some([("fx".to_string(), 0.5)].into()));
        assert_eq!(
            kept.covariance,
            Some(AnswerCovariance { parameters: vec!["fx".into()], matrix: vec![vec![0.25]] })
        );
        assert_eq!(
            (kept.warnings.len(), serde_json::to_string(&kept).unwrap().len() < 10_000),
            (MOST_WARNINGS, true)
        );
        // It means what it meant.
        let whole = accept(&problem(), serde_json::from_str(&line).unwrap());
        let (Outcome::Estimate(whole), Outcome::Estimate(kept)) = (whole, accept(&problem(), kept)) else {
            panic!("both keep the protocol")
        };
        assert_eq!(*kept, Estimate { warnings: kept.warnings.clone(), ..*whole });
        let refused = format!(r#"{{"id":"a","status":"refused","poses":[],"message":"{long}"}}"#);
        let kept = read(&refused).unwrap();
        assert_eq!((kept.poses.is_none(), kept.message.unwrap().chars().count()), (true, 401));
        let many = |what: &str, list: &str| {
            let line = format!(r#"{{"id":"a","status":"ok","parameters":{{"fx":1}},"{what}":[{list}]}}"#);
            (read(&line).unwrap_err().to_string(), accept(&problem(), serde_json::from_str(&line).unwrap()))
        };
        let pose = r#"{"rotation":[[1,0,0],[0,1,0],[0,0,1]],"translation":[0,0,1]}"#;
        for (what, list) in [
            ("poses", [pose; 9].join(",")),
            ("pose_covariances", "[[1]],[[1]]".into()),
            ("pose_covariances", "[[1,2,3,4,5,6,7]]".into()),
        ] {
            let (said, Outcome::Broken(breakage)) = many(what, &list) else { panic!("{what} are too many") };
            assert!(said.contains(" needed, got "), "{said}");
            assert_eq!(said.contains("pose covariance"), breakage.to_string().contains("pose covariance"));
        }
    }

    #[test]
    fn a_held_value_that_moved_is_seen() {
        let Outcome::Estimate(estimate) = read(r#"{"id":"a","status":"ok","parameters":{"fx":2,"cx":321}}"#)
        else {
            panic!("the answer keeps the protocol");
        };
        assert_eq!(estimate.held_changed, Some((Parameter::Cx, 320.0, 321.0)));
    }
}
