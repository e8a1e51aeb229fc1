//! May two calibrations be of one camera, of one lens model or of two?
//!
//! The difference over the frame that is left when the best motion is taken out, `d`, has to first order the
//! covariance `G G^T` if both are one camera,
//!
//! ```text
//! G = M [J_A L_A, J_B L_B],   M = 1 - W (W^T W)^-1 W^T,   P = L L^T
//! ```
//! with `J` the derivatives of the frame's pixels by what was estimated, `W` those by the motion and `P` the
//! covariances. With the singular values `s` and left vectors `u` of `G`, `sum (u^T d / s)^2` is chi-squared
//! with as many degrees of freedom as it has terms. Combinations of little trace are left out, which takes
//! power from the test and makes no false alarms: they are chosen by `G` alone.
//!
//! *One model.* Both are differentiated at the camera half-way, and `d = M J delta` with the difference of the parameters:
//! `G` has then no more directions than there are parameters, and what is left out is only what the motion
//! imitates.
//!
//! *Two models.* Parameters are not comparable; `d` is what [`frame_difference`] finds. If neither model is that of the
//! camera, the two predict other pixels, by more than chance allows where there are data enough: the test
//! then says so.
//!
//! The noise that scales both covariances is estimated: the mean term follows Fisher's distribution, with the
//! degrees of freedom of Satterthwaite (1946).

use super::frame::{Motion, enough, frame_difference, points_seen};
use super::root::root;
use super::slopes::{Estimated, Slopes};
use crate::camera::{Camera, FreeParameters, Lens, Parameter};
use crate::distribution::{ChiSquare, fisher_tail};
use crate::evaluate::{DifferenceError, TakenOut};
use crate::geometry::{Pose, Vec2, Vec3};
use nalgebra::{DMatrix, DVector};

/// A camera that was calibrated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibrated<'a> {
    /// The estimate.
    pub camera: &'a Camera<Lens>,
    /// What was estimated.
    pub free: FreeParameters,
    /// fy over fx, if the two were tied: fy then has no row.
    pub fy_per_fx: Option<f64>,
    /// Its covariance, n x n.
    pub covariance: &'a DMatrix<f64>,
    /// Degrees of freedom of the noise that scales it; without them the covariance is taken as known.
    pub degrees_of_freedom: Option<usize>,
}

impl Calibrated<'_> {
    fn estimated(&self) -> Estimated {
        Estimated { free: self.free, fy_per_fx: self.fy_per_fx }
    }
}

/// A test of whether two calibrations are of one camera.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct OneCamera {
    /// Squared Mahalanobis distance of the difference that is left.
    pub chi_squared: f64,
    /// Its degrees of freedom: combinations of parameters that the motion cannot imitate.
    pub degrees_of_freedom: usize,
    /// Combinations that the motion imitates: no difference that is left could show them.
    pub imitated: usize,
    /// Degrees of freedom of the noise estimates together, where both are known.
    pub noise_freedom: Option<usize>,
    /// Probability of such a distance or a larger one if both are one camera.
    pub p_value: f64,
}

/// With one model a combination whose difference is less than this part of that of the combination seen best
/// is one that the motion imitates: what the linear model leaves out is larger than a ten-thousandth.
const IMITATED: f64 = 1e-4;
/// With two models directions that both share differ by what the linear models leave out, some standard
/// deviations of a parameter over its value: a hundredth of the largest is well above it.
const SHARED: f64 = 1e-2;

