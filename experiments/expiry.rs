//! How long does a calibration last, and what does a check once per shift buy?
//!
//! A station measures a length on a fixed plane. Its lens drifts with temperature, vibration turns its
//! bracket, and the calibration of day one no longer fits. Expected: after a quarter the systematic error is
//! some hundredths of a millimetre, as in the chapter's case study (0.03 mm in three months); a fixed
//! reference of known length, measured once a shift, tells of it weeks before; and to recalibrate when the
//! check asks for it is needed less often than by a calendar that must serve the fastest station.
//!
//! What it cannot show: how large the causes are at a given station. The chapter gives the drift and not its
//! causes; the sizes below are round numbers, picked so that their sum is of the case study's size, and both
//! are taken to add. That the sum meets 0.03 mm is therefore no test of anything; what follows for the check
//! and its rules is.

mod results;
mod station;

use calibench::downstream::control::{Ewma, Rule, Shewhart};
use calibench::synth::{Stream, StreamKey};
use calibench_harness::{Context, Experiment, ExperimentError, Record};
use rayon::prelude::*;
use station::{History, SHIFTS_A_DAY, Station};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "expiry",
    title: "Why calibrations expire, and what a check once per shift buys",
    question: "A station's focal length follows the temperature and its bracket turns with vibration, three \
               shifts a day. How does the systematic error of a measured length grow over a quarter, when \
               do a threshold and a moving average (EWMA) on one reference length per shift notice it at \
               the same false-alarm rate, and how much longer may the station run between calibrations? \
               Expected: an error near the case study's 0.03 mm after three months, noticed by the moving \
               average weeks earlier.",
    seed: 1,
    takes_image: false,
    run,
};

/// Shifts of a quarter: 91 days.
pub(crate) const QUARTER: usize = 91 * SHIFTS_A_DAY;
/// Shifts of the fleet's horizon: a year.
pub(crate) const YEAR: usize = 365 * SHIFTS_A_DAY;
/// Simulated quarters of the drifting station, and of one that does not drift.
pub(crate) const QUARTERS: usize = 4000;
pub(crate) const IN_CONTROL: usize = 20_000;
/// Stations of a fleet that differ in how fast they drift: so many to set the calendar and the action limit
/// by, and as many others to judge them on.
pub(crate) const FLEET: usize = 2000;
/// Chance of a false alarm within a quarter that both rules are set to.
pub(crate) const FALSE_ALARM: f64 = 0.01;
/// Chances for the trade-off.
pub(crate) const TRADE_OFF: [f64; 5] = [0.001, 0.003, 0.01, 0.03, 0.1];
/// Error that a station may not exceed unnoticed: the case study's.
pub(crate) const TOLERANCE_MM: f64 = 0.03;
/// Share of stations that may exceed it unnoticed.
pub(crate) const RISK: f64 = 0.01;
/// Weight of the newest value in the moving average (Lucas & Saccucci 1990 recommend 0.05 to 0.25).
pub(crate) const EWMA_WEIGHT: f64 = 0.2;

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let station = Station::case_study();
    let sd_mm = station.check_sd_mm();
    let threshold = Shewhart::with_false_alarm(FALSE_ALARM, QUARTER);
    let ewma = Ewma::with_false_alarm(EWMA_WEIGHT, FALSE_ALARM, QUARTER);
    let progress = context.progress("stations", QUARTERS + IN_CONTROL + 2 * FLEET);

    let quarters: Vec<Quarter> = (0..QUARTERS)
        .into_par_iter()
        .map(|trial| {
            progress.step();
            Quarter::of(&station, context.seed, trial as u64, &threshold, &ewma)
        })
        .collect();
    let alarms: Vec<(bool, bool)> = (0..IN_CONTROL)
        .into_par_iter()
        .map(|trial| {
            progress.step();
            false_alarms(context.seed, trial as u64, &threshold, &ewma)
        })
        .collect();
    let mut fleet: Vec<Fleet> = (0..2 * FLEET)
        .into_par_iter()
        .map(|trial| {
            progress.step();
            Fleet::of(&station, context.seed, trial as u64)
        })
        .collect();

    let judged = fleet.split_off(FLEET);

    record.note(
        "The sizes of the causes are assumptions, picked round and so that their sum is of the size of the \
         case study's drift.",
    );
    let found = results::Results { station, sd_mm, threshold, ewma, quarters, alarms, fleet, judged };
    results::numbers(&mut record, &found);
    results::claims(&mut record, &found, context.seed);
    results::tables_and_figures(&mut record, &found, context.seed);
    Ok(record)
}

