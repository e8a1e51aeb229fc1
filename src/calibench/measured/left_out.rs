//! Which freedoms that nobody decided on, and which held values, do the marks contradict? The score tests of
//! [`crate::calibrate`], with the positions of marks among the unknowns.

use super::descent::Minimum;
use super::problem::Problem;
use crate::calibrate::{CostFalls, DEFORMATIONS, Freedoms, LensCalibration, Settings};
use crate::camera::FreeParameters;
use nalgebra::{DMatrix, DVector};

/// Normal equations of the camera's parameters at a minimum, poses and positions of marks eliminated, with
/// parameters that it does not have.
pub(super) struct Falls {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    all: FreeParameters,
    own: FreeParameters,
    /// What its own parameters would still lower the cost by.
    left: f64,
}

impl Falls {
    /// With `more` parameters than those of `found`; `None` where the marks fit up to rounding, or leave a
    /// pose or a mark open.
    pub fn of(
        problem: &Problem<'_>,
        minimum: &Minimum,
        settings: &Settings,
        found: &LensCalibration,
        more: Freedoms,
    ) -> Option<Falls> {
        if minimum.equations.cost <= problem.rounding_cost() {
            return None;
        }
        let all = more.parameters.iter().fold(found.free, FreeParameters::with);
        let with_all =
            Problem { free: all, fy_per_fx: settings.fy_per_fx(), priors: &found.priors, ..*problem };
        let (matrix, gradient) = with_all.equations(&minimum.state)?.of_first(all.len())?;
        let mut falls = Falls { matrix, gradient, all, own: found.free, left: 0.0 };
        falls.left = falls.fall(Freedoms::NONE)?;
        Some(falls)
    }
}

impl CostFalls for Falls {
    fn fall(&self, more: Freedoms) -> Option<f64> {
        let is_taken = |p: &_| self.own.contains(*p) || more.parameters.contains(*p);
        let rows: Vec<usize> =
            self.all.iter().filter(is_taken).filter_map(|p| self.all.position(p)).collect();
        if rows.is_empty() {
            return Some(-self.left);
        }
        let matrix = self.matrix.select_rows(&rows).select_columns(&rows);
        let gradient = self.gradient.select_rows(&rows);
        let gain = gradient.dot(&matrix.cholesky()?.solve(&gradient));
        Some(gain - self.left).filter(|fall| fall.is_finite())
    }

    /// Where its marks are was measured.
    fn shape(&self, _: FreeParameters) -> Option<[f64; DEFORMATIONS]> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{SIGMA_PX, Scene, stream};
    use super::super::{Noise, calibrate_measured};
    use crate::calibrate::{Settings, Warning};
    use crate::camera::Parameter::{self, Fx, Fy, K1, P1, P2};

    /// The parameters that are asked for, a list for each warning.
    fn told(scene: &Scene, sd: f64, noise: Noise, settings: &Settings) -> Vec<Vec<Parameter>> {
        let (target, views) = scene.drawn(sd, &mut stream("held", 0));
        let found = calibrate_measured(&target, &views, settings, noise).unwrap();
        let parameters = |w: &Warning| match w {
            Warning::LeftOut { parameters, .. } => Some(parameters.clone()),
            _ => None,
        };
        found.calibration.warnings.iter().filter_map(parameters).collect()
    }

    #[test]
    fn held_values_that_the_marks_contradict_are_told_and_right_ones_are_not() {
        let scene = Scene::cube();
        let (camera, none) = (&scene.camera, Vec::<Vec<Parameter>>::new());
        let value = |p| camera.value(p).unwrap();
        for (sd, noise) in [(0.0, Noise::Estimated), (0.01, Noise::Known { sigma_px: SIGMA_PX })] {
            let told = |settings: Settings| told(&scene, sd, noise, &settings);
            assert_eq!(told(scene.settings()), none);
            let (target, views) = scene.drawn(sd, &mut stream("held", 0));
            let free = calibrate_measured(&target, &views, &scene.settings(), noise).unwrap();
            // Twelve of its deviations.
            let far = |p| 12.0 * free.standard_deviation(p).unwrap();
            // Over a narrow angle k3 makes up for a wrong k2 as well.
            for p in [K1, Fx] {
                assert_eq!(told(scene.settings().hold(p, value(p))), none, "{p}");
                let wrong = value(p) + far(p);
                assert_eq!(told(scene.settings().hold(p, wrong)), [vec![p]], "{p} {sd}");
                // As good as held.
                assert_eq!(told(scene.settings().with_prior(p, wrong, 1e-9)), [vec![p]], "{p} {sd}");
            }
            // Both by one factor, which distances make up for.
            let focal = |factor| scene.settings().hold(Fx, factor * value(Fx)).hold(Fy, factor * value(Fy));
            assert_eq!(
                (told(focal(1.0)), told(focal(1.0 + far(Fx) / value(Fx)))),
                (none.clone(), vec![vec![Fx, Fy]]),
                "{sd}"
            );
            // One of them, which the other is tied to.
            let ratio = value(Fy) / value(Fx);
            let tied = |factor: f64| scene.settings().hold(Fx, factor * value(Fx)).tie_focal_lengths(ratio);
            let wrong = told(tied(1.0 + far(Fx) / value(Fx)));
            assert!(told(tied(1.0)) == none && wrong.first().is_some_and(|p| p[0] == Fx), "{sd} {wrong:?}");
        }
    }

    #[test]
    fn a_decentred_lens_is_told_where_p1_and_p2_were_left_out() {
        let mut scene = Scene::cube();
        for (p, value) in [(P1, 0.012), (P2, -0.008)] {
            scene.camera = scene.camera.with_value(p, value).unwrap();
        }
        let told = told(&scene, 0.01, Noise::Estimated, &scene.settings());
        assert_eq!(told.first(), Some(&vec![P1, P2]), "{told:?}");
    }
}
