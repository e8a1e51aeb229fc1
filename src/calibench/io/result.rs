//! How is a calibration kept and handed on? `result.json`: the camera by its parameters' names, with all that
//! is known of it.

use super::loss::loss_to_text;
use crate::calibrate::{
    BoardShape, Certificate, Compared, LensCalibration, Loss, Prior, ProfileInterval, in_words,
};
use crate::camera::{Camera, Lens, Model, Parameter};
use crate::geometry::{Vec2, rotation};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A camera with a lens of any model, by its parameters' names; `model` says which, and a camera without one
/// has Brown-Conrady's lens. Coefficients left out of a file are 0, and any other name is refused: without it
/// this would be another camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LensFields(pub Camera<Lens>);

impl Serialize for LensFields {
    fn serialize<S: serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeMap;
        let mut map = to.serialize_map(None)?;
        let model = self.0.distortion.model();
        if model != Model::BrownConrady {
            map.serialize_entry("model", model.name())?;
        }
        for (parameter, value) in self.0.values() {
            map.serialize_entry(parameter.name(), &value)?;
        }
        map.end()
    }
}

/// Reads what [`Serialize`] writes, in any order.
impl<'de> Deserialize<'de> for LensFields {
    fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<LensFields, D::Error> {
        from.deserialize_map(NamedParameters)
    }
}

struct NamedParameters;

impl<'de> serde::de::Visitor<'de> for NamedParameters {
    type Value = LensFields;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a camera: fx, fy, cx, cy and the coefficients of its lens, with `model` if that is not brown-conrady")
    }

    fn visit_map<A: serde::de::MapAccess<'de>>(self, mut map: A) -> Result<LensFields, A::Error> {
        use serde::de::Error;
        let (mut model, mut named) = (None, Vec::<(Parameter, f64)>::new());
        while let Some(name) = map.next_key::<String>()? {
            if name == "model" {
                if model.is_some() {
                    return Err(A::Error::custom("model is given twice"));
                }
                let name: String = map.next_value()?;
                model = Some(name.parse::<Model>().map_err(A::Error::custom)?);
                continue;
            }
            let parameter = name.parse().map_err(A::Error::custom)?;
            if named.iter().any(|(other, _)| *other == parameter) {
                return Err(A::Error::custom(format!("{name} is given twice")));
            }
            named.push((parameter, map.next_value()?));
        }
        let model = model.unwrap_or(Model::BrownConrady);
        for needed in [Parameter::Fx, Parameter::Fy, Parameter::Cx, Parameter::Cy] {
            if !named.iter().any(|(parameter, _)| *parameter == needed) {
                return Err(A::Error::custom(format!("missing field `{needed}`")));
            }
        }
        let empty = Camera::with_lens(f64::NAN, f64::NAN, f64::NAN, f64::NAN, Lens::ideal(model));
        let with = |camera: Camera<Lens>, (parameter, value): (Parameter, f64)| {
            let refused = || A::Error::custom(format!("the {model} model has no {parameter}"));
            camera.with_value(parameter, value).ok_or_else(refused)
        };
        named.into_iter().try_fold(empty, with).map(LensFields)
    }
}

/// A [`BoardShape`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BoardFields {
    /// Bow along x, bow along y and twist, in the target's unit.
    pub bow_x: f64,
    /// See `bow_x`.
    pub bow_y: f64,
    /// See `bow_x`.
    pub twist: f64,
    /// Their standard deviations.
    pub standard_deviations: [f64; 3],
    /// Least and greatest X and Y of all marks, over which they are defined.
    pub region: [[f64; 2]; 2],
}

impl BoardFields {
    fn of(shape: BoardShape) -> BoardFields {
        let BoardShape { bow_x, bow_y, twist, standard_deviations, region } = shape;
        BoardFields { bow_x, bow_y, twist, standard_deviations, region: region.map(Into::into) }
    }
}

/// One view of a result.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ViewFields {
    /// Its name.
    pub name: String,
    /// Number of points.
    pub points: usize,
    /// RMSE per point, px; of marks with weights that of a mark of weight 1, so that it is a multiple of
    /// `sigma_px` where the file has it.
    pub rmse_px: f64,
    /// Rotation vector of `cam_from_target`, rad.
    pub rotation_vector_rad: [f64; 3],
    /// Translation of `cam_from_target`, in the target's unit.
    pub translation: [f64; 3],
    /// Standard deviations of the rotation (left perturbation, rad) and of the translation.
    pub standard_deviations: [f64; 6],
    /// Covariance of these six, row by row.
    pub covariance: [[f64; 6]; 6],
    /// Covariance of the estimated parameters, a row each in the order of `free`, with these six.
    pub covariance_with_camera: Vec<[f64; 6]>,
    /// Predicted - observed `[du, dv]`, px, in the order of the points.
    pub residuals_px: Vec<[f64; 2]>,
}

