//! Where does the refinement start? Zhang's closed form, or a known principal point where it has no answer.

use super::closed_form::{self, ClosedFormError};
use super::minimise::State;
use super::tie::met_halfway;
use super::{CalibrationError, Prior, Settings};
use crate::camera::{Camera, Parameter};
use crate::geometry::{Homography, Mat3, Pose, Vec2};

/// The intrinsics and poses to refine from, the most promising first: the caller's own, the closed form, one
/// focal length from the principal point, guesses of a wide and of a long lens. `homographies` take the
/// target frame of the refinement to pixels; `pixel_frame` is the centre and the half-width of the pixels
/// seen.
pub(super) fn starts(
    homographies: &[Homography],
    settings: &Settings,
    held: &Held,
    pixel_frame: (Vec2, f64),
) -> Result<Vec<State>, CalibrationError> {
    let half_width = pixel_frame.1;
    let closed = normalised_closed_form(homographies, settings, pixel_frame);
    let aspect = held.fy_per_fx.unwrap_or(1.0);
    let centred = |focal: f64| Camera::pinhole(focal, aspect * focal, held.centre.x, held.centre.y);
    let cameras = [
        settings.start,
        held.focal_known.map(centred),
        closed.as_ref().ok().copied().filter(|camera| is_plausible(camera, pixel_frame)),
        focal_from_centre(homographies, held.centre, aspect).map(centred),
        Some(centred(2.0 * half_width)),
        Some(centred(8.0 * half_width)),
    ];
    let states: Vec<State> =
        cameras.into_iter().flatten().filter_map(|camera| held.state(camera, homographies)).collect();
    if states.is_empty() {
        return Err(CalibrationError::NoStart {
            source: closed.err().unwrap_or(ClosedFormError::NoRealCamera),
        });
    }
    Ok(states)
}

/// The closed form in pixels scaled to unit size, where its equations are well conditioned for any image
/// size.
fn normalised_closed_form(
    homographies: &[Homography],
    settings: &Settings,
    (centre, half_width): (Vec2, f64),
) -> Result<Camera, ClosedFormError> {
    let s = 1.0 / half_width;
    let normalise = Mat3::new(s, 0.0, -s * centre.x, 0.0, s, -s * centre.y, 0.0, 0.0, 1.0);
    let scaled: Vec<Homography> = homographies
        .iter()
        .map(|h| {
            let m = normalise * h.0;
            Homography(m / m.norm())
        })
        .collect();
    let unit = closed_form::closed_form(&scaled, settings.free().contains(Parameter::Skew))?;
    Ok(Camera {
        skew: unit.skew * half_width,
        ..Camera::pinhole(
            unit.fx * half_width,
            unit.fy * half_width,
            unit.cx * half_width + centre.x,
            unit.cy * half_width + centre.y,
        )
    })
}

/// A closed form thrown off by noise lies far outside what optics make: it is then no better than a guess.
fn is_plausible(camera: &Camera, (centre, half_width): (Vec2, f64)) -> bool {
    let focal_ok = |f: f64| f > 0.1 * half_width && f < 200.0 * half_width;
    focal_ok(camera.fx)
        && focal_ok(camera.fy)
        && camera.fx < 5.0 * camera.fy
        && camera.fy < 5.0 * camera.fx
        && (Vec2::new(camera.cx, camera.cy) - centre).norm() < 5.0 * half_width
}

/// One focal length from the two constraints of every view when the principal point is known (Zhang 2000,
/// section 3.1 with `u0, v0` given): `h1^T B h2 = 0` and `h1^T B h1 = h2^T B h2` with `B = diag(w, w, 1)`,
/// least squares in `w = 1/f^2`. With cells of `aspect`, fy over fx, rows are counted in units of it first,
/// and the result is fx.
pub(super) fn focal_from_centre(homographies: &[Homography], centre: Vec2, aspect: f64) -> Option<f64> {
    let shift = Mat3::new(1.0, 0.0, -centre.x, 0.0, 1.0 / aspect, -centre.y / aspect, 0.0, 0.0, 1.0);
    let (mut square, mut product) = (0.0, 0.0);
    for h in homographies {
        let h = shift * h.0;
        let h = h / h.norm();
        let (a, b) = (h.column(0), h.column(1));
        let across = (a[0] * b[0] + a[1] * b[1], a[2] * b[2]);
        let difference = (a[0] * a[0] + a[1] * a[1] - b[0] * b[0] - b[1] * b[1], a[2] * a[2] - b[2] * b[2]);
        for (factor, constant) in [across, difference] {
            square += factor * factor;
            product += factor * constant;
        }
    }
    let w = -product / square;
    (w > 0.0 && w.is_finite()).then(|| 1.0 / w.sqrt())
}

/// A focal length known to this part of it is a better start than any that is estimated without distortion.
const GOOD_START: f64 = 0.1;

/// The values that are not estimated.
pub(super) struct Held {
    values: [Option<f64>; Parameter::COUNT],
    /// fy over fx, where the two are estimated together.
    pub fy_per_fx: Option<f64>,
    /// fx, if it is known beforehand well enough to start from.
    focal_known: Option<f64>,
    /// The principal point that is held or known beforehand, or else the image's centre, or that of the
    /// pixels seen.
    pub centre: Vec2,
}

