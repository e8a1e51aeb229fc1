//! How well is a camera's place on a robot known, and which motions make it known?
//!
//! A robot with a camera on its gripper visits stations before a fixed target, or holds the target before a
//! fixed camera. Its poses err by what it repeats; the camera's come from calibrations of photographs with
//! noise. Four methods find the mounting X: the closed forms of Tsai & Lenz and of Park & Martin for `A X = X
//! B`, of Shah for `A X = Z B`, and the most likely X and Z together.
//!
//! Noise model: every coordinate of a pixel errs by a normal number of one standard deviation; every pose of
//! the robot by a turn from the left and a shift, both normal and the same about each axis. The Cramer-Rao
//! bound is that of all pixels and all poses of the robot, with the camera, every true pose of the robot, X
//! and Z unknown.
//!
//! Expected: the most likely X attains the bound and its covariance is true; no closed form does. Errors fall
//! with the number of stations by its root. By the turns alone the rotation's would fall in proportion to
//! their angle; the shifts of the robot tell of the rotation too, the more so the smaller the turns are, and
//! closed forms make no use of it. A few stations turned far about different axes are worth many at random.
//!
//! What it cannot show: a robot whose errors are systematic, as kinematic ones are, and poses that were not
//! taken at rest.

mod cases;
mod pixels;
mod shown;
mod trial;

use calibench_harness::stats::{Interval, each_of, slope};
use calibench_harness::{Band, Context, Experiment, ExperimentError, Record};
use cases::{Case, DESIGNS, Sweep, sweeps};
use rayon::prelude::*;
use trial::{Cell, METHODS, Trial};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "hand-eye",
    title: "Where a camera sits on a robot, and which motions tell",
    question: "A robot turns a camera before a target, or a target before a camera. How well is the mounting known by \
               number, axes and angles of the motions and by the noise of camera and robot, does any method lose what the \
               data hold, and is the stated covariance true? Expected: only the most likely mounting attains the \
               Cramer-Rao bound, and far turns about different axes are worth more than many stations.",
    seed: 1,
    takes_image: false,
    run,
};

/// Trials of a cell, each with stations and noise of its own.
const TRIALS: usize = 200;
/// Chance that a correct program fails one claim.
const RATE: f64 = 1e-4;

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let sweeps = sweeps();
    let count: usize = sweeps.iter().map(|sweep| sweep.cases.len()).sum();
    let progress = context.progress("stations solved", count * TRIALS);
    let cell = |case: &Case| -> Result<Cell, ExperimentError> {
        let trials = (0..TRIALS as u64)
            .into_par_iter()
            .map(|trial| {
                let found = Trial::new(case, context.seed, trial);
                progress.step();
                found
            })
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Cell { case: case.clone(), trials: trials.into_iter().flatten().collect() })
    };
    let found = sweeps
        .iter()
        .map(|sweep| Ok((sweep, sweep.cases.iter().map(cell).collect::<Result<Vec<_>, _>>()?)))
        .collect::<Result<Vec<(&Sweep, Vec<Cell>)>, ExperimentError>>()?;
    drop(progress);
    let cells: Vec<&Cell> = found.iter().flat_map(|(_, cells)| cells).collect();
    report(&mut record, &cells);
    claim_bound(&mut record, context.seed)?;
    claim_attained(&mut record, &cells);
    claim_stated(&mut record, &cells);
    claim_refused(&mut record, context.seed)?;
    claim_laws(&mut record, &found, context.seed)?;
    claim_designs(&mut record, &found);
    for (sweep, cells) in &found {
        record.table(shown::table(sweep, cells));
    }
    for figure in shown::figures(&found, context.seed) {
        record.figure(figure);
    }
    Ok(record)
}

/// Numbers that rest on converged estimates.
fn converged() -> Band {
    Band::relative(1e-5, "calibrations converge to a millionth of a standard deviation, the mounting to less")
}

