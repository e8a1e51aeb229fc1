//! What does a result say of a calibration, with everything that is known of its errors? Read back from
//! `result.json`: a camera with its poses and their joint covariance, or a map of a plane with its points.

use super::doubts::doubts;
use super::input::{InputError, MOST_SIDE_PX, MOST_TABLE_BYTES, read_regular_text};
use super::result_camera::{ResultError, parse_lens_camera};
use super::shown::{ShownPath, on_one_line};
use crate::calibrate::Covariance;
use crate::camera::{Camera, FreeParameters, Lens, Model, Parameter, UnknownParameter};
use crate::geometry::{Pose, Vec2, Vec3, rotation};
use crate::planar::{PlaneCalibration, PlaneError, PlaneModel, calibrate_plane};
use crate::validate::Estimate;
use nalgebra::{DMatrix, MatrixXx6, SMatrix};
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::path::Path;

/// A calibrated camera as its file tells of it.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct KnownCalibration {
    /// The camera, with a lens of any model.
    pub camera: Camera<Lens>,
    /// Width and height, px.
    pub image_size: Option<(usize, usize)>,
    /// Names of the views.
    pub views: Vec<String>,
    /// Their poses.
    pub cam_from_target: Vec<Pose>,
    /// Joint covariance of camera and poses.
    pub covariance: Covariance,
    /// Estimated noise of a pixel coordinate, px; with a robust loss the spread of all residuals, strays
    /// included.
    pub sigma_px: f64,
    /// The robust loss that residuals counted by, if one did.
    pub loss: Option<String>,
    /// Degrees of freedom of that noise.
    pub degrees_of_freedom: usize,
    /// Whether something was known of parameters beforehand, and counts in the covariance.
    pub has_priors: bool,
    /// Whether the board's shape was estimated: its marks then do not lie in a plane.
    pub has_board: bool,
    /// What the result itself says against its standard deviations: tests by them then mean nothing.
    pub doubts: Vec<String>,
}

impl KnownCalibration {
    /// The camera for what knows Brown-Conrady's lens only; `file` names the result in the error.
    ///
    /// # Errors
    /// [`ResultError::OtherModel`].
    pub fn brown_conrady(&self, file: &str) -> Result<Camera, ResultError> {
        let model = self.camera.distortion.model();
        self.camera.brown_conrady().ok_or(ResultError::OtherModel { file: file.into(), model })
    }

    /// The noise of a mark's coordinate, px; `file` names the result in the error.
    ///
    /// # Errors
    /// [`KnownError::RobustLoss`].
    pub fn noise_px(&self, file: &str) -> Result<f64, KnownError> {
        match &self.loss {
            None => Ok(self.sigma_px),
            Some(loss) => {
                Err(KnownError::RobustLoss { file: file.into(), loss: on_one_line(loss).into_owned() })
            }
        }
    }

    /// For what knows flat boards only; `file` names the result in the error.
    ///
    /// # Errors
    /// [`KnownError::BentBoard`].
    pub fn refuse_bent_board(&self, file: &str) -> Result<(), KnownError> {
        if self.has_board { Err(KnownError::BentBoard { file: file.into() }) } else { Ok(()) }
    }
}

impl<'a> From<&'a KnownCalibration> for Estimate<'a> {
    fn from(known: &'a KnownCalibration) -> Estimate<'a> {
        let KnownCalibration { camera, covariance, sigma_px, degrees_of_freedom, .. } = known;
        let degrees_of_freedom = Some(*degrees_of_freedom);
        Estimate { camera, covariance, sigma_px: *sigma_px, degrees_of_freedom }
    }
}

/// What a result is of.
#[derive(Debug, Clone, PartialEq)]
pub enum Known {
    /// A camera.
    Camera(Box<KnownCalibration>),
    /// A plane, seen by a camera of which nothing is known.
    Plane(Box<PlaneCalibration>),
}