/// A view that was given but not used.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeftOut {
    /// Its name.
    pub name: String,
    /// Why it was left out.
    pub reason: String,
}

/// A [`Certificate`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CertificateFields {
    /// Whether it holds.
    pub holds: bool,
    /// RMSE per point of the minimum, px; with a robust loss the root of the mean loss of its marks.
    pub rmse_px: f64,
    /// That of free homographies, px.
    pub floor_rmse_px: f64,
    /// Cost above theirs, in variances of a pixel coordinate.
    pub excess: f64,
    /// Degrees of freedom of that excess.
    pub freedom: usize,
    /// Degrees of freedom of the homographies' fit.
    pub floor_freedom: usize,
    /// Probability of such an excess by chance.
    pub p_value: f64,
}

impl CertificateFields {
    fn of(certificate: &Certificate) -> CertificateFields {
        CertificateFields {
            holds: certificate.holds(),
            rmse_px: certificate.rmse_px,
            floor_rmse_px: certificate.floor_rmse_px,
            excess: certificate.excess,
            freedom: certificate.freedom,
            floor_freedom: certificate.floor_freedom,
            p_value: certificate.p_value,
        }
    }
}

/// A [`ProfileInterval`]; an end is `null` where the cost never rises enough.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IntervalFields {
    /// Of which parameter.
    pub parameter: &'static str,
    /// Its probability of containing the true value.
    pub coverage: f64,
    /// Lower end.
    pub low: Option<f64>,
    /// Upper end.
    pub high: Option<f64>,
}

impl IntervalFields {
    fn of(interval: &ProfileInterval) -> IntervalFields {
        let ProfileInterval { parameter, coverage, low, high, .. } = *interval;
        IntervalFields { parameter: parameter.name(), coverage, low, high }
    }
}

/// A [`Prior`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PriorFields {
    /// Of which parameter.
    pub parameter: &'static str,
    /// Its value.
    pub mean: f64,
    /// How well it is known.
    pub standard_deviation: f64,
}

impl PriorFields {
    fn of(prior: &Prior) -> PriorFields {
        let Prior { parameter, mean, standard_deviation } = *prior;
        PriorFields { parameter: parameter.name(), mean, standard_deviation }
    }
}

/// A lens model in a comparison ([`Compared`]).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelFields {
    /// Its name.
    pub model: &'static str,
    /// Coefficients that were estimated.
    pub coefficients: String,
    /// RMSE of the fit, px.
    pub rmse_px: f64,
    /// Error of a coordinate on views that were left out, px; none where the lens cannot be calibrated
    /// without a part of the views, or does not reach a mark of that part.
    pub hold_out_px: Option<f64>,
    /// Schwarz's criterion.
    pub bic: f64,
    /// Correlation of a mark's residual with the next one's.
    pub correlation: f64,
    /// Whether it comes behind the others whatever its criterion: a coefficient lies where the model is not
    /// defined, or there are as many unknowns as measurements.
    pub is_behind: bool,
}

impl ModelFields {
    /// Of one that was compared.
    pub fn of(compared: &Compared) -> ModelFields {
        ModelFields {
            model: compared.candidate.model.name(),
            coefficients: compared.candidate.coefficients.to_string(),
            rmse_px: compared.calibration.rmse_px,
            hold_out_px: compared.hold_out_px,
            bic: compared.bic,
            correlation: compared.correlation,
            is_behind: compared.is_behind,
        }
    }
}

/// The whole of a calibration.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct CalibrationFields {
    /// The program that wrote it.
    pub written_by: String,
    /// The estimate.
    pub camera: LensFields,
    /// Width and height, px, if known.
    pub image_size: Option<(usize, usize)>,
    /// How far the photographs tell which mark is the board's first: `fixed`, `half-turn` or `quarter-turn`;
    /// the caller adds it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub orientation: Option<&'static str>,
    /// The shape of the board, where it was estimated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub board: Option<BoardFields>,
    /// Names of the estimated parameters, in the order of the covariance.
    pub free: Vec<&'static str>,
    /// fy over fx, if the two are tied: fy is then not in `free` and has no row in `covariance`, but has its
    /// standard deviation, that of fx times this; the two are fully correlated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fy_per_fx: Option<f64>,
    /// What was known of parameters beforehand; it counts in the estimate and in the covariance.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub priors: Vec<PriorFields>,
    /// Standard deviation of each estimated parameter.
    pub standard_deviations: BTreeMap<&'static str, f64>,
    /// Covariance of the estimated parameters.
    pub covariance: Vec<Vec<f64>>,
    /// `sqrt(sum |w r|^2 / N)`, px, with the weights `w` of the marks, 1 where the file has none.
    pub rmse_px: f64,
    /// Estimated noise of one pixel coordinate, px: `sqrt(sum |w r|^2 / (2 N - p))`, strays included whatever
    /// the loss.
    pub sigma_px: f64,
    /// What residuals counted by, where not by their squares: `huber:PX` or `cauchy:PX`: see
    /// [`CalibrationFields::with_loss`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loss: Option<String>,
    /// `2 N - p`.
    pub degrees_of_freedom: usize,
    /// `converged`, `above-floor`, `iteration-limit` or `stalled`.
    pub termination: &'static str,
    /// How the cost compares with that of free homographies.
    pub certificate: Option<CertificateFields>,
    /// Starts that were refined: 1 where the first left no doubt.
    pub starts: usize,
    /// Intervals by the profile of the cost, if they were asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub intervals: Vec<IntervalFields>,
    /// Refinement steps.
    pub iterations: usize,
    /// The combination of parameters the data say least about: names and weights, strongest first.
    pub weakest_direction: Vec<(String, f64)>,
    /// Part of that combination's information that remains when all else is unknown.
    pub weakest_information: Option<f64>,
    /// Lens models that were compared, the chosen one first; the caller adds them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub models: Vec<ModelFields>,
    /// What to be careful about.
    pub warnings: Vec<String>,
    /// Views that were given but not used; the caller adds them.
    pub left_out: Vec<LeftOut>,
    /// View by view.
    pub views: Vec<ViewFields>,
}