fn report(record: &mut Record, cells: &[&Cell]) {
    record.exact("").count("trials", TRIALS, "trials of a cell").count(
        "refused",
        cells.iter().map(|cell| TRIALS - cell.trials.len()).sum(),
        "trials of all cells that were refused since their motions leave the mounting open",
    );
    for cell in cells {
        let Case { id, what, .. } = &cell.case;
        record
            .group("deg", converged())
            .suffix(format!("-{id}"), format!(", {what}"))
            .number("bound-deg", cell.bound_deg(), "bound of the rotation of X")
            .unit("mm")
            .number("bound-mm", cell.bound_mm(), "bound of the translation of X")
            .unit("");
        for (method, (name, title)) in METHODS.iter().enumerate() {
            record.group("", converged()).suffix(format!("-{id}"), format!(", {what}")).number(
                *name,
                cell.over_bound(method),
                format!("errors of X in terms of the bound, {title}"),
            );
        }
        record
            .group("", converged())
            .suffix(format!("-{id}"), format!(", {what}"))
            .number("nees", cell.nees(), "mean of e^T P^-1 e of the six numbers of X, P as stated")
            .number(
                "both",
                cell.both_over_bound(),
                "errors of X and Z in terms of their bound, most likely ones",
            )
            .number("both-shah", cell.shah_over_bound(), "the same of Shah's X and Z");
    }
}

/// The bound of the poses' covariances is that of the pixels themselves.
fn claim_bound(record: &mut Record, seed: u64) -> Result<(), ExperimentError> {
    let mut compared = Vec::new();
    for case in [Case::base("eye-in-hand"), Case::base("eye-to-hand").with_fixed_camera()] {
        let (by_poses, by_pixels) = pixels::both_bounds(&case, seed)?;
        let worst = (0..6).map(|i| (by_poses[(i, i)] / by_pixels[(i, i)] - 1.0).abs()).fold(0.0, f64::max);
        record.group("", Band::absolute(1e-6, "differences of pixels keep nine digits")).number(
            format!("bounds-differ-{}", case.id),
            worst,
            format!("largest relative difference of a variance of X, {}", case.what),
        );
        compared.push((format!("{}: {worst:.1e}", case.id), worst < 1e-5));
    }
    record
        .claim_that(
            "bound-is-that-of-the-pixels",
            "the covariance of the poses loses nothing: the bound from it is the one from pixels and robot poses, with every pose of the robot unknown",
        )
        .every("set-ups", compared)
        .because("to first order both are one problem; its derivatives are differences of pixels here, which keep nine digits of 1e-5");
    Ok(())
}

/// The most likely X is as good as the bound allows, in every cell.
fn claim_attained(record: &mut Record, cells: &[&Cell]) {
    let holds = |cell: &&Cell| {
        let interval = Interval::of_mean_chi_squared(6, cell.trials.len(), each_of(cells.len(), RATE));
        let found = 6.0 * cell.over_bound(0) * cell.over_bound(0);
        (format!("{}: {found:.2} of 6", cell.case.id), interval.contains(found))
    };
    record
        .claim_that("the-most-likely-attains-the-bound", "errors of the most likely X are as large as the bound in every cell")
        .every("cells", cells.iter().map(holds))
        .at_rate(RATE)
        .because("mean of chi-squared numbers of six degrees of freedom, e^T B^-1 e with the bound B of each trial's own stations");
    let worse = |cell: &&Cell| {
        let worst = (1..METHODS.len()).map(|method| cell.over_bound(method)).fold(f64::INFINITY, f64::min);
        (format!("{}: {worst:.3}", cell.case.id), worst > cell.over_bound(0))
    };
    record
        .claim_that("no-closed-form-attains-it", "every closed form errs by more than the most likely X in every cell")
        .every("cells", cells.iter().map(worse))
        .because("they weigh rotations and translations of all stations alike, and find the rotation without the translations");
}

/// The stated covariance is true, in every cell.
fn claim_stated(record: &mut Record, cells: &[&Cell]) {
    let holds = |cell: &&Cell| {
        let interval = Interval::of_mean_chi_squared(6, cell.trials.len(), each_of(cells.len(), RATE));
        (format!("{}: {:.2} of 6", cell.case.id, cell.nees()), interval.contains(cell.nees()))
    };
    record
        .claim_that(
            "the-stated-covariance-is-true",
            "errors of X are as large as its stated covariance says in every cell",
        )
        .every("cells", cells.iter().map(holds))
        .at_rate(RATE)
        .because("mean of chi-squared numbers of six degrees of freedom");
}

/// Turns about one axis are refused, in photographs with noise too.
fn claim_refused(record: &mut Record, seed: u64) -> Result<(), ExperimentError> {
    const SETS: u64 = 50;
    let refused = |trial| Ok((format!("set {trial}"), Trial::new(&Case::one_axis(), seed, trial)?.is_none()));
    let sets = (0..SETS).map(refused).collect::<Result<Vec<_>, ExperimentError>>()?;
    record
        .claim_that("one-axis-is-refused", "stations that turn about one axis only are refused, every time")
        .every("sets of stations", sets)
        .because("noise tilts the axes by hundredths of a degree, which leaves the rotation about the axis unknown by some ten degrees");
    Ok(())
}

