//! What did the stations show? Numbers, claims, tables and figures.

use super::station::{History, SHIFTS_A_DAY, Station};
use super::{
    EWMA_WEIGHT, FALSE_ALARM, FLEET, Fleet, IN_CONTROL, QUARTER, QUARTERS, Quarter, RISK, TOLERANCE_MM,
    TRADE_OFF, YEAR,
};
use calibench::downstream::control::{Ewma, Rule, Shewhart};
use calibench_harness::stats::{Interval, mean, median, normal_two_sided, quantile, share};
use calibench_harness::{Band, Dash, Figure, Look, Plot, Record, Table};

/// Everything that was simulated.
pub(crate) struct Results {
    pub station: Station,
    pub sd_mm: f64,
    pub threshold: Shewhart,
    pub ewma: Ewma,
    pub quarters: Vec<Quarter>,
    pub alarms: Vec<(bool, bool)>,
    /// The stations by which calendar and action limit are set.
    pub fleet: Vec<Fleet>,
    /// Others, on which both are judged.
    pub judged: Vec<Fleet>,
}

/// Chance that a correct program fails one of the sampled claims of this file; there are six of them.
const RATE: f64 = 1e-5;
/// Days of an average month.
const MONTH_DAYS: f64 = 365.25 / 12.0;
/// Histories drawn in the figure.
const SHOWN: u64 = 5;
/// Quarters behind bands and trade-off: the first of them.
const WATCHED: u64 = 1000;

fn days(shifts: f64) -> f64 {
    shifts / SHIFTS_A_DAY as f64
}

impl Results {
    fn ends(&self, which: usize) -> Vec<f64> {
        self.quarters.iter().map(|q| q.end_mm[which]).collect()
    }

    /// Shift of the alarm by rule, the quarter's end where there was none.
    fn alarm_shifts(&self, rule: usize) -> Vec<f64> {
        self.quarters.iter().map(|q| q.alarms[rule].map_or(QUARTER as f64, |a| a.0 as f64)).collect()
    }

    fn errors_at_alarm(&self, rule: usize) -> Vec<f64> {
        self.quarters.iter().filter_map(|q| q.alarms[rule].map(|a| a.1)).collect()
    }

    /// Longest calendar interval after which no more than [`RISK`] of the fleet exceed the tolerance, shifts.
    fn calendar_shifts(&self) -> f64 {
        let exceeds: Vec<f64> = self.fleet.iter().map(|f| f.exceeds.unwrap_or(YEAR) as f64).collect();
        quantile(&exceeds, RISK)
    }

    /// Limit of the smoothed check at which no more than [`RISK`] of the fleet exceed the tolerance unasked.
    fn action_limit(&self) -> f64 {
        let before: Vec<f64> = self
            .fleet
            .iter()
            .map(|f| if f.exceeds.is_some() { f.largest_before } else { f64::INFINITY })
            .collect();
        quantile(&before, RISK)
    }

    /// Shift at which the check asks the judged stations for a calibration, the year's end where it never
    /// does.
    fn asked_shifts(&self) -> Vec<f64> {
        let limit = self.action_limit();
        self.judged.iter().map(|f| f.asked_at(limit).unwrap_or(YEAR) as f64).collect()
    }

    /// Share of the judged stations that exceed the tolerance before they are calibrated anew, at the shift
    /// `calibrated` gives.
    fn risk(&self, calibrated: impl Fn(&Fleet) -> usize) -> f64 {
        let exceeded = |f: &&Fleet| f.exceeds.is_some_and(|shift| shift < calibrated(f));
        self.judged.iter().filter(exceeded).count() as f64 / FLEET as f64
    }

    fn risk_of_check(&self) -> f64 {
        let limit = self.action_limit();
        self.risk(|f| f.asked_at(limit).unwrap_or(YEAR))
    }
}

/// Bands of what the simulation gives.
fn rounding_of_sums() -> Band {
    Band::relative(1e-9, "rounding in sums of 4000 values of one size")
}

fn counted() -> Band {
    Band::relative(1e-9, "a count: moves only if an alarm falls on the other side of its limit")
}

fn one_product() -> Band {
    Band::relative(1e-15, "one product")
}

pub(crate) fn numbers(record: &mut Record, r: &Results) {
    drift_numbers(record, r);
    station_numbers(record, r);
    rule_numbers(record, r);
    fleet_numbers(record, r);
}

