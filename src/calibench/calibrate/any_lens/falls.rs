//! By how much would the cost of a minimum fall with more freedoms? Its normal equations with all of them,
//! once, and the sums of squares that any of them would take away.

use super::super::elimination::Reduced;
use super::super::left_out::{CostFalls, DEFORMATIONS, Freedoms};
use super::super::minimise::{Descent, RELATIVE_GAIN};
use super::super::noise::Noise;
use super::super::settings::Bend;
use super::super::target_frame::TargetFrames;
use super::super::{LensCalibration, Settings};
use super::problem::{Problem, State, rounding_cost};
use super::{BoardShape, WIDTH, certificate, marks, shape};
use crate::board::View;
use crate::camera::{FreeParameters, Parameter};
use nalgebra::SVector;

/// Normal equations of the shared unknowns at a minimum, the poses eliminated, with freedoms that it does not
/// have.
pub(in super::super) struct Falls {
    reduced: Reduced<WIDTH>,
    /// All parameters of the equations; the board's deformations follow where there are some.
    all: FreeParameters,
    deformations: usize,
    /// The parameters and the deformations that the minimum has.
    own: FreeParameters,
    own_deformations: usize,
    own_shape: [f64; 3],
    /// What its own freedoms would still lower the cost by.
    left: f64,
}

impl Falls {
    /// With `more` freedoms; `None` where the marks fit up to rounding, or leave a pose open.
    pub fn of(views: &[View], settings: &Settings, found: &LensCalibration, more: Freedoms) -> Option<Falls> {
        let frames = TargetFrames::of(views);
        let marks = marks::of_views(views, &frames, &shape::region(views));
        let own_deformations = found.board.as_ref().and(settings.board.bend()).map_or(0, |b| b.deformations);
        let deformations = if more.shape { DEFORMATIONS } else { own_deformations };
        let all = more.parameters.iter().fold(found.free, FreeParameters::with);
        let nothing_known = Bend { deformations, standard_deviation: f64::INFINITY };
        let problem = Problem {
            views: &marks,
            free: all,
            held: FreeParameters::NONE,
            // Also where both are held: they move together if at all.
            fy_per_fx: settings.fy_per_fx(),
            priors: &found.priors,
            noise: Noise::of_squares(found.sigma_px * found.sigma_px),
            bend: match settings.board.bend() {
                Some(bend) => Some(Bend { deformations, ..bend }),
                None => (deformations > 0).then_some(nothing_known),
            },
            loss: settings.loss,
            max_iterations: settings.max_iterations,
            relative_gain: RELATIVE_GAIN,
            rounding_cost: rounding_cost(&marks),
            is_certifiable: certificate::counts_for(settings.model()),
        };
        let poses = found.cam_from_target.iter().enumerate();
        let cam_from_target = poses.map(|(view, pose)| frames.at(view).of_pose(pose)).collect();
        let shape = found.board.as_ref().map_or([0.0; 3], BoardShape::deformations);
        let state = State { camera: found.camera, cam_from_target, shape };
        let mut system = problem.system();
        problem.linearise_into(&state, &mut system);
        if !system.cost.is_finite() || system.cost <= problem.rounding_cost {
            return None;
        }
        let reduced = system.eliminate(0.0, &mut Vec::new())?;
        let own = found.free;
        let mut falls =
            Falls { reduced, all, deformations, own, own_deformations, own_shape: shape, left: 0.0 };
        falls.left = falls.fall(Freedoms::NONE)?;
        Some(falls)
    }

    /// The rows of the minimum's own unknowns and of these.
    fn rows(&self, more: Freedoms) -> Vec<usize> {
        let is_taken = |p: &Parameter| self.own.contains(*p) || more.parameters.contains(*p);
        let parameters = self.all.iter().filter(is_taken).filter_map(|p| self.all.position(p));
        let deformations = if more.shape { self.deformations } else { self.own_deformations };
        parameters.chain((0..deformations).map(|k| self.all.len() + k)).collect()
    }
}

impl CostFalls for Falls {
    fn fall(&self, more: Freedoms) -> Option<f64> {
        let gain = self.reduced.gain(&self.rows(more))?;
        Some(gain - self.left).filter(|fall| fall.is_finite())
    }

    fn shape(&self, parameters: FreeParameters) -> Option<[f64; DEFORMATIONS]> {
        let rows = self.rows(Freedoms { parameters, shape: true });
        let step: SVector<f64, WIDTH> = self.reduced.part(&rows).solve(rows.len())?;
        let first = rows.len().checked_sub(DEFORMATIONS)?;
        Some(std::array::from_fn(|k| self.own_shape[k] + step[first + k]))
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::{Board, calibrate_lens};
    use super::super::fixture;
    use super::*;
    use crate::camera::Model;

    #[test]
    fn falls_are_those_of_a_refit_and_the_shape_is_the_one_that_it_finds() {
        let views = fixture::wide_views_of_a_bowed_board(0.002);
        let held = Settings::of_model(Model::KannalaBrandt).hold(Parameter::K4, -0.0016);
        let found = calibrate_lens(&views, &held).unwrap();
        let square = |found: &LensCalibration| found.rmse_px * found.rmse_px * found.points() as f64;
        let k4 = FreeParameters::of(&[Parameter::K4]);
        let both = Freedoms { parameters: k4, shape: true };
        let falls = Falls::of(&views, &held, &found, both).unwrap();
        let bent = Board::Bent { standard_deviation: f64::INFINITY };
        let free = held.clone().estimate(Parameter::K4);
        for (more, settings) in [
            (Freedoms { shape: false, ..both }, free.clone()),
            (Freedoms { shape: true, ..Freedoms::NONE }, held.clone().with_board(bent)),
            (both, free.with_board(bent)),
        ] {
            let refitted = calibrate_lens(&views, &settings).unwrap();
            let (fall, said) = (square(&found) - square(&refitted), falls.fall(more).unwrap());
            assert!((said / fall - 1.0).abs() < 0.01, "{said} {fall}");
            if let Some(board) = refitted.board {
                let told = falls.shape(more.parameters).unwrap();
                for (told, found) in told.into_iter().zip([board.bow_x, board.bow_y, board.twist]) {
                    assert!((told - found).abs() < 1e-4, "{told} {found}");
                }
            }
        }
        // A minimum has nothing left to gain.
        assert!(falls.fall(Freedoms::NONE).unwrap().abs() < 1e-9 * square(&found));
    }

    #[test]
    fn exact_marks_ask_for_nothing() {
        let views = fixture::exact_views();
        let settings = Settings::of_model(Model::KannalaBrandt);
        let found = calibrate_lens(&views, &settings).unwrap();
        let shape = Freedoms { shape: true, ..Freedoms::NONE };
        assert!(Falls::of(&views, &settings, &found, shape).is_none());
    }
}
