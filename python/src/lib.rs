//! How does Python reach calibench? The compiled half of the package: arrays in, arrays out, and every number that of the Rust library.
//!
//! ```text
//! NumPy arrays --arrays--> Vec2 --calibrate | camera | synth | board | rectify | formats | study | gate--> classes whose attributes are arrays
//! ```
//! What is data and no computation (dataclasses, exceptions, the certified problems, the decorator for pytest) is Python and stands in
//! `calibench/`. Every long call lets other threads of Python run, and hears Ctrl-C ([`watch`]).

mod arguments;
mod arrays;
mod board;
mod calibrate;
mod camera;
mod compare;
mod covariance;
mod errors;
mod evaluate;
mod formats;
mod gate;
mod pickled;
mod records;
mod rectify;
mod settings;
mod study;
mod synth;
mod watch;

/// The compiled half of the package `calibench`.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use crate::board::Board;
    #[pymodule_export]
    use crate::calibrate::{Calibration, calibrate, fit_views, locate};
    #[pymodule_export]
    use crate::camera::Camera;
    #[pymodule_export]
    use crate::compare::compare_models;
    #[pymodule_export]
    use crate::covariance::Covariance;
    #[pymodule_export]
    use crate::evaluate::{RmseDistribution, cramer_rao, errors_of};
    #[pymodule_export]
    use crate::formats::{format_names, read_camera, read_corners, write_camera, write_corners};
    #[pymodule_export]
    use crate::gate::{Report, digits, gate_builtin, gate_command, gate_properties, gate_solver};
    #[pymodule_export]
    use crate::pickled::restored;
    #[pymodule_export]
    use crate::rectify::RectifyMap;
    #[pymodule_export]
    use crate::study::run_study;
    #[pymodule_export]
    use crate::synth::{Scene, Stream, looking_at_centre};

    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