/// Tests whether two independent calibrations are of one camera, whatever their lens models.
///
/// # Errors
/// [`DifferenceError`]: a frame that is not seen, a covariance that is none, or, with one model, a parameter
/// that was held at two values.
///
/// ```
/// use calibench::camera::{Camera, FreeParameters, Lens, Model, Parameter};
/// use calibench::evaluate::TakenOut;
/// use calibench::nalgebra::DMatrix;
/// use calibench::validate::{Calibrated, one_camera};
///
/// let camera = |fx: f64| Camera::with_lens(fx, 300.0, 320.0, 240.0, Lens::ideal(Model::KannalaBrandt));
/// // fx was estimated, to a tenth of a pixel.
/// let (free, covariance) = (FreeParameters::of(&[Parameter::Fx]), DMatrix::from_element(1, 1, 0.01));
/// let known = |camera| Calibrated { camera, free, fy_per_fx: None, covariance: &covariance, degrees_of_freedom: None };
/// let (a, near, far) = (camera(300.0), camera(300.1), camera(301.0));
/// let tested = |other| one_camera(&known(&a), &known(other), (640, 480), TakenOut::Rotation);
/// // (0.1 / 0.141)^2 and (1 / 0.141)^2 on one degree of freedom.
/// assert!((tested(&near)?.chi_squared - 0.5).abs() < 1e-9 && (tested(&far)?.chi_squared - 50.0).abs() < 1e-6);
/// # Ok::<(), calibench::evaluate::DifferenceError>(())
/// ```
pub fn one_camera(
    a: &Calibrated,
    b: &Calibrated,
    size: (usize, usize),
    taken_out: TakenOut,
) -> Result<OneCamera, DifferenceError> {
    if a.free.is_empty() && b.free.is_empty() {
        return Err(DifferenceError::NothingFree);
    }
    let motion = Motion::of(taken_out)?;
    match a.camera.distortion.model() == b.camera.distortion.model() {
        true => Ok(Seen::with_one_model(a, b, size, motion)?.tested(IMITATED, a, b)),
        false => Ok(Seen::with_two_models(a, b, size, taken_out)?.tested(SHARED, a, b)),
    }
}

/// What is seen of both covariances over the frame.
struct Seen {
    /// `G^T G`, the columns of A first.
    gram: DMatrix<f64>,
    /// `G^T d`.
    toward: DVector<f64>,
    /// Columns of A.
    of_a: usize,
    /// Directions that `G` can have.
    directions: usize,
}

impl Seen {
    fn with_one_model(
        a: &Calibrated,
        b: &Calibrated,
        size: (usize, usize),
        motion: Motion,
    ) -> Result<Seen, DifferenceError> {
        refuse_held_apart(a, b)?;
        let middle = between(a.camera, b.camera);
        let points = points_seen(&middle, &middle, size, motion.distance);
        let at: Vec<Slopes> =
            points.iter().filter_map(|(_, p)| Slopes::of(&middle, &Pose::identity(), p)).collect();
        enough(at.len())?;
        let delta =
            |parameter| b.camera.value(parameter).unwrap_or(0.0) - a.camera.value(parameter).unwrap_or(0.0);
        let moved = |at: &Slopes| at.by_parameters.iter().map(|(p, slope)| slope * delta(*p)).sum::<Vec2>();
        let difference = stacked(at.len(), |node| moved(&at[node]));
        let without = Without::of(&at, motion)?;
        let (of_a, of_b) = (seen_of(a, &at)?, seen_of(b, &at)?);
        let both = a.free.iter().chain(b.free.iter()).fold(FreeParameters::NONE, FreeParameters::with);
        let is_tied_once = a.fy_per_fx != b.fy_per_fx && !both.contains(Parameter::Fy);
        let directions = both.len() + usize::from(is_tied_once);
        Ok(Seen::of(&without, of_a, of_b, &without.motion(&difference), directions))
    }

    fn with_two_models(
        a: &Calibrated,
        b: &Calibrated,
        size: (usize, usize),
        taken_out: TakenOut,
    ) -> Result<Seen, DifferenceError> {
        let motion = Motion::of(taken_out)?;
        let left = frame_difference(a.camera, b.camera, size, taken_out)?;
        let point = |pixel: &Vec2| Some(motion.distance * a.camera.ray(pixel).ok()?);
        let slopes = |pixel: &Vec2| -> Option<(Slopes, Slopes)> {
            let point: Vec3 = point(pixel)?;
            let of_a = Slopes::of(a.camera, &Pose::identity(), &point)?;
            Some((of_a, Slopes::of(b.camera, &left.b_from_a, &point)?))
        };
        let seen = left.nodes.iter().filter_map(|node| Some((slopes(&node.pixel)?, node.difference)));
        let (at, differences): (Vec<(Slopes, Slopes)>, Vec<Vec2>) = seen.unzip();
        enough(at.len())?;
        let (at_a, at_b): (Vec<Slopes>, Vec<Slopes>) = at.into_iter().unzip();
        let without = Without::of(&at_b, motion)?;
        let difference = stacked(differences.len(), |node| differences[node]);
        let (of_a, of_b) = (seen_of(a, &at_a)?, seen_of(b, &at_b)?);
        let directions = of_a.ncols() + of_b.ncols();
        Ok(Seen::of(&without, of_a, of_b, &without.motion(&difference), directions))
    }