impl CalibrationFields {
    /// The result of a calibration of views with these names.
    pub fn of(
        calibration: &LensCalibration,
        names: &[String],
        image_size: Option<(usize, usize)>,
    ) -> CalibrationFields {
        let n = calibration.free.len();
        let covariance = &calibration.covariance.intrinsics;
        let deviation = |p: Parameter| Some((p.name(), calibration.standard_deviation(p)?));
        CalibrationFields {
            written_by: format!("calibench {}", env!("CARGO_PKG_VERSION")),
            camera: LensFields(calibration.camera),
            image_size,
            orientation: None,
            board: calibration.board.map(BoardFields::of),
            free: calibration.free.iter().map(Parameter::name).collect(),
            fy_per_fx: calibration.covariance.fy_per_fx,
            priors: calibration.priors.iter().map(PriorFields::of).collect(),
            standard_deviations: Parameter::OF_ALL_MODELS.into_iter().filter_map(deviation).collect(),
            covariance: (0..n).map(|i| (0..n).map(|j| covariance[(i, j)]).collect()).collect(),
            rmse_px: calibration.rmse_px,
            sigma_px: calibration.sigma_px,
            loss: None,
            degrees_of_freedom: calibration.degrees_of_freedom,
            termination: calibration.termination.name(),
            certificate: calibration
                .certificate
                .as_ref()
                .filter(|c| c.is_possible())
                .map(CertificateFields::of),
            starts: calibration.starts,
            intervals: calibration.intervals.iter().map(IntervalFields::of).collect(),
            iterations: calibration.iterations,
            weakest_direction: calibration
                .conditioning
                .iter()
                .flat_map(|c| c.weakest.iter().map(|m| (m.unknown.to_string(), m.weight)))
                .collect(),
            weakest_information: calibration.conditioning.as_ref().map(|c| c.smallest_eigenvalue),
            warnings: in_words(&calibration.warnings),
            models: Vec::new(),
            left_out: Vec::new(),
            views: (0..calibration.cam_from_target.len())
                .map(|i| view_fields(calibration, names, i))
                .collect(),
        }
    }

    /// The same of a calibration whose residuals counted by a loss: a robust one is named.
    pub fn with_loss(self, loss: Loss) -> CalibrationFields {
        CalibrationFields { loss: (loss != Loss::Squares).then(|| loss_to_text(loss)), ..self }
    }

    /// The file's text.
    pub fn to_json(&self) -> String {
        // Plain fields and string keys: nothing in them can fail to serialise.
        serde_json::to_string_pretty(self).expect("a calibration serialises") + "\n"
    }
}

fn view_fields(calibration: &LensCalibration, names: &[String], i: usize) -> ViewFields {
    let pose = &calibration.cam_from_target[i];
    let residuals: &[Vec2] = &calibration.residuals[i];
    let (of_pose, cross) = (&calibration.covariance.poses[i], &calibration.covariance.cross[i]);
    ViewFields {
        name: names.get(i).cloned().unwrap_or_else(|| i.to_string()),
        points: residuals.len(),
        rmse_px: calibration.view_rmse_px(i).unwrap_or(f64::NAN),
        rotation_vector_rad: rotation::log(&pose.rotation).into(),
        translation: pose.translation.into(),
        standard_deviations: std::array::from_fn(|k| of_pose[(k, k)].sqrt()),
        covariance: std::array::from_fn(|j| std::array::from_fn(|k| of_pose[(j, k)])),
        covariance_with_camera: cross.row_iter().map(|row| std::array::from_fn(|k| row[k])).collect(),
        residuals_px: residuals.iter().map(|r| [r.x, r.y]).collect(),
    }
}