fn drift_numbers(record: &mut Record, r: &Results) {
    let [end, thermal, bracket] = [0, 1, 2].map(|share| mean(&r.ends(share)));
    let middle: Vec<f64> = r.quarters.iter().map(|q| q.middle_mm).collect();
    let (low, high) = (quantile(&r.ends(0), 0.025), quantile(&r.ends(0), 0.975));
    let at_the_end = "systematic error of the reference at the last shift of a quarter, the hottest of its \
                      day, mean of all stations";
    let simulated = "a simulated station with round causes (30 ppm/K, 8 K, 5 urad a shift); tolerance: half \
                     the central 95 % of its stations";
    let opposed = "what would be left had the bracket turned the other way, first order";
    let quarter = "a quarter of 91 days of three shifts; tolerance: half a week";
    let drawn = "the same at the middle shift of the last day, as the figure draws it";
    record
        .group("mm", rounding_of_sums())
        .number("drift-mm", end, at_the_end)
        .near_printed(0.5 * (high - low), simulated)
        .number("drift-middle-mm", mean(&middle), drawn)
        .number("drift-thermal-mm", thermal, "share of the focal length's drift alone")
        .number("drift-bracket-mm", bracket, "share of the bracket's turn alone")
        .number("drift-opposed-mm", thermal - bracket, opposed)
        .number("drift-low-mm", low, "2.5 % quantile over stations")
        .number("drift-high-mm", high, "97.5 % quantile over stations")
        .exact("months")
        .number("drift-months", days(QUARTER as f64) / MONTH_DAYS, "length of the quarter")
        .near_printed(3.5 / MONTH_DAYS, quarter);
}

/// What was assumed.
fn station_numbers(record: &mut Record, r: &Results) {
    let s = &r.station;
    let walk = "standard deviation of the bracket's turn in a shift";
    record
        .exact("mm")
        .number("tolerance-mm", TOLERANCE_MM, "error that may not go unnoticed")
        .number("reference-mm", s.reference_mm, "length of the reference")
        .unit("")
        .count("frames", s.frames, "frames averaged by one check")
        .group("ppm/K", one_product())
        .number("focal-ppm-per-kelvin", 1e6 * s.focal_per_kelvin, "relative drift of the focal length")
        .exact("mm")
        .number("distance-mm", s.distance_mm, "distance of the plane")
        .unit("")
        .number("ewma-weight", EWMA_WEIGHT, "weight of the newest value in the moving average")
        .group("\u{b5}rad", one_product())
        .number("creep-sd-urad", 1e6 * s.creep_sd_rad, walk)
        .exact("K")
        .number("season-kelvin", s.season_kelvin, "warming within the quarter");
    let creep = "mean turn of the bracket in a shift";
    let band = Band::relative(1e-15, "three operations");
    record
        .group("\u{b5}rad", one_product())
        .number("creep-urad", 1e6 * s.creep_rad, creep)
        .group("mm", band)
        .number("check-sd-mm", r.sd_mm, "standard deviation of one check");
}

fn rule_numbers(record: &mut Record, r: &Results) {
    let limit = "limit of the threshold, standard deviations of one check";
    record
        .group("", Band::relative(1e-6, "bisection and quadrature"))
        .number("threshold-limit", r.threshold.limit, limit)
        .unit("mm")
        .number("threshold-limit-mm", r.threshold.limit * r.sd_mm, "the same in mm")
        .number("ewma-limit-mm", r.ewma.limit * r.sd_mm, "limit of the moving average, in mm");
    let threshold = "share of driftless quarters with an alarm, threshold";
    record
        .exact("")
        .number("false-alarm", FALSE_ALARM, "chance of a false alarm in a quarter, both rules")
        .band(counted())
        .number("threshold-false-alarms", share(&r.alarms, |a| a.0), threshold)
        .number("ewma-false-alarms", share(&r.alarms, |a| a.1), "the same, moving average");
    for (rule, prefix) in ["threshold-", "ewma-"].into_iter().enumerate() {
        let (alarms, errors) = (r.alarm_shifts(rule), r.errors_at_alarm(rule));
        let day = |p: f64| days(quantile(&alarms, p));
        let missed = (QUARTERS - errors.len()) as f64 / QUARTERS as f64;
        let late = "day by which 95 % of the stations had their alarm";
        record
            .group("days", counted())
            .prefix(prefix)
            .number("median-days", day(0.5), "median day of the alarm")
            .number("late-days", day(0.95), late)
            .group("mm", rounding_of_sums())
            .number("error-mm", median(&errors), "median systematic error at the alarm")
            .group("", counted())
            .number("missed", missed, "share of quarters without an alarm");
    }
}

