//! By how much does an estimated camera misplace pixels? The displacement over the frame that its error
//! causes, as it is, and with the rotation taken out that fits best: a calibration does not tell where its
//! camera looks (Kogan 2021).

use calibench::calibrate::Covariance;
use calibench::camera::{Camera, FreeParameters, Lens};
use calibench::evaluate::TakenOut;
use calibench::evaluate::difference::frame_nodes;
use calibench::geometry::Vec2;
use calibench::planning::{Estimated, frame_form};
use calibench::validate::frame_difference;
use nalgebra::{DMatrix, SymmetricEigen};

use super::expected::Expected;

/// One number of the displacement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameQuantity {
    /// Root of the mean square over the nodes of the frame, px.
    Rms,
    /// The largest of the nodes, px.
    Max,
    /// As `Rms`, the rotation taken out that makes it least.
    TurnedRms,
    /// The largest of the nodes with that rotation taken out, px.
    TurnedMax,
}

impl FrameQuantity {
    pub(super) const ALL: [FrameQuantity; 4] =
        [FrameQuantity::Rms, FrameQuantity::Max, FrameQuantity::TurnedRms, FrameQuantity::TurnedMax];

    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            FrameQuantity::Rms => "frame-rms",
            FrameQuantity::Max => "frame-max",
            FrameQuantity::TurnedRms => "turned-rms",
            FrameQuantity::TurnedMax => "turned-max",
        }
    }
}

/// The displacement in one trial; `None` where too little of the frame has a ray.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Displacement {
    plain: Option<[f64; 2]>,
    turned: Option<[f64; 2]>,
}

impl Displacement {
    /// Of an estimated camera against the true one, over a frame of `size` px.
    pub fn of(truth: &Camera<Lens>, estimate: &Camera<Lens>, size: (usize, usize)) -> Displacement {
        Displacement { plain: plain(truth, estimate, size), turned: turned(truth, estimate, size) }
    }

    pub fn value(&self, quantity: FrameQuantity) -> Option<f64> {
        let [rms, max] = match quantity {
            FrameQuantity::Rms | FrameQuantity::Max => self.plain?,
            FrameQuantity::TurnedRms | FrameQuantity::TurnedMax => self.turned?,
        };
        Some(if matches!(quantity, FrameQuantity::Rms | FrameQuantity::TurnedRms) { rms } else { max })
    }
}

/// The share of the frame's nodes that a camera shows; `None` where it shows them all.
pub(super) fn shown(camera: &Camera<Lens>, size: (usize, usize)) -> Option<f64> {
    let nodes = frame_nodes(size).0;
    let seen = nodes.iter().filter(|node| camera.ray(node).is_ok()).count();
    (seen < nodes.len()).then(|| seen as f64 / nodes.len() as f64)
}

/// Where the estimate shows the rays of the true camera's nodes.
fn plain(truth: &Camera<Lens>, estimate: &Camera<Lens>, size: (usize, usize)) -> Option<[f64; 2]> {
    let limit = estimate.distortion.monotone_angle();
    let displaced = |node: &Vec2| {
        let ray = truth.ray(node).ok()?;
        let angle = libm::atan2(ray.xy().norm(), ray.z);
        let pixel = if angle < limit { estimate.pixel(&ray)? } else { return None };
        Some((pixel - node).norm())
    };
    let sizes: Vec<f64> = frame_nodes(size).0.iter().filter_map(displaced).collect();
    let squares: f64 = sizes.iter().map(|size| size * size).sum();
    let largest = sizes.iter().fold(0.0, |most: f64, size| most.max(*size));
    (!sizes.is_empty()).then(|| [(squares / sizes.len() as f64).sqrt(), largest])
}

fn turned(truth: &Camera<Lens>, estimate: &Camera<Lens>, size: (usize, usize)) -> Option<[f64; 2]> {
    let difference = frame_difference(truth, estimate, size, TakenOut::Rotation).ok()?;
    Some([difference.rms_px, difference.largest()?.difference.norm()])
}

/// What the bound expects of the root mean square, to first order in the noise: the error of the camera is
/// normal, so that the mean square is a sum of squares of normal numbers, each times an eigenvalue of `L^T W
/// L` with `P = L L^T`. Theory says nothing of the largest.
pub(super) fn expected(
    quantity: FrameQuantity,
    truth: &Camera<Lens>,
    size: (usize, usize),
    free: FreeParameters,
    bound: &Covariance,
) -> Option<Expected> {
    let is_turned = match quantity {
        FrameQuantity::Rms => false,
        FrameQuantity::TurnedRms => true,
        FrameQuantity::Max | FrameQuantity::TurnedMax => return None,
    };
    let form = frame_form(size, truth, &Estimated { free, fy_per_fx: None }, is_turned).ok()?;
    let root: DMatrix<f64> = bound.intrinsics.clone().cholesky()?.l();
    let eigenvalues = SymmetricEigen::new(root.transpose() * form * &root).eigenvalues;
    root_of_squares(eigenvalues.as_slice())
}

/// The integral below is cut off at `exp(+-this / 2)` of its largest integrand, 1e-10, and taken in steps of
/// a quarter: the integrand is smooth, and the trapezoidal rule converges with the exponential of the inverse
/// step.
const REACH: f64 = 46.0;
const STEP: f64 = 0.25;

