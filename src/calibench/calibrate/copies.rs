//! Views and marks that were given more than once are calibrated from once, and have their place in the
//! result.

use super::duplicates::Distinct;
use super::{Calibration, CalibrationError, Outliers, Warning};
use crate::board::View;

/// What `calibrate` makes of the views without copies, for all that were given.
pub(super) fn without<L>(
    views: &[View],
    calibrate: impl Fn(&[View]) -> Result<Calibration<L>, CalibrationError>,
) -> Result<Calibration<L>, CalibrationError> {
    let Some(distinct) = Distinct::of(views) else { return calibrate(views) };
    match calibrate(&distinct.views(views)) {
        Ok(calibration) => Ok(with_copies(calibration, &distinct)),
        Err(CalibrationError::View { view, source }) => {
            Err(CalibrationError::View { view: distinct.kept[view], source })
        }
        Err(CalibrationError::TooFewViews { need, got, linear, .. }) => {
            Err(CalibrationError::TooFewViews { need, got, linear, copies: views.len() - got })
        }
        Err(CalibrationError::Outliers(mut outliers)) => {
            (outliers.view, outliers.point) = distinct.given_mark(outliers.view, outliers.point);
            Err(CalibrationError::Outliers(outliers))
        }
        Err(error) => Err(error),
    }
}

/// The result for all that was given: a copy has the pose and the residuals of what it is a copy of, and
/// counts in no statistic.
fn with_copies<L>(mut calibration: Calibration<L>, distinct: &Distinct) -> Calibration<L> {
    fn at<T: Clone>(list: &[T], place: &[usize]) -> Vec<T> {
        place.iter().map(|&i| list[i].clone()).collect()
    }
    let place = &distinct.place;
    calibration.cam_from_target = at(&calibration.cam_from_target, place);
    calibration.residuals =
        (0..place.len()).map(|view| distinct.spread(view, &calibration.residuals)).collect();
    calibration.covariance.poses = at(&calibration.covariance.poses, place);
    calibration.covariance.cross = at(&calibration.covariance.cross, place);
    for warning in &mut calibration.warnings {
        match warning {
            Warning::Outliers(Outliers { view, point, .. }) => {
                (*view, *point) = distinct.given_mark(*view, *point);
            }
            Warning::TwinPose { view, .. } | Warning::FromBehind { view, .. } => *view = distinct.kept[*view],
            _ => {}
        }
    }
    let copies = place.len() - distinct.kept.len();
    if let Some(view) = (0..place.len()).find(|&view| distinct.kept[place[view]] != view) {
        let copy_of = distinct.kept[place[view]];
        calibration.warnings.push(Warning::Duplicates { view, copy_of, copies });
    }
    if let Some((marks, view, point)) = distinct.repeated {
        calibration.warnings.push(Warning::RepeatedMarks { marks, view, point });
    }
    calibration
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::tests::four_views;
    use crate::calibrate::{Settings, calibrate};

    #[test]
    fn copies_are_counted_in_what_is_told() {
        let views = four_views(0.1);
        let copied =
            |order: &[usize]| -> Vec<View> { order.iter().map(|&view| views[view].clone()).collect() };
        let found = calibrate(&copied(&[0, 1, 2, 3, 1, 0, 1]), &Settings::standard()).unwrap();
        assert!(found.warnings.contains(&Warning::Duplicates { view: 4, copy_of: 1, copies: 3 }));
        assert_eq!(found.residuals[6], found.residuals[1]);
        // Three copies of one view are one.
        let refused = calibrate(&copied(&[1, 1, 1]), &Settings::standard());
        let expected = CalibrationError::TooFewViews { need: 2, got: 1, linear: 4, copies: 2 };
        assert_eq!(refused.map(|found| found.camera), Err(expected));
    }
}
