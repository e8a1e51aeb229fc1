//! What is said between the gate and a solver? One JSON object a line: problems one way, answers the other.
//!
//! The page for authors of solvers is `adapters/PROTOCOL.md`; the schemas in `src/gate/schema` are those of
//! these types, which a test checks.

use super::strict;
use calibench::board::View;
use calibench::camera::{Camera, FreeParameters, Lens, Model};
use calibench::geometry::{Mat3, Pose, Vec2, Vec3};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A calibration problem: a line on the solver's standard input.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Problem {
    /// Name of the problem; the answer repeats it.
    pub id: String,
    /// Image width and height, px.
    pub image_size: [usize; 2],
    /// The lens model: `brown-conrady` where nothing stands, else one that the program named in its greeting.
    #[serde(default = "brown_conrady", skip_serializing_if = "is_brown_conrady")]
    pub model: String,
    /// What was seen in each photograph.
    pub views: Vec<ProblemView>,
    /// Names of the parameters to estimate, of the model's: `fx fy cx cy skew k1 k2 p1 p2 k3` for
    /// Brown-Conrady's.
    pub free: Vec<String>,
    /// Values of all the other parameters of the model. The answer must keep them.
    pub held: BTreeMap<String, f64>,
}

fn brown_conrady() -> String {
    Model::BrownConrady.name().to_string()
}

fn is_brown_conrady(model: &str) -> bool {
    model == Model::BrownConrady.name()
}

/// One photograph: `target[i]` was seen at `pixels[i]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ProblemView {
    /// Points of the target's plane Z = 0, in the target's unit.
    pub target: Vec<[f64; 2]>,
    /// Pixels (u right, v down; (0, 0) is the centre of the top-left pixel). `null` is a coordinate that was
    /// not measured: bad input, to be refused.
    #[cfg_attr(test, schemars(with = "Vec<[Option<f64>; 2]>"))]
    pub pixels: Vec<[f64; 2]>,
}

/// What became of a problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Status {
    /// The answer may be used.
    Ok,
    /// The data cannot determine the parameters, or are broken.
    Refused,
    /// The search did not end in a minimum.
    NotConverged,
    /// The program does not know a parameter that is free or held, or cannot hold it: no problem of that kind
    /// is judged.
    Unsupported,
}

/// The answer to a problem: a line on the solver's standard output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Answer {
    /// The problem's id.
    pub id: String,
    /// What became of it.
    pub status: Status,
    /// Value of every free parameter by name; held ones may be repeated. Needed when the status is `ok`.
    #[serde(default, deserialize_with = "strict::named", skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, f64>,
    /// One pose a view, camera from target.
    #[serde(default, deserialize_with = "strict::objects_if_any", skip_serializing_if = "Option::is_none")]
    pub poses: Option<Vec<AnswerPose>>,
    /// Standard deviation of every free parameter by name.
    #[serde(default, deserialize_with = "strict::named_if_any", skip_serializing_if = "Option::is_none")]
    pub standard_deviations: Option<BTreeMap<String, f64>>,
    /// Covariance of the free parameters; takes the place of `standard_deviations`.
    #[serde(default, deserialize_with = "strict::object_if_any", skip_serializing_if = "Option::is_none")]
    pub covariance: Option<AnswerCovariance>,
    /// Covariance of every pose, 6 x 6, row by row: of the small rotation vector `w`, rad, by which the
    /// answered rotation is wrong, `R_answered = exp([w]x) R_true`, about the camera's x, y, z, then of the
    /// translation along them in the target's unit; marginal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose_covariances: Option<Vec<Vec<Vec<f64>>>>,
    /// `sqrt(sum |r|^2 / N)` over all N points, px.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rmse: Option<f64>,
    /// What the user should be careful about; an answer with a warning is flagged, not silent.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// Why there is no estimate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub message: Option<String>,
}

/// `X_camera = R X_target + t`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct AnswerPose {
    /// R, row by row.
    pub rotation: [[f64; 3]; 3],
    /// t, in the target's unit.
    pub translation: [f64; 3],
}

/// A covariance matrix with the names of its rows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct AnswerCovariance {
    /// Names of rows and columns.
    pub parameters: Vec<String>,
    /// The matrix, row by row.
    pub matrix: Vec<Vec<f64>>,
}

impl Answer {
    /// A problem without an estimate.
    pub fn without_estimate(id: &str, status: Status, message: impl Into<String>) -> Answer {
        Answer {
            id: id.to_string(),
            status,
            parameters: BTreeMap::new(),
            poses: None,
            standard_deviations: None,
            covariance: None,
            pose_covariances: None,
            rmse: None,
            warnings: Vec::new(),
            message: Some(message.into()),
        }
    }
}

impl AnswerPose {
    /// The pose, camera from target.
    pub fn pose(&self) -> Pose {
        Pose {
            rotation: Mat3::from_fn(|r, c| self.rotation[r][c]),
            translation: Vec3::from(self.translation),
        }
    }
}