fn fleet_numbers(record: &mut Record, r: &Results) {
    let (calendar, asked) = (r.calendar_shifts(), r.asked_shifts());
    let by_calendar = r.risk(|_| calendar as usize);
    let action = "smoothed check at which it asks";
    let never = share(&asked, |&shift| shift >= YEAR as f64);
    let one_per_cent = "calendar interval at which 1 % of a fleet exceed the tolerance";
    let before = "share of other stations above the tolerance before the calendar's day";
    let interval = "median interval when the check asks, stations not used to set its limit";
    record
        .group("days", counted())
        .number("calendar-days", days(calendar), one_per_cent)
        .unit("")
        .number("calendar-risk", by_calendar, before)
        .number("quarter-risk", r.risk(|_| QUARTER), "share of them above the tolerance within a quarter")
        .number("check-risk", r.risk_of_check(), "share of them above the tolerance before the check asks")
        .unit("days")
        .number("check-median-days", days(median(&asked)), interval)
        .group("mm", rounding_of_sums())
        .number("check-action-mm", r.action_limit() * r.sd_mm, action)
        .group("", counted())
        .number("check-never", never, "share of the fleet that needs no calibration within a year")
        .number("check-gain", median(&asked) / calendar, "median interval over the calendar's");
}

pub(crate) fn claims(record: &mut Record, r: &Results, seed: u64) {
    let history = History::of(&r.station, seed, "quarter", 0, QUARTER);
    let cases = (0..QUARTER).map(|i| {
        let (kelvin, turn) = (history.kelvin[i], history.turn_rad[i]);
        let (expected, bound) = r.station.first_order_mm(kelvin, turn);
        // Millimetres near 40 are rounded by 4e-15 in each of some ten operations.
        let held = (history.error_mm[i] - expected).abs() <= bound + 1e-13;
        (format!("shift {i}: {} mm, first order {expected} mm", history.error_mm[i]), held)
    });
    record
        .claim_that(
            "first-order",
            "at every shift the error is that of the first-order formula, within its second-order remainder",
        )
        .every("shifts", cases)
        .because("expansion in warming and turn, twice the second-order terms");
    let alarms = |pick: fn(&(bool, bool)) -> bool| r.alarms.iter().filter(|a| pick(a)).count();
    let rules =
        [("threshold", "the threshold", alarms(|a| a.0)), ("ewma", "the moving average", alarms(|a| a.1))];
    for (id, rule, alarms) in rules {
        let interval = Interval::of_proportion(alarms, IN_CONTROL, RATE);
        let reason = format!(
            "{alarms} of {IN_CONTROL} simulated quarters, Wilson interval of the rate behind them; the rate \
             that the limit was computed for (product of probabilities; Crowder's integral equation) must \
             lie inside"
        );
        let statement = format!("{rule}'s false alarms are as often as set");
        let draft = record.claim_that(format!("{id}-false-alarms-as-set"), statement);
        draft.within(FALSE_ALARM, interval).at_rate(RATE).because(reason);
    }
    // Both shares are counted on as many stations, one of them by choice of the limit: twice the binomial
    // variance.
    let spread = (2.0 * RISK * (1.0 - RISK) / FLEET as f64).sqrt();
    let reason =
        "the limits were set on other stations: binomial, twice, as the setting has chance in it too";
    for (id, rule, risk) in [
        ("calendar-keeps-its-risk", "calendar", r.risk(|_| r.calendar_shifts() as usize)),
        ("check-keeps-its-risk", "check", r.risk_of_check()),
    ] {
        let statement = format!(
            "on stations that it was not set by, the {rule} lets no more exceed the tolerance unnoticed than it was set to"
        );
        let highest = RISK + normal_two_sided(2.0 * RATE) * spread;
        record.claim_that(id, statement).at_most(risk, highest).at_rate(RATE).because(reason);
    }
    let turn = r.station.creep_rad * QUARTER as f64;
    let spread = r.station.creep_sd_rad * (QUARTER as f64).sqrt();
    let slope = r.station.first_order_mm(0.0, 1.0).0;
    // The second-order remainder at the mean turn plus five standard deviations.
    let remainder = r.station.first_order_mm(0.0, turn + 5.0 * spread).1;
    let interval = Interval::of_mean(slope * turn, slope.abs() * spread, QUARTERS, RATE);
    let interval = Interval { low: interval.low - remainder, high: interval.high + remainder };
    let reason = "a random walk with drift: mean n m, standard deviation sqrt(n) s, over the first-order \
                  slope; widened by the second-order remainder";
    let statement = "the bracket's mean share is that of a random walk with drift";
    record
        .claim_that("bracket-walk", statement)
        .within(mean(&r.ends(2)), interval)
        .unit("mm")
        .at_rate(RATE)
        .because(reason);
    let earlier = r
        .quarters
        .iter()
        .filter(|q| q.alarms[1].map_or(QUARTER, |a| a.0) < q.alarms[0].map_or(QUARTER, |a| a.0))
        .count();
    let interval = Interval::of_proportion(earlier, QUARTERS, RATE);
    let statement = "against slow drift the moving average is the earlier of the two more often than not";
    let reason = format!("{earlier} of {QUARTERS} quarters; lower end of the Wilson interval above one half");
    record
        .claim_that("moving-average-is-earlier", statement)
        .at_least(interval.low, 0.5)
        .at_rate(RATE)
        .because(reason);
}

