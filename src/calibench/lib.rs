//! calibench: a test bench for camera calibration.
//!
//! A virtual camera whose truth is known photographs a target, a calibrator recovers the camera, and every
//! number is reconciled with truth, with theory, with the published values, and with the last run. Data flows
//! one way:
//!
//! ```text
//! synth (truth) -> observe (noise, the only place it enters) -> calibrate (never sees truth)
//!   -> evaluate (truth meets estimate) -> record (numbers, tables, figures) -> emit -> golden / gate / book
//! ```
//!
//! Conventions: pixel (0, 0) is the centre of the top-left pixel, u right, v down; camera axes x right, y
//! down, z forward; target points lie in Z = 0; `cam_from_target` takes target coordinates to camera
//! coordinates; rotations are perturbed on the left; residual = predicted - observed; RMSE is per point.

//! # A calibration
//!
//! ```
//! use calibench::board::View;
//! use calibench::calibrate::{Settings, calibrate};
//! use calibench::camera::Parameter;
//! use calibench::synth::{Scene, Stream, StreamKey};
//!
//! // Four photographs of a grid by a virtual camera, with noise of a tenth of a pixel; yours come from a detector.
//! let scene = Scene::example();
//! let mut stream = Stream::open(StreamKey { seed: 1, scenario: "example", trial: 0, purpose: "noise" });
//! let views: Vec<View> = scene.observe(0.1, &mut stream);
//!
//! let result = calibrate(&views, &Settings::standard().with_image_size((640, 480)))?;
//! let deviation = result.covariance.standard_deviation(Parameter::Fx).expect("fx is free");
//! assert!((result.camera.fx - scene.truth.camera.fx).abs() < 4.0 * deviation);
//! # Ok::<(), calibench::calibrate::CalibrationError>(())
//! ```

/// The linear algebra of this library's types, for programs that must name the same version.
pub use nalgebra;

#[cfg(feature = "serde")]
mod as_data;
pub mod board;
pub mod calibrate;
pub mod camera;
pub mod detect;
pub mod distribution;
pub mod downstream;
pub mod evaluate;
pub mod geometry;
#[cfg(feature = "io")]
pub mod io;
pub mod measured;
pub mod noise;
#[cfg(feature = "photo")]
pub mod photos;
pub mod planar;
pub mod planning;
pub mod raster;
pub mod rectify;
#[cfg(feature = "serde")]
mod rows;
pub mod synth;
pub mod tsai;
pub mod validate;