impl Problem {
    /// To find `free` from `views`, all else held at the values of `camera`.
    pub fn of_views(
        id: String,
        (width, height): (usize, usize),
        views: &[View],
        camera: &Camera<Lens>,
        free: FreeParameters,
    ) -> Problem {
        let pair = |p: &Vec2| [p.x, p.y];
        let view = |view: &View| ProblemView {
            target: view.points().iter().map(pair).collect(),
            pixels: view.pixels().iter().map(pair).collect(),
        };
        let held = camera.values().filter(|(parameter, _)| !free.contains(*parameter));
        Problem {
            id,
            image_size: [width, height],
            model: camera.distortion.model().name().to_string(),
            views: views.iter().map(view).collect(),
            free: free.iter().map(|p| p.name().to_string()).collect(),
            held: held.map(|(parameter, value)| (parameter.name().to_string(), value)).collect(),
        }
    }

    /// The lens model; Brown-Conrady's where its name is unknown, which no problem of the gate's has.
    pub fn lens_model(&self) -> Model {
        self.model.parse().unwrap_or_default()
    }

    /// Number of points over all views.
    pub fn points(&self) -> usize {
        self.views.iter().map(|view| view.pixels.len()).sum()
    }

    /// The line that is sent, without its end.
    pub fn to_line(&self) -> String {
        // A pixel that is not a number is written as `null`.
        serde_json::to_string(self).expect("a problem has text keys only")
    }
}

/// The JSON schemas of problem, answer and greeting, name and text.
pub fn schemas() -> [(&'static str, &'static str); 3] {
    [
        ("greeting.schema.json", include_str!("schema/greeting.schema.json")),
        ("problem.schema.json", include_str!("schema/problem.schema.json")),
        ("answer.schema.json", include_str!("schema/answer.schema.json")),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_schemas_are_those_of_the_types() {
        let greeting = schemars::schema_for!(crate::greeting::Greeting);
        let generated = [greeting, schemars::schema_for!(Problem), schemars::schema_for!(Answer)];
        for ((name, text), schema) in schemas().into_iter().zip(generated) {
            // Where a comment's line ends is no matter of the schema; its paragraphs are.
            let generated = format!("{:#}\n", schema.to_value());
            let paragraphs = generated.split(r"\n\n").map(|paragraph| paragraph.replace(r"\n", " "));
            let expected = paragraphs.collect::<Vec<_>>().join(r"\n\n");
            assert_eq!(text, expected, "src/gate/schema/{name} is not what the types say");
        }
    }

    #[test]
    fn an_unmeasured_coordinate_is_written_as_null() {
        let view = ProblemView { target: vec![[0.0, 1.0]], pixels: vec![[f64::NAN, 2.5]] };
        assert_eq!(serde_json::to_string(&view).unwrap(), r#"{"target":[[0.0,1.0]],"pixels":[[null,2.5]]}"#);
    }

    #[test]
    fn what_stands_twice_or_has_no_names_is_refused() {
        let read =
            |rest: &str| serde_json::from_str::<Answer>(&format!(r#"{{"id":"a","status":"ok",{rest}}}"#));
        for (rest, said) in [
            (r#""parameters":{"fx":1,"fx":2}"#, "`fx` stands twice"),
            (r#""parameters":[["fx",1]]"#, "expected an object of numbers by name"),
            (r#""standard_deviations":{"k1":1,"k1":1}"#, "`k1` stands twice"),
            (r#""covariance":[["fx"],[[1]]]"#, "expected an object"),
            (r#""poses":[[[[1,0,0],[0,1,0],[0,0,1]],[0,0,1]]]"#, "expected an object"),
        ] {
            let error = read(rest).unwrap_err().to_string();
            assert!(error.contains(said), "{rest}: {error}");
        }
        let none = read(r#""poses":null,"standard_deviations":null,"covariance":null"#).unwrap();
        assert!(none.poses.is_none() && none.standard_deviations.is_none() && none.covariance.is_none());
    }

    #[test]
    fn a_short_answer_is_enough() {
        let answer: Answer = serde_json::from_str(r#"{"id":"a","status":"refused","extra":1}"#).unwrap();
        assert_eq!((answer.status, answer.parameters.len()), (Status::Refused, 0));
    }

    #[test]
    fn a_problem_is_sent_in_one_line_and_read_as_it_was() {
        let view = ProblemView { target: vec![[0.1, 1.0]], pixels: vec![[1.0 / 3.0, -2.5]] };
        for model in ["brown-conrady", "kannala-brandt"] {
            let problem = Problem {
                id: "a\nb".into(),
                image_size: [640, 480],
                model: model.into(),
                views: vec![view.clone()],
                free: vec!["fx".into()],
                held: [("k1".to_string(), -0.1)].into(),
            };
            let line = problem.to_line();
            assert_eq!(serde_json::from_str::<Problem>(&line).unwrap(), problem);
            // A program that knows one lens only need not know the word.
            assert!(!line.contains('\n') && line.contains("model") == (model != "brown-conrady"), "{line}");
        }
    }
}
