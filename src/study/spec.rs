//! What is a study? A scene, an estimator, factors to vary, and how many trials: a TOML file, every field
//! named here.

use super::factor::Factor;
use super::inputs::Inputs;
use super::limits;
use super::lists;
use super::names;
use super::poses::Poses;
use super::spec_error::SpecError;
use super::target::TargetSpec;
use calibench::calibrate::{Loss, Settings};
use calibench::camera::{FreeParameters, Model, Parameter};
use calibench::io::implausible_value;
use calibench::io::result::LensFields;
use calibench::synth::Departure;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A study as its file says it, defaults filled in.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spec {
    /// Name in kebab-case.
    pub name: String,
    /// What is asked, what answer is expected, and what the study cannot show.
    pub question: String,
    /// Seed of every stream.
    pub seed: u64,
    /// Whether trial `t` meets the same noise in every cell: comparisons between cells are then paired, and
    /// cells are not independent of each other.
    #[serde(default = "yes")]
    pub common_random_numbers: bool,
    /// Confidence of every interval.
    #[serde(default = "ninety_five_percent")]
    pub confidence: f64,
    /// Truth.
    pub scene: SceneSpec,
    /// Who estimates.
    #[serde(default)]
    pub estimator: Estimator,
    /// How many trials.
    pub trials: Trials,
    /// What varies; every combination of levels is a cell.
    #[serde(default)]
    pub factor: Vec<Factor>,
    /// What is measured in every trial besides the errors of what is estimated.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub measure: Vec<Measure>,
    /// The files that it names.
    #[serde(skip)]
    pub(super) inputs: Inputs,
}

/// What takes time to measure, and is measured where it is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Measure {
    /// By how much the estimated camera misplaces pixels, over the frame.
    Frame,
}

/// No image is as wide as such noise, px; far above it pixels are no finite numbers.
const MOST_NOISE_PX: f64 = 1e6;
/// Less than any image has, and than coordinates of an image are rounded to.
const LEAST_NOISE_PX: f64 = 1e-9;

/// Truth: camera, target, poses, noise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneSpec {
    /// The virtual camera: its parameters by name, with `model` where the lens is not Brown-Conrady's.
    pub camera: LensFields,
    /// Image width and height, px.
    #[serde(deserialize_with = "lists::pair")]
    pub image: (usize, usize),
    /// The board.
    pub target: TargetSpec,
    /// Where it is held.
    pub poses: Poses,
    /// Standard deviation of each pixel coordinate, px.
    pub noise_px: f64,
    /// Probability that a point is a gross error.
    #[serde(default)]
    pub outlier_share: f64,
    /// A gross error is uniform in a square of this half-width about the point, px.
    #[serde(default = "ten")]
    pub outlier_px: f64,
    /// Correlation of the noise from one mark of a grid to the next, see [`Departure`].
    #[serde(default, skip_serializing_if = "is_zero")]
    pub noise_correlation: f64,
    /// By how much the board bulges towards the camera in its middle, see [`Departure`].
    #[serde(default, skip_serializing_if = "is_zero")]
    pub bow_mm: f64,
    /// A length measured with the calibrated camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length: Option<Length>,
}

/// A length parallel to the image plane at a known distance: its ends are seen at their true pixels, and the
/// calibrated camera measures it on the plane `Z = centre_mm[2]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Length {
    /// Middle, in the camera's frame.
    #[serde(deserialize_with = "lists::exactly")]
    pub centre_mm: [f64; 3],
    /// Length.
    pub length_mm: f64,
    /// Angle from the image's u axis towards v.
    #[serde(default)]
    pub direction_deg: f64,
}

/// Which parameters are estimated, and by what loss.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(from = "EstimatorText")]
pub struct Estimator {
    /// The lens model, which may differ from the truth's.
    #[serde(with = "names::model", skip_serializing_if = "names::model::is_usual")]
    pub model: Model,
    /// Free parameters; the model's usual ones where none are named.
    #[serde(with = "names::free")]
    pub free: FreeParameters,
    /// Whether the file names them: if not, they follow a model that a factor sets.
    #[serde(skip)]
    pub(super) is_free_named: bool,
    /// Values at which others are held; skew and distortion are held at 0 otherwise, the principal point at
    /// the image's centre.
    #[serde(default, with = "names::held", skip_serializing_if = "BTreeMap::is_empty")]
    pub hold: BTreeMap<Parameter, f64>,
    /// Loss of a residual.
    #[serde(default)]
    pub loss: LossChoice,
}