    fn of(
        without: &Without,
        of_a: DMatrix<f64>,
        of_b: DMatrix<f64>,
        difference: &DMatrix<f64>,
        directions: usize,
    ) -> Seen {
        let (n_a, n_b) = (of_a.ncols(), of_b.ncols());
        let mut g = of_a.insert_columns(n_a, n_b, 0.0);
        g.columns_mut(n_a, n_b).copy_from(&of_b);
        let g = without.motion(&g);
        let toward = (g.transpose() * difference).column(0).into_owned();
        Seen { gram: g.transpose() * &g, toward, of_a: n_a, directions }
    }

    /// The test, without combinations that are seen less than this part of the one seen best.
    fn tested(&self, least: f64, a: &Calibrated, b: &Calibrated) -> OneCamera {
        let eigen = self.gram.clone().symmetric_eigen();
        let limit = least * least * eigen.eigenvalues.max();
        let kept: Vec<usize> =
            (0..eigen.eigenvalues.len()).filter(|&k| eigen.eigenvalues[k] > limit).collect();
        let vector = |k: usize| eigen.eigenvectors.column(k);
        let term = |&k: &usize| {
            let along = vector(k).dot(&self.toward);
            along * along / (eigen.eigenvalues[k] * eigen.eigenvalues[k])
        };
        let chi_squared: f64 = kept.iter().map(term).sum();
        let rank = kept.len();
        let noise_freedom = a.degrees_of_freedom.zip(b.degrees_of_freedom).map(|(of_a, of_b)| {
            let part = |&k: &usize| vector(k).rows(0, self.of_a).norm_squared();
            satterthwaite(kept.iter().map(part).sum::<f64>() / rank.max(1) as f64, of_a, of_b)
        });
        let p_value = match noise_freedom {
            _ if rank == 0 => 1.0,
            Some(freedom) => fisher_tail(chi_squared / rank as f64, rank, freedom),
            None => ChiSquare::new(rank).survival(chi_squared),
        };
        let imitated = self.directions.saturating_sub(rank);
        OneCamera { chi_squared, degrees_of_freedom: rank, imitated, noise_freedom, p_value }
    }
}

/// `J L`, two rows a node.
fn seen_of(calibrated: &Calibrated, at: &[Slopes]) -> Result<DMatrix<f64>, DifferenceError> {
    let estimated = calibrated.estimated();
    let columns: Vec<Vec<Vec2>> = at.iter().map(|at| at.by_estimated(&estimated)).collect();
    let n = estimated.free.len();
    let is_whole = calibrated.covariance.shape() == (n, n);
    let is_positive = calibrated.covariance.diagonal().iter().all(|variance| *variance > 0.0);
    let root = root(calibrated.covariance).filter(|_| is_whole && is_positive);
    let j = DMatrix::from_fn(2 * at.len(), n, |row, k| columns[row / 2][k][row % 2]);
    Ok(j * root.ok_or(DifferenceError::NotPositive)?)
}

/// Two rows a node.
fn stacked(nodes: usize, at: impl Fn(usize) -> Vec2) -> DMatrix<f64> {
    DMatrix::from_fn(2 * nodes, 1, |row, _| at(row / 2)[row % 2])
}

/// What the motion that fits best takes out of columns.
struct Without {
    by_motion: DMatrix<f64>,
    factor: nalgebra::Cholesky<f64, nalgebra::Dyn>,
}

