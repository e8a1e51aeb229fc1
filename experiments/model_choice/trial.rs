//! What does a trial say? A truth photographed, every candidate fitted, and each camera held against the
//! truth.

use super::layout::Layout;
use super::row::{Fitted, Row};
use super::truths::{CANDIDATES, Truth};
use calibench::board::View;
use calibench::calibrate::{Candidate, Compared, LensCalibration, Settings, Warning, compare_models};
use calibench::camera::{Camera, Lens};
use calibench::evaluate::TakenOut;
use calibench::evaluate::difference::frame_nodes;
use calibench::synth::scene::{Scene, Truth as Photographed};
use calibench::synth::{Stream, StreamKey};
use calibench::validate::frame_difference;

/// Noise of each coordinate, px.
pub const NOISE_PX: f64 = 0.1;

/// A scene of a truth. Poses and noise are keyed by truth, marks and trial alone.
pub struct Photographs<'a> {
    truth: &'a Truth,
    scene: Scene<Lens>,
    key: (u64, String, u64),
}

impl<'a> Photographs<'a> {
    /// The scene of a trial; `None` where the board does not fit into the image.
    pub fn new(truth: &'a Truth, layout: Layout, seed: u64, trial: u64) -> Option<Photographs<'a>> {
        let key = (seed, format!("{}-{}", truth.name, layout.marks()), trial);
        let cam_from_target = layout.poses(truth, &mut stream(&key, "pose"))?;
        let camera = truth.camera();
        let world = Photographed { camera, image_size: truth.size, points: layout.points(), cam_from_target };
        Some(Photographs { truth, scene: Scene::new(world).ok()?, key })
    }

    /// The marks as they are.
    pub fn exact(&self) -> Vec<View> {
        self.scene.exact()
    }

    /// The marks with noise.
    pub fn noisy(&self) -> Vec<View> {
        self.scene.observe(NOISE_PX, &mut stream(&self.key, "noise"))
    }

    /// Every candidate, in the order of [`CANDIDATES`].
    pub fn rows(&self) -> Vec<Row> {
        let candidates = Candidate::usual();
        let settings = settings(self.truth);
        let (compared, _) = compare_models(&self.noisy(), &settings, &candidates);
        let row = |(candidate, wanted): (usize, &Candidate)| {
            let place = compared.iter().position(|c| c.candidate == *wanted);
            let fitted = place.map(|place| fitted(self.truth, place, &compared[place]));
            Row { marks: self.scene.observations(), trial: self.key.2, candidate, fitted }
        };
        debug_assert_eq!(candidates.len(), CANDIDATES.len());
        candidates.iter().enumerate().map(row).collect()
    }
}

fn stream((seed, scenario, trial): &(u64, String, u64), purpose: &str) -> Stream {
    Stream::open(StreamKey { seed: *seed, scenario, trial: *trial, purpose })
}

/// What `calibench calibrate --model auto` compares with.
pub fn settings(truth: &Truth) -> Settings {
    Settings::standard().with_image_size(truth.size)
}

fn fitted(truth: &Truth, place: usize, compared: &Compared) -> Fitted {
    let LensCalibration { camera, rmse_px, warnings, .. } = &compared.calibration;
    let is_told =
        |warning: &Warning| matches!(warning, Warning::Structured { .. } | Warning::AboveFloor { .. });
    let frame = Frame::of(truth, camera);
    let exact = truth.camera();
    Fitted {
        place,
        rmse_px: *rmse_px,
        bic: compared.bic,
        hold_out_px: compared.hold_out_px,
        errors_px: [camera.fx - exact.fx, camera.fy - exact.fy, camera.cx - exact.cx, camera.cy - exact.cy],
        rms_px: frame.rms_px,
        worst_px: frame.worst_px,
        shown: frame.shown,
        told: warnings.iter().any(is_told),
    }
}

/// The difference of a camera from the truth over the frame, the best rotation taken out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Root mean square over the nodes, px; infinite where next to nothing is shown.
    pub rms_px: f64,
    /// The largest, px.
    pub worst_px: f64,
    /// Share of the frame's nodes whose rays the camera shows.
    pub shown: f64,
}

impl Frame {
    /// Of a camera against a truth.
    pub fn of(truth: &Truth, camera: &Camera<Lens>) -> Frame {
        let nothing = Frame { rms_px: f64::INFINITY, worst_px: f64::INFINITY, shown: 0.0 };
        let Ok(difference) = frame_difference(&truth.camera(), camera, truth.size, TakenOut::Rotation) else {
            return nothing;
        };
        let nodes = frame_nodes(truth.size).0.len();
        difference.largest().map_or(nothing, |worst| Frame {
            rms_px: difference.rms_px,
            worst_px: worst.difference.norm(),
            shown: difference.nodes.len() as f64 / nodes as f64,
        })
    }
}