pub(crate) fn tables_and_figures(record: &mut Record, r: &Results, seed: u64) {
    let bands = error_bands(r, seed);
    let caption = "systematic error of the reference against time: 2.5 %, 50 % and 97.5 % of the stations";
    let columns = [("day", "days"), ("low", "mm"), ("median", "mm"), ("high", "mm")];
    record.table(Table::of_arrays("error", caption, columns, &bands));
    let trade = trade_off(r, seed);
    let caption = "median day of the alarm against the chance of a false alarm in a quarter";
    let columns = [("false_alarm", ""), ("threshold_days", "days"), ("ewma_days", "days")];
    record.table(Table::of_arrays("trade-off", caption, columns, &trade));
    let asked = r.asked_shifts();
    let exceeds: Vec<f64> = r.judged.iter().map(|f| f.exceeds.unwrap_or(YEAR) as f64).collect();
    let caption = "day by which a share of the fleet exceeds the tolerance, and by which the check has \
                   asked; 365 means never in the year";
    record.table(
        Table::of("fleet", caption, (0..=100).map(|percent| f64::from(percent) / 100.0))
            .column("share", "", |share| *share)
            .column("exceeds", "days", |share| days(quantile(&exceeds, *share)))
            .column("check_asks", "days", |share| days(quantile(&asked, *share))),
    );

    record.figure(error_figure(r, seed, &bands));
    record.figure(alarm_figure(r));
    record.figure(trade_off_figure(&trade));
    record.figure(fleet_figure(r, &exceeds, &asked));
}

/// `(day, low, median, high)` every week over the first [`WATCHED`] quarters.
fn error_bands(r: &Results, seed: u64) -> Vec<[f64; 4]> {
    let histories: Vec<History> =
        (0..WATCHED).map(|trial| History::of(&r.station, seed, "quarter", trial, QUARTER)).collect();
    // The middle shift of every seventh day, and of the last.
    let shifts = (0..13).map(|week| 7 * SHIFTS_A_DAY * week + 1).chain([QUARTER - 2]);
    shifts
        .map(|shift| {
            let errors: Vec<f64> = histories.iter().map(|h| h.error_mm[shift]).collect();
            [days(shift as f64), quantile(&errors, 0.025), quantile(&errors, 0.5), quantile(&errors, 0.975)]
        })
        .collect()
}

/// `(false-alarm chance, median day by threshold, median day by moving average)` over the first [`WATCHED`]
/// quarters.
fn trade_off(r: &Results, seed: u64) -> Vec<[f64; 3]> {
    let checks: Vec<Vec<f64>> = (0..WATCHED)
        .map(|trial| {
            let history = History::of(&r.station, seed, "quarter", trial, QUARTER);
            history.checks(&r.station, seed, "quarter", trial)
        })
        .collect();
    let median_day = |rule: &dyn Rule| {
        let shifts: Vec<f64> = checks.iter().map(|c| rule.first_alarm(c).unwrap_or(QUARTER) as f64).collect();
        days(quantile(&shifts, 0.5))
    };
    TRADE_OFF
        .iter()
        .map(|&chance| {
            let threshold = Shewhart::with_false_alarm(chance, QUARTER);
            let ewma = Ewma::with_false_alarm(r.ewma.weight, chance, QUARTER);
            [chance, median_day(&threshold), median_day(&ewma)]
        })
        .collect()
}

