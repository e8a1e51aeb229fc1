//! What is minimised with a lens of any model? The sum of squared, weighted pixel distances, and what is
//! known beforehand.

use super::super::Loss;
use super::super::blocks::ViewBlock;
use super::super::chunks::{self, CHUNK};
use super::super::minimise::Descent;
use super::super::noise::Noise;
use super::super::prior::{Prior, Weight};
use super::super::settings::Bend;
use super::super::system::{Step, System};
use super::super::tie::tied;
use super::WIDTH;
use super::kernel::{self, Columns, Share};
use super::marks::Marks;
use crate::camera::{Camera, FreeParameters, Lens};
use crate::geometry::{Pose, Vec2};

/// The unknowns.
#[derive(Debug, Clone)]
pub(super) struct State {
    pub camera: Camera<Lens>,
    pub cam_from_target: Vec<Pose>,
    /// Of the board, in its own unit.
    pub shape: [f64; 3],
}

impl State {
    /// The pixel of a mark; `None` where the lens has none.
    pub fn pixel(&self, view: usize, mark: &super::marks::Mark) -> Option<Vec2> {
        self.camera.pixel(&self.cam_from_target[view].apply(&mark.on_board(&self.shape)))
    }
}

/// What is minimised.
#[derive(Clone, Copy)]
pub(super) struct Problem<'a> {
    pub views: &'a [Marks],
    pub free: FreeParameters,
    /// Parameters that are held for a while, as along a profile: of what is known of them beforehand they pay
    /// for their place.
    pub held: FreeParameters,
    pub fy_per_fx: Option<f64>,
    /// What is known beforehand, and the noise of a coordinate of weight 1 that weighs it.
    pub priors: &'a [Prior],
    pub noise: Noise,
    /// What is unknown of the board.
    pub bend: Option<Bend>,
    pub loss: Loss,
    pub max_iterations: usize,
    /// A step that promises less than this part of the cost is the last.
    pub relative_gain: f64,
    pub rounding_cost: f64,
    /// Whether [`certificate::counts_for`] the model that is wanted, so that starts are spared and poses are
    /// refined alone.
    ///
    /// [`certificate::counts_for`]: super::certificate::counts_for
    pub is_certifiable: bool,
}

/// What is known of a parameter or of a deformation beforehand.
pub(super) struct Known {
    /// Among the shared unknowns; `None` where it is held.
    pub row: Option<usize>,
    /// Distance from the value that is expected.
    pub off: f64,
    pub weight: Weight,
}

/// Where minima are compared or left for another model, a cost that is known to this part of itself is known
/// well enough: to a thousandth of a variance with a thousand degrees of freedom.
pub(super) const ROUGH_GAIN: f64 = 1e-6;

/// A good start takes fewer iterations.
const PATIENCE: usize = 12;

/// Residuals of pixels near `p` cannot be known better than this many roundings of `p`.
const ROUNDINGS: f64 = 8.0;

/// The cost that rounding alone makes.
pub(super) fn rounding_cost(views: &[Marks]) -> f64 {
    let unit = |p: f64| (ROUNDINGS * f64::EPSILON * p) * (ROUNDINGS * f64::EPSILON * p);
    let marks = views.iter().flat_map(|view| &view.list);
    marks.map(|mark| (unit(mark.pixel.x) + unit(mark.pixel.y)) * mark.weight * mark.weight).sum()
}

