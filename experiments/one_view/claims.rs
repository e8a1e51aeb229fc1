//! What is claimed of them.

use super::numbers::QUANTITIES;
use super::trial::{
    Cell, OFF_CENTRE, OneView, REFINED, Several, camera, exact_error, image_centre, true_centre,
};
use super::{COVERAGE, LINEAR_TILT_DEG, NONLINEARITY, RATE, TILT_DEG, TRIALS};
use calibench_harness::stats::{Interval, each_of};
use calibench_harness::{ExperimentError, Record};

pub(super) fn claim_refused(record: &mut Record, tilts: &[Cell]) {
    let facing = &tilts[0];
    record
        .claim_that("facing-is-refused", "a plane that faces the camera is refused, every time")
        .every(
            "views",
            facing.trials.iter().enumerate().map(|(i, t)| (format!("trial {i}"), t.tsai.is_none())),
        )
        .because("a facing plane passes for a tilted one once in a million");
    let steep = tilts.iter().filter(|cell| cell.tilt_deg >= LINEAR_TILT_DEG);
    record
        .claim_that("tilted-is-answered", "from 10 degrees of tilt every view gives a camera")
        .every("cells", steep.map(|cell| (format!("{} deg", cell.tilt_deg), cell.is_answered_always())))
        .because("the focal length is then known to a twentieth and better, and refused at a third");
}

pub(super) fn claim_one_minimum(record: &mut Record, tilts: &[Cell]) {
    let answered = tilts.iter().filter(|cell| cell.tilt_deg >= LINEAR_TILT_DEG).flat_map(|cell| {
        let case = |(i, trial): (usize, &OneView)| {
            let same = trial
                .refined
                .zip(trial.zhang)
                .is_some_and(|(a, b)| (a.errors[0] - b.errors[0]).abs() < 1e-4 * a.stated_fx);
            (format!("{} deg, trial {i}", cell.tilt_deg), same)
        };
        cell.trials.iter().enumerate().map(case).collect::<Vec<_>>()
    });
    record
        .claim_that("one-minimum", "from 10 degrees of tilt the refinement ends where Zhang's start and the search lead, whether it starts there or at Tsai's answer")
        .every("views", answered)
        .because("both minimise one cost; a refinement ends within a millionth of a standard deviation, and a hundred times that is allowed");
}

pub(super) fn claim_bound(record: &mut Record, tilts: &[Cell], several: &[Several]) {
    let linear: Vec<&Cell> = tilts.iter().filter(|cell| cell.tilt_deg >= LINEAR_TILT_DEG).collect();
    let interval = Interval::of_deviation_ratio(TRIALS, each_of(3 * linear.len(), RATE));
    let within = |ratio: f64, interval: Interval| {
        interval.low * (1.0 - NONLINEARITY) < ratio && ratio < interval.high * (1.0 + NONLINEARITY)
    };
    let cases = linear.iter().flat_map(|cell| {
        (0..3).map(|k| {
            let ratio = cell.sd(REFINED, k) / cell.bound_of(k);
            (format!("{} deg, {}: {ratio:.3}", cell.tilt_deg, QUANTITIES[k].0), within(ratio, interval))
        })
    });
    record
        .claim_that(
            "bound-attained",
            "from 10 degrees of tilt one view, refined, spreads as its Cramer-Rao bound says",
        )
        .every("spreads", cases)
        .at_rate(RATE)
        .because("sqrt(chi2 / (n - 1)), all cases together at 1e-4, and 5 % for terms of second order");
    let interval = Interval::of_deviation_ratio(TRIALS, each_of(several.len(), RATE));
    record
        .claim_that(
            "several-attain-theirs",
            "two views and more with a free principal point spread as their bounds say",
        )
        .every(
            "numbers of views",
            several.iter().map(|found| {
                let ratio = found.rms() / found.bound_fx;
                (format!("{} views: {ratio:.3}", found.views), within(ratio, interval))
            }),
        )
        .at_rate(RATE)
        .because("the same; the bias is less than a fiftieth of the spread and counts in its square only");
}

pub(super) fn claim_two_are_better(record: &mut Record, tilts: &[Cell], several: &[Several]) {
    let one = tilts.iter().find(|cell| cell.tilt_deg == TILT_DEG).map_or(f64::NAN, |cell| cell.bound_of(0));
    let two = several.iter().find(|found| found.views == 2).map_or(f64::NAN, |found| found.bound_fx);
    record
        .claim_that(
            "two-views-are-better",
            "two views about different axes with a free principal point know f better than one whose principal point is exact, by their bounds",
        )
        .at_most(two / one, 1.0)
        .because("bounds, without noise of their own; it could be otherwise, since two views have two unknowns more");
}

/// The bias is that of exact pixels, and the stated interval does not know of it.
pub(super) fn claim_misled(record: &mut Record, tilts: &[Cell]) -> Result<(), ExperimentError> {
    let linear: Vec<&Cell> = tilts.iter().filter(|cell| cell.tilt_deg >= LINEAR_TILT_DEG).collect();
    let offset = image_centre() - true_centre();
    let mut cases = Vec::new();
    for cell in &linear {
        let (exact, found) = (exact_error(cell.tilt_deg, offset)?, cell.bias(OFF_CENTRE, 0));
        let sd = cell.sd(OFF_CENTRE, 0);
        let interval = Interval::of_mean(exact, sd, TRIALS, each_of(linear.len(), RATE));
        // The noise's own bias, of second order: sd^2 / f.
        let slack = 2.0 * sd * sd / camera().fx;
        let holds = (found - exact).abs() < interval.half_width() + slack;
        cases.push((format!("{} deg: {found:.3} px, exact {exact:.3} px", cell.tilt_deg), holds));
    }
    record
        .claim_that("a-wrong-centre-is-a-bias", "with the principal point 7 px off, f is wrong on average by what exact pixels give")
        .every("tilts", cases)
        .at_rate(RATE)
        .because("to first order noise and a wrong principal point add; normal interval of a mean, and twice the noise's own bias of second order");
    let cases = linear.iter().map(|cell| {
        let interval = Interval::of_proportion(
            (cell.coverage(REFINED) * TRIALS as f64).round() as usize,
            TRIALS,
            each_of(linear.len(), RATE),
        );
        (
            format!("{} deg: {:.3}", cell.tilt_deg, cell.coverage(REFINED)),
            interval.low - 0.01 < COVERAGE && COVERAGE < interval.high + 0.01,
        )
    });
    record
        .claim_that("a-right-centre-is-honest", "with the principal point right the stated interval of f contains it as often as it says")
        .every("tilts", cases)
        .at_rate(RATE)
        .because("Wilson's interval of a share, and a hundredth for the degrees of freedom of the noise and the tails of second order");
    Ok(())
}