/// How the bound falls with angle and number.
fn claim_laws(record: &mut Record, found: &[(&Sweep, Vec<Cell>)], seed: u64) -> Result<(), ExperimentError> {
    let cells = found.iter().flat_map(|(_, cells)| cells);
    let many: Vec<&Cell> =
        cells.filter(|cell| cell.case.id.starts_with("stations-") && cell.case.level >= 12.0).collect();
    let number = exponent(&many.iter().map(|cell| (cell.case.level, cell.bound_deg())).collect::<Vec<_>>());
    let (with_shifts, alone) =
        (angle_exponent(Case::of_angle, seed)?, angle_exponent(Case::of_turns_alone, seed)?);
    record
        .group("", converged())
        .number(
            "slope-stations",
            number,
            "exponent of the rotation's bound against the number of stations, from 12 on",
        )
        .number(
            "slope-angle",
            with_shifts,
            "the same against the largest angle, the same stations turned less or further",
        )
        .number("slope-turns-alone", alone, "the same of a robot whose positions tell nothing");
    record
        .claim_that("error-falls-with-the-root-of-the-number", "the bound of the rotation falls with the root of the number of stations, from 12 on")
        .within(number, Interval::around(-0.5, 0.1))
        .because("information of independent stations adds up; the camera's error, which all share, and the two poses found along leave a fifth");
    record
        .claim_that("turns-alone-tell-by-their-angle", "by the turns alone the bound of the rotation falls in proportion to their angle or faster")
        .at_most(alone, -0.95)
        .because("information about a rotation grows with the squared angle, and a tilted target's rotation is seen better; a twentieth is for the curvature of large turns");
    record
        .claim_that("shifts-tell-of-the-rotation", "with the robot's positions the bound of the rotation falls by less, since the shifts tell of it whatever the angle")
        .within(with_shifts, Interval { low: alone, high: 0.0 })
        .because("information of turns and shifts adds up, and that of shifts does not depend on the angle");
    Ok(())
}

/// Exponent of the rotation's bound against the largest angle. The sets of stations are the same at every
/// angle but for their scale.
fn angle_exponent(case: impl Fn(f64) -> Case, seed: u64) -> Result<f64, ExperimentError> {
    const SETS: u64 = 30;
    let at = |angle_deg: f64| -> Result<(f64, f64), ExperimentError> {
        let case = case(angle_deg);
        let bounds =
            (0..SETS).map(|set| trial::bound_of_set(&case, seed, set)).collect::<Result<Vec<_>, _>>()?;
        let square: f64 = bounds.iter().map(|b| b.fixed_view::<3, 3>(0, 0).trace()).sum();
        Ok((angle_deg, (square / SETS as f64).sqrt()))
    };
    Ok(exponent(&[5.0, 10.0, 20.0, 40.0].map(at).into_iter().collect::<Result<Vec<_>, _>>()?))
}

/// Slope on logarithmic axes.
fn exponent(points: &[(f64, f64)]) -> f64 {
    let (x, y): (Vec<f64>, Vec<f64>) = points.iter().map(|(x, y)| (libm::log(*x), libm::log(*y))).unzip();
    slope(&x, &y)
}

/// Which six stations to choose.
fn claim_designs(record: &mut Record, found: &[(&Sweep, Vec<Cell>)]) {
    let bound = |design: &str| {
        let cells = found.iter().flat_map(|(_, cells)| cells);
        let cell = cells.into_iter().find(|cell| cell.case.id == design);
        cell.map_or(f64::NAN, Cell::bound_deg)
    };
    let gain = bound(DESIGNS[0].0) / bound(DESIGNS[2].0);
    record.group("", converged()).number(
        "gain-of-design",
        gain,
        "bound of the rotation with six stations at random over that with six turned as far as they may about three axes",
    );
    record
        .claim_that("far-turns-about-three-axes", "six stations turned by the largest angle both ways about three axes bound the rotation more tightly than six at random by the root of two or more")
        .at_least(gain, std::f64::consts::SQRT_2)
        .because("rotations drawn evenly up to the largest angle have a third of its square, which alone is the root of three; arms that translations bring are the same in both");
}
