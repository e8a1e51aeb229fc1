//! From where does a target near a plane start? From the calibration of its marks dropped on that plane.

use super::data::Data;
use super::problem::State;
use super::shape::Shape;
use crate::board::View;
use crate::calibrate::{CalibrationError, Settings, Warning, calibrate_lens};
use crate::geometry::{Vec2, Vec3};

/// The camera and the poses that [`calibrate_lens`] finds for the marks as a flat board, and its warnings of
/// other cameras: they are the data's, whatever a few hundredths of a millimetre do.
///
/// # Errors
/// What it refuses: planes that face the camera, too few views.
pub(super) fn start(
    data: &Data,
    shape: &Shape,
    settings: &Settings,
) -> Result<(State, Vec<Warning>), CalibrationError> {
    let plane = shape.plane_from_points();
    let views: Vec<View> = data
        .views
        .iter()
        .filter_map(|view| {
            let points = view.iter().map(|seen| plane.apply(&data.positions[seen.mark]).xy()).collect();
            let pixels: Vec<Vec2> = view.iter().map(|seen| seen.pixel).collect();
            let flat = View::new(points, pixels).ok()?;
            let weights: Vec<f64> = view.iter().map(|seen| seen.weight).collect();
            // Marks of weight 1 have a solver that knows more.
            if weights.iter().all(|w| *w == 1.0) { Some(flat) } else { flat.with_weights(weights).ok() }
        })
        .collect();
    let found = calibrate_lens(&views, settings)?;
    let poses = found.cam_from_target.iter().map(|pose| pose.compose(&plane));
    let state = State {
        camera: found.camera,
        cam_from_target: poses.collect(),
        offsets: vec![0.0; data.unknown_deviations.len()],
    };
    let is_ambiguous = |w: &Warning| matches!(w, Warning::Ambiguous { .. });
    Ok((state, found.warnings.into_iter().filter(is_ambiguous).collect()))
}

/// Marks are a plane's if they are as flat as one, or as flat as they are known to be.
pub(super) fn is_flat(data: &Data, shape: &Shape) -> bool {
    let squared = |sd: &Vec3| sd.norm_squared() / 3.0;
    let known = (data.deviations.iter().map(squared).sum::<f64>() / data.deviations.len() as f64).sqrt();
    shape.thickness() <= super::shape::FLAT || shape.extents[2] <= AS_KNOWN * known
}

/// Marks of a plane are spread about it by this many of their standard deviations at most.
const AS_KNOWN: f64 = 2.0;
