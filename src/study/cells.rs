//! Which experiments does a study consist of? The cells of its grid, each ready for its trials.

use super::design::{Design, designs};
use super::poses::Sight;
use super::prediction::{DRAWS, Prediction};
use super::quantity::Quantity;
use super::spec::{Length, Measure, Spec};
use super::spec_error::SpecError;
use calibench::calibrate::{CalibrationError, Covariance, Loss, Settings};
use calibench::camera::{Camera, FreeParameters, Lens, Model};
use calibench::evaluate::cramer_rao;
use calibench::geometry::{Pose, Vec2};
use calibench::io::result::LensFields;
use calibench::io::shown::on_one_line;
use calibench::synth::{Departure, Scene, Stream, StreamKey, Truth};

/// One combination of levels.
#[derive(Debug, Clone)]
pub struct Cell {
    /// Place in the grid.
    pub index: usize,
    /// Level of every factor.
    pub levels: Vec<usize>,
    /// Labels of the levels.
    pub labels: Vec<String>,
    /// `views = 4, tilt = 20`; `-` where nothing varies.
    pub name: String,
    /// What theory expects of each quantity of the study.
    pub prediction: Prediction,
    pub(super) design: Design,
    pub(super) settings: Settings,
    pub(super) free: FreeParameters,
    pub(super) camera: Camera<Lens>,
    pub(super) points: Vec<Vec2>,
    /// The scene, where every trial meets the same poses.
    pub(super) scene: Option<Scene<Lens>>,
    pub(super) length: Option<(Length, [Vec2; 2])>,
    /// Whether the displacement of pixels over the frame is measured.
    pub(super) measures_frame: bool,
    /// Seed and name of the streams.
    pub(super) seed: u64,
    pub(super) scenario: String,
}

impl Spec {
    /// The quantities of every trial.
    pub fn quantities(&self, cells: &[Cell]) -> Vec<Quantity> {
        let free = cells.iter().flat_map(|c| c.free.iter()).fold(FreeParameters::NONE, FreeParameters::with);
        Quantity::list(free, cells.iter().any(|c| c.length.is_some()), self.measure.contains(&Measure::Frame))
    }

    /// The cells of the grid, the last factor varying fastest. `text` is the file, for errors that say where.
    ///
    /// # Errors
    /// A level that does not fit the study, poses that cannot be, a precision of something that is not
    /// measured.
    pub fn cells(&self, text: &str) -> Result<Vec<Cell>, SpecError> {
        let designs = designs(self, text)?;
        let mut cells = designs
            .into_iter()
            .enumerate()
            .map(|(index, (levels, design))| Cell::new(self, index, levels, design))
            .collect::<Result<Vec<Cell>, _>>()?;
        let quantities = self.quantities(&cells);
        for cell in &mut cells {
            cell.prediction = cell.predict(&quantities)?;
            self.check_precision(cell)?;
        }
        Ok(cells)
    }

    fn check_precision(&self, cell: &Cell) -> Result<(), SpecError> {
        let Some(precision) = &self.trials.precision else { return Ok(()) };
        let own = Quantity::list(cell.free, cell.length.is_some(), cell.measures_frame);
        if own.iter().any(|q| q.name() == precision.quantity) {
            return Ok(());
        }
        let known: Vec<&str> = own.iter().map(|q| q.name()).collect();
        Err(SpecError::Precision {
            quantity: precision.quantity.clone(),
            cell: cell.name.clone(),
            known: known.join(", "),
        })
    }
}

impl Cell {
    /// The poses that every trial meets; `None` where each draws its own.
    pub fn poses(&self) -> Option<&[Pose]> {
        self.scene.as_ref().map(|scene| &scene.truth.cam_from_target[..])
    }