/// Why a result does not serve.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum KnownError {
    /// The file cannot be read.
    #[error(transparent)]
    Input(#[from] InputError),
    /// No camera can be read from it.
    #[error(transparent)]
    Result(#[from] ResultError),
    /// It is not JSON, or a field is not what it should be.
    #[error("{file}:{}:{}: {cause}", cause.line(), cause.column())]
    Format {
        /// The file.
        file: String,
        /// What is wrong, with line and column.
        cause: serde_json::Error,
    },
    /// Without joint covariances nothing can be said about errors.
    #[error(
        "{file}: there is no joint covariance of camera and poses: calibrate again, and with enough marks that the residuals tell the noise"
    )]
    NoCovariance {
        /// The file.
        file: String,
    },
    /// The spread of residuals with strays among them is not the noise of the others.
    #[error(
        "{file}: it was calibrated with the loss {loss}, and what its residuals spread by counts strays too: it does not tell the noise of a mark"
    )]
    RobustLoss {
        /// The file.
        file: String,
        /// The loss.
        loss: String,
    },
    /// Its board is not flat.
    #[error("{file}: the board's shape was estimated, so that its marks lie in no plane")]
    BentBoard {
        /// The file.
        file: String,
    },
    /// A name in `free` is none.
    #[error("{file}: free: {cause}")]
    Free {
        /// The file.
        file: String,
        /// What is wrong.
        cause: UnknownParameter,
    },
    /// Numbers do not fit together.
    #[error("{file}: {what}")]
    Shape {
        /// The file.
        file: String,
        /// What is wrong.
        what: String,
    },
    /// The points of a plane give no map.
    #[error("{file}: {cause}")]
    Plane {
        /// The file.
        file: String,
        /// Why.
        cause: PlaneError,
    },
}

/// Fields of a camera's result that matter here; a number that is `null` is not known.
#[derive(Deserialize)]
#[serde(expecting = "a camera's result, an object with `camera` and `views`")]
struct CameraFields {
    #[serde(default)]
    free: Vec<String>,
    #[serde(default)]
    fy_per_fx: Option<f64>,
    #[serde(default)]
    covariance: Vec<Vec<Option<f64>>>,
    #[serde(default)]
    sigma_px: Option<f64>,
    #[serde(default)]
    loss: Option<String>,
    #[serde(default)]
    degrees_of_freedom: usize,
    #[serde(default)]
    views: Vec<ViewFields>,
    #[serde(default)]
    priors: Vec<IgnoredAny>,
    #[serde(default)]
    board: Option<IgnoredAny>,
    #[serde(default)]
    warnings: Vec<String>,
}

#[derive(Deserialize)]
#[serde(expecting = "a view, an object with `name` and its pose")]
struct ViewFields {
    name: String,
    rotation_vector_rad: [f64; 3],
    translation: [f64; 3],
    #[serde(default)]
    covariance: Vec<Vec<Option<f64>>>,
    #[serde(default)]
    covariance_with_camera: Vec<Vec<Option<f64>>>,
}

/// Fields of a plane's result.
#[derive(Deserialize)]
#[serde(expecting = "a plane's result, an object with `points`")]
struct PlaneFields {
    mode: String,
    points: Vec<PlanePoint>,
}

#[derive(Deserialize)]
#[serde(expecting = "a point of a plane, an object")]
struct PlanePoint {
    pixel: [f64; 2],
    world: [f64; 2],
}

/// What tells one result from the other.
#[derive(Deserialize)]
#[serde(expecting = "a result of calibench, an object")]
struct Kind {
    #[serde(default)]
    camera: Option<IgnoredAny>,
}

/// Reads a result.
///
/// # Errors
/// See [`KnownError`].
///
/// ```
/// use calibench::calibrate::{Settings, calibrate};
/// use calibench::io::{CalibrationFields, Known, read_known, write_atomically};
/// use calibench::synth::{Scene, Stream, StreamKey};
///
/// let mut stream = Stream::open(StreamKey { seed: 1, scenario: "known", trial: 0, purpose: "noise" });
/// let result = calibrate(&Scene::example().observe(0.1, &mut stream), &Settings::standard())?;
/// let names: Vec<String> = (1..=4).map(|view| format!("view {view}")).collect();
/// let file = std::env::temp_dir().join("calibench-example-known.json");
/// write_atomically(&file, CalibrationFields::of(&result.clone().into(), &names, None).to_json().as_bytes())?;
/// // All that tests of the calibration need comes back: poses and their joint covariance too.
/// let Known::Camera(known) = read_known(&file)? else { panic!("it is the result of a camera") };
/// assert_eq!(known.cam_from_target.len(), 4);
/// assert_eq!(known.covariance.intrinsics, result.covariance.intrinsics);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_known(path: &Path) -> Result<Known, KnownError> {
    parse_known(&path.shown(), &read_regular_text(path, MOST_TABLE_BYTES)?)
}

