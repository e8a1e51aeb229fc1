//! What did the stations show? Numbers, claims, tables and figures.

use super::control::{Ewma, Rule, Shewhart};
use super::station::{History, SHIFTS_A_DAY, Station};
use super::{
    EWMA_WEIGHT, FALSE_ALARM, FLEET, Fleet, IN_CONTROL, QUARTER, QUARTERS, Quarter, RISK, TOLERANCE_MM,
    TRADE_OFF, YEAR,
};
use calibench::evaluate::Interval;
use calibench::evaluate::distribution::normal_two_sided;
use calibench_harness::{Band, Claim, Dash, ExperimentError, Figure, Look, Plot, Record, Table};

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

/// The value below which a share `p` of the sample lies: the smallest with at least that many.
fn quantile(sample: &[f64], p: f64) -> f64 {
    let mut sorted = sample.to_vec();
    sorted.sort_by(f64::total_cmp);
    let index = ((p * sorted.len() as f64).ceil() as usize).clamp(1, sorted.len().max(1)) - 1;
    sorted.get(index).copied().unwrap_or(f64::NAN)
}

fn mean(sample: &[f64]) -> f64 {
    sample.iter().sum::<f64>() / sample.len() as f64
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

    /// Shift at which the check asks the judged stations for a calibration, the year's end where it never does.
    fn asked_shifts(&self) -> Vec<f64> {
        let limit = self.action_limit();
        self.judged.iter().map(|f| f.asked_at(limit).unwrap_or(YEAR) as f64).collect()
    }

    /// Share of the judged stations that exceed the tolerance before they are calibrated anew, at the shift `calibrated` gives.
    fn risk(&self, calibrated: impl Fn(&Fleet) -> usize) -> f64 {
        let exceeded = |f: &&Fleet| f.exceeds.is_some_and(|shift| shift < calibrated(f));
        self.judged.iter().filter(exceeded).count() as f64 / FLEET as f64
    }

    fn risk_of_check(&self) -> f64 {
        let limit = self.action_limit();
        self.risk(|f| f.asked_at(limit).unwrap_or(YEAR))
    }
}

