//! Is this the code that began the study? Version, numeric crates, and the bits of the trials of a fixed
//! study.

use super::engine::Engine;
use super::shard::Shard;
use super::tables;
use super::trial::{Trial, run_trial};
use calibench::io::hash::sha256_hex;
use calibench_harness::Build;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What identifies code whose trials may stand in one study.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fingerprint {
    /// Version of calibench.
    pub calibench: String,
    /// SHA-256 of the trials and predictions of a fixed study, bit for bit.
    pub behaviour: String,
    /// Versions of the crates whose arithmetic stands in the path of a number.
    pub crates: BTreeMap<String, String>,
}

impl Fingerprint {
    /// Of the running code.
    pub fn of(build: &Build) -> Fingerprint {
        Fingerprint {
            calibench: env!("CARGO_PKG_VERSION").to_string(),
            behaviour: behaviour(),
            crates: build.crates.clone(),
        }
    }
}

/// Touches what a trial can meet: drawn poses, gross errors, a length, every parameter and every loss. The
/// seed is arbitrary.
const STUDY: &str = r#"
name = "fingerprint"
question = "Is this the code that began the study?"
seed = 0
scene.image = [640, 480]
scene.camera = { fx = 600.0, fy = 590.0, cx = 326.0, cy = 243.0, k1 = -0.18, k2 = 0.05, p1 = 0.001, p2 = -0.0015 }
scene.target = { columns = 9, rows = 7, spacing_mm = 10.0 }
scene.noise_px = 0.1
scene.length = { centre_mm = [20.0, -10.0, 160.0], length_mm = 25.0, direction_deg = 30.0 }
trials = { per_cell = 2 }

[scene.poses]
kind = "random"
views = 5
tilt_min_deg = 10.0
tilt_deg = 35.0
roll_deg = 90.0
coverage = 0.7
distance_mm = 150.0
distance_spread = 0.1

[[factor]]
name = "kind"
set = ["estimator.free", "estimator.loss", "scene.outlier_share"]
levels = [
    [["fx", "fy", "cx", "cy", "k1", "k2"], { kind = "squares" }, 0.0],
    [["fx", "fy", "cx", "cy", "skew", "k1", "k2", "p1", "p2", "k3"], { kind = "squares" }, 0.0],
    [["fx", "fy", "cx", "cy", "k1", "k2"], { kind = "huber", delta_px = 0.15 }, 0.05],
    [["fx", "fy", "cx", "cy", "k1", "k2"], { kind = "cauchy", scale_px = 0.2 }, 0.05],
]
"#;

/// Trials and predictions of a fixed study, bit for bit.
fn behaviour() -> String {
    let engine = Engine::new(STUDY, Shard::WHOLE).expect("a test runs this study");
    let mut text = String::new();
    for cell in &engine.cells {
        let trials: Vec<Trial> = (0..2).map(|trial| run_trial(cell, &engine.quantities, trial)).collect();
        text.push_str(&tables::rows(&trials));
        text.push_str(&format!("{:?}\n", cell.prediction));
    }
    sha256_hex(text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_code_has_the_same_fingerprint_and_its_trials_give_cameras() {
        assert_eq!(Fingerprint::of(&Build::default()), Fingerprint::of(&Build::default()));
        let engine = Engine::new(STUDY, Shard::WHOLE).unwrap();
        for cell in &engine.cells {
            let trial = run_trial(cell, &engine.quantities, 0);
            assert!(trial.converged(), "{}: {}", cell.name, trial.outcome);
        }
    }

    #[test]
    fn behaviour_is_told_by_a_sha_256() {
        let told = Fingerprint::of(&Build::default()).behaviour;
        assert!(told.len() == 64 && told.chars().all(|c| c.is_ascii_hexdigit()), "{told}");
    }
}
