//! Which camera do the marks of photographs give? Calibration with the bias of discs taken off, and stray
//! views left out.
//!
//! The centre of an imaged disc is not the image of the disc's centre, and by how much depends on the camera
//! and the pose that are sought. So they are found in turn: calibrate, predict every disc's bias from the
//! estimate, subtract it from what was detected, calibrate again (Heikkila 2000). The bias is a second-order
//! effect of the disc's size and hardly changes with the estimate, so each round leaves a small part of the
//! error of the last.

use crate::board::{Board, Pattern, View};
use crate::calibrate::{CalibrationError, LensCalibration, Settings, calibrate_lens, locate};
use crate::camera::{Camera, Lens};
use crate::detect::disc_biases;
use crate::geometry::{Pose, Vec2};

/// Rounds end when no disc's bias changes by more than this, px: a tenth of what the best detection on
/// noise-free images leaves.
const SETTLED_PX: f64 = 1e-4;

/// Rounds before giving up; two or three suffice wherever the estimate is near the truth.
const MOST_ROUNDS: usize = 20;

/// A view that fits this well is no stray, whatever the median: no detector does better on a photograph, and
/// on computed points only rounding is left to compare.
const LEAST_STRAY_PX: f64 = 0.01;

/// How views are fitted.
///
/// [`Fitter::fit`] has an example.
#[derive(Debug, Clone)]
pub struct Fitter<'a> {
    /// What is estimated, and the loss.
    pub settings: &'a Settings,
    /// The board whose discs' bias is corrected.
    pub discs: Option<&'a Board>,
    /// Views whose RMSE exceeds this many times the median are left out, worst first.
    pub reject_factor: Option<f64>,
}

/// How the bias of discs was corrected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BiasCorrection {
    /// Calibrations, the uncorrected one not counted.
    pub rounds: usize,
    /// Largest change of a disc's bias in the last round, px.
    pub last_change_px: f64,
    /// Largest bias of a disc, px.
    pub largest_px: f64,
    /// RMS bias over all discs, px.
    pub rms_px: f64,
}

impl BiasCorrection {
    /// Whether the last round changed nothing that matters.
    pub fn settled(&self) -> bool {
        self.last_change_px < SETTLED_PX
    }
}

/// A view that was left out.
#[derive(Debug, Clone, PartialEq)]
pub struct Rejected {
    /// Its index among the views given.
    pub view: usize,
    /// Why.
    pub reason: String,
}

/// A calibration and what it rests on.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Of the kept views, in order.
    pub calibration: LensCalibration,
    /// What was fitted: the kept views, bias of discs taken off.
    pub views: Vec<View>,
    /// Indices of the kept views among those given.
    pub kept: Vec<usize>,
    /// Views left out, in the order in which they were.
    pub rejected: Vec<Rejected>,
    /// `None` for marks without extent or of unknown size.
    pub bias: Option<BiasCorrection>,
}

