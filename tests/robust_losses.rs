//! Robust losses where marks are astray: the estimate, its uncertainty, and what is said of the model.

use calibench::board::View;
use calibench::calibrate::{
    Board, CalibrationError, Candidate, Freedom, Loss, Settings, Warning, calibrate_lens, compare_models,
    explaining_freedoms,
};
use calibench::camera::{Camera, Lens, Model, Parameter};
use calibench::geometry::Vec2;

use crate::lens_views::{board, poses, seen};

const SIZE: (usize, usize) = (1280, 960);

fn camera(model: Model, fx: f64, fy: f64, coefficients: &[f64]) -> Camera<Lens> {
    Camera::with_lens(fx, fy, 655.0, 470.0, Lens::new(model, coefficients).unwrap())
}

fn settings(model: Model) -> Settings {
    Settings::of_model(model).with_image_size(SIZE)
}

/// What a camera sees of twelve boards with noise of 0.1 px, one mark in ten astray by `off` px; the boards
/// are twisted by `twist`.
fn astray(truth: &Camera<Lens>, distance: f64, off: f64, twist: f64) -> Vec<View> {
    let mut views = seen(truth, &poses(12, distance, [0.5, 0.5]), |_| board(), twist);
    for (k, view) in views.iter_mut().enumerate() {
        let mut pixels = view.pixels().to_vec();
        for mark in (k % 9..pixels.len()).step_by(10) {
            pixels[mark] += off * Vec2::new(libm::cos(mark as f64), libm::sin(1.7 * mark as f64));
        }
        *view = View::new(view.points().to_vec(), pixels).unwrap();
    }
    views
}

fn fisheye() -> Camera<Lens> {
    camera(Model::KannalaBrandt, 420.0, 424.0, &[-0.02, 0.004, -0.001, 0.0002])
}

/// What two lenses see with marks astray by 8 px.
fn with_strays() -> [(Model, Vec<View>); 2] {
    let brown = camera(Model::BrownConrady, 800.0, 805.0, &[-0.2, 0.05, 0.0, 0.0, 0.0]);
    [(fisheye(), 60.0), (brown, 150.0)]
        .map(|(truth, distance)| (truth.distortion.model(), astray(&truth, distance, 8.0, 0.0)))
}

const ROBUST: [Loss; 2] = [Loss::Cauchy { scale_px: 0.2 }, Loss::Huber { delta_px: 0.1 }];

/// What is known beforehand as well as the marks say it takes half of the way, whatever the loss: the cost's
/// curvature, the normal matrix and the covariance are three numbers there.
#[test]
fn a_prior_under_a_robust_loss_weighs_what_it_says() {
    for (model, views) in with_strays() {
        for loss in ROBUST {
            let settings = settings(model).with_loss(loss);
            let alone = calibrate_lens(&views, &settings).unwrap();
            for parameter in [Parameter::Fx, Parameter::Cx, Parameter::K1] {
                let at = alone.camera.value(parameter).unwrap();
                let sd = alone.standard_deviation(parameter).unwrap();
                let both = calibrate_lens(&views, &settings.clone().with_prior(parameter, at + 2.0 * sd, sd))
                    .unwrap();
                let moved = (both.camera.value(parameter).unwrap() - at) / sd;
                assert!((moved - 1.0).abs() < 0.05, "{model:?} {loss:?} {parameter}: {moved}");
                let left = both.standard_deviation(parameter).unwrap() / sd;
                assert!((left - 0.5_f64.sqrt()).abs() < 0.02, "{model:?} {loss:?} {parameter}: {left}");
            }
        }
    }
}

/// What one standard deviation costs is not the variance that scales the covariance where a loss is robust.
#[test]
fn a_robust_loss_makes_no_interval_of_another_width() {
    for (model, views) in with_strays() {
        for loss in ROBUST {
            let settings = settings(model).with_loss(loss).with_profile_intervals(0.95);
            let found = calibrate_lens(&views, &settings).unwrap();
            let misleads = |w: &Warning| matches!(w, Warning::NotLinear { .. });
            for interval in &found.intervals {
                let (low, high) = (interval.low.unwrap(), interval.high.unwrap());
                let ratio = (high - low) / (interval.linear.1 - interval.linear.0);
                // In units of the covariance's variance they would be 1.13 times as wide and more.
                assert!((ratio - 1.0).abs() < 0.08, "{loss:?} {}: {ratio}", interval.parameter);
            }
            assert!(!found.warnings.iter().any(misleads), "{:?}", found.warnings);
        }
    }
}