/// An estimator as a file says it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EstimatorText {
    #[serde(default = "names::model::usual", with = "names::model")]
    model: Model,
    #[serde(default)]
    free: Option<names::Free>,
    #[serde(default, with = "names::held")]
    hold: BTreeMap<Parameter, f64>,
    #[serde(default)]
    loss: LossChoice,
}

impl From<EstimatorText> for Estimator {
    fn from(text: EstimatorText) -> Estimator {
        let EstimatorText { model, free, hold, loss } = text;
        let is_free_named = free.is_some();
        let free = free.map_or_else(|| Settings::of_model(model).free(), |names::Free(free)| free);
        Estimator { model, free, is_free_named, hold, loss }
    }
}

/// See [`Loss`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
#[allow(missing_docs, reason = "the fields are those of `calibrate::Loss`")]
pub enum LossChoice {
    Squares {},
    Huber { delta_px: f64 },
    Cauchy { scale_px: f64 },
}

/// How many trials a cell has, and in what batches.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Trials {
    /// Trials a cell; the most there may be where a precision is wanted.
    pub per_cell: u64,
    /// Trials between two checkpoints. The stop rule is judged at the end of a batch only, so its outcome
    /// does not depend on timing.
    #[serde(default = "five_hundred")]
    pub batch: u64,
    /// Stop a cell early once this is known well enough.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub precision: Option<Precision>,
}

/// A cell ends when the interval of the standard deviation of `quantity` is narrow enough.
///
/// Looking repeatedly and stopping at the first success makes the interval cover slightly less often than it
/// says; two batches at least, and a fixed batch size, keep the loss below a percent for batches of some
/// hundred trials.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Precision {
    /// `fx`, ..., `depth`, `length`.
    pub quantity: String,
    /// Wanted half-width of the interval over the standard deviation.
    pub relative_half_width: f64,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

fn yes() -> bool {
    true
}

fn ten() -> f64 {
    10.0
}

fn five_hundred() -> u64 {
    500
}

fn ninety_five_percent() -> f64 {
    0.95
}

impl Default for Estimator {
    fn default() -> Estimator {
        Estimator {
            model: Model::BrownConrady,
            free: FreeParameters::STANDARD,
            is_free_named: false,
            hold: BTreeMap::new(),
            loss: LossChoice::default(),
        }
    }
}

impl Spec {
    /// Reads a study's file.
    ///
    /// # Errors
    /// What is wrong, where (line and column), and what to do.
    pub fn parse(text: &str) -> Result<Spec, SpecError> {
        Spec::parse_with(text, &Inputs::default())
    }

    /// The same for a study that names files.
    ///
    /// # Errors
    /// As [`Spec::parse`].
    pub fn parse_with(text: &str, inputs: &Inputs) -> Result<Spec, SpecError> {
        let spec: Spec = toml::from_str(text).map_err(|e| SpecError::toml(text, &e))?;
        let spec = Spec { inputs: inputs.clone(), ..spec };
        spec.check()?;
        Ok(spec)
    }

    /// The spec with its defaults, the same text however the file was laid out and wherever the files lie
    /// that it names.
    pub fn canonical(&self) -> serde_json::Value {
        let mut tree = serde_json::to_value(self).expect("a spec holds nothing that JSON cannot");
        self.inputs.put_contents(&mut tree);
        tree
    }