impl Fitter<'_> {
    /// Calibrates, without the views whose marks do not span a plane. With a factor of rejection, the view
    /// that stands out most is dropped and all others fitted again until none stands out, so that a view that
    /// spoils the fit does not take others with it. At least half of the views stay.
    ///
    /// # Errors
    /// See [`CalibrationError`]; views in it are counted among those given.
    ///
    /// ```
    /// use calibench::calibrate::Settings;
    /// use calibench::geometry::Vec2;
    /// use calibench::board::View;
    /// use calibench::photos::Fitter;
    /// use calibench::synth::{Scene, Stream, StreamKey};
    ///
    /// let mut stream = Stream::open(StreamKey { seed: 1, scenario: "stray", trial: 0, purpose: "noise" });
    /// let mut views = Scene::example().observe(0.1, &mut stream);
    /// // In the last photograph every second mark was found three pixels too far right.
    /// let shifted = views[3].pixels().iter().enumerate();
    /// let pixels = shifted.map(|(i, p)| p + Vec2::new(3.0 * (i % 2) as f64, 0.0)).collect();
    /// views[3] = View::new(views[3].points().to_vec(), pixels)?;
    ///
    /// let fitter = Fitter { settings: &Settings::standard(), discs: None, reject_factor: Some(3.0) };
    /// let fit = fitter.fit(&views)?;
    /// assert_eq!((fit.kept, fit.rejected[0].view), (vec![0, 1, 2], 3));
    /// assert!(fit.calibration.rmse_px < 0.2);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn fit(&self, views: &[View]) -> Result<Fit, CalibrationError> {
        let mut kept: Vec<usize> = (0..views.len()).collect();
        let mut rejected: Vec<Rejected> = Vec::new();
        let mut on_a_line = None;
        loop {
            let chosen: Vec<View> = kept.iter().map(|&view| views[view].clone()).collect();
            let half_stay = 2 * (kept.len() - 1) >= views.len();
            let may_drop = self.reject_factor.is_some() && half_stay;
            match self.fit_all(&chosen) {
                Ok((calibration, views, bias)) => match self.stray(&calibration).filter(|_| may_drop) {
                    Some((place, reason)) => rejected.push(Rejected { view: kept.remove(place), reason }),
                    None => return Ok(Fit { calibration, views, kept, rejected, bias }),
                },
                // Marks on a line say next to nothing, whatever the fit.
                Err(CalibrationError::View { view, source }) if half_stay => {
                    let view = kept.remove(view);
                    rejected.push(Rejected { view, reason: source.to_string() });
                    on_a_line = on_a_line.or(Some(CalibrationError::View { view, source }));
                }
                // Of a view that was given, "too few" says nothing.
                Err(error @ CalibrationError::TooFewViews { .. }) => return Err(on_a_line.unwrap_or(error)),
                Err(CalibrationError::View { view, source }) => {
                    return Err(CalibrationError::View { view: kept[view], source });
                }
                // A view so wrong that under its errors nothing seems determined.
                Err(error @ (CalibrationError::NotIdentifiable { .. } | CalibrationError::Outliers(_)))
                    if may_drop =>
                {
                    let Some(place) = self.best_without_one(&chosen) else { return Err(error) };
                    let reason =
                        format!("without it the other views determine the camera, with it not: {error}");
                    rejected.push(Rejected { view: kept.remove(place), reason });
                }
                Err(error) => return Err(error),
            }
        }
    }

    /// The view without which the others have the least RMSE; `None` if they determine nothing without any
    /// one.
    fn best_without_one(&self, views: &[View]) -> Option<usize> {
        let without = |place: usize| {
            let others: Vec<View> =
                views.iter().enumerate().filter(|(i, _)| *i != place).map(|(_, view)| view.clone()).collect();
            Some((place, self.fit_all(&others).ok()?.0.rmse_px))
        };
        let fits = (0..views.len()).filter_map(without);
        fits.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(place, _)| place)
    }

    /// The worst view, if its RMSE exceeds the factor times the median of all.
    fn stray(&self, calibration: &LensCalibration) -> Option<(usize, String)> {
        let factor = self.reject_factor?;
        let rmse: Vec<f64> =
            (0..calibration.residuals.len()).filter_map(|i| calibration.view_rmse_px(i)).collect();
        let mut sorted = rmse.clone();
        sorted.sort_by(f64::total_cmp);
        // Lower median: of two views neither is the odd one.
        let median = *sorted.get((sorted.len().checked_sub(1)?) / 2)?;
        let worst = (0..rmse.len()).max_by(|&a, &b| rmse[a].total_cmp(&rmse[b]))?;
        (rmse.len() > 2 && rmse[worst] > (factor * median).max(LEAST_STRAY_PX)).then(|| {
            let reason = format!(
                "its RMSE of {:.3} px is {:.1} times the median of {} views ({median:.3} px); at most {factor} times was asked for",
                rmse[worst],
                rmse[worst] / median,
                rmse.len()
            );
            (worst, reason)
        })
    }

    /// Calibrates all views given, and again without their discs' bias until that settles.
    fn fit_all(
        &self,
        views: &[View],
    ) -> Result<(LensCalibration, Vec<View>, Option<BiasCorrection>), CalibrationError> {
        let mut calibration = calibrate_lens(views, self.settings)?;
        let mut corrected = views.to_vec();
        let discs = self.discs.filter(|board| matches!(board.pattern(), Pattern::Circles { .. }));
        let Some(board) = discs else { return Ok((calibration, corrected, None)) };
        let mut last: Option<Vec<Vec<Vec2>>> = None;
        let mut rounds = 0;
        loop {
            // An estimate that puts a disc behind the camera predicts no bias: it is left uncorrected, and
            // the RMSE tells.
            let Some(biases) = biases(&calibration, views, board) else {
                return Ok((calibration, corrected, None));
            };
            let change = last.as_ref().map_or(f64::INFINITY, |last| largest_change(last, &biases));
            if change < SETTLED_PX || rounds == MOST_ROUNDS {
                let bias = BiasCorrection {
                    rounds,
                    last_change_px: change,
                    largest_px: biases.iter().flatten().map(|b| b.norm()).fold(0.0, f64::max),
                    rms_px: rms(&biases),
                };
                return Ok((calibration, corrected, Some(bias)));
            }
            corrected = views.iter().zip(&biases).map(|(view, biases)| without_bias(view, biases)).collect();
            calibration = calibrate_lens(&corrected, self.settings)?;
            last = Some(biases);
            rounds += 1;
        }
    }
}

