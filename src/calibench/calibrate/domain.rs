//! Which settings can no camera meet, and which views tell no pose? Told before any camera is looked for, and
//! alike by every estimator.

use super::{CalibrationError, Loss, Prior, Role, Settings};
use crate::board::View;
use crate::camera::Parameter;
use crate::geometry::{Homography, HomographyError, Vec3};

/// Scales of a robust loss, px: with any other their squares are lost in rounding.
const SCALES_PX: std::ops::RangeInclusive<f64> = 1e-9..=1e9;

/// The square of a smaller standard deviation has no inverse.
const LEAST_DEVIATION: f64 = 1e-100;

impl Loss {
    /// Whether a robust loss has a scale from 1e-9 to 1e9 px.
    pub fn is_valid(&self) -> bool {
        match *self {
            Loss::Squares => true,
            Loss::Huber { delta_px: scale } | Loss::Cauchy { scale_px: scale } => SCALES_PX.contains(&scale),
        }
    }
}

impl Prior {
    /// Whether a camera may have the value, and the standard deviation says something of it.
    fn is_possible(&self) -> bool {
        let sd = self.standard_deviation;
        self.parameter.is_defined_at(self.mean) && sd >= LEAST_DEVIATION && sd.is_finite()
    }
}

/// The loss, priors, start, image size and coverage are possible, each parameter belongs to the model and is
/// free or has a value.
///
/// # Errors
/// The first that is not.
pub(crate) fn check(settings: &Settings) -> Result<(), CalibrationError> {
    if !settings.loss.is_valid() {
        return Err(CalibrationError::BadLoss);
    }
    if let Some(Prior { parameter, mean, standard_deviation }) = settings.priors().find(|p| !p.is_possible())
    {
        return Err(CalibrationError::BadPrior { parameter, mean, standard_deviation });
    }
    if let Some(coverage) = settings.profile_coverage.filter(|coverage| !(*coverage > 0.0 && *coverage < 1.0))
    {
        return Err(CalibrationError::BadCoverage { coverage });
    }
    if let Some((width, height)) = settings.image_size.filter(|(width, height)| width.min(height) == &0) {
        return Err(CalibrationError::BadImageSize { width, height });
    }
    check_start(settings)?;
    settings.tie()?;
    check_parameters(settings)
}

/// Values that a camera may have.
fn check_start(settings: &Settings) -> Result<(), CalibrationError> {
    let Some(start) = settings.start else { return Ok(()) };
    let values = Parameter::ALL.into_iter().zip(start.parameters());
    match values.into_iter().find(|(parameter, value)| !parameter.is_defined_at(*value)) {
        Some((parameter, value)) => Err(CalibrationError::BadStart { parameter, value }),
        None => Ok(()),
    }
}

/// Roles are given to parameters of the model only, and what is not estimated has a value.
fn check_parameters(settings: &Settings) -> Result<(), CalibrationError> {
    let model = settings.model();
    let is_foreign = |p: &Parameter| !model.parameters().any(|own| own == *p);
    let mut told = Parameter::OF_ALL_MODELS.into_iter().filter(|&p| settings.role(p) != Role::Default);
    if let Some(parameter) = told.find(is_foreign) {
        return Err(CalibrationError::NotOfModel { parameter, model });
    }
    model.parameters().try_for_each(|parameter| settings.held(parameter).map(drop))
}

/// Whether a view tells its pose. Marks on a line do not, and with but one beside the line they tell it as
/// badly: such a view is refused. The homography of the marks to themselves says it of the board's side; of
/// pixels it is no question beyond a pinhole.
pub(super) fn spans_a_plane(view: &View) -> Result<(), HomographyError> {
    Homography::fit(view.points(), view.points()).map(drop)
}

/// The same, as fast where nothing is wrong with it.
pub(super) fn refuse_line(view: usize, marks: &View) -> Result<(), CalibrationError> {
    let points = marks.points();
    if is_line_but_for_one(points.len(), 0.0, |i| Vec3::new(points[i].x, points[i].y, 0.0)) {
        return spans_a_plane(marks).map_err(|source| CalibrationError::View { view, source });
    }
    Ok(())
}

/// Whether so many points, one of them `at(i)`, lie on a line but for one at most: farther from it than by
/// rounding, and by `thickness` of their distance from a point on it. A look at the first three and at two
/// beside their lines says so of most.
pub(crate) fn is_line_but_for_one(count: usize, thickness: f64, at: impl Fn(usize) -> Vec3) -> bool {
    let sine = thickness.max(ROUNDED);
    // Of three points two are on the line, if there is one.
    let through_two = || {
        [(0, 1), (0, 2), (1, 2)].into_iter().any(|(a, b)| {
            let (from, along) = (at(a), at(b) - at(a));
            let is_beside = |&i: &usize| {
                let to = at(i) - from;
                along.cross(&to).norm_squared() > sine * sine * along.norm_squared() * to.norm_squared()
            };
            along.norm_squared() > 0.0 && (0..count).filter(is_beside).take(2).count() < 2
        })
    };
    count < 3 || through_two()
}