impl Problem<'_> {
    /// Unknowns that are not parameters of the camera.
    pub fn deformations(&self) -> usize {
        self.bend.map_or(0, |bend| bend.deformations)
    }

    fn add_priors(&self, state: &State, system: &mut System<WIDTH>) {
        for Known { row, off, weight } in self.known(state) {
            system.cost += weight.cost * off * off;
            let Some(row) = row else { continue };
            system.intrinsics[(row, row)] += weight.information;
            system.gradient[row] += weight.cost * off;
        }
    }

    /// What is known beforehand: of parameters first, then of the board's deformations.
    pub fn known(&self, state: &State) -> Vec<Known> {
        let known =
            |row: Option<usize>, off: f64, sd: f64| Known { row, off, weight: Weight::of(self.noise, sd) };
        let of_prior = |prior: &Prior| {
            let row = self.free.position(prior.parameter);
            if row.is_none() && !self.held.contains(prior.parameter) {
                return None;
            }
            Some(known(row, state.camera.value(prior.parameter)? - prior.mean, prior.standard_deviation))
        };
        let bend = self.known_bend();
        let deformations = (0..bend.map_or(0, |bend| bend.deformations)).zip(state.shape);
        let of_board = |(k, value)| Some(known(Some(self.free.len() + k), value, bend?.standard_deviation));
        self.priors.iter().filter_map(of_prior).chain(deformations.filter_map(of_board)).collect()
    }

    /// What a state costs for what is known of camera and board beforehand.
    pub fn cost_of_priors(&self, state: &State) -> f64 {
        self.known(state).iter().map(|known| known.weight.cost * known.off * known.off).sum()
    }

    /// What the kernel is asked of view `at`.
    pub fn view<'b>(&'b self, state: &'b State, columns: &'b Columns, at: usize) -> kernel::View<'b> {
        kernel::View {
            camera: &state.camera,
            cam_from_target: &state.cam_from_target[at],
            shape: &state.shape,
            marks: &self.views[at],
            loss: self.loss,
            columns,
        }
    }

    /// The cost of a state without derivatives: the bits of [`Descent::linearise_into`], as the sums have its
    /// order. Infinite where the lens has no image of a mark.
    pub fn cost(&self, state: &State) -> f64 {
        let columns = Columns::NONE;
        let of_view = |at: usize, _: &Marks| kernel::cost(&self.view(state, &columns, at));
        let of_views: Option<Vec<f64>> = chunks::map(self.views, of_view).into_iter().collect();
        let of_marks = of_views.map(|costs| costs.chunks(CHUNK).map(|chunk| chunk.iter().sum::<f64>()).sum());
        match of_marks {
            Some(cost) if state.camera.fx > 0.0 && state.camera.fy > 0.0 && !f64::is_nan(cost) => self
                .known(state)
                .iter()
                .fold(cost, |sum, known| sum + known.weight.cost * known.off * known.off),
            _ => f64::INFINITY,
        }
    }

    /// Columns of the shared unknowns.
    pub fn columns(&self, state: &State) -> Columns {
        Columns::of(&state.camera.distortion, self.free, self.fy_per_fx, self.deformations())
    }

    /// How many unknowns are settled by what is known beforehand: `sum (posterior sd / prior sd)^2`.
    pub fn settled(&self, system: &System<WIDTH>) -> f64 {
        let bend = self.known_bend();
        if self.priors.is_empty() && bend.is_none() {
            return 0.0;
        }
        let Some(covariance) = system.reduction().and_then(|r| r.intrinsics_covariance()) else { return 0.0 };
        let share = |row: usize, sd: f64| covariance[(row, row)] * self.noise.variance / (sd * sd);
        let of_priors = self
            .priors
            .iter()
            .filter_map(|prior| Some(share(self.free.position(prior.parameter)?, prior.standard_deviation)));
        let rows = self.free.len()..self.free.len() + bend.map_or(0, |bend| bend.deformations);
        let of_board = rows.filter_map(|row| Some(share(row, bend?.standard_deviation)));
        of_priors.chain(of_board).sum()
    }

    /// The board's shape where something is known of it beforehand.
    fn known_bend(&self) -> Option<Bend> {
        self.bend.filter(|bend| bend.standard_deviation.is_finite())
    }

    fn fill(&self, state: &State, system: &mut System<WIDTH>) -> Option<()> {
        let columns = self.columns(state);
        system.views.resize_with(self.views.len(), ViewBlock::zero);
        let mut total = Some(Share::zero());
        let chunk = |index: usize, blocks: &mut [ViewBlock<WIDTH>]| {
            let mut share = Share::zero();
            for (k, block) in blocks.iter_mut().enumerate() {
                kernel::add_view(&self.view(state, &columns, index * CHUNK + k), &mut share, block)?;
            }
            Some(share)
        };
        chunks::fold(&mut system.views, chunk, |share| {
            total = match (total.take(), share) {
                (Some(mut sum), Some(part)) => {
                    sum.square += part.square;
                    sum.gradient += part.gradient;
                    sum.cost += part.cost;
                    Some(sum)
                }
                _ => None,
            };
        });
        let mut total = total?;
        total.square.fill_lower_triangle_with_upper_triangle();
        (system.intrinsics, system.gradient, system.cost) = (total.square, total.gradient, total.cost);
        Some(())
    }
}

