//! What speaks for a minimum, and what against it?

use super::certificate::{self, Certificate};
use super::estimate::Fit;
use super::from_relaxed::beside;
use super::identifiability;
use super::intervals::Skewed;
use super::loss::Loss;
use super::minimise::{Minimum, Problem, State};
use super::noise::Noise;
use super::rival::{Met, RIVALS, Rival};
use super::system::Reduction;
use super::{CalibrationError, Termination, outliers, tilt};
use crate::camera::{Camera, FreeParameters, Parameter};
use nalgebra::DMatrix;

/// A minimum with what is needed to judge it.
pub(super) struct Judged {
    pub minimum: Minimum,
    /// `None` where a pose is undetermined.
    pub reduction: Option<Reduction>,
    pub certificate: Option<Certificate>,
    /// Starts that were refined; 1 on good data.
    pub starts: usize,
    /// Parameters whose cost is no parabola: asked only where they are known poorly.
    pub skewed: Vec<Skewed>,
    /// The best of the other minima, if it is nearly as good.
    pub rival: Option<Rival>,
    /// Views whose other tilt is nearly as good.
    pub twins: Vec<Twin>,
}

/// A view's other tilt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Twin {
    pub view: usize,
    /// By how much its plane is turned there.
    pub degrees: f64,
    /// By how many variances the cost is higher there.
    pub excess: f64,
}

/// Planes that differ by less are one and the same.
const APART_DEGREES: f64 = 1.0;
/// A certificate whose probability is below this is no reason to refuse a minimum, but one to look for a
/// better.
const CLEAR: f64 = 1e-4;
/// With fewer degrees of freedom a certificate tells too little to rely on it alone: two views can be
/// explained by another camera entirely.
const TELLING: usize = 4;
/// Good data take five to ten iterations; a search that took more came from far away.
const SHORT_WAY: usize = 25;

/// A focal length or principal point known worse than this part of the focal length may hide another minimum
/// that is nearly as good.
const WELL_KNOWN: f64 = 0.03;
/// The same where the lens is free to be crooked (tangential terms, skew) or has a third radial term: such a
/// lens explains more.
const WELL_KNOWN_FLEXIBLE: f64 = 0.01;

/// Whether a minimum needs no search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Settled {
    Not,
    /// So many tilts are evident that the camera is the right one whatever the others are: these alone are to
    /// be tried the other way round.
    ButForTilts,
    Entirely,
}

/// Views of evident tilt that leave the others no say in what camera it is: with hundreds of views in all
/// orientations some always face it, and a search over all of them for their sake takes a hundred times as
/// long as the rest.
const ENOUGH_TILTS: usize = 100;

impl Judged {
    pub fn of(problem: &Problem<'_>, minimum: Minimum, starts: usize) -> Judged {
        let reduction = minimum.system.reduction();
        let certificate = reduction
            .as_ref()
            .map(|reduction| certificate::certify(problem, &minimum.state, reduction, minimum.system.cost));
        Judged { minimum, reduction, certificate, starts, skewed: Vec::new(), rival: None, twins: Vec::new() }
    }

    /// With the floor fitted where a step towards it does not certify the minimum: the step is straight, the
    /// relaxed model is not. A lower cost of the relaxed model that was met elsewhere is a floor too.
    pub fn certified(mut self, problem: &Problem<'_>, lowest_relaxed: f64) -> Judged {
        let points = problem.observations.iter().map(|o| o.len()).sum();
        // What rounding leaves of exact data proves nothing.
        let rounding = problem.rounding_cost;
        if let Some(certificate) = self.certificate.as_mut() {
            if !certificate.holds()
                && let Some(beside) = beside(problem, &self.minimum)
            {
                *certificate = certificate.with_floor(problem, &self.minimum, beside.cost.max(rounding));
            }
            if lowest_relaxed.max(rounding) < certificate.floor(points) {
                *certificate = certificate.with_floor(problem, &self.minimum, lowest_relaxed.max(rounding));
            }
        }
        self
    }

