//! Where on the plane is what a pixel shows? Nine-point calibration: an affine, projective or similarity map
//! from pixels to world coordinates, from four point pairs or more.
//!
//! ```text
//! s [X Y 1]^T = M [u v 1]^T
//! ```

mod calibrate;
mod map;
mod pairs;
mod spread;

pub use calibrate::{PlaneCalibration, PlaneModel, calibrate_plane};
pub use map::PlaneMap;
pub use pairs::PlaneError;
pub use spread::PlaneSpread;
