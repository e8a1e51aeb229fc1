//! Between which values does a parameter lie? The profile of the cost, where the covariance alone would
//! mislead.
//!
//! A covariance takes the cost for a parabola. Where the data are weak it is none: a long focal length is
//! bounded below and hardly above. The profile holds one parameter, refits all others, and asks how much the
//! cost has risen: with the signed root
//!
//! ```text
//! tau(v) = sign(v - estimate) sqrt((cost(v) - least cost) / u)
//! ```
//! where `u` is what the cost rises by at one standard deviation (the variance of a coordinate under least
//! squares), the interval of coverage `1 - alpha` is `|tau| <= t`, `t` the quantile of Student's distribution
//! (Bates & Watts 1988, section 6.1). Linear theory has `tau = (v - estimate) / standard deviation`; JCGM 101
//! (2008), section 8.1, asks for such a comparison before a standard uncertainty is stated.

use super::blocks::N;
use super::minimise::{Descent, Minimum, Problem, State, descend};
use super::noise::Noise;
use super::system::Reduction;
use super::tie::tied;
use crate::camera::{FreeParameters, Parameter};
use crate::distribution::student_two_sided;
use nalgebra::SVector;

/// An interval by the profile of the cost, beside the linear one of the same coverage.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ProfileInterval {
    /// Of which parameter.
    pub parameter: Parameter,
    /// Probability with which such intervals contain the true value.
    pub coverage: f64,
    /// Lower end; `None` where the cost never rises enough.
    pub low: Option<f64>,
    /// Upper end; `None` where the cost never rises enough.
    pub high: Option<f64>,
    /// The linear interval: estimate -+ t standard deviations.
    pub linear: (f64, f64),
}

/// Where the check of linearity looks, in standard deviations.
const CHECKED_AT: f64 = 2.0;
/// The intervals differ where a half-width does by more than this part.
const TOLERATED: f64 = 0.1;
/// Refits of an end.
const REFITS: usize = 40;
/// Those that go along secants, once the end lies between two values.
const SECANTS: usize = 8;
/// An end is found when `tau` is this close to `t`.
const CLOSE: f64 = 1e-4;
/// A `tau` so many times the wanted one is far off, and so is a rise so many times what deviations say.
const FAR_OFF: f64 = 10.0;
/// Parts of a way between two of which the cost is looked at.
const STEPS_OF_A_WAY: usize = 8;
/// An end between two values that differ by less than this part is found.
const LEAP: f64 = 1e-6;
/// An end farther away than this many linear half-widths counts as open.
const FARTHEST: f64 = 50.0;

/// How the profile of a parameter differs from a parabola, two standard deviations away.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Skewed {
    pub parameter: Parameter,
    /// True half-width over the linear one, below and above the estimate.
    pub ratios: [f64; 2],
}

/// A problem whose parameters can be held one by one.
pub(super) trait Profiled<const W: usize>: Descent<W> + Sized {
    /// Parameters that are estimated.
    fn free(&self) -> FreeParameters;

    /// The same problem with one of them held where the start has it.
    fn holding(&self, parameter: Parameter) -> Self;

    /// The value of a parameter.
    fn value(state: &Self::State, parameter: Parameter) -> f64;

    /// The state with another value of a parameter, and what is tied to it.
    fn with_value(&self, state: Self::State, parameter: Parameter, value: f64) -> Self::State;

    /// A parameter that lies where the model is not defined, and the limit that it is beyond.
    fn beyond(state: &Self::State) -> Option<(Parameter, f64)>;
}

impl Profiled<N> for Problem<'_> {
    fn free(&self) -> FreeParameters {
        self.free
    }

    fn holding(&self, parameter: Parameter) -> Self {
        Problem { free: self.free.without(parameter), ..*self }
    }

    fn value(state: &State, parameter: Parameter) -> f64 {
        state.camera.get(parameter)
    }

    fn with_value(&self, state: State, parameter: Parameter, value: f64) -> State {
        State { camera: tied(state.camera.with(parameter, value), self.fy_per_fx), ..state }
    }

    /// Its coefficients have no limits.
    fn beyond(_: &State) -> Option<(Parameter, f64)> {
        None
    }
}

/// The profile around a minimum.
pub(super) struct Profile<'a, P: Profiled<W>, const W: usize> {
    problem: &'a P,
    minimum: &'a Minimum<P::State, W>,
    reduction: &'a Reduction<W>,
    /// Covariance of the shared unknowns for unit noise.
    covariance: nalgebra::DMatrix<f64>,
    noise: Noise,
}