    fn check(&self) -> Result<(), SpecError> {
        let plain = |b: u8| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-';
        if self.name.is_empty() || !self.name.bytes().all(plain) {
            return Err(SpecError::Name(self.name.clone()));
        }
        let tree = serde_json::to_value(self).expect("a spec holds nothing that JSON cannot");
        if let Some(text) = with_control_character(&tree) {
            return Err(SpecError::ControlCharacter(calibench::io::shown(&text).to_string()));
        }
        let trials = &self.trials;
        check("trials.per_cell", trials.per_cell as f64, "2 or more", trials.per_cell >= 2)?;
        check("trials.batch", trials.batch as f64, "1 or more", trials.batch >= 1)?;
        check(
            "confidence",
            self.confidence,
            "between 0 and 1",
            self.confidence > 0.0 && self.confidence < 1.0,
        )?;
        if let Some(precision) = &trials.precision {
            let width = precision.relative_half_width;
            check(
                "trials.precision.relative_half_width",
                width,
                "between 0 and 1",
                width > 0.0 && width < 1.0,
            )?;
        }
        Ok(())
    }
}

/// A text of a tree with a character that neither XML nor a terminal takes for text.
fn with_control_character(tree: &serde_json::Value) -> Option<String> {
    let is_refused = |c: char| c.is_control() && !matches!(c, '\n' | '\r' | '\t');
    match tree {
        serde_json::Value::String(text) => text.contains(is_refused).then(|| text.clone()),
        serde_json::Value::Array(list) => list.iter().find_map(with_control_character),
        serde_json::Value::Object(fields) => {
            let key = fields.keys().find(|key| key.contains(is_refused)).cloned();
            key.or_else(|| fields.values().find_map(with_control_character))
        }
        _ => None,
    }
}

fn check(field: &'static str, value: f64, need: &'static str, held: bool) -> Result<(), SpecError> {
    if held { Ok(()) } else { Err(SpecError::Value { field, value, need }) }
}

impl SceneSpec {
    pub(super) fn check(&self) -> Result<(), SpecError> {
        let LensFields(camera) = self.camera;
        // What is written is to be read again, by verbs that refuse what nothing can be calculated with.
        let odd = camera.values().find_map(|(parameter, value)| implausible_value(parameter, value));
        odd.map_or(Ok(()), |reason| Err(SpecError::Camera(reason)))?;
        let side = self.image.0.max(self.image.1);
        check("scene.image", side as f64, "at most 1048576 px a side", side <= limits::MOST_SIDE)?;
        let noise = self.noise_px;
        let is_noise = (LEAST_NOISE_PX..MOST_NOISE_PX).contains(&noise);
        check("scene.noise_px", noise, "a number from 1e-9 to below 1e6", is_noise)?;
        let share = self.outlier_share;
        check("scene.outlier_share", share, "from 0 to below 1", (0.0..1.0).contains(&share))?;
        let spread = self.outlier_px;
        check("scene.outlier_px", spread, "a positive number", spread > 0.0 && spread.is_finite())?;
        let shared = self.noise_correlation;
        check("scene.noise_correlation", shared, "from 0 to below 1", (0.0..1.0).contains(&shared))?;
        if shared != 0.0 && self.target.columns().is_none() {
            return Err(SpecError::NoNeighbours);
        }
        check("scene.bow_mm", self.bow_mm, "a finite number", self.bow_mm.is_finite())?;
        if let Some(length) = &self.length {
            length.check()?;
        }
        self.target.check()
    }

    /// In what the scene differs from what a calibration assumes.
    pub(super) fn departure(&self) -> Departure {
        Departure { noise_correlation: self.noise_correlation, bow: self.bow_mm }
    }

    /// The same, with what stands in the files that it names.
    pub(super) fn read(self, inputs: &Inputs) -> Result<SceneSpec, SpecError> {
        Ok(SceneSpec { target: self.target.read(inputs)?, poses: self.poses.read(inputs)?, ..self })
    }
}

impl Length {
    fn check(&self) -> Result<(), SpecError> {
        let Length { centre_mm: [x, y, z], length_mm, direction_deg } = *self;
        check("scene.length.length_mm", length_mm, "positive", length_mm > 0.0 && length_mm.is_finite())?;
        check("scene.length.centre_mm", z, "in front of the camera", z > 0.0 && z.is_finite())?;
        for value in [x, y] {
            check("scene.length.centre_mm", value, "a finite number", value.is_finite())?;
        }
        check("scene.length.direction_deg", direction_deg, "a finite number", direction_deg.is_finite())
    }
}