    /// Whether the certificate holds and tells enough to rely on.
    pub fn is_certified(&self) -> bool {
        self.certificate
            .as_ref()
            .is_some_and(|c| c.freedom >= TELLING && c.is_possible() && c.p_value > CLEAR)
    }

    /// Whether nothing speaks for another minimum, but perhaps parallel planes or tilts.
    fn is_clear_but_for_tilts(&self, problem: &Problem<'_>) -> bool {
        self.minimum.termination == Termination::Converged
            && self.minimum.iterations <= SHORT_WAY
            && self.is_certified()
            && self.is_well_known(problem)
    }

    /// With the best of the minima met that is another camera and nearly as good.
    pub fn with_rival(mut self, problem: &Problem<'_>, met: &[Met]) -> Judged {
        let Some(covariance) = self.reduction.as_ref().and_then(Reduction::intrinsics_covariance) else {
            return self;
        };
        let noise = self.noise(problem).at_least(problem.rounding_cost);
        let best = Met::of(&self.minimum);
        let value = |camera: &Camera, parameter| camera.get(parameter);
        self.rival = best.rival(met, problem.free, &(covariance * noise.variance), noise.rise, value);
        self
    }

    /// With the views whose other tilt, the camera held, is nearly as good.
    pub fn with_twins(mut self, problem: &Problem<'_>) -> Judged {
        let noise = self.noise(problem).at_least(problem.rounding_cost);
        let state = &self.minimum.state;
        let twin = |view: usize| {
            let pose = state.cam_from_target[view];
            let (own, cost) = tilt::resected(problem, state, view, pose);
            let (other, other_cost) = tilt::resected(problem, state, view, tilt::mirrored(&own));
            let excess = (other_cost - cost) / noise.rise;
            let degrees = tilt::angle_between(&own, &other).to_degrees();
            (excess < RIVALS && degrees > APART_DEGREES).then_some(Twin { view, degrees, excess })
        };
        self.twins = self.doubtful_tilts(problem).into_iter().filter_map(twin).collect();
        self
    }

    /// Whether the minimum is clear, and the planes are not parallel. Parallel planes that determine nothing
    /// are refused at once, before a search that could find nothing, where the noise is known: at a cost that
    /// its floor certifies.
    pub fn is_settled(&self, problem: &Problem<'_>) -> Result<Settled, CalibrationError> {
        if !self.certificate.as_ref().is_some_and(|c| c.is_possible() && c.holds()) {
            return Ok(Settled::Not);
        }
        let lower = identifiability::refuse_if_parallel(problem, &self.minimum, self.noise(problem));
        let lower = outliers::or_blamed(problem, &self.minimum.state, lower)?;
        if lower.is_some() || !self.is_clear_but_for_tilts(problem) {
            return Ok(Settled::Not);
        }
        let doubtful = self.doubtful_tilts(problem).len();
        Ok(match problem.observations.len() - doubtful {
            _ if doubtful == 0 => Settled::Entirely,
            evident if evident >= ENOUGH_TILTS => Settled::ButForTilts,
            _ => Settled::Not,
        })
    }

    pub fn noise(&self, problem: &Problem<'_>) -> Noise {
        noise_of(problem, &self.minimum)
    }

    /// Whether focal lengths and principal point are known so well that no other minimum can be nearly as
    /// good.
    pub fn is_well_known(&self, problem: &Problem<'_>) -> bool {
        let Some(covariance) = self.reduction.as_ref().and_then(Reduction::intrinsics_covariance) else {
            return false;
        };
        let scale_px = self.noise(problem).scale();
        let camera = &self.minimum.state.camera;
        let flexible = [Parameter::Skew, Parameter::P1, Parameter::P2, Parameter::K3];
        let is_flexible = flexible.iter().any(|&p| problem.free.contains(p));
        if is_flexible && trades_off(problem.free, &covariance) {
            return false;
        }
        let limit = if is_flexible { WELL_KNOWN_FLEXIBLE } else { WELL_KNOWN };
        problem.free.iter().zip(covariance.diagonal().iter()).all(|(parameter, variance)| {
            let scale = match parameter {
                Parameter::Fx | Parameter::Cx => camera.fx,
                Parameter::Fy | Parameter::Cy => camera.fy,
                _ => return true,
            };
            variance.sqrt() * scale_px <= limit * scale
        })
    }