impl Without {
    fn of(at: &[Slopes], motion: Motion) -> Result<Without, DifferenceError> {
        let by = |row: usize, k: usize| at[row / 2].by_pose[(row % 2, k)] * motion.unit(k);
        let by_motion = DMatrix::from_fn(2 * at.len(), motion.unknowns, by);
        let factor = (by_motion.transpose() * &by_motion).cholesky().ok_or(DifferenceError::NotPositive)?;
        Ok(Without { by_motion, factor })
    }

    /// `M` times columns. Twice: what rounding leaves of the motion after the first time is of the size of
    /// what a long lens leaves of a principal point.
    fn motion(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let once =
            |of: &DMatrix<f64>| of - &self.by_motion * self.factor.solve(&(self.by_motion.transpose() * of));
        once(&once(columns))
    }
}

/// A parameter that neither calibration estimated and that has two values, and ties at two ratios.
fn refuse_held_apart(a: &Calibrated, b: &Calibrated) -> Result<(), DifferenceError> {
    let (of_a, of_b) = (a.estimated(), b.estimated());
    let is_apart =
        |p: &Parameter| of_a.is_held(*p) && of_b.is_held(*p) && a.camera.value(*p) != b.camera.value(*p);
    let apart = a.camera.distortion.model().parameters().find(is_apart);
    let ties = a.fy_per_fx.zip(b.fy_per_fx).filter(|(of_a, of_b)| of_a != of_b);
    match apart.or(ties.map(|_| Parameter::Fy)) {
        Some(parameter) => Err(DifferenceError::HeldApart(parameter)),
        None => Ok(()),
    }
}

/// The camera half-way between two of one model.
fn between(a: &Camera<Lens>, b: &Camera<Lens>) -> Camera<Lens> {
    b.values().fold(*a, |middle, (parameter, of_b)| {
        let of_a = a.value(parameter).unwrap_or(of_b);
        middle.with_value(parameter, 0.5 * (of_a + of_b)).unwrap_or(middle)
    })
}