/// A sine that rounding makes of points on a line, and more.
const ROUNDED: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, Model};
    use crate::geometry::Vec2;

    #[test]
    fn a_line_but_for_one_is_told_wherever_the_one_stands() {
        let is_line = |points: &[Vec3]| is_line_but_for_one(points.len(), 0.0, |i| points[i]);
        let on_line = |i: usize| Vec3::new(1.0, -2.0, 0.3) * i as f64 + Vec3::new(7.0, 0.0, 100.0);
        let line: Vec<Vec3> = (0..6).map(on_line).collect();
        assert!(is_line(&line) && (0..3).all(|count| is_line(&line[..count])));
        for place in 0..6 {
            let mut points = line.clone();
            points[place] += Vec3::new(3.0, 1.0, 0.0);
            assert!(is_line(&points), "{place}");
            points[(place + 1) % 6] -= Vec3::new(5.0, 0.1, 1.0);
            assert!(!is_line(&points), "{place}");
        }
        // As flat as it is allowed to be.
        let mut bent = line;
        bent[3].x += 1e-4;
        bent[4].y += 1e-4;
        assert!(!is_line(&bent) && is_line_but_for_one(6, 1e-3, |i| bent[i]));
    }

    #[test]
    fn a_view_is_refused_where_its_homography_to_itself_is() {
        let grid = |i: usize| Vec2::new((i % 3) as f64, (i / 3) as f64);
        for chosen in [&[0, 1, 2, 5][..], &[0, 3, 6, 7], &[0, 1, 2, 3, 4], &[0, 4, 8, 2], &[0, 1, 3, 4]] {
            let points: Vec<Vec2> = chosen.iter().map(|&i| grid(i)).collect();
            let view = View::new(points.clone(), points).unwrap();
            assert_eq!(refuse_line(0, &view).is_err(), spans_a_plane(&view).is_err(), "{chosen:?}");
        }
    }

    #[track_caller]
    fn is_refused(settings: Settings, is_meant: fn(&CalibrationError) -> bool) {
        let error = check(&settings).expect_err("an impossible setting");
        assert!(is_meant(&error), "{error:?}");
    }

    fn square_pixels() -> Settings {
        Settings::standard()
    }

    #[test]
    fn a_coverage_is_a_probability() {
        for coverage in [2.0, 1.0, 0.0, -3.0, f64::NAN] {
            let settings = square_pixels().with_profile_intervals(coverage);
            is_refused(settings, |e| matches!(e, CalibrationError::BadCoverage { .. }));
        }
        assert_eq!(check(&square_pixels().with_profile_intervals(0.999)), Ok(()));
    }

    #[test]
    fn a_start_is_a_camera() {
        let camera = Camera::pinhole(600.0, 600.0, 320.0, 240.0);
        for start in [
            Camera { fx: f64::NAN, ..camera },
            Camera { fy: -1.0, ..camera },
            Camera { cx: 1.0 / 0.0, ..camera },
        ] {
            is_refused(square_pixels().starting_at(start), |e| {
                matches!(e, CalibrationError::BadStart { .. })
            });
        }
        assert_eq!(check(&square_pixels().starting_at(camera)), Ok(()));
    }

    #[test]
    fn an_image_has_pixels() {
        for size in [(0, 480), (640, 0), (0, 0)] {
            let settings = square_pixels().with_image_size(size);
            is_refused(settings, |e| matches!(e, CalibrationError::BadImageSize { .. }));
        }
    }

    #[test]
    fn a_robust_loss_has_a_scale_that_can_be_squared() {
        for scale_px in [1e300, 1e-300, 0.0, -1.0, f64::INFINITY, f64::NAN] {
            let settings = square_pixels().with_loss(Loss::Cauchy { scale_px });
            is_refused(settings, |e| matches!(e, CalibrationError::BadLoss));
        }
    }

    #[test]
    fn values_lie_where_the_model_is_defined() {
        let sphere = Settings::of_model(Model::DoubleSphere);
        is_refused(sphere.clone().hold(Parameter::Alpha, 7.0), |e| {
            matches!(e, CalibrationError::BadHeldValue { .. })
        });
        is_refused(sphere.clone().with_prior(Parameter::Xi, 1.5, 0.1), |e| {
            matches!(e, CalibrationError::BadPrior { .. })
        });
        assert_eq!(check(&sphere.hold(Parameter::Alpha, 1.0)), Ok(()));
    }
}