    /// Standard deviations of cx and cy; infinite where nothing is known, `None` where they are held.
    pub fn centre_deviations(&self, problem: &Problem<'_>) -> [Option<f64>; 2] {
        let covariance = self.reduction.as_ref().and_then(Reduction::intrinsics_covariance);
        [Parameter::Cx, Parameter::Cy].map(|parameter| {
            let row = problem.free.position(parameter)?;
            Some(
                covariance
                    .as_ref()
                    .map_or(f64::INFINITY, |c| c[(row, row)].sqrt() * self.noise(problem).scale()),
            )
        })
    }

    /// Views whose other tilt might do as well.
    fn doubtful_tilts(&self, problem: &Problem<'_>) -> Vec<usize> {
        let State { camera, cam_from_target } = &self.minimum.state;
        let (focal, noise_px) = (0.5 * (camera.fx + camera.fy), self.noise(problem).px());
        let views = cam_from_target.iter().zip(problem.observations).enumerate();
        views
            .filter(|(_, (pose, observations))| tilt::is_doubtful(pose, observations, focal, noise_px))
            .map(|(view, _)| view)
            .collect()
    }
}

/// Beyond this correlation a crooked lens can take the place of the principal point: there may be two of
/// them.
const TRADES_OFF: f64 = 0.98;

/// Whether the principal point is hardly told from the tangential terms.
fn trades_off(free: FreeParameters, covariance: &DMatrix<f64>) -> bool {
    let rows = |list: [Parameter; 2]| list.into_iter().filter_map(|p| free.position(p)).collect::<Vec<_>>();
    let correlation =
        |i: usize, j: usize| covariance[(i, j)] / (covariance[(i, i)] * covariance[(j, j)]).sqrt();
    let (centre, tangential) = (rows([Parameter::Cx, Parameter::Cy]), rows([Parameter::P1, Parameter::P2]));
    centre.iter().any(|&i| tangential.iter().any(|&j| correlation(i, j).abs() > TRADES_OFF))
}