impl Descent<WIDTH> for Problem<'_> {
    type State = State;

    fn system(&self) -> System<WIDTH> {
        System::new(self.free, self.views.len()).sharing(self.deformations())
    }

    fn linearise_into(&self, state: &State, system: &mut System<WIDTH>) {
        let filled = self.fill(state, system);
        if filled.is_none() || !(state.camera.fx > 0.0 && state.camera.fy > 0.0) || system.cost.is_nan() {
            system.cost = f64::INFINITY;
            return;
        }
        self.add_priors(state, system);
    }

    fn step(&self, from: &State, step: &Step<WIDTH>, to: &mut State) {
        let shared = step.intrinsics.as_slice();
        to.camera = from.camera.moved(self.free, shared);
        to.camera = tied(to.camera, self.fy_per_fx);
        for k in 0..self.deformations() {
            to.shape[k] = from.shape[k] + shared[self.free.len() + k];
        }
        for ((to, from), delta) in to.cam_from_target.iter_mut().zip(&from.cam_from_target).zip(&step.poses) {
            *to = from.perturbed(delta);
        }
    }

    fn is_curved(&self) -> bool {
        true
    }

    fn may_leap(&self) -> bool {
        true
    }

    fn patience(&self) -> usize {
        PATIENCE
    }

    fn acceleration(&self, from: &State, damping: f64, step: &Step<WIDTH>) -> Option<Step<WIDTH>> {
        Problem::acceleration(self, from, damping, step)
    }

    fn max_iterations(&self) -> usize {
        self.max_iterations
    }

    fn relative_gain(&self) -> f64 {
        self.relative_gain
    }

    fn rounding_cost(&self) -> f64 {
        self.rounding_cost
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::minimise::descend;
    use super::super::fixture::{FREE, at_minimum};
    use super::*;
    use crate::camera::Parameter;

    #[test]
    fn what_is_known_weighs_by_the_noise_of_a_coordinate_over_its_own() {
        at_minimum(FreeParameters::of(&FREE), 1.0, |nothing_known, minimum| {
            let prior = Prior { parameter: Parameter::Cx, mean: 300.0, standard_deviation: 0.2 };
            let bend = Some(Bend { deformations: 2, standard_deviation: 0.05 });
            let problem = Problem {
                priors: &[prior],
                noise: Noise { coordinate: 0.02, variance: 0.01, rise: 0.008 },
                bend,
                ..*nothing_known
            };
            let state = State { shape: [0.3, -0.1, 0.0], ..minimum.state.clone() };
            let known = problem.known(&state);
            let expected =
                [(2, state.camera.cx - 300.0, 0.01 / 0.04), (6, 0.3, 0.01 / 0.0025), (7, -0.1, 4.0)];
            assert_eq!(known.len(), expected.len());
            for (Known { row, off, weight }, (row_expected, off_expected, weight_expected)) in
                known.iter().zip(expected)
            {
                assert_eq!((*row, *off), (Some(row_expected), off_expected));
                assert!((weight.information / weight_expected - 1.0).abs() < 1e-14, "{weight:?}");
                assert!((weight.cost / weight_expected - 0.8).abs() < 1e-14, "{weight:?}");
            }
            // And so it costs, with derivatives and without.
            let known_cost: f64 = expected.iter().map(|(_, off, weight)| 0.8 * weight * off * off).sum();
            let mut system = problem.system();
            problem.linearise_into(&state, &mut system);
            let of_marks = Problem { priors: &[], bend: None, ..problem }.cost(&state);
            assert!((system.cost / (of_marks + known_cost) - 1.0).abs() < 1e-14);
            assert_eq!(problem.cost(&state), system.cost);
        });
    }

    #[test]
    fn a_camera_with_a_negative_focal_length_is_none() {
        at_minimum(FreeParameters::of(&FREE), 1.0, |problem, minimum| {
            for (x, y) in [(-1.0, 1.0), (1.0, -1.0)] {
                let mut state = minimum.state.clone();
                (state.camera.fx, state.camera.fy) = (x * state.camera.fx, y * state.camera.fy);
                let mut system = problem.system();
                problem.linearise_into(&state, &mut system);
                assert_eq!((problem.cost(&state), system.cost), (f64::INFINITY, f64::INFINITY));
            }
        });
    }

    #[test]
    fn what_is_known_beforehand_settles_its_part_of_an_unknown() {
        at_minimum(FreeParameters::of(&FREE), 1.0, |nothing_known, minimum| {
            assert_eq!(nothing_known.settled(&minimum.system), 0.0);
            let unit = minimum.system.reduction().unwrap().intrinsics_covariance().unwrap();
            let (row, cx) = (2, minimum.state.camera.cx);
            let pixels = 0.01 * unit[(row, row)];
            // A prior as wide as what the pixels say settles half, one half as wide four fifths.
            for (part, settled) in [(1.0, 0.5), (0.25, 0.8)] {
                let prior =
                    Prior { parameter: Parameter::Cx, mean: cx, standard_deviation: (part * pixels).sqrt() };
                let problem = Problem { priors: &[prior], noise: Noise::of_squares(0.01), ..*nothing_known };
                let own = problem.settled(&descend(&problem, minimum.state.clone()).system);
                assert!((own - settled).abs() < 1e-6, "{own}");
            }
        });
    }
}
