//! Does another camera explain the data nearly as well? Minima that a search met, compared with the one it
//! chose.

use super::Termination;
use super::blocks::N;
use super::minimise::{Minimum, State};
use crate::camera::{BrownConrady, Camera, FreeParameters, Parameter};
use nalgebra::DMatrix;
use std::cmp::Ordering;

/// A minimum whose cost is higher by fewer variances than this is a rival: four standard deviations.
pub(super) const RIVALS: f64 = 16.0;
/// A minimum whose parameters all lie within this many standard deviations is the same one.
pub(super) const SAME: f64 = 6.0;

/// A minimum that the search met.
#[derive(Debug, Clone, Copy)]
pub(super) struct Met<L = BrownConrady> {
    pub camera: Camera<L>,
    pub cost: f64,
    pub converged: bool,
}

/// Another camera that explains the data nearly as well.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rival {
    /// The parameter that differs most, in standard deviations.
    pub parameter: Parameter,
    /// Its value there.
    pub value: f64,
    /// By how many variances the cost is higher there.
    pub excess: f64,
}

impl Met {
    pub fn of(minimum: &Minimum<State, N>) -> Met {
        Met {
            camera: minimum.state.camera,
            cost: minimum.system.cost,
            converged: minimum.termination == Termination::Converged,
        }
    }
}

impl<L> Met<L> {
    /// The best of the other minima that is another camera and nearly as good; `covariance` is that of the
    /// free parameters, px^2 and so on, `rise` what one standard deviation costs, px^2.
    pub fn rival(
        &self,
        others: &[Met<L>],
        free: FreeParameters,
        covariance: &DMatrix<f64>,
        rise: f64,
        value: impl Fn(&Camera<L>, Parameter) -> f64,
    ) -> Option<Rival> {
        let rivals = others.iter().filter(|other| other.converged).filter_map(|other| {
            let excess = self.excess(other, rise);
            let (parameter, deviations) = self.apart(other, free, covariance, &value)?;
            let is_rival = excess < RIVALS && deviations > SAME;
            is_rival.then(|| Rival { parameter, value: value(&other.camera, parameter), excess })
        });
        rivals.min_by(Rival::nearer)
    }

    /// By how many variances another minimum costs more.
    pub fn excess(&self, other: &Met<L>, rise: f64) -> f64 {
        (other.cost - self.cost) / rise
    }

    /// The free parameter by which another minimum differs most, and by how many standard deviations.
    pub fn apart(
        &self,
        other: &Met<L>,
        free: FreeParameters,
        covariance: &DMatrix<f64>,
        value: impl Fn(&Camera<L>, Parameter) -> f64,
    ) -> Option<(Parameter, f64)> {
        let differences = free.iter().enumerate().map(|(i, parameter)| {
            let difference = (value(&other.camera, parameter) - value(&self.camera, parameter)).abs();
            (parameter, difference / covariance[(i, i)].sqrt())
        });
        differences.max_by(|a, b| a.1.total_cmp(&b.1))
    }
}

impl Rival {
    /// Which of two explains the data better.
    pub fn nearer(&self, other: &Rival) -> Ordering {
        self.excess.total_cmp(&other.excess)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_of_what_is_far_in_deviations_and_near_in_cost_is_the_rival() {
        let free = FreeParameters::of(&[Parameter::Fx, Parameter::K1]);
        // Deviations of 2 px and 0.01; a deviation costs 0.5 px^2.
        let covariance = DMatrix::from_row_slice(2, 2, &[4.0, 0.0, 0.0, 1e-4]);
        let met = |fx: f64, k1: f64, excess: f64, converged: bool| {
            let camera =
                Camera::pinhole(fx, 600.0, 320.0, 240.0).with_distortion(BrownConrady::radial(k1, 0.0));
            Met { camera, cost: 7.0 + 0.5 * excess, converged }
        };
        let others = [
            met(613.0, -0.2, 10.0, true),
            met(600.0, -0.13, 5.0, true),
            met(611.0, -0.2, 1.0, true),
            met(700.0, -0.2, 17.0, true),
            met(700.0, -0.2, 0.5, false),
        ];
        let value = |camera: &Camera, parameter| camera.get(parameter);
        let best = met(600.0, -0.2, 0.0, true);
        let rival = |others: &[Met]| best.rival(others, free, &covariance, 0.5, value);
        assert_eq!(rival(&others), Some(Rival { parameter: Parameter::K1, value: -0.13, excess: 5.0 }));
        assert_eq!(rival(&others[2..]), None);
    }
}