impl Estimator {
    pub(super) fn check(&self) -> Result<(), SpecError> {
        let model = self.model;
        let has = |parameter: &Parameter| model.parameters().any(|p| p == *parameter);
        if let Some(parameter) = self.free.iter().chain(self.hold.keys().copied()).find(|p| !has(p)) {
            return Err(SpecError::NotOfModel { parameter, model });
        }
        let (field, scale) = match self.loss {
            LossChoice::Squares {} => return Ok(()),
            LossChoice::Huber { delta_px } => ("estimator.loss.delta_px", delta_px),
            LossChoice::Cauchy { scale_px } => ("estimator.loss.scale_px", scale_px),
        };
        check(field, scale, "a positive number", self.loss.loss().is_valid())
    }

    /// The solver's settings.
    pub fn settings(&self, image: (usize, usize)) -> Settings {
        let settings = Settings::new(self.free).with_model(self.model);
        let settings = settings.with_image_size(image).with_loss(self.loss.loss());
        self.hold.iter().fold(settings, |settings, (&parameter, &value)| settings.hold(parameter, value))
    }

    /// What is estimated: the free parameters that are not held after all.
    pub fn estimated(&self) -> FreeParameters {
        self.hold.keys().fold(self.free, |free, &parameter| free.without(parameter))
    }
}

impl Default for LossChoice {
    fn default() -> LossChoice {
        LossChoice::Squares {}
    }
}

