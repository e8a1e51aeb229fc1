//! What does theory expect of a cell before anything is drawn? The Cramer-Rao bound and the distributions
//! that follow from it.

use super::expected::Expected;
use super::frame;
use super::quantity::Quantity;
use super::spec::Length;
use calibench::calibrate::Covariance;
use calibench::camera::{Camera, FreeParameters, Lens, Model};
use calibench::evaluate::{RmseDistribution, cramer_rao};
use calibench::geometry::Vec2;
use calibench::synth::Truth;

/// The predictions of a cell, one a quantity; `None` where theory says nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction(pub Vec<Option<Expected>>);

/// Where poses are drawn anew in every trial, the prediction is the mean over those of the first trials.
pub(super) const DRAWS: u64 = 200;

/// A central difference over this part of a standard deviation is exact to the square of it.
const GRADIENT_STEP: f64 = 0.01;

impl Prediction {
    /// For one set of poses.
    pub(super) fn of(
        quantities: &[Quantity],
        truth: &Truth<Lens>,
        (model, free): (Model, FreeParameters),
        sigma_px: f64,
        length: Option<&(Length, [Vec2; 2])>,
    ) -> Prediction {
        // Theory speaks of estimators that know what lens it is.
        if model != truth.camera.distortion.model() {
            return Prediction(vec![None; quantities.len()]);
        }
        let bound = cramer_rao(truth, free, sigma_px).ok();
        let rmse = RmseDistribution {
            sigma_px,
            points: truth.points.len() * truth.cam_from_target.len(),
            parameters: free.len() + 6 * truth.cam_from_target.len(),
        };
        let one = |quantity: &Quantity| match quantity {
            Quantity::Rmse => (rmse.degrees_of_freedom() > 0)
                .then(|| Expected { mean: rmse.mean_px(), sd: rmse.standard_deviation_px() }),
            Quantity::Nees => nees(free.len() as f64, rmse.degrees_of_freedom() as f64),
            Quantity::Parameter(p) => error(bound.as_ref()?.standard_deviation(*p)?),
            Quantity::Depth => error(bound.as_ref()?.poses.first()?[(5, 5)].sqrt()),
            Quantity::Length => error(length_sd(&truth.camera, free, bound.as_ref()?, length?)?),
            Quantity::Frame(of_frame) => {
                frame::expected(*of_frame, &truth.camera, truth.image_size, free, bound.as_ref()?)
            }
        };
        Prediction(quantities.iter().map(one).collect())
    }

    /// The mean over several sets of poses: means of means and of variances. A quantity that one set cannot
    /// predict has none.
    pub(super) fn mean_of(sets: &[Prediction]) -> Prediction {
        let count = sets.len() as f64;
        let quantities = sets.first().map_or(0, |s| s.0.len());
        let mean = |q: usize| {
            let (mut mean, mut variance) = (0.0, 0.0);
            for set in sets {
                let p = set.0[q]?;
                mean += p.mean / count;
                variance += p.sd * p.sd / count;
            }
            Some(Expected { mean, sd: variance.sqrt() })
        };
        Prediction((0..quantities).map(mean).collect())
    }
}

fn error(sd: f64) -> Option<Expected> {
    sd.is_finite().then_some(Expected { mean: 0.0, sd })
}

/// With sigma estimated from `d` degrees of freedom, `e^T P^-1 e / n` follows Fisher's F with `(n, d)`: mean
/// `d / (d - 2)`, variance `2 d^2 (n + d - 2) / (n (d - 2)^2 (d - 4))`.
fn nees(n: f64, d: f64) -> Option<Expected> {
    if n == 0.0 || d <= 4.0 {
        return None;
    }
    let variance = 2.0 * d * d * (n + d - 2.0) / (n * (d - 2.0) * (d - 2.0) * (d - 4.0));
    Some(Expected { mean: n * d / (d - 2.0), sd: n * variance.sqrt() })
}

/// `sqrt(g^T P g)` with the gradient `g` of the measured length by the intrinsics.
fn length_sd(
    camera: &Camera<Lens>,
    free: FreeParameters,
    bound: &Covariance,
    (length, pixels): &(Length, [Vec2; 2]),
) -> Option<f64> {
    let slope = |p| {
        let step = GRADIENT_STEP * bound.standard_deviation(p)?;
        let value = camera.value(p)?;
        let at = |sign: f64| length.error_mm(&camera.with_value(p, value + sign * step)?, pixels);
        Some((at(1.0)? - at(-1.0)?) / (2.0 * step))
    };
    let gradient = nalgebra::DVector::from_vec(free.iter().map(slope).collect::<Option<Vec<f64>>>()?);
    Some(gradient.dot(&(&bound.intrinsics * &gradient)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench::camera::Parameter;

    #[test]
    fn over_several_sets_of_poses_means_and_variances_are_averaged() {
        let set = |mean, sd| Prediction(vec![Some(Expected { mean, sd }), None]);
        let Prediction(both) = Prediction::mean_of(&[set(1.0, 3.0), set(3.0, 4.0)]);
        let Expected { mean, sd } = both[0].unwrap();
        assert!((mean - 2.0).abs() < 1e-15 && (sd - 12.5f64.sqrt()).abs() < 1e-15);
        assert_eq!(both[1], None);
    }

    #[test]
    fn the_nees_has_the_moments_of_a_ratio_of_chi_squares() {
        for (n, d) in [(1.0, 5.0), (6.0, 20.0), (10.0, 480.0)] {
            let Expected { mean, sd } = nees(n, d).unwrap();
            // Of chi-squared numbers: E[x] = n, E[x^2] = n (n + 2), E[1 / y] = 1 / (d - 2), E[1 / y^2] = 1 /
            // ((d - 2) (d - 4)).
            let (first, second) = (n * d / (d - 2.0), n * (n + 2.0) * d * d / ((d - 2.0) * (d - 4.0)));
            assert!(
                (mean - first).abs() < 1e-12 * first
                    && (sd * sd + mean * mean - second).abs() < 1e-12 * second
            );
        }
        assert!(nees(6.0, 4.0).is_none() && nees(0.0, 20.0).is_none());
    }

    #[test]
    fn a_length_without_distortion_errs_as_its_focal_length_does() {
        let truth = Truth::example();
        let camera: Camera<Lens> = Camera::pinhole(600.0, 600.0, 326.0, 243.0).into();
        let truth = Truth {
            camera,
            image_size: truth.image_size,
            points: truth.points,
            cam_from_target: truth.cam_from_target,
        };
        let free = FreeParameters::of(&[Parameter::Fx, Parameter::Fy, Parameter::Cx, Parameter::Cy]);
        let bound = cramer_rao(&truth, free, 0.1).unwrap();
        // Along u a length is L = Z du / fx, so that dL / dfx = -L / fx, and nothing else counts.
        let length = Length { centre_mm: [5.0, -3.0, 200.0], length_mm: 40.0, direction_deg: 0.0 };
        let seen = (length, length.pixels(&camera).unwrap());
        let sd = length_sd(&camera, free, &bound, &seen).unwrap();
        let expected = 40.0 / 600.0 * bound.standard_deviation(Parameter::Fx).unwrap();
        assert!((sd / expected - 1.0).abs() < 1e-6, "{sd} {expected}");
    }
}