fn biases(calibration: &LensCalibration, views: &[View], board: &Board) -> Option<Vec<Vec<Vec2>>> {
    let views = views.iter().zip(&calibration.cam_from_target);
    views.map(|(view, pose)| of_marks(view, board, biases_at(&calibration.camera, pose, board)?)).collect()
}

/// A Brown-Conrady lens gives the bits of that model's own projection.
fn biases_at(camera: &Camera<Lens>, pose: &Pose, board: &Board) -> Option<Vec<Vec2>> {
    match camera.brown_conrady() {
        Some(plain) => disc_biases(&plain, pose, board).ok(),
        None => disc_biases(camera, pose, board).ok(),
    }
}

/// Of the values of a board's marks those of the marks in a view; `None` if one of them is none of the
/// board's.
fn of_marks(view: &View, board: &Board, all: Vec<Vec2>) -> Option<Vec<Vec2>> {
    let points = board.points();
    if view.points() == points {
        return Some(all);
    }
    let value = |point: &Vec2| Some(all[points.iter().position(|other| other == point)?]);
    view.points().iter().map(value).collect()
}

/// A view of discs without the bias that a known camera predicts for them at the pose that it finds, in turns
/// until that settles; `None` where the camera does not find the board.
///
/// ```
/// use calibench::board::View;
/// use calibench::detect::disc_biases;
/// use calibench::photos::without_disc_bias;
/// use calibench::synth::{Scene, Truth};
///
/// // What a detector finds: the middles of the discs' images, not the images of their middles.
/// let (truth, board, scene) = (Truth::example(), Truth::example_board(), Scene::example());
/// let biases = disc_biases(&truth.camera, &truth.cam_from_target[0], &board)?;
/// let found = scene.pixels()[0].iter().zip(&biases).map(|(pixel, bias)| pixel + bias).collect();
/// let view = View::new(board.points(), found)?;
/// let corrected = without_disc_bias(&truth.camera.into(), &view, &board).expect("the camera sees the board");
/// let left = corrected.pixels().iter().zip(&scene.pixels()[0]).map(|(a, b)| (a - b).norm());
/// assert!(left.fold(0.0, f64::max) < 1e-4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn without_disc_bias(camera: &Camera<Lens>, view: &View, board: &Board) -> Option<View> {
    let mut corrected = view.clone();
    let mut last: Option<Vec<Vec2>> = None;
    for _ in 0..MOST_ROUNDS {
        let pose = locate(camera, &corrected)?.cam_from_target;
        let biases = of_marks(view, board, biases_at(camera, &pose, board)?)?;
        corrected = without_bias(view, &biases);
        let now = [biases];
        if last.replace(now[0].clone()).is_some_and(|last| largest_change(&[last], &now) < SETTLED_PX) {
            break;
        }
    }
    Some(corrected)
}