impl LossChoice {
    /// The solver's loss.
    pub fn loss(self) -> Loss {
        match self {
            LossChoice::Squares {} => Loss::Squares,
            LossChoice::Huber { delta_px } => Loss::Huber { delta_px },
            LossChoice::Cauchy { scale_px } => Loss::Cauchy { scale_px },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example::STUDY;

    #[test]
    fn what_a_study_leaves_out_has_the_stated_default() {
        let spec = Spec::parse(&STUDY.replace("batch = 2\n", "")).unwrap();
        assert_eq!((spec.trials.batch, spec.trials.precision), (500, None));
        assert_eq!((spec.confidence, spec.common_random_numbers), (0.95, true));
    }

    #[test]
    fn what_no_study_can_have_is_refused_by_its_field() {
        for (old, new, field) in [
            ("per_cell = 3", "per_cell = 1", "trials.per_cell"),
            ("batch = 2", "batch = 0", "trials.batch"),
            ("seed = 1", "seed = 1\nconfidence = 1.0", "confidence"),
            (
                "batch = 2",
                "batch = 2\nprecision = { quantity = \"fx\", relative_half_width = 0.0 }",
                "trials.precision.relative_half_width",
            ),
        ] {
            let refused = Spec::parse(&STUDY.replace(old, new)).unwrap_err();
            assert!(matches!(&refused, SpecError::Value { field: own, .. } if *own == field), "{refused}");
        }
        let refused = Spec::parse(&STUDY.replace("two-cells", "Two cells")).unwrap_err();
        assert!(matches!(&refused, SpecError::Name(name) if name == "Two cells"), "{refused}");
    }

    #[test]
    fn a_target_of_a_file_has_the_marks_that_stand_there() {
        let grid = "{ columns = 3, rows = 3, spacing_mm = 10.0 }";
        let text = STUDY.replace(grid, "{ file = \"marks.csv\" }");
        let inputs = Inputs::parse(r#"{ "marks.csv": "X,Y\n0,0\n12.5,0\n0,9\n12.5,9.25\n" }"#).unwrap();
        let spec = Spec::parse_with(&text, &inputs).unwrap();
        let scene = spec.scene.clone().read(&inputs).unwrap();
        let marks = scene.target.points().unwrap();
        assert_eq!(
            marks.iter().map(|p| [p.x, p.y]).collect::<Vec<_>>(),
            [[0.0, 0.0], [12.5, 0.0], [0.0, 9.0], [12.5, 9.25]]
        );
        assert!(spec.scene.read(&Inputs::default()).is_err());
    }

    #[test]
    fn what_is_no_camera_is_refused_by_its_parameter() {
        for (old, new, said) in [
            ("fx = 600.0", "fx = 0.0", "fx = 0e0 px, and focal lengths are from 1e-6 to 1e9 px"),
            ("fx = 600.0", "fx = 1e-300", "fx = 1e-300 px, and focal lengths are"),
            ("fy = 600.0", "fy = -600.0", "fy = -6e2 px, and focal lengths are"),
            ("cx = 320.0", "cx = nan", "cx = NaN, and at most 1e9"),
            ("cx = 320.0", "cx = 320.0, k1 = 1e31", "k1 = 1e31, and at most 1e30"),
        ] {
            let refused =
                Spec::parse(&STUDY.replace(old, new)).unwrap().scene.check().unwrap_err().to_string();
            assert!(refused.starts_with("scene.camera: ") && refused.contains(said), "{refused}");
        }
    }

    #[test]
    fn a_scene_that_no_study_can_have_is_refused_by_its_field() {
        let check = |old: &str, new: &str| {
            let text = STUDY.replace(old, new);
            assert_ne!(text, STUDY, "{old}");
            Spec::parse(&text).unwrap().scene.check()
        };
        let noise = "noise_px = 0.1";
        for (old, new, field) in [
            ("[640, 480]", "[640, 1048577]", "scene.image"),
            (noise, "noise_px = 0.0", "scene.noise_px"),
            (noise, "noise_px = 1e6", "scene.noise_px"),
            (noise, "noise_px = 0.1\noutlier_share = 1.0", "scene.outlier_share"),
            (noise, "noise_px = 0.1\noutlier_px = 0.0", "scene.outlier_px"),
            (noise, "noise_px = 0.1\noutlier_px = inf", "scene.outlier_px"),
            (noise, "noise_px = 0.1\nnoise_correlation = 1.0", "scene.noise_correlation"),
            (noise, "noise_px = 0.1\nbow_mm = inf", "scene.bow_mm"),
        ] {
            let refused = check(old, new).unwrap_err();
            assert!(matches!(&refused, SpecError::Value { field: own, .. } if *own == field), "{refused}");
        }
        assert_eq!(check("[640, 480]", "[640, 1048576]").map_err(|e| e.to_string()), Ok(()));
    }

    #[test]
    fn a_length_is_positive_and_lies_in_front_of_the_camera() {
        let good = Length { centre_mm: [0.0, 0.0, 100.0], length_mm: 10.0, direction_deg: 30.0 };
        let field = |length: Length| match length.check() {
            Ok(()) => "none",
            Err(SpecError::Value { field, .. }) => field,
            Err(other) => panic!("{other}"),
        };
        assert_eq!(field(good), "none");
        for length_mm in [0.0, -1.0, f64::INFINITY] {
            assert_eq!(field(Length { length_mm, ..good }), "scene.length.length_mm");
        }
        for centre_mm in [[0.0, 0.0, 0.0], [0.0, 0.0, f64::INFINITY], [f64::NAN, 0.0, 100.0]] {
            assert_eq!(field(Length { centre_mm, ..good }), "scene.length.centre_mm");
        }
        assert_eq!(field(Length { direction_deg: f64::NAN, ..good }), "scene.length.direction_deg");
    }

    #[test]
    fn a_gross_error_is_up_to_ten_pixels_large_unless_it_is_said_how_large() {
        assert_eq!(Spec::parse(STUDY).unwrap().scene.outlier_px, 10.0);
    }

    #[test]
    fn what_is_free_and_held_has_to_be_of_the_model() {
        let check = |estimator: &str| {
            let text = STUDY.replace("[trials]", &format!("[estimator]\n{estimator}\n\n[trials]"));
            Spec::parse(&text).unwrap().estimator.check()
        };
        assert!(check("free = [\"fx\", \"k1\"]\nhold = { k2 = 0.1 }").is_ok());
        let kannala = "model = \"kannala-brandt\"\nfree = [\"fx\"]\nhold = { p1 = 0.1 }";
        assert!(matches!(check(kannala), Err(SpecError::NotOfModel { .. })));
        for delta in ["0.0", "-1.0"] {
            let refused = check(&format!("loss = {{ kind = \"huber\", delta_px = {delta} }}"));
            assert!(matches!(refused, Err(SpecError::Value { field: "estimator.loss.delta_px", .. })));
        }
    }
}
