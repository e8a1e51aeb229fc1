//! Do the views of a calibration predict each other? They are divided into parts; each is left out in turn,
//! the camera calibrated from the rest, and the part's error compared with its prediction.

use super::{Estimate, HoldOut, HoldOutError, hold_out};
use crate::board::View;
use crate::calibrate::{CalibrationError, Settings, calibrate_lens};
use crate::camera::{Camera, Lens};

/// One part left out.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Fold {
    /// Indices of the views left out: every so many-th.
    pub left_out: Vec<usize>,
    /// The camera of the others.
    pub camera: Camera<Lens>,
    /// What the views left out say of it.
    pub hold_out: HoldOut,
}

/// Why parts cannot be judged.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FoldError {
    /// Parts without a view, or one part.
    #[error("{views} views cannot be divided into {folds} parts: from 2 to as many parts as views")]
    Parts {
        /// Views given.
        views: usize,
        /// Parts asked for.
        folds: usize,
    },
    /// The rest does not determine the camera.
    #[error("without part {fold} the views give no camera")]
    Rest {
        /// Which part, from 0.
        fold: usize,
        /// Why.
        source: CalibrationError,
    },
    /// A part says nothing.
    #[error("part {fold}")]
    Part {
        /// Which part, from 0.
        fold: usize,
        /// Why; views are counted within the part.
        source: HoldOutError,
    },
}

/// Leaves out every `folds`-th view in turn. `false_alarm` is the chance that any part of a right model
/// fails: each is judged at its share (Bonferroni).
///
/// # Errors
/// See [`FoldError`].
///
/// ```
/// use calibench::calibrate::Settings;
/// use calibench::synth::{Scene, Stream, StreamKey};
/// use calibench::validate::folds;
///
/// let mut noise = Stream::open(StreamKey { seed: 1, scenario: "folds", trial: 0, purpose: "noise" });
/// let views = Scene::example().observe(0.1, &mut noise);
/// // The first view faces the camera; the three others determine it.
/// let found = folds(&views, &Settings::standard(), 4, 0.01)?;
/// assert!(found.len() == 4 && found.iter().all(|fold| fold.hold_out.holds()));
/// # Ok::<(), calibench::validate::FoldError>(())
/// ```
pub fn folds(
    views: &[View],
    settings: &Settings,
    folds: usize,
    false_alarm: f64,
) -> Result<Vec<Fold>, FoldError> {
    if folds < 2 || folds > views.len() {
        return Err(FoldError::Parts { views: views.len(), folds });
    }
    let each = false_alarm / folds as f64;
    (0..folds).map(|fold| judged(views, settings, (fold, folds), each)).collect()
}

fn judged(
    views: &[View],
    settings: &Settings,
    (fold, folds): (usize, usize),
    false_alarm: f64,
) -> Result<Fold, FoldError> {
    let (left_out, kept): (Vec<usize>, Vec<usize>) = (0..views.len()).partition(|view| view % folds == fold);
    let of = |indices: &[usize]| -> Vec<View> { indices.iter().map(|&view| views[view].clone()).collect() };
    let result = calibrate_lens(&of(&kept), settings).map_err(|source| FoldError::Rest { fold, source })?;
    let estimate = Estimate {
        camera: &result.camera,
        covariance: &result.covariance,
        sigma_px: result.sigma_px,
        degrees_of_freedom: Some(result.degrees_of_freedom),
    };
    let hold_out = hold_out(&estimate, &of(&left_out), false_alarm)
        .map_err(|source| FoldError::Part { fold, source })?;
    Ok(Fold { left_out, camera: result.camera, hold_out })
}