fn error_figure(r: &Results, seed: u64, bands: &[[f64; 4]]) -> Figure {
    let edges = bands.iter().map(|[day, low, _, high]| (*day, *low, *high));
    let median = bands.iter().map(|[day, _, median, _]| (*day, *median));
    let mut plot = Plot::new(
        format!("Systematic error of the {} mm reference", r.station.reference_mm),
        "days since calibration",
        "error (mm)",
    )
    .band_as("central 95 % of stations", edges, Look::series(4));
    for trial in 0..SHOWN {
        let history = History::of(&r.station, seed, "quarter", trial, QUARTER);
        let middle = (0..QUARTER).skip(1).step_by(SHIFTS_A_DAY);
        let path = middle.map(|i| (days(i as f64), history.error_mm[i]));
        let name = if trial == 0 { "single stations" } else { "" };
        plot = plot.line_as(name, path, Look::series(2).dash(Dash::Solid).width(0.7));
    }
    let plot = plot
        .line_as("median", median, Look::series(0).width(2.0))
        .hline(format!("case study: {TOLERANCE_MM} mm"), TOLERANCE_MM)
        .x_range(0.0, days(QUARTER as f64));
    let caption = format!(
        "Length error at the middle shift of every day, neither the coldest nor the hottest, for {SHOWN} \
         simulated stations, with median and central 95 % of {WATCHED}, in mm; seed {seed}. Notice that \
         the median station is {:.3} mm off on the last day, where the case study allows {TOLERANCE_MM} mm.",
        bands[bands.len() - 1][2]
    );
    Figure::plot("error", &plot, caption)
}

/// Day, and the share of `shifts` that lie before it.
fn share_by_day(shifts: &[f64], last_day: usize) -> impl Iterator<Item = (f64, f64)> {
    (0..=last_day).map(|day| (day as f64, share(shifts, |&shift| shift < (day * SHIFTS_A_DAY) as f64)))
}

fn alarm_figure(r: &Results) -> Figure {
    let plot =
        Plot::new("Which rule notices when?", "days since calibration", "share of stations with an alarm")
            .line("threshold on one check", share_by_day(&r.alarm_shifts(0), 91))
            .line("moving average (EWMA)", share_by_day(&r.alarm_shifts(1), 91))
            .hline("", 0.5)
            .x_range(0.0, days(QUARTER as f64))
            .y_range(0.0, 1.0);
    let median_day = |rule: usize| days(median(&r.alarm_shifts(rule)));
    let caption = format!(
        "Share of {QUARTERS} drifting stations whose check has given an alarm, both rules set to a \
         false-alarm chance of {} % a quarter. Half of the stations have had their alarm from the threshold \
         by day {:.1}, from the moving average by day {:.1}.",
        100.0 * FALSE_ALARM,
        median_day(0),
        median_day(1)
    );
    Figure::plot("alarms", &plot, caption)
}

fn trade_off_figure(trade: &[[f64; 3]]) -> Figure {
    let curve = |column: usize| trade.iter().map(move |t| (t[0], t[column]));
    let plot = Plot::new(
        "False alarms against delay",
        "chance of a false alarm in a quarter",
        "median day of the alarm",
    )
    .line("threshold on one check", curve(1))
    .line("moving average (EWMA)", curve(2))
    .log_x();
    let ends = |column: usize| {
        let at = |row: Option<&[f64; 3]>| row.map_or(f64::NAN, |row| row[column]);
        format!("from day {:.1} to day {:.1}", at(trade.first()), at(trade.last()))
    };
    let caption = format!(
        "Median day of the alarm over {WATCHED} drifting stations against the chance of a false alarm in a \
         quarter that the rule is set to. As that chance grows, the threshold's alarm moves {}, the moving \
         average's {}.",
        ends(1),
        ends(2)
    );
    Figure::plot("trade-off", &plot, caption)
}

fn fleet_figure(r: &Results, exceeds: &[f64], asked: &[f64]) -> Figure {
    let plot = Plot::new("A fleet over a year", "days since calibration", "share of the fleet")
        .line(format!("error above {TOLERANCE_MM} mm"), share_by_day(exceeds, 364))
        .line("check has asked for calibration", share_by_day(asked, 364))
        .vline(format!("calendar at {} % risk", 100.0 * RISK), days(r.calendar_shifts()))
        .y_range(0.0, 1.0);
    let caption = format!(
        "{FLEET} stations whose creep and warming lie between none and twice the case study's; calendar and \
         action limit were set on {FLEET} others. A calendar with {} % risk recalibrates all of them after \
         {:.0} days; the check has asked half of them by day {:.0}.",
        100.0 * RISK,
        days(r.calendar_shifts()),
        days(quantile(asked, 0.5))
    );
    Figure::plot("fleet", &plot, caption)
}