/// As [`read_known`], from text; `file` names it in errors.
///
/// # Errors
/// See [`KnownError`].
pub fn parse_known(file: &str, text: &str) -> Result<Known, KnownError> {
    let format = |cause| KnownError::Format { file: file.into(), cause };
    let kind: Kind = serde_json::from_str(text).map_err(format)?;
    if kind.camera.is_none() {
        let fields: PlaneFields = serde_json::from_str(text).map_err(format)?;
        return Ok(Known::Plane(Box::new(plane(file, &fields)?)));
    }
    let (camera, image_size) = parse_lens_camera(file, text)?;
    let fields: CameraFields = serde_json::from_str(text).map_err(format)?;
    let free = free_of(file, &fields.free, camera.distortion.model())?;
    let no_covariance = || KnownError::NoCovariance { file: file.into() };
    let covariance = covariance(free, &fields).ok_or_else(no_covariance)?;
    refuse_impossible(file, &covariance, &fields.views)?;
    let sigma_px = noise_of(file, fields.sigma_px, fields.degrees_of_freedom)?;
    Ok(Known::Camera(Box::new(KnownCalibration {
        camera,
        image_size,
        views: fields.views.iter().map(|view| view.name.clone()).collect(),
        cam_from_target: fields.views.iter().map(|view| pose(file, view)).collect::<Result<_, _>>()?,
        covariance,
        sigma_px,
        degrees_of_freedom: fields.degrees_of_freedom,
        has_priors: !fields.priors.is_empty(),
        has_board: fields.board.is_some(),
        loss: fields.loss,
        doubts: doubts(fields.warnings),
    })))
}

fn free_of(file: &str, names: &[String], model: Model) -> Result<FreeParameters, KnownError> {
    let wrong = |what: String| Err(KnownError::Shape { file: file.into(), what });
    let mut free = FreeParameters::NONE;
    for name in names {
        let parameter: Parameter =
            name.parse().map_err(|cause| KnownError::Free { file: file.into(), cause })?;
        if free.iter().last() >= Some(parameter) {
            return wrong(format!("free: {parameter} is out of order"));
        }
        if !model.parameters().any(|other| other == parameter) {
            return wrong(format!("free: the {model} model has no {parameter}"));
        }
        free = free.with(parameter);
    }
    Ok(free)
}

fn pose(file: &str, view: &ViewFields) -> Result<Pose, KnownError> {
    let pose = Pose {
        rotation: rotation::exp(&Vec3::from(view.rotation_vector_rad)),
        translation: Vec3::from(view.translation),
    };
    if pose.is_finite() {
        return Ok(pose);
    }
    Err(KnownError::Shape {
        file: file.into(),
        what: format!("the pose of view {} is not finite", view.name),
    })
}

/// The joint covariance; `None` where a block is missing, of another size or not finite.
fn covariance(free: FreeParameters, fields: &CameraFields) -> Option<Covariance> {
    let n = free.len();
    let block = |rows: &[Vec<Option<f64>>], of_rows: usize, columns: usize| -> Option<DMatrix<f64>> {
        let fits = rows.len() == of_rows && rows.iter().all(|row| row.len() == columns);
        let numbers: Option<Vec<f64>> = rows.iter().flatten().copied().collect();
        let numbers = numbers.filter(|numbers| fits && numbers.iter().all(|x| x.is_finite()))?;
        Some(DMatrix::from_row_slice(of_rows, columns, &numbers))
    };
    let of_pose = |view: &ViewFields| {
        let block = block(&view.covariance, 6, 6)?;
        Some(SMatrix::<f64, 6, 6>::from_fn(|i, j| block[(i, j)]))
    };
    let cross = |view: &ViewFields| {
        let block = block(&view.covariance_with_camera, n, 6)?;
        Some(MatrixXx6::from_fn(n, |i, j| block[(i, j)]))
    };
    Some(Covariance {
        free,
        fy_per_fx: fields.fy_per_fx,
        intrinsics: block(&fields.covariance, n, n)?,
        poses: fields.views.iter().map(of_pose).collect::<Option<_>>()?,
        cross: fields.views.iter().map(cross).collect::<Option<_>>()?,
    })
}