pub(crate) fn numbers(record: &mut Record, r: &Results) -> Result<(), ExperimentError> {
    let sum = || Band::relative(1e-9, "rounding in sums of 4000 values of one size");
    let count =
        || Band::relative(1e-9, "a count: moves only if an alarm falls on the other side of its limit");
    let root = || Band::relative(1e-6, "bisection and quadrature");
    let end = mean(&r.ends(0));
    record.number(
        "drift-mm",
        end,
        "mm",
        sum(),
        "systematic error of the reference at the last shift of a quarter, the hottest of its day, mean of all stations",
    );
    let middle: Vec<f64> = r.quarters.iter().map(|q| q.middle_mm).collect();
    record.number(
        "drift-middle-mm",
        mean(&middle),
        "mm",
        sum(),
        "the same at the middle shift of the last day, as the figure draws it",
    );
    record.number(
        "drift-thermal-mm",
        mean(&r.ends(1)),
        "mm",
        sum(),
        "share of the focal length's drift alone",
    );
    record.number("drift-bracket-mm", mean(&r.ends(2)), "mm", sum(), "share of the bracket's turn alone");
    let opposed = mean(&r.ends(1)) - mean(&r.ends(2));
    record.number(
        "drift-opposed-mm",
        opposed,
        "mm",
        sum(),
        "what would be left had the bracket turned the other way, first order",
    );
    let (low, high) = (quantile(&r.ends(0), 0.025), quantile(&r.ends(0), 0.975));
    record.number("drift-low-mm", low, "mm", sum(), "2.5 % quantile over stations");
    record.number("drift-high-mm", high, "mm", sum(), "97.5 % quantile over stations");
    let months = days(QUARTER as f64) / MONTH_DAYS;
    record.number("drift-months", months, "months", Band::Exact, "length of the quarter");
    record.number("tolerance-mm", TOLERANCE_MM, "mm", Band::Exact, "error that may not go unnoticed");
    record.number("reference-mm", r.station.reference_mm, "mm", Band::Exact, "length of the reference");
    record.number("frames", r.station.frames as f64, "", Band::Exact, "frames averaged by one check");
    record.number(
        "focal-ppm-per-kelvin",
        1e6 * r.station.focal_per_kelvin,
        "ppm/K",
        Band::relative(1e-15, "one product"),
        "relative drift of the focal length",
    );
    record.number("distance-mm", r.station.distance_mm, "mm", Band::Exact, "distance of the plane");
    record.number(
        "ewma-weight",
        EWMA_WEIGHT,
        "",
        Band::Exact,
        "weight of the newest value in the moving average",
    );
    record.number(
        "creep-sd-urad",
        1e6 * r.station.creep_sd_rad,
        "\u{b5}rad",
        Band::relative(1e-15, "one product"),
        "standard deviation of the bracket's turn in a shift",
    );
    record.number("season-kelvin", r.station.season_kelvin, "K", Band::Exact, "warming within the quarter");
    record.number(
        "creep-urad",
        1e6 * r.station.creep_rad,
        "\u{b5}rad",
        Band::relative(1e-15, "one product"),
        "mean turn of the bracket in a shift",
    );
    record.number(
        "check-sd-mm",
        r.sd_mm,
        "mm",
        Band::relative(1e-15, "three operations"),
        "standard deviation of one check",
    );
    record.number(
        "threshold-limit",
        r.threshold.limit,
        "",
        root(),
        "limit of the threshold, standard deviations of one check",
    );
    record.number("threshold-limit-mm", r.threshold.limit * r.sd_mm, "mm", root(), "the same in mm");
    record.number(
        "ewma-limit-mm",
        r.ewma.limit * r.sd_mm,
        "mm",
        root(),
        "limit of the moving average, in mm",
    );
    record.number(
        "false-alarm",
        FALSE_ALARM,
        "",
        Band::Exact,
        "chance of a false alarm in a quarter, both rules",
    );
    let share = |pick: fn(&(bool, bool)) -> bool| {
        r.alarms.iter().filter(|a| pick(a)).count() as f64 / IN_CONTROL as f64
    };
    record.number(
        "threshold-false-alarms",
        share(|a| a.0),
        "",
        count(),
        "share of driftless quarters with an alarm, threshold",
    );
    record.number("ewma-false-alarms", share(|a| a.1), "", count(), "the same, moving average");
    for (rule, name) in ["threshold", "ewma"].into_iter().enumerate() {
        let (shifts, errors) = (r.alarm_shifts(rule), r.errors_at_alarm(rule));
        let missed = (QUARTERS - errors.len()) as f64 / QUARTERS as f64;
        record.number(
            format!("{name}-median-days"),
            days(quantile(&shifts, 0.5)),
            "days",
            count(),
            "median day of the alarm",
        );
        record.number(
            format!("{name}-late-days"),
            days(quantile(&shifts, 0.95)),
            "days",
            count(),
            "day by which 95 % of the stations had their alarm",
        );
        record.number(
            format!("{name}-error-mm"),
            quantile(&errors, 0.5),
            "mm",
            sum(),
            "median systematic error at the alarm",
        );
        record.number(format!("{name}-missed"), missed, "", count(), "share of quarters without an alarm");
    }
    record.number(
        "calendar-days",
        days(r.calendar_shifts()),
        "days",
        count(),
        "calendar interval at which 1 % of a fleet exceed the tolerance",
    );
    let calendar = r.calendar_shifts() as usize;
    for (id, risk, what) in [
        (
            "calendar-risk",
            r.risk(|_| calendar),
            "share of other stations above the tolerance before the calendar's day",
        ),
        ("quarter-risk", r.risk(|_| QUARTER), "share of them above the tolerance within a quarter"),
        ("check-risk", r.risk_of_check(), "share of them above the tolerance before the check asks"),
    ] {
        record.number(id, risk, "", count(), what);
    }
    let asked = r.asked_shifts();
    record.number(
        "check-median-days",
        days(quantile(&asked, 0.5)),
        "days",
        count(),
        "median interval when the check asks, stations not used to set its limit",
    );
    record.number(
        "check-action-mm",
        r.action_limit() * r.sd_mm,
        "mm",
        sum(),
        "smoothed check at which it asks",
    );
    let never = asked.iter().filter(|&&s| s >= YEAR as f64).count() as f64 / FLEET as f64;
    record.number(
        "check-never",
        never,
        "",
        count(),
        "share of the fleet that needs no calibration within a year",
    );
    record.number(
        "check-gain",
        quantile(&asked, 0.5) / r.calendar_shifts(),
        "",
        count(),
        "median interval over the calendar's",
    );
    let half = 0.5 * (high - low);
    let stand_in = "a simulated station with round causes (30 ppm/K, 8 K, 5 urad a shift); tolerance: half the central 95 % of \
                    its stations";
    record.reconcile_within("drift-mm", half, stand_in)?;
    let stand_in = "a quarter of 91 days of three shifts; tolerance: half a week";
    record.reconcile_within("drift-months", 3.5 / MONTH_DAYS, stand_in)?;
    Ok(())
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
    record.claim(
        Claim::all_of(
            "first-order",
            "at every shift the error is that of the first-order formula, within its second-order remainder",
            cases,
            "expansion in warming and turn, twice the second-order terms",
        )
        .over("shifts"),
    );
    let share = |pick: fn(&(bool, bool)) -> bool| r.alarms.iter().filter(|a| pick(a)).count();
    let rules = [
        ("threshold-false-alarms-as-set", "the threshold's false alarms are as often as set", share(|a| a.0)),
        ("ewma-false-alarms-as-set", "the moving average's false alarms are as often as set", share(|a| a.1)),
    ];
    for (id, statement, alarms) in rules {
        let interval = Interval::of_proportion(alarms, IN_CONTROL, RATE);
        let reason = format!(
            "{alarms} of {IN_CONTROL} simulated quarters, Wilson interval of the rate behind them; the rate that the limit was \
             computed for (product of probabilities; Crowder's integral equation) must lie inside"
        );
        let range = (interval.low, interval.high);
        record.claim(Claim::within(id, statement, FALSE_ALARM, range, reason).with_false_alarm_rate(RATE));
    }
    // Both shares are counted on as many stations, one of them by choice of the limit: twice the binomial variance.
    let spread = (2.0 * RISK * (1.0 - RISK) / FLEET as f64).sqrt();
    let reason =
        "the limits were set on other stations: binomial, twice, as the setting has chance in it too";
    for (id, risk) in [
        ("calendar-keeps-its-risk", r.risk(|_| r.calendar_shifts() as usize)),
        ("check-keeps-its-risk", r.risk_of_check()),
    ] {
        let statement = "on stations it was not set by, it lets no more exceed the tolerance unnoticed than it was set to";
        let highest = RISK + normal_two_sided(2.0 * RATE) * spread;
        let claim = Claim::at_most(id, statement, risk, highest, reason);
        record.claim(claim.with_false_alarm_rate(RATE));
    }
    let turn = r.station.creep_rad * QUARTER as f64;
    let spread = r.station.creep_sd_rad * (QUARTER as f64).sqrt();
    let slope = r.station.first_order_mm(0.0, 1.0).0;
    // The second-order remainder at the mean turn plus five standard deviations.
    let remainder = r.station.first_order_mm(0.0, turn + 5.0 * spread).1;
    let interval = Interval::of_mean(slope * turn, slope.abs() * spread, QUARTERS, RATE);
    let range = (interval.low - remainder, interval.high + remainder);
    let reason = "a random walk with drift: mean n m, standard deviation sqrt(n) s, over the first-order slope; widened by the \
                  second-order remainder";
    let statement = "the bracket's mean share is that of a random walk with drift";
    let claim = Claim::within("bracket-walk", statement, mean(&r.ends(2)), range, reason);
    record.claim(claim.in_unit("mm").with_false_alarm_rate(RATE));
    let earlier = r
        .quarters
        .iter()
        .filter(|q| q.alarms[1].map_or(QUARTER, |a| a.0) < q.alarms[0].map_or(QUARTER, |a| a.0))
        .count();
    let interval = Interval::of_proportion(earlier, QUARTERS, RATE);
    let statement = "against slow drift the moving average is the earlier of the two more often than not";
    let reason = format!("{earlier} of {QUARTERS} quarters; lower end of the Wilson interval above one half");
    record.claim(
        Claim::at_least("moving-average-is-earlier", statement, interval.low, 0.5, reason)
            .with_false_alarm_rate(RATE),
    );
}