    fn new(spec: &Spec, index: usize, levels: Vec<usize>, design: Design) -> Result<Cell, SpecError> {
        let labels: Vec<String> = spec.factor.iter().zip(&levels).map(|(f, &level)| f.label(level)).collect();
        let named: Vec<String> =
            spec.factor.iter().zip(&labels).map(|(f, label)| format!("{} = {label}", f.name)).collect();
        let name =
            if named.is_empty() { "-".to_string() } else { on_one_line(&named.join(", ")).into_owned() };
        let LensFields(camera) = design.scene.camera;
        // Without the cell in the key, trial t draws the same numbers in every cell.
        let scenario =
            if spec.common_random_numbers { "study".to_string() } else { format!("study: {name}") };
        let mut cell = Cell {
            index,
            levels,
            labels,
            prediction: Prediction(Vec::new()),
            settings: design.estimator.settings(design.scene.image),
            free: design.estimator.estimated(),
            camera,
            points: design.scene.target.points()?,
            scene: None,
            length: design.scene.length.and_then(|length| Some((length, length.pixels(&camera)?))),
            measures_frame: spec.measure.contains(&Measure::Frame),
            seed: spec.seed,
            scenario,
            design,
            name,
        };
        // Every trial's poses are alike: what fails in the first would fail in most.
        let first = cell.draw_scene(0)?;
        cell.departure().pixels(&first).ok_or(SpecError::Value {
            field: "scene.bow_mm",
            value: cell.design.scene.bow_mm,
            need: "so small that every mark stays in front of the camera",
        })?;
        cell.scene = (!cell.design.scene.poses.redraws()).then_some(first);
        Ok(cell)
    }

    /// The noise-free scene of a trial.
    pub(super) fn draw_scene(&self, trial: u64) -> Result<Scene<Lens>, SpecError> {
        let sight = Sight { camera: &self.camera, image: self.design.scene.image, points: &self.points };
        let poses = self.design.scene.poses.generate(&sight, &mut self.stream(trial, "pose"));
        let cam_from_target = poses.map_err(|cause| SpecError::Poses { cell: self.name.clone(), cause })?;
        let truth = Truth {
            camera: self.camera,
            image_size: self.design.scene.image,
            points: self.points.clone(),
            cam_from_target,
        };
        Ok(Scene::new(truth).expect("generated poses show every point in front of the camera"))
    }

    /// In what the scene differs from what is assumed of it.
    pub(super) fn departure(&self) -> Departure {
        self.design.scene.departure()
    }

    pub(super) fn stream(&self, trial: u64, purpose: &str) -> Stream {
        Stream::open(StreamKey { seed: self.seed, scenario: &self.scenario, trial, purpose })
    }

    fn predict(&self, quantities: &[Quantity]) -> Result<Prediction, SpecError> {
        let sigma = self.design.scene.noise_px;
        let estimated = (self.model(), self.free);
        let length = self.length.as_ref();
        let of = |scene: &Scene<Lens>| Prediction::of(quantities, &scene.truth, estimated, sigma, length);
        match &self.scene {
            Some(scene) => Ok(of(scene)),
            None => {
                let sets = (0..DRAWS)
                    .map(|trial| self.draw_scene(trial).map(|scene| of(&scene)))
                    .collect::<Result<Vec<_>, _>>()?;
                Ok(Prediction::mean_of(&sets))
            }
        }
    }

    /// The lens model that is estimated.
    pub fn model(&self) -> Model {
        self.settings.model()
    }

    /// What is estimated.
    pub fn free(&self) -> FreeParameters {
        self.free
    }

    /// Image width and height, px.
    pub fn image_size(&self) -> (usize, usize) {
        self.design.scene.image
    }

    /// Whether the residuals are squared, and nothing else.
    pub fn minimises_squares(&self) -> bool {
        self.settings.loss == Loss::Squares
    }

    /// A camera whose parameters that are held have the values at which the estimator holds them.
    ///
    /// # Errors
    /// A parameter that is neither free nor given a value.
    pub fn held(&self) -> Result<Camera<Lens>, CalibrationError> {
        let ideal = Camera::with_lens(1.0, 1.0, 0.0, 0.0, Lens::ideal(self.model()));
        self.model().parameters().try_fold(ideal, |camera, parameter| {
            let value = self.settings.held(parameter)?;
            Ok(value.and_then(|value| camera.with_value(parameter, value)).unwrap_or(camera))
        })
    }

    /// Whether the estimator's lens model is the truth's.
    pub fn knows_its_lens(&self) -> bool {
        self.model() == self.camera.distortion.model()
    }

    /// The Cramer-Rao covariance of the cell's scene; `None` where it is singular, where each trial has poses
    /// of its own, and where another lens is estimated.
    pub fn bound(&self) -> Option<Covariance> {
        if !self.knows_its_lens() {
            return None;
        }
        cramer_rao(&self.scene.as_ref()?.truth, self.free, self.noise_px()).ok()
    }