/// A sum of squares is that of the strays, and a lens with coefficients to spare would bend to one of them.
#[test]
fn strays_do_not_choose_the_lens() {
    let truth = camera(Model::BrownConrady, 800.0, 805.0, &[-0.2, 0.05, 1e-3, -8e-4, 0.0]);
    for off in [1.0, 5.0, 15.0, 60.0] {
        let views = astray(&truth, 150.0, off, 0.0);
        for loss in ROBUST {
            let settings = Settings::standard().with_image_size(SIZE).with_loss(loss);
            let (compared, _) = compare_models(&views, &settings, &Candidate::usual());
            let chosen = &compared[0];
            let name = |c: &Candidate| format!("{} {}", c.model, c.coefficients);
            assert_eq!(name(&chosen.candidate), "brown-conrady k1,k2,p1,p2", "{off} px, {loss:?}");
            // Of a coordinate, as of noise alone; the strays are in the RMSE.
            let hold_out_px = chosen.hold_out_px.unwrap();
            assert!((0.09..0.13).contains(&hold_out_px), "{off} px, {loss:?}: {hold_out_px}");
            assert!(chosen.calibration.rmse_px > 0.2 * off, "{}", chosen.calibration.rmse_px);
        }
    }
}

#[test]
fn strays_hide_no_structure_and_not_what_explains_it() {
    let standard_deviation = f64::INFINITY;
    for loss in ROBUST {
        let settings = settings(Model::KannalaBrandt).with_loss(loss);
        let views = astray(&fisheye(), 60.0, 15.0, 0.3);
        let flat = calibrate_lens(&views, &settings).unwrap();
        let is_structured = |w: &Warning| matches!(w, Warning::Structured { .. });
        assert!(flat.warnings.iter().any(is_structured), "{loss:?}: {:?}", flat.warnings);
        let found = explaining_freedoms(&views, &settings, &flat);
        let best = found.first().unwrap();
        assert_eq!(best.candidate.board, Board::Bent { standard_deviation }, "{loss:?}: {found:?}");
        // Of a mark: 0.1 px a coordinate, and what poses take up.
        assert!(
            (0.12..0.16).contains(&best.rmse_px) && best.rmse_without_px > 1.2 * best.rmse_px,
            "{best:?}"
        );
        // Marks that are astray alone share nothing.
        let strays = calibrate_lens(&astray(&fisheye(), 60.0, 15.0, 0.0), &settings).unwrap();
        assert!(!strays.warnings.iter().any(is_structured), "{loss:?}: {:?}", strays.warnings);
    }
}

/// Far below the noise a loss weighs every mark by its residual, and deviations by its slopes mean nothing.
#[test]
fn a_loss_narrower_than_the_noise_is_refused_with_any_lens() {
    for (model, views) in with_strays() {
        for (loss, is_narrow) in [
            (Loss::Huber { delta_px: 0.02 }, true),
            (Loss::Cauchy { scale_px: 0.04 }, true),
            (Loss::Huber { delta_px: 0.05 }, false),
            (Loss::Cauchy { scale_px: 0.1 }, false),
        ] {
            let outcome = calibrate_lens(&views, &settings(model).with_loss(loss));
            let is_refused = matches!(outcome, Err(CalibrationError::NarrowLoss { .. }));
            assert_eq!(is_refused, is_narrow, "{model} {loss:?}: {:?}", outcome.err());
        }
    }
}

/// Strays are in the RMSE and the loss keeps them out of the floor: the two are no measure of each other.
#[test]
fn strays_make_no_result_unusable_and_hide_no_small_freedom() {
    let truth = camera(Model::BrownConrady, 800.0, 805.0, &[-0.2, 0.05, 4e-4, -3e-4, 0.0]);
    for loss in ROBUST {
        let settings = Settings::standard().with_image_size(SIZE).with_loss(loss);
        let views = astray(&truth, 150.0, 15.0, 0.0);
        let found = calibrate_lens(&views, &settings).unwrap();
        let certificate = found.certificate.unwrap();
        assert!(found.is_usable(), "{loss:?}: {certificate:?}");
        assert!(found.rmse_px > 4.0 * certificate.rmse_px, "{loss:?}: {certificate:?}");
        assert!(certificate.rmse_px >= certificate.floor_rmse_px);
        let explaining = explaining_freedoms(&views, &settings, &found);
        let is_it = |f: &Freedom| f.candidate.coefficients.to_string() == "k1,k2,p1,p2";
        assert!(explaining.iter().any(is_it), "{loss:?}: {explaining:?}");
    }
}