/// Noise of a pixel coordinate: under least squares from the cost, and otherwise from what the residuals
/// count for, as gross errors, which a robust loss discounts, say nothing of it.
pub(super) fn noise_of(problem: &Problem<'_>, minimum: &Minimum) -> Noise {
    let coordinates = 2 * problem.observations.iter().map(|o| o.len()).sum::<usize>();
    let measurements = coordinates + problem.priors.list.len();
    let freedom = measurements.saturating_sub(minimum.system.unknowns()).max(1);
    if problem.loss == Loss::Squares {
        return Noise::of_squares(minimum.system.cost / freedom as f64);
    }
    Fit::of(&minimum.state, problem.observations).noise(problem.loss, freedom as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::normal::Observations;
    use crate::calibrate::tests::{TURNS, observations, plain_problem, seen};
    use crate::camera::BrownConrady;
    use crate::geometry::{Pose, Vec2, Vec3, rotation};

    fn barrel() -> BrownConrady {
        BrownConrady::radial(-0.18, 0.05)
    }

    /// What `then` makes of the minimum with these parameters free, of views of 9 x 7 marks so turned: 252
    /// marks of [`TURNS`], with noise of 0.1 px.
    fn at_minimum<T>(
        turns: &[[f64; 3]],
        lens: BrownConrady,
        (free, fy_per_fx): (FreeParameters, Option<f64>),
        then: impl FnOnce(&Problem<'_>, Judged) -> T,
    ) -> T {
        let camera = Camera::pinhole(600.0, 600.0, 320.0, 240.0).with_distortion(lens);
        let pose = |(view, [x, y, z]): (usize, &[f64; 3])| Pose {
            rotation: rotation::from_xyz_rad(*x, *y, *z),
            translation: Vec3::new(2.0, -3.0, 120.0 + 10.0 * view as f64),
        };
        let cam_from_target: Vec<Pose> = turns.iter().enumerate().map(pose).collect();
        let observations = observations(&seen(&camera, &cam_from_target, 0.1));
        let problem = Problem { fy_per_fx, ..plain_problem(&observations, free) };
        let minimum = problem.minimise(State { camera, cam_from_target });
        then(&problem, Judged::of(&problem, minimum, 1))
    }

    #[test]
    fn the_minimum_of_good_views_needs_no_search() {
        at_minimum(&TURNS, barrel(), (FreeParameters::STANDARD, None), |problem, judged| {
            assert!(judged.is_certified() && judged.is_well_known(problem));
            assert!(judged.doubtful_tilts(problem).is_empty());
            assert_eq!(judged.is_settled(problem), Ok(Settled::Entirely));
        });
    }

    #[test]
    fn a_minimum_is_clear_by_a_certificate_that_tells_enough_only() {
        at_minimum(&TURNS, barrel(), (FreeParameters::STANDARD, None), |problem, mut judged| {
            let own = judged.certificate.unwrap();
            let is_not_possible = Certificate { floor_freedom: 0, p_value: 1.0, ..own };
            for certificate in [
                None,
                Some(Certificate { freedom: 3, ..own }),
                Some(Certificate { p_value: 1e-5, ..own }),
                Some(is_not_possible),
            ] {
                judged.certificate = certificate;
                assert!(!judged.is_certified() && !judged.is_clear_but_for_tilts(problem), "{certificate:?}");
            }
            judged.certificate = Some(own);
            assert!(judged.is_clear_but_for_tilts(problem));
            judged.minimum.iterations = SHORT_WAY + 1;
            assert!(!judged.is_clear_but_for_tilts(problem));
        });
    }

    #[test]
    fn a_focal_length_or_principal_point_is_well_known_to_three_hundredths_of_the_focal_length() {
        use Parameter::{Cx, Cy, Fx, Fy, P1};
        for (parameter, lens, limit) in
            [(Fx, None, 0.03), (Fy, None, 0.03), (Cx, None, 0.03), (Cy, None, 0.03), (Fx, Some(P1), 0.01)]
        {
            let free = lens.iter().fold(FreeParameters::of(&[parameter]), |free, &p| free.with(p));
            at_minimum(&TURNS, barrel(), (free, None), |problem, mut judged| {
                let unit = judged.reduction.as_ref().unwrap().intrinsics_covariance().unwrap();
                let freedom = (504 - free.len() - 24) as f64;
                for (relative, is_known) in [(0.98 * limit, true), (1.02 * limit, false)] {
                    // A cost of so much noise that the deviation is this part of 600 px.
                    let variance = (relative * 600.0) * (relative * 600.0) / unit[(0, 0)];
                    judged.minimum.system.cost = variance * freedom;
                    assert_eq!(judged.is_well_known(problem), is_known, "{parameter} {relative}");
                }
            });
        }
    }

    #[test]
    fn parallel_planes_are_refused_at_a_certified_cost_only() {
        let facing = [[0.0; 3], [0.0, 0.0, 0.3], [0.0, 0.0, -0.2]];
        // A distortion that is known would tell the focal length.
        let lens = BrownConrady::radial(0.0, 0.0);
        let fx = FreeParameters::of(&[Parameter::Fx]);
        at_minimum(&facing, lens, (fx, Some(1.0)), |problem, mut judged| {
            let refused = judged.is_settled(problem);
            assert!(matches!(refused, Err(CalibrationError::NotIdentifiable { .. })), "{refused:?}");
            judged.certificate = judged.certificate.map(|own| Certificate { p_value: 0.0, ..own });
            assert_eq!(judged.is_settled(problem), Ok(Settled::Not));
        });
    }

    #[test]
    fn noise_is_the_cost_of_a_degree_of_freedom() {
        at_minimum(&TURNS, barrel(), (FreeParameters::STANDARD, None), |problem, mut judged| {
            // 504 coordinates, 6 parameters and 24 numbers of poses.
            judged.minimum.system.cost = 4.74;
            assert!((judged.noise(problem).variance - 0.01).abs() < 1e-15);
        });
    }

    #[test]
    fn a_rival_lies_many_deviations_of_the_noise_away() {
        at_minimum(&TURNS, barrel(), (FreeParameters::STANDARD, None), |problem, mut judged| {
            let variance = judged.noise(problem).variance;
            let unit = judged.reduction.as_ref().unwrap().intrinsics_covariance().unwrap();
            let own = Met::of(&judged.minimum);
            for (deviations, is_rival) in [(5.0, false), (7.0, true)] {
                let fx = own.camera.fx + deviations * (unit[(0, 0)] * variance).sqrt();
                let other = Met { camera: Camera { fx, ..own.camera }, cost: own.cost + variance, ..own };
                judged = judged.with_rival(problem, &[other]);
                assert_eq!(judged.rival.is_some(), is_rival, "{deviations}");
            }
            let rival = judged.rival.unwrap();
            assert!(rival.parameter == Parameter::Fx && (rival.excess - 1.0).abs() < 1e-9, "{rival:?}");
        });
    }

    #[test]
    fn a_twin_is_told_with_what_its_cost_is_higher_by() {
        // A small target far away, without noise.
        let camera = Camera::pinhole(3000.0, 3000.0, 320.0, 240.0);
        let pose = |tilt: f64| Pose {
            rotation: rotation::from_xyz_rad(tilt, 0.0, 0.0),
            translation: Vec3::new(0.0, 0.0, 3000.0),
        };
        let pair = |i: u32| {
            let point = Vec2::new(f64::from(i % 9) - 4.0, f64::from(i / 9) - 4.0) * 7.5;
            (point, camera.project(&pose(0.5).apply(&Vec3::new(point.x, point.y, 0.0))).unwrap())
        };
        let observations = [Observations::new((0..81).map(pair))];
        let problem = plain_problem(&observations, FreeParameters::NONE);
        let [own, other] =
            [0.5, -0.5].map(|tilt| problem.minimise(State { camera, cam_from_target: vec![pose(tilt)] }));
        let higher = other.system.cost - own.system.cost;
        let mut judged = Judged::of(&problem, own, 1);
        // Of 162 coordinates six belong to the pose; noise of 0.4 px on the others.
        judged.minimum.system.cost = 0.16 * 156.0;
        let judged = judged.with_twins(&problem);
        let [twin] = &judged.twins[..] else { panic!("{:?}", judged.twins) };
        assert!(twin.view == 0 && (twin.degrees - 57.3).abs() < 1.0, "{twin:?}");
        assert!(higher > 0.5 && (twin.excess - higher / 0.16).abs() < 1e-6, "{twin:?} {higher}");
    }

    #[test]
    fn a_principal_point_trades_off_with_tangential_terms_where_they_are_correlated() {
        use Parameter::{Cx, Cy, P1, P2};
        let free = FreeParameters::of(&[Cx, Cy, P1, P2]);
        // Deviations of 2, 2, 3 and 3.
        let with = |row: usize, column: usize, covariance: f64| {
            let mut matrix =
                DMatrix::from_diagonal(&nalgebra::DVector::from_row_slice(&[4.0, 4.0, 9.0, 9.0]));
            (matrix[(row, column)], matrix[(column, row)]) = (covariance, covariance);
            trades_off(free, &matrix)
        };
        assert!(with(0, 2, 5.94) && with(1, 3, -5.94));
        assert!(!with(0, 2, 5.82) && !with(1, 3, -5.82));
        // Of one with the other it is no trade.
        assert!(!with(0, 1, 3.99));
    }
}