/// Part by which numbers of a covariance may contradict each other: far above what is lost in computing one.
const CONTRADICTION: f64 = 1e-3;

/// Refuses what is no covariance of anything, as after a damage of the file: a variance below nought, a half
/// that is not the other, and what varies together more than each does alone.
fn refuse_impossible(file: &str, covariance: &Covariance, views: &[ViewFields]) -> Result<(), KnownError> {
    let n = covariance.intrinsics.nrows();
    let refused = |of: String| {
        let what = format!(
            "the covariance {of} is none: variances of 0 or more, and correlations from -1 to 1, both ways the same"
        );
        Err(KnownError::Shape { file: file.into(), what })
    };
    let camera = |i: usize, j: usize| covariance.intrinsics[(i, j)];
    if !is_possible(n, &camera) {
        return refused("of the camera".into());
    }
    for ((view, pose), cross) in views.iter().zip(&covariance.poses).zip(&covariance.cross) {
        let joint = |i: usize, j: usize| match (i < n, j < n) {
            (true, true) => camera(i, j),
            (true, false) => cross[(i, j - n)],
            (false, true) => cross[(j, i - n)],
            (false, false) => pose[(i - n, j - n)],
        };
        if !is_possible(n + 6, &joint) {
            return refused(format!("of view '{}'", on_one_line(&view.name)));
        }
    }
    Ok(())
}

/// The noise by which the covariance is scaled; one that no photograph has, or that nothing tells, is
/// refused.
fn noise_of(file: &str, sigma_px: Option<f64>, degrees_of_freedom: usize) -> Result<f64, KnownError> {
    let what = match sigma_px {
        _ if degrees_of_freedom == 0 => {
            "degrees_of_freedom: 0, so that nothing tells its noise, nor how well it is known".to_string()
        }
        None => "sigma_px: missing, and the covariance is scaled by it".to_string(),
        Some(sigma_px) if sigma_px > MOST_SIDE_PX as f64 => {
            format!("sigma_px: {sigma_px} px is wider than any image")
        }
        Some(sigma_px) if sigma_px >= 0.0 => return Ok(sigma_px),
        Some(sigma_px) => format!("sigma_px: {sigma_px} px is no noise"),
    };
    Err(KnownError::Shape { file: file.into(), what })
}

/// A larger variance is a slip, in whatever unit, and its products soon are no numbers.
const MOST_VARIANCE: f64 = 1e60;

/// Whether a symmetric matrix may be a covariance, as far as its entries two by two tell: variances of 0 or
/// more, and correlations from -1 to 1, up to the digits that files keep.
pub(super) fn is_possible(size: usize, entry: &dyn Fn(usize, usize) -> f64) -> bool {
    let most = |i: usize, j: usize| entry(i, i).sqrt() * entry(j, j).sqrt();
    // A comparison with the root of a number below nought does not hold.
    (0..size).all(|i| {
        entry(i, i) <= MOST_VARIANCE
            && (0..=i).all(|j| {
                let (most, differ) = (most(i, j), (entry(i, j) - entry(j, i)).abs());
                entry(i, j).abs() <= (1.0 + CONTRADICTION) * most && differ <= CONTRADICTION * most
            })
    })
}

