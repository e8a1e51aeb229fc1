//! Is this the code that began the study? Version, numeric crates, and the bits of fixed calibrations.

use crate::calibrate::{Loss, Settings, calibrate};
use crate::camera::{FreeParameters, Parameter};
use crate::harness::hash::sha256_hex;
use crate::harness::provenance::crate_versions;
use crate::synth::{Scene, Stream, StreamKey};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What identifies code whose trials may stand in one study.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fingerprint {
    /// Version of calibench.
    pub calibench: String,
    /// SHA-256 of the results of fixed calibrations and of the first random numbers, bit for bit.
    pub behaviour: String,
    /// Versions of the crates whose arithmetic stands in the path of a number.
    pub crates: BTreeMap<String, String>,
}

impl Fingerprint {
    /// Of the running code.
    pub fn current() -> Fingerprint {
        Fingerprint {
            calibench: env!("CARGO_PKG_VERSION").to_string(),
            behaviour: behaviour(),
            crates: crate_versions().into_iter().collect(),
        }
    }
}

/// Seed of the fixed calibrations; any would do.
const SEED: u64 = 0;

fn behaviour() -> String {
    let full = FreeParameters::of(&Parameter::ALL);
    let models = [
        Settings::chapter(),
        Settings::new(full).with_image_size((640, 480)),
        Settings::chapter().with_loss(Loss::Huber { delta_px: 0.15 }),
        Settings::chapter().with_loss(Loss::Cauchy { scale_px: 0.2 }),
    ];
    let mut bytes = Vec::new();
    for (trial, settings) in models.iter().enumerate() {
        let key = StreamKey { seed: SEED, scenario: "fingerprint", trial: trial as u64, purpose: "noise" };
        let mut stream = Stream::open(key);
        let views = Scene::chapter().observe(0.1, &mut stream);
        bytes.extend(stream.uniform().to_le_bytes());
        match calibrate(&views, settings) {
            Err(error) => bytes.extend(error.to_string().bytes()),
            Ok(result) => {
                bytes.extend((result.iterations as u64).to_le_bytes());
                let poses = result.cam_from_target.iter().flat_map(|p| p.translation.iter().copied());
                let numbers = result.camera.parameters().into_iter().chain(poses).chain([result.rmse_px]);
                numbers
                    .chain(result.covariance.intrinsics.iter().copied())
                    .for_each(|x| bytes.extend(x.to_le_bytes()));
            }
        }
    }
    sha256_hex(&bytes)
}
