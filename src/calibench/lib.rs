//! calibench: a test bench for camera calibration.
//!
//! A virtual camera whose truth is known photographs a target, a calibrator recovers the camera, and every number is
//! reconciled with truth, with theory, with the published values, and with the last run. Data flows one way:
//!
//! ```text
//! synth (truth) -> observe (noise, the only place it enters) -> calibrate (never sees truth)
//!   -> evaluate (truth meets estimate) -> record (numbers, tables, figures) -> emit -> golden / gate / book
//! ```
//!
//! Conventions: pixel (0, 0) is the centre of the top-left pixel, u right, v down; camera axes x right, y down, z forward;
//! target points lie in Z = 0; `cam_from_target` takes target coordinates to camera coordinates; rotations are perturbed on
//! the left; residual = predicted - observed; RMSE is per point.

pub mod board;
pub mod calibrate;
pub mod camera;
pub mod detect;
pub mod evaluate;
pub mod geometry;
#[cfg(feature = "io")]
pub mod io;
#[cfg(feature = "photo")]
pub mod photos;
pub mod planar;
pub mod raster;
pub mod rectify;
pub mod synth;