impl<'a, P: Profiled<W>, const W: usize> Profile<'a, P, W> {
    /// `None` where the covariance is singular.
    pub fn new(
        problem: &'a P,
        minimum: &'a Minimum<P::State, W>,
        reduction: &'a Reduction<W>,
        noise: Noise,
    ) -> Option<Self> {
        let covariance = reduction.intrinsics_covariance()?;
        Some(Profile { problem, minimum, reduction, covariance, noise })
    }

    /// The parameters whose profile is no parabola, or a state of lower cost if one is met.
    pub fn skewed(&self) -> Result<Vec<Skewed>, Box<P::State>> {
        self.skewed_where(Err)
    }

    /// The same where lower costs are no reason to go there: on that side the profile never rises.
    pub fn skewed_or_open(&self) -> Vec<Skewed> {
        self.skewed_where(|_| Ok(0.0)).unwrap_or_default()
    }

    /// `at_lower` says what `tau` is where a state of lower cost is met.
    fn skewed_where(
        &self,
        at_lower: impl Fn(Box<P::State>) -> Result<f64, Box<P::State>>,
    ) -> Result<Vec<Skewed>, Box<P::State>> {
        let mut found = Vec::new();
        for parameter in self.problem.free().iter() {
            let mut ratios = [1.0; 2];
            for (ratio, side) in ratios.iter_mut().zip([-1.0, 1.0]) {
                let tau =
                    self.tau(parameter, side * CHECKED_AT * self.deviation(parameter)).or_else(&at_lower)?;
                *ratio = CHECKED_AT / tau;
            }
            // A ratio that is no number counts as far off.
            if !ratios.iter().all(|r| (r - 1.0).abs() <= TOLERATED) {
                found.push(Skewed { parameter, ratios });
            }
        }
        Ok(found)
    }

    /// The interval of each free parameter.
    pub fn intervals(&self, coverage: f64, degrees_of_freedom: usize) -> Vec<ProfileInterval> {
        let t = student_quantile(coverage, degrees_of_freedom);
        let interval = |parameter: Parameter| {
            let estimate = P::value(&self.minimum.state, parameter);
            let half = t * self.deviation(parameter);
            ProfileInterval {
                parameter,
                coverage,
                low: self.end(parameter, -half, t).map(|offset| estimate + offset),
                high: self.end(parameter, half, t).map(|offset| estimate + offset),
                linear: (estimate - half, estimate + half),
            }
        };
        self.problem.free().iter().map(interval).collect()
    }

    /// Whether `|tau|` stays within `most` on the way to a value `offset` away from the estimate: an interval
    /// of so many standard deviations then goes on to there.
    pub fn reaches(&self, parameter: Parameter, offset: f64, most: f64) -> bool {
        let on_the_way = |step: usize| offset * step as f64 / STEPS_OF_A_WAY as f64;
        (1..STEPS_OF_A_WAY).all(|step| self.tau_in_range(parameter, on_the_way(step)) <= most)
    }

    fn deviation(&self, parameter: Parameter) -> f64 {
        let row = self.problem.free().position(parameter).expect("the parameter is free");
        self.covariance[(row, row)].sqrt() * self.noise.scale()
    }

    /// Where `|tau| = t`, starting from the linear end: secants through the estimate, which the profile makes
    /// nearly straight, and halves of what is left where it does not.
    fn end(&self, parameter: Parameter, linear: f64, t: f64) -> Option<f64> {
        let mut offset = linear;
        let (mut inside, mut outside) = (0.0, f64::INFINITY);
        for refits in 1..=REFITS {
            let tau = self.tau_in_range(parameter, offset);
            if (tau - t).abs() <= CLOSE * t {
                return Some(offset);
            }
            *if tau < t { &mut inside } else { &mut outside } = offset.abs();
            // Where the cost leaps, as at the edge of what a lens sees, the interval ends there.
            if outside - inside < LEAP * outside {
                return Some(inside.copysign(linear));
            }
            // A linear end that is absurdly far off has a cost without bound.
            offset *= if tau > FAR_OFF * t { 1.0 / FAR_OFF } else { (t / tau).clamp(0.4, 2.5) };
            let is_between = inside < offset.abs() && offset.abs() < outside;
            if !is_between || (refits > SECANTS && outside.is_finite()) {
                offset = 0.5 * (inside + outside).copysign(linear);
            }
            if offset.abs() > FARTHEST * linear.abs() {
                return None;
            }
        }
        None
    }

    /// `|tau|` with `parameter` held `offset` away from its estimate; a state of lower cost if one is met.
    fn tau(&self, parameter: Parameter, offset: f64) -> Result<f64, Box<P::State>> {
        self.tau_of(self.refitted(&self.problem.holding(parameter), parameter, offset))
    }

