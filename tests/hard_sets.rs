//! The sets that a stranger's scenes once got a wrong answer with: `reference/hard-sets`, each with what is
//! right.

use calibench::board::View;
use calibench::calibrate::{
    Calibration, CalibrationError, Outliers, Settings, Termination, Warning, calibrate,
};
use calibench::camera::FreeParameters;
use calibench::io::parse_corners;

fn views(name: &str) -> Vec<View> {
    let path = format!("{}/reference/hard-sets/{name}.csv", env!("CARGO_MANIFEST_DIR"));
    parse_corners(name, std::fs::read(path).unwrap().as_slice()).unwrap().views
}

fn calibrated(
    name: &str,
    free: &str,
    image_size: Option<(usize, usize)>,
) -> Result<Calibration, CalibrationError> {
    let free: FreeParameters = free.parse().unwrap();
    let mut settings = Settings::new(free);
    settings.image_size = image_size;
    calibrate(&views(name), &settings)
}

const CHAPTER: &str = "fx,fy,cx,cy,k1,k2";

/// The reference's cost and focal length: a search that starts at the truth, written by somebody else in
/// another language.
#[test]
fn the_minimum_is_the_one_next_to_the_truth() {
    let rows = [
        ("two-views-of-circles", CHAPTER, Some((320, 240)), 5.299215e-5, 456.489),
        ("tangential-few-marks", "fx,fy,cx,cy,k1,k2,p1,p2", None, 8.119664e-4, 9270.378),
        ("strip-collapses", CHAPTER, None, 0.1123967, 57055.03),
        ("refused-as-parallel", CHAPTER, None, 0.1357233, 4623.379),
        ("two-views-five-parameters", "fx,fy,cx,cy,skew,k1,k2", None, 1.201278e-4, 689.0634),
        ("two-views-long-lens", CHAPTER, None, 1.470163e-3, 16441.27),
    ];
    for (name, free, image_size, cost, fx) in rows {
        let result = calibrated(name, free, image_size).unwrap();
        assert_eq!(result.termination, Termination::Converged, "{name}");
        let found = result.rmse_px * result.rmse_px * result.points() as f64;
        assert!((found / cost - 1.0).abs() < 1e-6, "{name}: {found:e} instead of {cost:e}");
        assert!((result.camera.fx / fx - 1.0).abs() < 1e-6, "{name}: {}", result.camera.fx);
    }
}

#[test]
fn a_view_whose_other_tilt_does_as_well_is_named() {
    let result = calibrated("turned-view", "fx,fy,cx,cy", None).unwrap();
    let twin = result.warnings.iter().find_map(|w| match w {
        Warning::TwinPose { view, degrees, excess, .. } => Some((*view, *degrees, *excess)),
        _ => None,
    });
    let (view, degrees, excess) = twin.unwrap_or_else(|| panic!("{:?}", result.warnings));
    assert_eq!(view, 10);
    assert!((70.0..85.0).contains(&degrees) && (0.0..1.0).contains(&excess), "{degrees} {excess}");
}

#[test]
fn without_anything_to_certify_by_a_warning_says_so() {
    let result = calibrated("views-of-four-marks", "fx,fy,cx,cy", None).unwrap();
    assert!(!result.certificate.unwrap().is_possible());
    assert!(result.warnings.contains(&Warning::NotCertified));
    let few = |w: &Warning| matches!(w, Warning::FewDegreesOfFreedom { degrees_of_freedom: 8, .. });
    assert!(result.warnings.iter().any(few), "{:?}", result.warnings);
}

/// Homographies bend along with a board, so that the certificate holds; neighbours' residuals do not.
#[test]
fn a_bent_board_shows_in_the_residuals() {
    let result = calibrated("bent-board", CHAPTER, None).unwrap();
    let is_structured = |w: &Warning| matches!(w, Warning::Structured { correlation } if *correlation > 0.5);
    assert!(result.warnings.iter().any(is_structured), "{:?}", result.warnings);
}

#[test]
fn copies_are_found_behind_their_rounding() {
    let error = calibrated("copies-with-rounding", CHAPTER, None).unwrap_err();
    assert_eq!(error, CalibrationError::TooFewViews { need: 2, got: 1, linear: 4, copies: 4 });
}

#[test]
fn one_mark_in_ten_astray_is_blamed_and_not_the_tilts() {
    let error = calibrated("one-mark-in-ten-astray", CHAPTER, None).unwrap_err();
    assert!(matches!(error, CalibrationError::Outliers(Outliers { marks: 38, .. })), "{error}");
}
