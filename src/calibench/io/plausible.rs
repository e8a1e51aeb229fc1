//! Which numbers does a camera of a file have? Those that can be calculated with: every term of every lens
//! stays finite over any image.

use crate::camera::{Camera, Lens, Parameter};
use std::ops::RangeInclusive;

/// Focal lengths, px; that of a telescope of 10 m behind pixels of a micrometre is 1e7, and a camera of an
/// image of width 1 has some 1.
const FOCAL_PX: RangeInclusive<f64> = 1e-6..=1e9;
/// Principal point and skew, px, either way.
const MOST_PX: f64 = 1e9;
/// Coefficients of a lens, either way. Those of long lenses are large, since they multiply powers of small
/// angles: k3 = 1e18 where r = 0.001.
const MOST_COEFFICIENT: f64 = 1e30;

/// Why no camera has these numbers, if none has.
pub(super) fn implausible(camera: &Camera<Lens>) -> Option<String> {
    camera.values().find_map(|(parameter, value)| implausible_value(parameter, value))
}

/// Why no camera has this value of a parameter, px or without a unit, if none has: nothing can be calculated
/// with it.
///
/// ```
/// use calibench::camera::Parameter;
/// use calibench::io::implausible_value;
///
/// assert_eq!(implausible_value(Parameter::Fx, 600.0), None);
/// assert!(implausible_value(Parameter::Fx, -600.0).is_some());
/// ```
pub fn implausible_value(parameter: Parameter, value: f64) -> Option<String> {
    let most = match parameter {
        Parameter::Fx | Parameter::Fy if FOCAL_PX.contains(&value) => return None,
        Parameter::Fx | Parameter::Fy => {
            let (least, most) = (FOCAL_PX.start(), FOCAL_PX.end());
            return Some(format!(
                "{parameter} = {value:e} px, and focal lengths are from {least:e} to {most:e} px"
            ));
        }
        Parameter::Cx | Parameter::Cy | Parameter::Skew => MOST_PX,
        _ => MOST_COEFFICIENT,
    };
    // Not a number is not within it.
    let within = value.abs() <= most;
    (!within)
        .then(|| format!("{parameter} = {value:e}, and at most {most:e} either way can be calculated with"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_overflows_is_no_camera_and_long_lenses_are() {
        let camera = |fx: f64, cx: f64, k3: f64| {
            Camera::from_parameters([fx, 600.0, cx, 240.0, 0.0, 0.0, 0.0, 0.0, 0.0, k3]).into()
        };
        for (possible, camera) in [
            (true, camera(600.0, 320.0, 0.0)),
            (true, camera(1e7, 320.0, 1e18)),
            (true, camera(0.8, 0.5, -0.1)),
            (false, camera(1e-308, 320.0, 0.0)),
            (false, camera(-600.0, 320.0, 0.0)),
            (false, camera(f64::NAN, 320.0, 0.0)),
            (false, camera(600.0, -1e308, 0.0)),
            (false, camera(600.0, 320.0, 1e308)),
            (false, camera(600.0, 320.0, f64::INFINITY)),
        ] {
            assert_eq!(implausible(&camera).is_none(), possible, "{camera:?}");
        }
        assert_eq!(
            implausible(&camera(600.0, 1e308, 0.0)).unwrap(),
            "cx = 1e308, and at most 1e9 either way can be calculated with"
        );
    }
}