/// Degrees of freedom of a sum of two variances in proportion `share` to `1 - share` (Satterthwaite 1946),
/// rounded down.
fn satterthwaite(share: f64, of_a: usize, of_b: usize) -> usize {
    let part = |share: f64, freedom: usize| share * share / freedom.max(1) as f64;
    let freedom = 1.0 / (part(share, of_a) + part(1.0 - share, of_b));
    (freedom as usize).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::{Calibration, Settings, calibrate};
    use crate::camera::{BrownConrady, Model};
    use crate::synth::scene::looking_at_centre;
    use crate::synth::{Scene, Stream, StreamKey, Truth};

    const SIZE: (usize, usize) = Truth::EXAMPLE_IMAGE;

    /// A covariance of parameters with these standard deviations and correlations of 0.3.
    fn covariance(deviations: &[f64]) -> DMatrix<f64> {
        let n = deviations.len();
        let share = |i: usize, j: usize| if i == j { 1.0 } else { 0.3 };
        DMatrix::from_fn(n, n, |i, j| share(i, j) * deviations[i] * deviations[j])
    }

    fn known<'a>(camera: &'a Camera<Lens>, free: &str, covariance: &'a DMatrix<f64>) -> Calibrated<'a> {
        let free = free.parse().unwrap();
        Calibrated { camera, free, fy_per_fx: None, covariance, degrees_of_freedom: Some(400) }
    }

    fn bent() -> Camera {
        Camera::pinhole(600.0, 598.0, 320.0, 240.0).with_distortion(BrownConrady::radial(-0.2, 0.05))
    }

    /// A calibration of a camera from five views of its own.
    fn calibration(camera: Camera, trial: u64, purpose: &'static str) -> Calibration {
        let mut stream = Stream::open(StreamKey { seed: 20, scenario: "difference", trial, purpose });
        let cam_from_target = [0.0, 1.2, 2.5, 3.7, 5.0].map(|direction: f64| {
            let tilt = stream.uniform_in(15.0, 30.0);
            let turned = direction + stream.uniform_in(-0.3, 0.3);
            let degrees =
                [tilt * libm::cos(turned), tilt * libm::sin(turned), stream.uniform_in(-20.0, 20.0)];
            looking_at_centre(degrees, stream.uniform_in(110.0, 140.0))
        });
        let truth = Truth { camera, cam_from_target: cam_from_target.to_vec(), ..Truth::example() };
        let views = Scene::new(truth).unwrap().observe(0.1, &mut stream);
        calibrate(&views, &Settings::standard().with_image_size(SIZE)).unwrap()
    }

    fn of<'a>(calibration: &'a Calibration, camera: &'a Camera<Lens>) -> Calibrated<'a> {
        Calibrated {
            camera,
            free: calibration.free,
            fy_per_fx: None,
            covariance: &calibration.covariance.intrinsics,
            degrees_of_freedom: Some(calibration.degrees_of_freedom),
        }
    }

    /// The test of two calibrations, each with its own covariance at the camera that is given.
    fn tested(a: &Calibration, at_a: Camera, b: &Calibration, at_b: Camera) -> OneCamera {
        let (at_a, at_b) = (at_a.into(), at_b.into());
        one_camera(&of(a, &at_a), &of(b, &at_b), SIZE, TakenOut::Rotation).unwrap()
    }

    #[test]
    fn one_camera_is_doubted_as_often_as_is_said() {
        const DRAWS: u64 = 400;
        let camera = Truth::example_camera();
        let test = |trial| {
            let (a, b) = (calibration(camera, trial, "first"), calibration(camera, trial, "second"));
            tested(&a, a.camera, &b, b.camera)
        };
        let tests: Vec<OneCamera> = (0..DRAWS).map(test).collect();
        assert!(tests.iter().all(|test| test.degrees_of_freedom == 6 && test.imitated == 0));
        let below = |limit: f64| tests.iter().filter(|test| test.p_value < limit).count() as u64;
        // Binomial counts, of which each interval holds all but a thousandth: of 400, 4 are expected at 1 %,
        // 40 at 10 %, 200 at 50 %.
        assert!(below(0.01) <= 11, "{} of {DRAWS} below 0.01", below(0.01));
        assert!((22..=61).contains(&below(0.1)), "{} of {DRAWS} below 0.1", below(0.1));
        assert!((167..=233).contains(&below(0.5)), "{} of {DRAWS} below 0.5", below(0.5));
    }

    #[test]
    fn another_camera_is_seen_as_often_as_its_distance_says() {
        const DRAWS: u64 = 100;
        let camera = Truth::example_camera();
        // A lens half a percent longer.
        let longer = camera.with(Parameter::Fx, 1.005 * camera.fx).with(Parameter::Fy, 1.005 * camera.fy);
        let tests = (0..DRAWS).map(|trial| {
            let (a, b) = (calibration(camera, trial, "first"), calibration(longer, trial, "second"));
            // The distance of the true cameras by the same covariances is the noncentrality.
            (tested(&a, a.camera, &b, b.camera), tested(&a, camera, &b, longer).chi_squared)
        });
        let tests: Vec<(OneCamera, f64)> = tests.collect();
        let mean = |of: fn(&(OneCamera, f64)) -> f64| tests.iter().map(of).sum::<f64>() / DRAWS as f64;
        let (found, noncentrality) = (mean(|t| t.0.chi_squared), mean(|t| t.1));
        // Noncentral chi-squared: mean r + lambda, variance 2 (r + 2 lambda); 3.3 standard deviations of the
        // mean leave a thousandth.
        let spread = (2.0 * (6.0 + 2.0 * noncentrality) / DRAWS as f64).sqrt();
        assert!((found - 6.0 - noncentrality).abs() < 3.3 * spread, "{found} against 6 + {noncentrality}");
        let seen = tests.iter().filter(|(test, _)| test.p_value < 0.01).count();
        // 83 were seen when this was written; 3.3 standard deviations of such a count are 12.
        assert!(seen >= 71, "{seen} of {DRAWS} seen at a rate of 0.01");
    }

    #[test]
    fn a_long_lens_leaves_no_trace_of_its_principal_point() {
        // A field of a third of a degree: what a rotation leaves of a principal point is a hundred-thousandth
        // of it.
        let camera: Camera<Lens> = Camera::pinhole(1e5, 1e5, 320.0, 240.0).into();
        let moved = Camera { cx: 321.0, ..camera };
        // A focal length known to a hundredth, a principal point to a pixel.
        let covariance = DMatrix::from_diagonal(&DVector::from_vec(vec![1e6, 1e6, 1.0, 1.0]));
        let of = |camera| known(camera, "fx,fy,cx,cy", &covariance);
        let test = one_camera(&of(&camera), &of(&moved), SIZE, TakenOut::Rotation).unwrap();
        assert_eq!((test.degrees_of_freedom, test.imitated), (2, 2), "{test:?}");
        assert!(test.chi_squared < 1e-6, "{test:?}");
    }

    #[test]
    fn of_two_models_that_are_one_camera_the_longer_adds_its_directions() {
        let plain: Camera<Lens> = bent().into();
        let mut coefficients = plain.distortion.coefficients().to_vec();
        coefficients.resize(8, 0.0);
        let rational = Lens::new(Model::Rational, &coefficients).unwrap();
        let longer = Camera { distortion: rational, ..plain };
        let of_a = covariance(&[0.5, 0.4, 0.6, 0.7, 2e-3, 5e-3]);
        let of_b = covariance(&[0.5, 0.4, 0.6, 0.7, 2e-3, 5e-3, 0.02]);
        let (a, b) =
            (known(&plain, "fx,fy,cx,cy,k1,k2", &of_a), known(&longer, "fx,fy,cx,cy,k1,k2,k4", &of_b));
        let same = one_camera(&a, &b, SIZE, TakenOut::Rotation).unwrap();
        assert!(same.chi_squared < 1e-12 && same.p_value > 0.999, "{same:?}");
        assert!((6..=7).contains(&same.degrees_of_freedom), "{same:?}");
        // A focal length ten standard deviations off is seen.
        let other = Camera { fx: plain.fx + 7.0, fy: plain.fy + 6.0, ..longer };
        let b = Calibrated { camera: &other, ..b };
        assert!(one_camera(&a, &b, SIZE, TakenOut::Rotation).unwrap().p_value < 1e-6);
    }

    #[test]
    fn a_tie_is_one_freedom_and_ties_at_two_ratios_are_two_cameras() {
        let camera = |f: f64| Camera::with_lens(f, 1.25 * f, 320.0, 240.0, Lens::ideal(Model::Division));
        let one = DMatrix::from_element(1, 1, 0.5);
        let (first, second) = (camera(600.0), camera(601.0));
        let tied = |camera| Calibrated { fy_per_fx: Some(1.25), ..known(camera, "fx", &one) };
        let test = one_camera(&tied(&first), &tied(&second), SIZE, TakenOut::Rotation).unwrap();
        // A difference of 1 px, of variance 0.5 + 0.5.
        assert!((test.chi_squared - 1.0).abs() < 1e-9 && test.degrees_of_freedom == 1, "{test:?}");
        let other = Calibrated { fy_per_fx: Some(1.0), ..tied(&second) };
        let apart = one_camera(&tied(&first), &other, SIZE, TakenOut::Rotation);
        assert_eq!(apart, Err(DifferenceError::HeldApart(Parameter::Fy)));
        let bent = Camera { distortion: Lens::new(Model::Division, &[-0.1]).unwrap(), ..second };
        let held = one_camera(&tied(&first), &tied(&bent), SIZE, TakenOut::Rotation);
        assert_eq!(held, Err(DifferenceError::HeldApart(Parameter::K1)));
        let nothing = Calibrated { free: FreeParameters::NONE, ..tied(&first) };
        assert_eq!(
            one_camera(&nothing, &nothing, SIZE, TakenOut::Rotation),
            Err(DifferenceError::NothingFree)
        );
        let zero = DMatrix::zeros(1, 1);
        let unknown = Calibrated { covariance: &zero, ..tied(&first) };
        assert_eq!(
            one_camera(&unknown, &unknown, SIZE, TakenOut::Rotation),
            Err(DifferenceError::NotPositive)
        );
    }
}
