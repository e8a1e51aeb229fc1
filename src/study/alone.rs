//! How is one cell of a study run again, by itself? The marks and poses that it used stand in tables beside
//! its results; a study of its own takes them from there and gives the same trials.

use super::cells::Cell;
use super::engine::Engine;
use super::factor::Factor;
use super::poses::Poses;
use super::spec::Spec;
use super::target::TargetSpec;
use calibench::io::scene_tables::{target_marks, target_poses};
use toml::{Spanned, Value};

/// The marks of every cell.
pub const MARKS: &str = "marks.csv";
/// The poses of every cell whose trials all meet the same.
pub const POSES: &str = "poses.csv";

/// The table of the marks that each cell's target had.
pub(super) fn marks(engine: &Engine) -> String {
    target_marks(engine.cells.iter().map(|cell| (cell.index, &cell.points[..])))
}

/// The table of the poses that each cell had; `None` where every trial drew its own.
pub(super) fn poses(engine: &Engine) -> Option<String> {
    let fixed: Vec<_> = engine.cells.iter().filter_map(|cell| Some((cell.index, cell.poses()?))).collect();
    (!fixed.is_empty()).then(|| target_poses(fixed))
}

impl Engine {
    /// The study of one cell alone, with marks and poses from the tables of a run in `folder`; `None` if
    /// there is no such cell.
    ///
    /// Its trials are those of the cell, bit for bit. Where trials draw poses of their own, they draw the
    /// same ones again.
    pub fn alone(&self, index: usize, folder: &str) -> Option<Spec> {
        let cell = self.cells.get(index)?;
        let mut spec = self.spec.clone();
        spec.name = format!("{}-cell-{index}", spec.name);
        (spec.scene, spec.estimator) = (cell.design.scene.clone(), cell.design.estimator.clone());
        let place = |name: &str| format!("{}/{name}", folder.trim_end_matches('/'));
        // Noise that neighbours share needs the grid, whose marks are those of the table.
        if spec.scene.noise_correlation == 0.0 {
            spec.scene.target =
                TargetSpec::File { file: place(MARKS), cell: Some(index), marks: cell.points.clone() };
        }
        if let Some(poses) = cell.poses() {
            let poses = poses.to_vec();
            spec.scene.poses = Poses::File { file: place(POSES), cell: Some(index), poses };
        }
        spec.factor = named(cell, &self.spec);
        Some(spec)
    }
}

/// Where cells draw noise of their own, their names are part of the keys of its streams: a factor of one
/// level gives the cell its name.
fn named(cell: &Cell, spec: &Spec) -> Vec<Factor> {
    let Some((first, label)) = cell.name.split_once(" = ").filter(|_| !spec.common_random_numbers) else {
        return Vec::new();
    };
    let level = Spanned::new(0..0, Value::Float(cell.noise_px()));
    vec![Factor {
        name: first.to_string(),
        unit: String::new(),
        set: vec!["scene.noise_px".to_string()],
        levels: Spanned::new(0..0, vec![level]),
        labels: vec![label.to_string()],
    }]
}

impl Spec {
    /// The text of a study's file.
    pub fn to_text(&self) -> String {
        toml::to_string(self).expect("a study came from TOML and goes back into it")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example::STUDY;
    use crate::{Inputs, Trial, in_memory_seeing};

    #[test]
    fn a_cell_alone_reads_the_tables_of_its_run_and_has_the_same_trials() {
        // The second has the names of its cells, here of two factors, in the keys of its noise.
        let tilt = "\n[[factor]]\nname = \"tilt\"\nset = [\"scene.poses.tilt_deg\"]\nlevels = [30.0, 35.0]\n";
        let named = format!("common_random_numbers = false\n{STUDY}{tilt}");
        for (text, cells) in [(STUDY, 2), (&named, 4)] {
            let run = |spec: Spec, text: &str| {
                let mut trials: Vec<Trial> = Vec::new();
                let engine = in_memory_seeing(spec, text, |trial| trials.push(trial.clone()), |_| ());
                (engine.unwrap(), trials)
            };
            let (engine, mut trials) = run(Spec::parse(text).unwrap(), text);
            let tables = serde_json::json!({
                "runs/one/marks.csv": marks(&engine),
                "runs/one/poses.csv": poses(&engine).unwrap(),
            });
            let alone = engine.alone(1, "runs/one/").unwrap().to_text();
            let inputs = Inputs::parse(&tables.to_string()).unwrap();
            let (_, again) = run(Spec::parse_with(&alone, &inputs).unwrap(), &alone);
            trials.retain(|trial| trial.cell == 1);
            trials.iter_mut().for_each(|trial| trial.cell = 0);
            assert!(again == trials, "{alone}");
            assert!(engine.alone(cells, "runs/one/").is_none());
        }
    }
}