    /// Standard deviation of a pixel coordinate.
    pub fn noise_px(&self) -> f64 {
        self.design.scene.noise_px
    }

    /// Views and points of each.
    pub fn size(&self) -> (usize, usize) {
        let views = match &self.scene {
            Some(scene) => scene.truth.cam_from_target.len(),
            None => self.design.scene.poses.views(),
        };
        (views, self.points.len())
    }

    /// The predicted standard deviation of a quantity of the study.
    pub fn predicted(&self, quantities: &[Quantity], name: &str) -> Option<super::Expected> {
        let at = quantities.iter().position(|q| q.name() == name)?;
        self.prediction.0[at]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example::STUDY;

    #[test]
    fn a_precision_is_of_something_that_every_cell_measures() {
        let with = |quantity: &str| {
            let wanted =
                format!("batch = 2\nprecision = {{ quantity = \"{quantity}\", relative_half_width = 0.1 }}");
            let text = STUDY.replace("batch = 2", &wanted);
            Spec::parse(&text).unwrap().cells(&text).map(|cells| cells.len())
        };
        assert_eq!(with("fx").unwrap(), 2);
        let refused = with("k3").unwrap_err();
        let expected = SpecError::Precision {
            quantity: "k3".into(),
            cell: "noise = 0.1".into(),
            known: "rmse, nees, fx, fy, cx, cy, k1, k2, depth".into(),
        };
        assert_eq!(refused.to_string(), expected.to_string());
    }

    #[test]
    fn a_cell_tells_what_is_seen_and_what_is_estimated() {
        let text = STUDY.replace("[trials]", "[estimator]\nfree = [\"fx\", \"cy\"]\n\n[trials]");
        let cells = Spec::parse(&text).unwrap().cells(&text).unwrap();
        assert_eq!([cells[0].noise_px(), cells[1].noise_px()], [0.1, 0.3]);
        assert_eq!((cells[0].size(), cells[0].image_size()), ((3, 9), (640, 480)));
        let free: Vec<&str> = cells[0].free().iter().map(|parameter| parameter.name()).collect();
        assert_eq!(free, ["fx", "cy"]);
        assert!(cells[0].minimises_squares() && cells[0].knows_its_lens() && cells[0].bound().is_some());
    }

    #[test]
    fn of_another_lens_than_the_cameras_nothing_is_expected() {
        let text = STUDY.replace("[trials]", "[estimator]\nmodel = \"kannala-brandt\"\n\n[trials]");
        let cells = Spec::parse(&text).unwrap().cells(&text).unwrap();
        assert!(!cells[0].knows_its_lens() && cells[0].bound().is_none());
        assert!(cells[0].prediction.0.iter().all(Option::is_none));
        let text =
            STUDY.replace("[trials]", "[estimator]\nloss = { kind = \"huber\", delta_px = 0.2 }\n\n[trials]");
        let cells = Spec::parse(&text).unwrap().cells(&text).unwrap();
        assert!(!cells[0].minimises_squares() && cells[0].knows_its_lens());
    }

    #[test]
    fn the_expected_rmse_is_that_of_the_degrees_of_freedom() {
        let text = STUDY.replace(
            "[trials]",
            "[estimator]\nfree = [\"fx\", \"fy\", \"cx\", \"cy\", \"k1\", \"k2\"]\n\n[trials]",
        );
        let spec = Spec::parse(&text).unwrap();
        let cells = spec.cells(&text).unwrap();
        // 27 points, 54 coordinates less 6 + 18 unknowns: N rmse^2 / sigma^2 is chi-squared on 30, the mean
        // of its root sqrt(2) gamma(15.5) / gamma(15) = 5.431780, its variance 30 less the square of that.
        let found = cells[0].predicted(&spec.quantities(&cells), "rmse").unwrap();
        let mean = 0.1 / 27.0f64.sqrt() * 5.431_780_054_2;
        assert!((found.mean - mean).abs() < 1e-9, "{found:?}");
        assert!((found.sd - (0.01 * 30.0 / 27.0 - mean * mean).sqrt()).abs() < 1e-7, "{found:?}");
    }
}