pub(crate) fn tables_and_figures(record: &mut Record, r: &Results, seed: u64) {
    let bands = error_bands(r, seed);
    let columns = [("day", "days"), ("low", "mm"), ("median", "mm"), ("high", "mm")];
    let mut table = Table::new(
        "error",
        "systematic error of the reference against time: 2.5 %, 50 % and 97.5 % of the stations",
        &columns,
    );
    bands.iter().for_each(|row| table.push(row.to_vec()));
    record.table(table);

    let trade = trade_off(r, seed);
    let columns = [("false_alarm", ""), ("threshold_days", "days"), ("ewma_days", "days")];
    let mut table = Table::new(
        "trade-off",
        "median day of the alarm against the chance of a false alarm in a quarter",
        &columns,
    );
    trade.iter().for_each(|row| table.push(row.to_vec()));
    record.table(table);

    let asked = r.asked_shifts();
    let exceeds: Vec<f64> = r.judged.iter().map(|f| f.exceeds.unwrap_or(YEAR) as f64).collect();
    let columns = [("share", ""), ("exceeds", "days"), ("check_asks", "days")];
    let mut table = Table::new(
        "fleet",
        "day by which a share of the fleet exceeds the tolerance, and by which the check has asked; 365 means never in the year",
        &columns,
    );
    let shares: Vec<f64> = (0..=100).map(|k| f64::from(k) / 100.0).collect();
    for &share in &shares {
        table.push([share, days(quantile(&exceeds, share)), days(quantile(&asked, share))]);
    }
    record.table(table);

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

/// `(false-alarm chance, median day by threshold, median day by moving average)` over the first [`WATCHED`] quarters.
fn trade_off(r: &Results, seed: u64) -> Vec<[f64; 3]> {
    let checks: Vec<Vec<f64>> = (0..WATCHED)
        .map(|trial| {
            let history = History::of(&r.station, seed, "quarter", trial, QUARTER);
            history.checks(&r.station, seed, "quarter", trial)
        })
        .collect();
    let median = |rule: &dyn Rule| {
        let shifts: Vec<f64> = checks.iter().map(|c| rule.first_alarm(c).unwrap_or(QUARTER) as f64).collect();
        days(quantile(&shifts, 0.5))
    };
    TRADE_OFF
        .iter()
        .map(|&chance| {
            let threshold = Shewhart::with_false_alarm(chance, QUARTER);
            let ewma = Ewma::with_false_alarm(r.ewma.weight, chance, QUARTER);
            [chance, median(&threshold), median(&ewma)]
        })
        .collect()
}

fn error_figure(r: &Results, seed: u64, bands: &[[f64; 4]]) -> Figure {
    let edges: Vec<(f64, f64, f64)> = bands.iter().map(|b| (b[0], b[1], b[3])).collect();
    let median: Vec<(f64, f64)> = bands.iter().map(|b| (b[0], b[2])).collect();
    let mut plot = Plot::new(
        format!("Systematic error of the {} mm reference", r.station.reference_mm),
        "days since calibration",
        "error (mm)",
    )
    .band_as("central 95 % of stations", &edges, Look::series(4));
    for trial in 0..SHOWN {
        let history = History::of(&r.station, seed, "quarter", trial, QUARTER);
        let middle = (0..QUARTER).skip(1).step_by(SHIFTS_A_DAY);
        let path: Vec<(f64, f64)> = middle.map(|i| (days(i as f64), history.error_mm[i])).collect();
        let name = if trial == 0 { "single stations" } else { "" };
        plot = plot.line_as(name, &path, Look::series(2).dash(Dash::Solid).width(0.7));
    }
    let plot = plot
        .line_as("median", &median, Look::series(0).width(2.0))
        .hline(format!("case study: {TOLERANCE_MM} mm"), TOLERANCE_MM)
        .x_range(0.0, days(QUARTER as f64));
    let caption = format!(
        "Length error at the middle shift of every day, neither the coldest nor the hottest, for {SHOWN} simulated stations, with \
         median and central 95 % of {WATCHED}, in mm; seed {seed}. Notice where the case study's {TOLERANCE_MM} mm lies."
    );
    Figure::plot("error", &plot, caption)
}

fn alarm_figure(r: &Results) -> Figure {
    let curve = |rule: usize| -> Vec<(f64, f64)> {
        let shifts = r.alarm_shifts(rule);
        (0..=91)
            .map(|day| {
                let limit = f64::from(day * SHIFTS_A_DAY as i32);
                let count = shifts.iter().filter(|&&s| s < limit).count();
                (f64::from(day), count as f64 / QUARTERS as f64)
            })
            .collect()
    };
    let plot =
        Plot::new("Which rule notices when?", "days since calibration", "share of stations with an alarm")
            .line("threshold on one check", &curve(0))
            .line("moving average (EWMA)", &curve(1))
            .hline("", 0.5)
            .x_range(0.0, days(QUARTER as f64))
            .y_range(0.0, 1.0);
    let median = |rule: usize| days(quantile(&r.alarm_shifts(rule), 0.5));
    let caption = format!(
        "Share of {QUARTERS} drifting stations whose check has given an alarm, both rules set to a false-alarm chance of {} % a \
         quarter. Half of the stations have had their alarm from the threshold by day {:.1}, from the moving average by day {:.1}.",
        100.0 * FALSE_ALARM,
        median(0),
        median(1)
    );
    Figure::plot("alarms", &plot, caption)
}

fn trade_off_figure(trade: &[[f64; 3]]) -> Figure {
    let curve = |column: usize| -> Vec<(f64, f64)> { trade.iter().map(|t| (t[0], t[column])).collect() };
    let plot = Plot::new(
        "False alarms against delay",
        "chance of a false alarm in a quarter",
        "median day of the alarm",
    )
    .line("threshold on one check", &curve(1))
    .line("moving average (EWMA)", &curve(2))
    .log_x();
    let ends = |column: usize| {
        let at = |row: Option<&[f64; 3]>| row.map_or(f64::NAN, |row| row[column]);
        format!("from day {:.1} to day {:.1}", at(trade.first()), at(trade.last()))
    };
    let caption = format!(
        "Median day of the alarm over {WATCHED} drifting stations against the chance of a false alarm in a quarter that the \
         rule is set to. As that chance grows, the threshold's alarm moves {}, the moving average's {}.",
        ends(1),
        ends(2)
    );
    Figure::plot("trade-off", &plot, caption)
}

fn fleet_figure(r: &Results, exceeds: &[f64], asked: &[f64]) -> Figure {
    let curve = |sample: &[f64]| -> Vec<(f64, f64)> {
        (0..365)
            .map(|day| {
                let limit = f64::from(day * SHIFTS_A_DAY as i32);
                (f64::from(day), sample.iter().filter(|&&s| s < limit).count() as f64 / FLEET as f64)
            })
            .collect()
    };
    let plot = Plot::new("A fleet over a year", "days since calibration", "share of the fleet")
        .line(format!("error above {TOLERANCE_MM} mm"), &curve(exceeds))
        .line("check has asked for calibration", &curve(asked))
        .vline(format!("calendar at {} % risk", 100.0 * RISK), days(r.calendar_shifts()))
        .y_range(0.0, 1.0);
    let caption = format!(
        "{FLEET} stations whose creep and warming lie between none and twice the case study's; calendar and action limit were set \
         on {FLEET} others. A calendar with {} % risk recalibrates all of them after {:.0} days; the check has asked half of them \
         by day {:.0}.",
        100.0 * RISK,
        days(r.calendar_shifts()),
        days(quantile(asked, 0.5))
    );
    Figure::plot("fleet", &plot, caption)
}