    /// The minimum with `parameter` held `offset` away from its estimate, from where all others follow it to
    /// first order. Where that costs far more than deviations say, these are absurd: then also from where no
    /// other follows.
    fn refitted(&self, problem: &P, parameter: Parameter, offset: f64) -> Minimum<P::State, W> {
        let following = descend(problem, self.moved(parameter, offset));
        let deviations = offset / self.deviation(parameter);
        let most = FAR_OFF * deviations * deviations * self.noise.rise;
        if following.system.cost - self.minimum.system.cost <= most {
            return following;
        }
        let value = P::value(&self.minimum.state, parameter) + offset;
        let alone = descend(problem, self.problem.with_value(self.minimum.state.clone(), parameter, value));
        if alone.system.cost < following.system.cost || following.system.cost.is_nan() {
            alone
        } else {
            following
        }
    }

    /// `|tau|` where no parameter may leave the range in which the model is defined, if none is beyond it at
    /// the minimum: one that would is held at its limit. Infinite where the one that is moved is beyond; 0
    /// where another minimum costs less, as the profile has not risen yet.
    fn tau_in_range(&self, parameter: Parameter, offset: f64) -> f64 {
        let mut problem = self.problem.holding(parameter);
        let mut refitted = self.refitted(&problem, parameter, offset);
        let is_bounded = P::beyond(&self.minimum.state).is_none();
        while let Some((beyond, limit)) = P::beyond(&refitted.state).filter(|_| is_bounded) {
            if !problem.free().contains(beyond) {
                return f64::INFINITY;
            }
            problem = problem.holding(beyond);
            refitted = descend(&problem, self.problem.with_value(refitted.state, beyond, limit));
        }
        self.tau_of(refitted).unwrap_or(0.0)
    }

    /// `|tau|` at a refit; infinite where no camera is.
    fn tau_of(&self, refitted: Minimum<P::State, W>) -> Result<f64, Box<P::State>> {
        let rise = (refitted.system.cost - self.minimum.system.cost) / self.noise.rise;
        if rise < -LOWER {
            return Err(Box::new(refitted.state));
        }
        if rise.is_nan() {
            return Ok(f64::INFINITY);
        }
        Ok(rise.max(0.0).sqrt())
    }

    /// The state with `parameter` moved and all others following it to first order.
    fn moved(&self, parameter: Parameter, offset: f64) -> P::State {
        let shared = self.covariance.nrows();
        let row = self.problem.free().position(parameter).expect("the parameter is free");
        let mut intrinsics = SVector::zeros();
        for i in 0..shared {
            intrinsics[i] = self.covariance[(i, row)] / self.covariance[(row, row)] * offset;
        }
        let state = self.problem.stepped(&self.minimum.state, self.reduction.following(intrinsics));
        // A curved path may end beside the value wanted.
        let value = P::value(&self.minimum.state, parameter) + offset;
        self.problem.with_value(state, parameter, value)
    }
}

/// A rise below minus this many variances is a better minimum and no rounding.
const LOWER: f64 = 1e-3;

