//! Item by item, how far is an estimate from the truth, in units of its predicted standard deviation?

use super::distribution::ChiSquare;
use crate::calibrate::Covariance;
use crate::camera::{Camera, Parameter};

/// One parameter against the truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Item {
    /// Which.
    pub parameter: Parameter,
    /// True value.
    pub truth: f64,
    /// Estimate.
    pub estimate: f64,
    /// Estimate - truth.
    pub error: f64,
    /// Predicted standard deviation of the error.
    pub standard_deviation: f64,
    /// Error in standard deviations.
    pub z: f64,
}

/// An estimate against the truth, item by item and jointly.
#[derive(Debug, Clone, PartialEq)]
pub struct Errors {
    /// One item per free parameter, in order.
    pub items: Vec<Item>,
    /// `e^T P^-1 e`: the squared Mahalanobis distance of the error, or normalised estimation error squared.
    pub chi_squared: f64,
    /// Probability that chance makes it larger.
    pub p_value: f64,
}

/// Compares `estimate` with `truth` under the covariance `predicted`. `None` if the covariance is singular.
///
/// ```
/// use calibench::calibrate::{Settings, calibrate};
/// use calibench::evaluate::errors_of;
/// use calibench::synth::{Scene, Stream, StreamKey};
///
/// let scene = Scene::example();
/// let mut stream = Stream::open(StreamKey { seed: 1, scenario: "errors", trial: 0, purpose: "noise" });
/// let result = calibrate(&scene.observe(0.1, &mut stream), &Settings::standard())?;
/// let errors = errors_of(&scene.truth.camera, &result.camera, &result.covariance).expect("not singular");
/// assert_eq!(errors.items.len(), 6);
/// // The stated covariance covers the errors: chance alone would often make them larger.
/// assert!(errors.p_value > 0.001 && errors.items.iter().all(|item| item.z.abs() < 4.0));
/// # Ok::<(), calibench::calibrate::CalibrationError>(())
/// ```
pub fn errors_of(truth: &Camera, estimate: &Camera, predicted: &Covariance) -> Option<Errors> {
    let items: Vec<Item> = predicted
        .free
        .iter()
        .map(|parameter| {
            let (truth, estimate) = (truth.get(parameter), estimate.get(parameter));
            let error = estimate - truth;
            let standard_deviation = predicted.standard_deviation(parameter)?;
            Some(Item {
                parameter,
                truth,
                estimate,
                error,
                standard_deviation,
                z: error / standard_deviation,
            })
        })
        .collect::<Option<_>>()?;
    let errors: Vec<f64> = items.iter().map(|item| item.error).collect();
    let chi_squared = predicted.normalised_error_squared(&errors)?;
    Some(Errors { p_value: ChiSquare::new(errors.len()).survival(chi_squared), chi_squared, items })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{BrownConrady, FreeParameters};
    use crate::evaluate::cramer_rao;
    use crate::synth::Truth;

    #[test]
    fn the_published_table_is_one_plausible_draw() {
        // Printed for this scene: Mahalanobis chi2 = 9.0 on 6 degrees of freedom, p = 0.17.
        let truth = Truth::example();
        let bound = cramer_rao(&truth, FreeParameters::STANDARD, 0.1).unwrap();
        let published = Camera::pinhole(598.5707, 598.5468, 325.5661, 243.2207)
            .with_distortion(BrownConrady::radial(-0.1832, 0.0663));
        let errors = errors_of(&truth.camera, &published, &bound).unwrap();
        assert!((errors.chi_squared - 9.0).abs() < 0.05, "{}", errors.chi_squared);
        assert!((errors.p_value - 0.17).abs() < 0.005);
    }
}