/// One quarter of the drifting station.
pub(crate) struct Quarter {
    /// Systematic error at the quarter's end, and the shares of temperature and bracket alone, mm.
    pub end_mm: [f64; 3],
    /// Systematic error at the middle shift of the last day, mm.
    pub middle_mm: f64,
    /// Shift of the alarm by threshold and by moving average, and the systematic error then.
    pub alarms: [Option<(usize, f64)>; 2],
}

impl Quarter {
    fn of(station: &Station, seed: u64, trial: u64, threshold: &Shewhart, ewma: &Ewma) -> Quarter {
        let history = History::of(station, seed, "quarter", trial, QUARTER);
        let checks = history.checks(station, seed, "quarter", trial);
        let at = |alarm: Option<usize>| alarm.map(|shift| (shift, history.error_mm[shift]));
        let last = QUARTER - 1;
        let warm = station.error_mm(history.kelvin[last], 0.0);
        let turned = station.error_mm(0.0, history.turn_rad[last]);
        Quarter {
            end_mm: [history.error_mm[last], warm, turned],
            middle_mm: history.error_mm[last - 1],
            alarms: [at(threshold.first_alarm(&checks)), at(ewma.first_alarm(&checks))],
        }
    }
}

/// Whether each rule gives an alarm in a quarter in which nothing drifts.
fn false_alarms(seed: u64, trial: u64, threshold: &Shewhart, ewma: &Ewma) -> (bool, bool) {
    let mut stream = Stream::open(StreamKey { seed, scenario: "in control", trial, purpose: "noise" });
    let checks: Vec<f64> = (0..QUARTER).map(|_| stream.normal()).collect();
    (threshold.first_alarm(&checks).is_some(), ewma.first_alarm(&checks).is_some())
}

/// A year of one station of the fleet.
pub(crate) struct Fleet {
    /// First shift at which the error exceeds the tolerance.
    pub exceeds: Option<usize>,
    /// Largest value of the smoothed check before that, in standard deviations of one check; the year's
    /// largest if never.
    pub largest_before: f64,
    /// Every shift at which the smoothed check reaches a new largest value, with that value.
    pub records: Vec<(usize, f64)>,
}

impl Fleet {
    fn of(station: &Station, seed: u64, trial: u64) -> Fleet {
        let mut stream = Stream::open(StreamKey { seed, scenario: "fleet", trial, purpose: "station" });
        // Creep and warming differ from station to station between none and twice the case study's.
        let station = station.scaled(stream.uniform_in(0.0, 2.0), stream.uniform_in(0.0, 2.0));
        let history = History::of(&station, seed, "fleet", trial, YEAR);
        let checks = history.checks(&station, seed, "fleet", trial);
        let exceeds = history.error_mm.iter().position(|e| e.abs() > TOLERANCE_MM);
        let mut records = Vec::new();
        let mut largest = 0.0;
        for (shift, smoothed) in Ewma::smoothed(EWMA_WEIGHT, &checks).enumerate() {
            if smoothed.abs() > largest {
                largest = smoothed.abs();
                records.push((shift, largest));
            }
        }
        let before = |shift: usize| exceeds.is_none_or(|limit| shift < limit);
        let largest_before = records.iter().filter(|r| before(r.0)).map(|r| r.1).fold(0.0, f64::max);
        Fleet { exceeds, largest_before, records }
    }

    /// The shift at which the smoothed check first reaches `limit`.
    pub(crate) fn asked_at(&self, limit: f64) -> Option<usize> {
        self.records.iter().find(|r| r.1 >= limit).map(|r| r.0)
    }
}