/// Mean and standard deviation of `sqrt(Q)`, `Q = sum l_i z_i^2` with standard normal `z_i`: `E Q = sum l_i`,
/// and `E sqrt(Q) = 1 / (2 sqrt(pi)) * integral over t > 0 of (1 - E exp(-t Q)) t^(-3/2)`, with `E exp(-t Q)
/// = prod (1 + 2 l_i t)^(-1/2)`.
fn root_of_squares(eigenvalues: &[f64]) -> Option<Expected> {
    // Roundings of a form that is not negative.
    let eigenvalues: Vec<f64> = eigenvalues.iter().map(|l| l.max(0.0)).collect();
    let mean_square: f64 = eigenvalues.iter().sum();
    if !(mean_square > 0.0 && mean_square.is_finite()) {
        return None;
    }
    // With t = e^s / E Q the integrand falls like e^(-|s| / 2) to both sides.
    let integrand = |s: f64| {
        let t = libm::exp(s) / mean_square;
        let log: f64 = eigenvalues.iter().map(|l| libm::log1p(2.0 * l * t)).sum();
        -libm::expm1(-0.5 * log) * libm::exp(-0.5 * s)
    };
    let steps = (REACH / STEP) as i32;
    let sum: f64 = (-steps..=steps).map(|i| integrand(f64::from(i) * STEP)).sum();
    let mean = mean_square.sqrt() * STEP * sum / (2.0 * std::f64::consts::PI.sqrt());
    Some(Expected { mean, sd: (mean_square - mean * mean).max(0.0).sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench::camera::Parameter;
    use calibench::synth::Truth;

    #[test]
    fn a_lens_that_folds_back_within_the_frame_shows_a_part_of_it() {
        let ideal: Camera<Lens> = Camera::pinhole(600.0, 600.0, 319.5, 239.5).into();
        assert_eq!(shown(&ideal, (640, 480)), None);
        // r (1 - r^2) grows as far as r = 1 / sqrt(3), where it is 2 / sqrt(27): a circle of 231 px in the
        // frame. Nodes stand 21 px apart, and the ring of cells that it cuts is a tenth of the frame.
        let folding = ideal.with_value(Parameter::K1, -1.0).unwrap();
        let radius = 600.0 * 2.0 / 27.0f64.sqrt();
        let expected = std::f64::consts::PI * radius * radius / (640.0 * 480.0);
        let share = shown(&folding, (640, 480)).unwrap();
        assert!((share - expected).abs() < 0.03, "{share} for {expected}");
    }

    #[test]
    fn the_root_of_a_sum_of_squares_has_the_moments_of_a_chi_distribution() {
        // Of one, two and three equal squares: half-normal, Rayleigh and Maxwell, means sqrt(2 / pi), sqrt(pi
        // / 2), sqrt(8 / pi).
        let pi = std::f64::consts::PI;
        for (eigenvalues, mean) in [
            (vec![1.0, 0.0], (2.0 / pi).sqrt()),
            (vec![1.0, 1.0], (pi / 2.0).sqrt()),
            (vec![1.0; 3], (8.0 / pi).sqrt()),
        ] {
            let square: f64 = eigenvalues.iter().sum();
            let scaled: Vec<f64> = eigenvalues.iter().map(|l| 1e-6 * l).collect();
            let found = root_of_squares(&scaled).unwrap();
            assert!((found.mean - 1e-3 * mean).abs() < 1e-12, "{found:?}");
            assert!((found.sd - 1e-3 * (square - mean * mean).sqrt()).abs() < 1e-12, "{found:?}");
        }
        assert!(root_of_squares(&[0.0]).is_none());
    }

    #[test]
    fn a_principal_point_apart_displaces_all_pixels_alike_and_is_mostly_a_rotation() {
        let truth: Camera<Lens> = Truth::example_camera().into();
        let moved = truth.with_value(Parameter::Cx, truth.cx + 3.0).unwrap();
        let found = Displacement::of(&truth, &moved, Truth::EXAMPLE_IMAGE);
        let [rms, max, turned, largest] = FrameQuantity::ALL.map(|q| found.value(q).unwrap());
        assert!((rms - 3.0).abs() < 1e-9 && (max - 3.0).abs() < 1e-9, "{found:?}");
        assert!(turned < 0.6 && turned > 0.05 && largest > turned && largest < 3.0, "{found:?}");
    }

    #[test]
    fn the_root_mean_square_and_the_largest_are_of_all_nodes() {
        // A focal length 1 % longer moves a pixel by a hundredth of its distance from the principal point.
        let truth: Camera<Lens> = Camera::pinhole(600.0, 600.0, 319.5, 239.5).into();
        let longer = Camera { fx: 606.0, fy: 606.0, ..truth };
        let found = Displacement::of(&truth, &longer, (640, 480));
        let centre = Vec2::new(319.5, 239.5);
        let sizes: Vec<f64> =
            frame_nodes((640, 480)).0.iter().map(|node| 0.01 * (node - centre).norm()).collect();
        let rms = (sizes.iter().map(|size| size * size).sum::<f64>() / sizes.len() as f64).sqrt();
        let most = sizes.iter().copied().fold(0.0, f64::max);
        assert!((found.value(FrameQuantity::Rms).unwrap() - rms).abs() < 1e-9, "{found:?}");
        assert!((found.value(FrameQuantity::Max).unwrap() - most).abs() < 1e-9, "{found:?}");
    }
}