fn largest_change(last: &[Vec<Vec2>], now: &[Vec<Vec2>]) -> f64 {
    last.iter().flatten().zip(now.iter().flatten()).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

fn rms(biases: &[Vec<Vec2>]) -> f64 {
    let count = biases.iter().map(Vec::len).sum::<usize>().max(1);
    (biases.iter().flatten().map(|b| b.norm_squared()).sum::<f64>() / count as f64).sqrt()
}

fn without_bias(view: &View, biases: &[Vec2]) -> View {
    let pixels = view.pixels().iter().zip(biases).map(|(pixel, bias)| pixel - bias).collect();
    let moved = View::new(view.points().to_vec(), pixels);
    let weighted = moved.and_then(|moved| match view.weights() {
        Some(weights) => moved.with_weights(weights.to_vec()),
        None => Ok(moved),
    });
    weighted.unwrap_or_else(|_| view.clone())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::{Scene, Truth};

    fn biased_views() -> Vec<View> {
        let truth = Truth::example();
        let board = Truth::example_board();
        let scene = Scene::example();
        (truth.cam_from_target.iter().zip(scene.pixels()))
            .map(|(pose, pixels)| {
                let biases = disc_biases(&truth.camera, pose, &board).unwrap();
                let seen = pixels.iter().zip(&biases).map(|(pixel, bias)| pixel + bias).collect();
                View::new(board.points(), seen).unwrap()
            })
            .collect()
    }

    #[test]
    fn the_bias_of_discs_is_taken_off_and_the_camera_is_exact() {
        let settings = Settings::standard();
        let board = Truth::example_board();
        let fitter = Fitter { settings: &settings, discs: Some(&board), reject_factor: None };
        let fit = fitter.fit(&biased_views()).unwrap();
        let bias = fit.bias.unwrap();
        assert!(bias.settled() && bias.rounds <= 4, "{bias:?}");
        // The last round changed no pixel by more than 1e-4 px, and the next would change it by far less: the
        // residuals are below it.
        assert!(fit.calibration.rmse_px < SETTLED_PX, "{}", fit.calibration.rmse_px);
        let uncorrected = Fitter { discs: None, ..fitter }.fit(&biased_views()).unwrap();
        assert!(
            uncorrected.bias.is_none() && uncorrected.calibration.rmse_px > 10.0 * fit.calibration.rmse_px
        );
    }

    #[test]
    fn a_known_camera_takes_the_bias_off_views_it_has_not_seen() {
        let (truth, scene) = (Truth::example(), Scene::example());
        for (view, exact) in biased_views().iter().zip(scene.exact()) {
            let corrected = without_disc_bias(&truth.camera.into(), view, &Truth::example_board()).unwrap();
            let left = corrected.pixels().iter().zip(exact.pixels()).map(|(a, b)| (a - b).norm());
            // The bias changes by a part in a thousand of its change with the pose.
            assert!(left.fold(0.0, f64::max) < SETTLED_PX);
        }
    }

    #[test]
    fn discs_that_are_hidden_leave_the_bias_of_the_others() {
        let settings = Settings::standard();
        let board = Truth::example_board();
        let fitter = Fitter { settings: &settings, discs: Some(&board), reject_factor: None };
        let mut views = biased_views();
        let (points, pixels) = (views[2].points()[5..].to_vec(), views[2].pixels()[5..].to_vec());
        views[2] = View::new(points, pixels).unwrap();
        let fit = fitter.fit(&views).unwrap();
        assert!(fit.bias.unwrap().settled() && fit.calibration.rmse_px < SETTLED_PX);
        assert_eq!(fit.calibration.residuals[2].len(), 58);
        let known = without_disc_bias(&Truth::example_camera().into(), &views[2], &board).unwrap();
        let exact = &Scene::example().exact()[2];
        let left = known.pixels().iter().zip(&exact.pixels()[5..]).map(|(a, b)| (a - b).norm());
        assert!(left.fold(0.0, f64::max) < SETTLED_PX);
    }

    #[test]
    fn where_too_few_views_stay_the_one_that_tells_nothing_is_named() {
        let mut views = Scene::example().exact();
        views.truncate(2);
        let line = |list: &[Vec2]| list[..9].to_vec();
        views[1] = View::new(line(views[1].points()), line(views[1].pixels())).unwrap();
        let settings = Settings::standard();
        let fitter = Fitter { settings: &settings, discs: None, reject_factor: None };
        let refused = fitter.fit(&views).unwrap_err();
        assert!(matches!(refused, CalibrationError::View { view: 1, .. }), "{refused}");
    }

    #[test]
    fn a_mis_detected_view_is_left_out_and_no_other() {
        let mut views = Scene::example().exact();
        views.extend(Scene::example().exact());
        // The detector took the board to start one row further down: the marks' names are shifted by a row.
        let mut pixels = views[5].pixels().to_vec();
        pixels.rotate_left(9);
        views[5] = View::new(views[5].points().to_vec(), pixels).unwrap();
        let settings = Settings::standard();
        let fitter = Fitter { settings: &settings, discs: None, reject_factor: Some(3.0) };
        let fit = fitter.fit(&views).unwrap();
        assert_eq!(fit.rejected.iter().map(|r| r.view).collect::<Vec<_>>(), [5]);
        assert_eq!(fit.kept, [0, 1, 2, 3, 4, 6, 7]);
        assert!((fit.calibration.camera.fx - 600.0).abs() < 1e-6);
        // With it the errors are too large for anything to be determined, or the fit shows them.
        let all = Fitter { reject_factor: None, ..fitter }.fit(&views);
        assert!(all.is_err() || all.unwrap().calibration.rmse_px > 1.0);
    }
}