/// The map of a plane, from its points anew: a file keeps no covariance of it.
fn plane(file: &str, fields: &PlaneFields) -> Result<PlaneCalibration, KnownError> {
    let model = match fields.mode.as_str() {
        "planar" => PlaneModel::Affine,
        "tilted" => PlaneModel::Projective,
        "similarity" => PlaneModel::Similarity,
        other => {
            let what = format!("mode: `{other}` is none of planar, tilted, similarity");
            return Err(KnownError::Shape { file: file.into(), what });
        }
    };
    let pixels: Vec<Vec2> = fields.points.iter().map(|p| Vec2::from(p.pixel)).collect();
    let world: Vec<Vec2> = fields.points.iter().map(|p| Vec2::from(p.world)).collect();
    calibrate_plane(model, &pixels, &world).map_err(|cause| KnownError::Plane { file: file.into(), cause })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::{Calibration, Settings, calibrate};
    use crate::io::CalibrationFields;
    use crate::synth::{Scene, Stream, StreamKey};

    fn calibration(settings: &Settings) -> Calibration {
        let key = StreamKey { seed: 4, scenario: "known", trial: 0, purpose: "noise" };
        calibrate(&Scene::example().observe(0.1, &mut Stream::open(key)), settings).unwrap()
    }

    #[test]
    fn a_calibration_comes_back_from_its_file_with_its_covariance_to_the_bit() {
        let tied = Settings::standard().with_image_size((640, 480)).tie_focal_lengths(1.0);
        for settings in [Settings::standard().with_image_size((640, 480)), tied] {
            let calibration = calibration(&settings);
            let text = CalibrationFields::of(&calibration.clone().into(), &[], None).to_json();
            let Known::Camera(known) = parse_known("r.json", &text).unwrap() else { panic!("a camera") };
            assert_eq!(
                (known.camera, &known.covariance),
                (calibration.camera.into(), &calibration.covariance)
            );
            assert!(!known.has_priors && !known.has_board);
            assert_eq!(
                (known.sigma_px, known.degrees_of_freedom),
                (calibration.sigma_px, calibration.degrees_of_freedom)
            );
            for (a, b) in known.cam_from_target.iter().zip(&calibration.cam_from_target) {
                assert!((a.rotation - b.rotation).norm() < 1e-14 && a.translation == b.translation);
            }
        }
    }

    #[test]
    fn what_is_no_covariance_is_refused_by_the_view_it_is_of() {
        let of = calibration(&Settings::standard());
        let whole = CalibrationFields::of(&of.into(), &[], None);
        let said = |damage: &dyn Fn(&mut serde_json::Value)| {
            let mut value = serde_json::to_value(&whole).unwrap();
            damage(&mut value);
            parse_known("r.json", &value.to_string()).map(|_| ()).map_err(|error| error.to_string())
        };
        assert_eq!(said(&|_| ()), Ok(()));
        let refused = |of: &str| {
            Err(format!(
                "r.json: the covariance of {of} is none: variances of 0 or more, and correlations from -1 to 1, both ways the same"
            ))
        };
        let name = serde_json::to_value(&whole).unwrap()["views"][1]["name"].as_str().unwrap().to_string();
        let (camera, view) = (refused("the camera"), refused(&format!("view '{name}'")));
        assert_eq!(said(&|r| r["covariance"][0][0] = (-1.0).into()), camera);
        assert_eq!(said(&|r| r["covariance"][0][0] = 1e308.into()), camera);
        assert!(said(&|r| r["degrees_of_freedom"] = 0.into()).unwrap_err().contains("degrees_of_freedom: 0"));
        assert!(said(&|r| r["sigma_px"] = 1e308.into()).unwrap_err().contains("wider than any image"));
        assert!(
            said(&|r| r["sigma_px"] = (-0.5).into()).unwrap_err().contains("sigma_px: -0.5 px is no noise")
        );
        assert!(
            said(&|r| r["sigma_px"] = serde_json::Value::Null).unwrap_err().contains("sigma_px: missing")
        );
        assert_eq!(said(&|r| r["covariance"][0][1] = 1e9.into()), camera);
        assert_eq!(said(&|r| r["views"][1]["covariance_with_camera"][1][2] = 2e9.into()), view);
        assert_eq!(said(&|r| r["views"][1]["covariance"][4][3] = 0.0.into()), view);
    }

    #[test]
    fn results_without_what_is_needed_are_refused_by_name() {
        let fail = |text: &str| parse_known("r.json", text).unwrap_err().to_string();
        let camera = r#"{"camera": {"fx": 600, "fy": 600, "cx": 320, "cy": 240}"#;
        let view = r#""views": [{"name": "a", "rotation_vector_rad": [0,0,0], "translation": [0,0,1]}]"#;
        assert!(fail(&format!(r#"{camera}, "sigma_px": 0.1, {view}}}"#)).contains("no joint covariance"));
        assert!(fail(&format!(r#"{camera}, "free": ["cx", "fx"]}}"#)).contains("fx is out of order"));
        assert!(fail(&format!(r#"{camera}, "free": ["f"]}}"#)).contains("`f`"));
        assert!(
            fail(&format!(r#"{camera}, "free": ["k4"]}}"#)).contains("the brown-conrady model has no k4")
        );
        assert!(fail(r#"{"mode": "oblique", "points": []}"#).contains("oblique"));
        assert!(fail(r#"{"mode": "planar", "points": []}"#).contains("at least 4"));
        assert!(fail("{}").starts_with("r.json:1:"));
    }
}