impl Held {
    pub fn of(settings: &Settings, pixel_centre: Vec2) -> Result<Held, CalibrationError> {
        let mut values = [None; Parameter::COUNT];
        for parameter in Parameter::ALL {
            values[parameter as usize] = settings.held(parameter)?;
        }
        let image_centre = settings
            .image_size
            .map_or(pixel_centre, |(w, h)| Vec2::new(0.5 * (w as f64 - 1.0), 0.5 * (h as f64 - 1.0)));
        let known = |p| settings.priors().find(|prior| prior.parameter == p).map(|prior| prior.mean);
        let centre = Vec2::new(
            values[Parameter::Cx as usize].or(known(Parameter::Cx)).unwrap_or(image_centre.x),
            values[Parameter::Cy as usize].or(known(Parameter::Cy)).unwrap_or(image_centre.y),
        );
        let is_good_start = |prior: &Prior| {
            matches!(prior.parameter, Parameter::Fx | Parameter::Fy)
                && prior.standard_deviation < GOOD_START * prior.mean
        };
        let focal_known = settings.priors().find(is_good_start).map(|prior| prior.mean);
        Ok(Held { values, fy_per_fx: settings.tie()?, focal_known, centre })
    }

    /// The value a parameter is held at.
    pub fn value(&self, parameter: Parameter) -> Option<f64> {
        self.values[parameter as usize]
    }

    /// The camera with its held values, and its focal lengths tied if they are to be.
    pub fn camera(&self, camera: Camera) -> Camera {
        let mut parameters = camera.parameters();
        for (parameter, held) in parameters.iter_mut().zip(self.values) {
            *parameter = held.unwrap_or(*parameter);
        }
        met_halfway(Camera::from_parameters(parameters), self.fy_per_fx)
    }

    /// The camera with its held values, and the poses it implies.
    fn state(&self, camera: Camera, homographies: &[Homography]) -> Option<State> {
        let camera = self.camera(camera);
        let poses: Option<Vec<Pose>> =
            homographies.iter().map(|h| closed_form::pose_from_homography(&camera, h)).collect();
        poses.map(|cam_from_target| State { camera, cam_from_target })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Vec3, rotation};

    fn homographies(camera: &Camera) -> Vec<Homography> {
        let of_turn = |[x, y, z]: [f64; 3]| {
            let r = rotation::from_xyz_rad(x, y, z);
            let columns = [r.column(0).into(), r.column(1).into(), Vec3::new(3.0, -2.0, 120.0)];
            Homography(camera.k() * Mat3::from_columns(&columns))
        };
        [[0.3, 0.1, 0.0], [0.0, -0.35, 0.4], [-0.25, 0.25, 0.2]].map(of_turn).to_vec()
    }

    #[test]
    fn exact_homographies_give_the_exact_camera_in_any_pixel_frame() {
        let camera = Camera::pinhole(3800.0, 3700.0, 2060.0, 1490.0);
        for frame in [(Vec2::new(2000.0, 1500.0), 1800.0), (Vec2::new(2300.0, 1100.0), 900.0)] {
            let found = normalised_closed_form(&homographies(&camera), &Settings::standard(), frame).unwrap();
            for (own, expected) in found.parameters().iter().zip(camera.parameters()) {
                assert!((own - expected).abs() < 1e-7, "{found:?}");
            }
        }
    }

    #[test]
    fn a_known_principal_point_gives_the_exact_focal_length_of_cells_of_any_shape() {
        for aspect in [1.0, 0.75] {
            let camera = Camera::pinhole(600.0, 600.0 * aspect, 326.0, 243.0);
            let found = focal_from_centre(&homographies(&camera), Vec2::new(326.0, 243.0), aspect).unwrap();
            assert!((found - 600.0).abs() < 1e-8, "{found}");
        }
    }

    #[test]
    fn a_camera_is_plausible_within_what_optics_make() {
        for (fx, fy, cx, is) in [
            (600.0, 600.0, 320.0, true),
            // A tenth of the half-width of 300 px, and two hundred times it.
            (29.0, 35.0, 320.0, false),
            (35.0, 29.0, 320.0, false),
            (31.0, 31.0, 320.0, true),
            (59_000.0, 59_000.0, 320.0, true),
            (61_000.0, 59_000.0, 320.0, false),
            // Cells five times as high as wide, or as wide as high.
            (600.0, 121.0, 320.0, true),
            (600.0, 119.0, 320.0, false),
            (119.0, 600.0, 320.0, false),
            // Five half-widths aside.
            (600.0, 600.0, 320.0 + 1490.0, true),
            (600.0, 600.0, 320.0 + 1510.0, false),
        ] {
            let frame = (Vec2::new(320.0, 240.0), 300.0);
            assert_eq!(is_plausible(&Camera::pinhole(fx, fy, cx, 240.0), frame), is, "{fx} {fy} {cx}");
        }
    }

    #[test]
    fn the_centre_is_what_is_known_of_it_or_the_middle_of_the_image() {
        let pixels = Vec2::new(300.0, 200.0);
        let centre = |settings: &Settings| Held::of(settings, pixels).unwrap().centre;
        let standard = Settings::standard();
        assert_eq!(centre(&standard), pixels);
        // Pixel centres are whole numbers: the middle of 640 lies between 319 and 320.
        let sized = standard.with_image_size((640, 480));
        assert_eq!(centre(&sized), Vec2::new(319.5, 239.5));
        assert_eq!(centre(&sized.clone().with_prior(Parameter::Cy, 250.0, 1.0)), Vec2::new(319.5, 250.0));
        assert_eq!(centre(&sized.hold(Parameter::Cx, 330.0)), Vec2::new(330.0, 239.5));
    }

    #[test]
    fn a_focal_length_known_to_a_tenth_is_a_start() {
        for (sd, expected) in [(59.0, Some(600.0)), (61.0, None)] {
            let settings = Settings::standard().with_prior(Parameter::Fx, 600.0, sd);
            assert_eq!(Held::of(&settings, Vec2::zeros()).unwrap().focal_known, expected);
        }
    }
}
