//! Where was the board in one view, behind a camera that is known? Six unknowns, so that neither a system of
//! all views nor derivatives by the lens are needed; a lens with minima side by side is descended with them
//! all the same, as [`counts_for`] says.
//!
//! [`counts_for`]: super::certificate::counts_for

use super::super::minimise::descend;
use super::kernel::{self, Columns, OfPose};
use super::problem::{Problem, ROUGH_GAIN, State};
use crate::camera::{Camera, FreeParameters, Lens};
use crate::geometry::Pose;
use nalgebra::SVector;

/// Damping as in the descent of all unknowns: what it starts and falls to, its factor, and where nothing
/// helps any more.
const FIRST_DAMPING: f64 = 1e-6;
const LEAST_DAMPING: f64 = 1e-12;
const DAMPING_FACTOR: f64 = 10.0;
const LARGEST_DAMPING: f64 = 1e10;

/// A view and a camera.
#[derive(Clone, Copy)]
pub(super) struct Resection<'a> {
    pub problem: &'a Problem<'a>,
    pub camera: &'a Camera<Lens>,
    /// Of the board.
    pub shape: &'a [f64; 3],
    pub view: usize,
}

/// A pose and what it costs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Posed {
    pub pose: Pose,
    /// Infinite where the lens has no image of a mark.
    pub cost: f64,
}

impl Resection<'_> {
    /// The pose after so many steps at most, or from where a further one promises less than [`ROUGH_GAIN`]. A
    /// start that costs least is left as it is.
    pub fn refined(&self, start: Pose, steps: usize) -> Posed {
        if self.problem.is_certifiable { self.alone(start, steps) } else { self.descended(start, steps) }
    }

    /// The descent of all unknowns, of which there are but these.
    fn descended(&self, start: Pose, steps: usize) -> Posed {
        let Resection { problem, camera, shape, view } = *self;
        let alone = Problem {
            views: std::slice::from_ref(&problem.views[view]),
            free: FreeParameters::NONE,
            priors: &[],
            bend: None,
            max_iterations: steps,
            relative_gain: ROUGH_GAIN,
            ..*problem
        };
        let found = descend(&alone, State { camera: *camera, cam_from_target: vec![start], shape: *shape });
        Posed { pose: found.state.cam_from_target[0], cost: found.system.cost }
    }

    /// Levenberg and Marquardt's method.
    fn alone(&self, start: Pose, steps: usize) -> Posed {
        let Some(mut here) = self.at(&start) else { return Posed { pose: start, cost: f64::INFINITY } };
        let mut pose = start;
        let mut damping = FIRST_DAMPING;
        for _ in 0..steps {
            let step = step(&here, damping);
            let is_last = |(_, gain): &(SVector<f64, 6>, f64)| {
                damping <= FIRST_DAMPING && *gain <= ROUGH_GAIN * here.cost + self.problem.rounding_cost
            };
            if step.as_ref().is_some_and(is_last) || damping > LARGEST_DAMPING {
                break;
            }
            let next = step.and_then(|(step, _)| {
                let next = pose.perturbed(&step);
                Some((next, self.at(&next)?))
            });
            match next {
                Some((next, there)) if there.cost < here.cost => {
                    (pose, here) = (next, there);
                    damping = (damping / DAMPING_FACTOR).max(LEAST_DAMPING);
                }
                _ => damping = damping.max(FIRST_DAMPING) * DAMPING_FACTOR,
            }
        }
        Posed { pose, cost: here.cost }
    }

    fn at(&self, pose: &Pose) -> Option<OfPose> {
        let Resection { problem, camera, shape, view } = *self;
        let columns = &Columns::NONE;
        let marks = &problem.views[view];
        kernel::of_pose(&kernel::View {
            camera,
            cam_from_target: pose,
            shape,
            marks,
            loss: problem.loss,
            columns,
        })
        .filter(|found| !found.cost.is_nan())
    }
}

/// The damped step and the fall of the cost that it promises.
fn step(here: &OfPose, damping: f64) -> Option<(SVector<f64, 6>, f64)> {
    let diagonal = here.square.diagonal();
    let mut damped = here.square;
    for i in 0..6 {
        damped[(i, i)] *= 1.0 + damping;
    }
    let step = -damped.cholesky()?.solve(&here.gradient);
    let gain = (0..6).map(|i| step[i] * (damping * diagonal[i] * step[i] - here.gradient[i])).sum();
    Some((step, gain))
}

#[cfg(test)]
mod tests {
    use super::super::super::minimise::Descent;
    use super::super::fixture::{FREE, at_minimum};
    use super::*;
    use crate::geometry::Vec3;

    #[test]
    fn the_equations_of_a_pose_are_its_block_of_the_whole() {
        at_minimum(FreeParameters::of(&FREE), 1.0, |problem, minimum| {
            let State { camera, cam_from_target, shape } = &minimum.state;
            let mut system = problem.system();
            problem.linearise_into(&minimum.state, &mut system);
            let mut cost = 0.0;
            for (view, block) in system.views.iter().enumerate() {
                let alone = Resection { problem, camera, shape, view };
                let found = alone.at(&cam_from_target[view]).unwrap();
                assert!((found.square - block.pose).norm() < 1e-14 * block.pose.norm());
                // The gradient vanishes here: it is compared with what its terms are.
                let terms = (block.pose.diagonal().max() * found.cost).sqrt();
                assert!((found.gradient - block.gradient).norm() < 1e-13 * terms);
                cost += found.cost;
            }
            assert!((cost / system.cost - 1.0).abs() < 1e-14);
            assert_eq!(problem.cost(&minimum.state), system.cost);
        });
    }

    #[test]
    fn a_pose_is_found_again_and_then_left_as_it_is() {
        at_minimum(FreeParameters::of(&FREE), 1.0, |problem, minimum| {
            let State { camera, cam_from_target, shape } = &minimum.state;
            let alone = Resection { problem, camera, shape, view: 2 };
            let there = alone.refined(cam_from_target[2], 20);
            assert_eq!(there.pose, cam_from_target[2]);
            let off = SVector::from([0.1, -0.1, 0.2, 0.1, 0.05, -0.3]);
            let found = alone.refined(cam_from_target[2].perturbed(&off), 20);
            assert!((found.cost / there.cost - 1.0).abs() < 1e-5, "{} {}", found.cost, there.cost);
            assert!(found.cost >= there.cost);
            // The descent of all unknowns finds it as well.
            let descended = Problem { is_certifiable: false, ..*problem };
            let same =
                Resection { problem: &descended, ..alone }.refined(cam_from_target[2].perturbed(&off), 20);
            assert!((same.cost / there.cost - 1.0).abs() < 1e-5, "{} {}", same.cost, there.cost);
            // Too few steps do not get there, and a pose behind the lens has no cost.
            assert!(alone.refined(cam_from_target[2].perturbed(&off), 1).cost > 2.0 * there.cost);
            let behind = Pose { translation: Vec3::new(0.0, 0.0, f64::NAN), ..cam_from_target[2] };
            assert_eq!(alone.refined(behind, 5).cost, f64::INFINITY);
        });
    }
}