/// Half the width of the interval of Student's distribution that holds `coverage`; to nine digits, the same
/// on every machine.
pub(super) fn student_quantile(coverage: f64, degrees_of_freedom: usize) -> f64 {
    super::chance::significant(student_two_sided(1.0 - coverage, degrees_of_freedom.max(1) as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Termination;
    use crate::calibrate::system::{Step, System};
    use crate::calibrate::tests::four_views;
    use crate::calibrate::{Settings, calibrate};

    #[test]
    fn the_quantile_comes_with_any_degrees_of_freedom() {
        // By `scipy.stats.t.ppf`.
        for (freedom, t) in
            [(1, 12.706_204_736), (300, 1.967_903_011), (100_000, 1.959_987_708), (10_000_000, 1.959_964_222)]
        {
            assert!((student_quantile(0.95, freedom) / t - 1.0).abs() < 1e-9, "{freedom}");
        }
    }

    #[test]
    fn intervals_of_good_data_lie_students_quantile_about_the_estimate() {
        let views = four_views(0.1);
        let found = calibrate(&views, &Settings::standard().with_profile_intervals(0.95)).unwrap();
        assert_eq!((found.degrees_of_freedom, found.intervals.len()), (474, 6));
        for interval in &found.intervals {
            // 1.959964 + (1.959964^3 + 1.959964) / (4 * 474), to first order.
            let half = 1.964969 * found.standard_deviation(interval.parameter).unwrap();
            let estimate = found.camera.get(interval.parameter);
            let ends =
                [(interval.low.unwrap(), interval.linear.0), (interval.high.unwrap(), interval.linear.1)];
            for ((end, linear), expected) in ends.into_iter().zip([estimate - half, estimate + half]) {
                assert!((linear - expected).abs() < 1e-4 * half, "{interval:?}");
                // Where the cost is nearly a parabola the profile says the same.
                assert!((end - expected).abs() < 0.1 * half, "{interval:?}");
            }
        }
    }

    /// A cost of one number.
    struct Curve {
        free: FreeParameters,
        cost: fn(f64) -> f64,
    }

    impl Descent<N> for Curve {
        type State = f64;

        fn system(&self) -> System {
            System::new(self.free, 0)
        }

        fn linearise_into(&self, at: &f64, system: &mut System) {
            system.cost = (self.cost)(*at);
        }

        fn step(&self, from: &f64, step: &Step, to: &mut f64) {
            *to = from + step.intrinsics[0];
        }

        fn max_iterations(&self) -> usize {
            10
        }

        fn rounding_cost(&self) -> f64 {
            0.0
        }
    }

    impl Profiled<N> for Curve {
        fn free(&self) -> FreeParameters {
            self.free
        }

        fn holding(&self, parameter: Parameter) -> Self {
            Curve { free: self.free.without(parameter), ..*self }
        }

        fn value(state: &f64, _: Parameter) -> f64 {
            *state
        }

        fn with_value(&self, _: f64, _: Parameter, value: f64) -> f64 {
            value
        }

        fn beyond(_: &f64) -> Option<(Parameter, f64)> {
            None
        }
    }

    /// What `then` makes of the profile of a cost about 0, with this standard deviation and unit noise.
    fn profile_of<T>(
        cost: fn(f64) -> f64,
        deviation: f64,
        then: impl FnOnce(&Profile<'_, Curve, N>) -> T,
    ) -> T {
        let problem = Curve { free: FreeParameters::of(&[Parameter::Fx]), cost };
        let mut system = problem.system();
        system.cost = cost(0.0);
        system.intrinsics[(0, 0)] = 1.0 / (deviation * deviation);
        let reduction = system.reduction().unwrap();
        let minimum = Minimum { state: 0.0, system, termination: Termination::Converged, iterations: 1 };
        then(&Profile::new(&problem, &minimum, &reduction, Noise::of_squares(1.0)).unwrap())
    }

    /// Half the width of an interval of 95 % with many degrees of freedom.
    const T: f64 = 1.959964;

    fn ends(cost: fn(f64) -> f64, deviation: f64) -> [Option<f64>; 2] {
        profile_of(cost, deviation, |profile| {
            let interval = profile.intervals(0.95, 10_000_000)[0];
            [interval.low, interval.high]
        })
    }

    #[test]
    fn the_ends_of_a_skewed_profile_are_where_it_has_risen_by_the_quantile() {
        // tau is |x| + x^2 below and 3 (1 - exp(-x / 3)) above.
        let [low, high] = ends(
            |x| {
                let tau = if x < 0.0 { x * x - x } else { 3.0 * (1.0 - libm::exp(-x / 3.0)) };
                5.0 + tau * tau
            },
            1.0,
        );
        let expected = [0.5 - (0.25 + T).sqrt(), -3.0 * libm::log(1.0 - T / 3.0)];
        for (end, expected) in [low, high].into_iter().zip(expected) {
            assert!((end.unwrap() - expected).abs() < 1e-3, "{end:?} {expected}");
        }
    }

    #[test]
    fn an_interval_has_no_end_where_the_cost_never_rises_enough() {
        // tau rises to 1.5.
        let [low, high] = ends(
            |x| {
                let tau = if x < 0.0 { x } else { 1.5 * (1.0 - libm::exp(-x)) };
                5.0 + tau * tau
            },
            1.0,
        );
        assert!((low.unwrap() + T).abs() < 1e-3 && high.is_none(), "{low:?} {high:?}");
    }

    #[test]
    fn an_interval_ends_where_the_cost_leaps() {
        let [low, high] = ends(|x| if x < 12_345.0 { 5.0 + 1e-8 * x * x } else { 1e6 }, 1e4);
        assert!((high.unwrap() / 12_345.0 - 1.0).abs() < 1e-5, "{high:?}");
        assert!((low.unwrap() / (-1e4 * T) - 1.0).abs() < 1e-3, "{low:?}");
    }

    #[test]
    fn a_lower_cost_on_the_profile_is_a_better_minimum() {
        let lower = profile_of(|x| if x < -1.0 { 4.0 } else { 5.0 + x * x }, 1.0, |profile| profile.skewed());
        assert_eq!(lower, Err(Box::new(-2.0)));
        let parabola = profile_of(|x| 5.0 + x * x, 1.0, |profile| profile.skewed());
        assert_eq!(parabola, Ok(Vec::new()));
    }
}
