//! Are the residuals and the covariance of a plane calibration what theory says, for all three families?

use calibench::geometry::{Homography, Mat3, Vec2};
use calibench::planar::{PlaneModel, calibrate_plane};
use calibench::synth::{Stream, StreamKey};
use nalgebra::{DMatrix, DVector};

/// World units; the plane below has about 0.0042 units a pixel, so this is 0.025 px.
const SIGMA: f64 = 1e-4;
/// With z = 4.5 every two-sided check has a false-alarm rate of 7e-6, for a seed that is fixed.
const TRIALS: u64 = 2000;
const Z: f64 = 4.5;

/// Nine marks as the chapter's image shows them, about a centre of (715, 566), 236.2 px apart.
fn pixels() -> Vec<Vec2> {
    let offset = |i: i32| 236.2 * f64::from(i - 1);
    (0..9).map(|i| Vec2::new(714.7 + offset(i % 3), 566.0 + offset(i / 3))).collect()
}

/// A true map of the family: Y up, turned a little, and tilted for the projective one.
fn truth(model: PlaneModel) -> Homography {
    let (a, b) = (0.00423, 0.0001);
    let (a2, h31, h32) = match model {
        PlaneModel::Similarity => (-a, 0.0, 0.0),
        PlaneModel::Affine => (-0.98 * a, 0.0, 0.0),
        PlaneModel::Projective => (-a, 5e-5, -3e-5),
    };
    Homography(Mat3::new(a, b, -3.08, b, a2, 2.33, h31, h32, 1.0))
}

/// Matrix entries that are free in the family and independent of each other, by their place in a row-by-row
/// count.
fn free_entries(model: PlaneModel) -> &'static [usize] {
    match model {
        PlaneModel::Similarity => &[0, 1, 2, 5],
        PlaneModel::Affine => &[0, 1, 2, 3, 4, 5],
        PlaneModel::Projective => &[0, 1, 2, 3, 4, 5, 6, 7],
    }
}

/// `e^T C^-1 e`, with rows and columns scaled to correlations first.
fn mahalanobis(error: &DVector<f64>, covariance: &DMatrix<f64>) -> f64 {
    let sd: Vec<f64> = (0..error.len()).map(|i| covariance[(i, i)].sqrt()).collect();
    let correlation = DMatrix::from_fn(sd.len(), sd.len(), |i, j| covariance[(i, j)] / (sd[i] * sd[j]));
    let scaled = DVector::from_fn(sd.len(), |i, _| error[i] / sd[i]);
    scaled.dot(&correlation.cholesky().unwrap().solve(&scaled))
}

fn check(model: PlaneModel) {
    let truth = truth(model);
    let exact: Vec<Vec2> = pixels().iter().map(|p| truth.apply(p).unwrap()).collect();
    // A corner of the image, beyond the marks: there the map's error is largest.
    let corner = Vec2::new(1570.0, 1052.0);
    let corner_true = truth.apply(&corner).unwrap();
    let entries = free_entries(model);
    let (mut chi_residual, mut chi_entries, mut chi_corner) = (0.0, 0.0, 0.0);
    for trial in 0..TRIALS {
        let key = StreamKey { seed: 20260101, scenario: "plane", trial, purpose: "noise" };
        let mut stream = Stream::open(key);
        let world: Vec<Vec2> =
            exact.iter().map(|w| w + Vec2::new(stream.normal(), stream.normal()) * SIGMA).collect();
        let fit = calibrate_plane(model, &pixels(), &world).unwrap();
        let spread = fit.spread.unwrap();
        // The covariance at the true sigma: the estimated one cancels.
        let scale = (SIGMA / spread.sigma) * (SIGMA / spread.sigma);
        chi_residual += 9.0 * fit.rms_point * fit.rms_point / (SIGMA * SIGMA);
        let all = spread.covariance.unwrap();
        let matrix = fit.map.matrix();
        let at = |m: &Mat3, entry: usize| m[(entry / 3, entry % 3)];
        let covariance =
            DMatrix::from_fn(entries.len(), entries.len(), |i, j| all[(entries[i], entries[j])] * scale);
        let error =
            DVector::from_fn(entries.len(), |i, _| at(&matrix, entries[i]) - at(&truth.0, entries[i]));
        chi_entries += mahalanobis(&error, &covariance);
        let covariance = spread.world_covariance(&corner).unwrap() * scale;
        let error = fit.map.world_from_pixel(&corner).unwrap() - corner_true;
        chi_corner += error.dot(&covariance.cholesky().unwrap().solve(&error));
    }
    // Each is chi-square with d degrees of freedom: mean d, variance 2 d. The families are linear, or nearly
    // so at a noise of 1e-4 over marks 1 unit apart: the second order is 1e-4 of the first.
    let parameters = model.parameters() as f64;
    for (sum, d) in [(chi_residual, 18.0 - parameters), (chi_entries, parameters), (chi_corner, 2.0)] {
        let mean = sum / TRIALS as f64;
        let interval = Z * (2.0 * d / TRIALS as f64).sqrt();
        assert!((mean - d).abs() < interval, "{model:?}: {mean} for {d} +- {interval}");
    }
}

#[test]
fn the_affine_map_attains_its_predicted_spread() {
    check(PlaneModel::Affine);
}

#[test]
fn the_projective_map_attains_its_predicted_spread() {
    check(PlaneModel::Projective);
}

#[test]
fn the_similarity_attains_its_predicted_spread() {
    check(PlaneModel::Similarity);
}

#[test]
fn each_family_finds_its_own_exact_map_and_the_larger_ones_too() {
    use PlaneModel::{Affine, Projective, Similarity};
    for (true_family, fitted) in [
        (Similarity, Similarity),
        (Similarity, Affine),
        (Similarity, Projective),
        (Affine, Affine),
        (Affine, Projective),
        (Projective, Projective),
    ] {
        let truth = truth(true_family);
        let world: Vec<Vec2> = pixels().iter().map(|p| truth.apply(p).unwrap()).collect();
        let fit = calibrate_plane(fitted, &pixels(), &world).unwrap();
        // World coordinates of order one; the projective fit's own test allows 1e-11 of order 100.
        assert!(fit.max_point < 1e-13, "{fitted:?}: {:e}", fit.max_point);
        assert!((fit.map.matrix() - truth.0).norm() < 1e-11, "{fitted:?}");
        for (p, w) in pixels().iter().zip(&world) {
            // 1e-13 world units are 2.4e-11 px.
            assert!((fit.map.pixel_from_world(w).unwrap() - p).norm() < 1e-9);
        }
    }
}

#[test]
fn a_smaller_family_shows_in_its_residuals_what_it_cannot_follow() {
    let tilted = truth(PlaneModel::Projective);
    let world: Vec<Vec2> = pixels().iter().map(|p| tilted.apply(p).unwrap()).collect();
    let rms = |model| calibrate_plane(model, &pixels(), &world).unwrap().rms_point;
    assert!(rms(PlaneModel::Similarity) > rms(PlaneModel::Affine));
    // h31 over 236 px bends the marks by 1 %: far above the exact fit.
    assert!(rms(PlaneModel::Affine) > 1e-3 && rms(PlaneModel::Projective) < 1e-13);
}
