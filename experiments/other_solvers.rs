//! How do other solvers do on the noise of the studies?
//!
//! Expected: where the data determine the camera, every program that minimises the same sum of squares gives
//! the same camera, trial by trial, to what its arithmetic and its stopping rule leave; spread, bias and
//! stated uncertainty are then the bound's. They differ where the data tell little: there one refuses and
//! another answers.
//!
//! What it cannot show: data that break the model, and how long a program takes. The programs are not run
//! here: the command `other-solvers-trials` asked them and wrote golden/other-solvers/, which is read. It is
//! refused as stale when a line of what draws the trials, of an adapter, or, for this library's own trials,
//! of the solver has changed since.

use calibench::evaluate::Interval;
use calibench::evaluate::distribution::normal_two_sided;
use calibench::evaluate::interval::each_of;
use calibench_gate::Builtin;
use calibench_harness::fingerprint::Fingerprint;
use calibench_harness::{Band, Context, Experiment, ExperimentError, Record, stats};

pub mod campaign;
mod figures;
mod grid;
mod judged;
mod programs;
mod row;
mod tables;
pub mod trials;

use judged::{Judged, Place, places};
use programs::{PROGRAMS, Program};
use row::{HEADER, Row};
use trials::{Asked, JUDGED};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "other-solvers",
    title: "Other solvers on the noise of the studies",
    question: "OpenCV, COLMAP, SciPy, 200 lines of NumPy and this library calibrate the same noise: 23 cells of three studies, from 16 \
               views at 20 degrees to two views at one degree. Do they attain the bound, do they know their uncertainty, and are two right \
               solvers the same, trial by trial? Expected: to rounding where the data determine the camera; elsewhere they differ in \
               whether they answer.",
    seed: 1,
    takes_image: false,
    run,
};

/// Chance that correct programs fail one of the statistical claims, over all programs, cells and quantities
/// of the claim.
const FALSE_ALARM: f64 = 1e-4;
/// First trials of each cell that every run repeats with this library's solver.
const REPEATED: u64 = 3;
/// How far two programs of double precision may differ, in units of the bound. Their stopping rules leave a
/// gain of 1e-15 of a cost of a thousand variances: a millionth of a standard deviation. A search that
/// converges linearly stops a hundredfold too early at worst.
const ROUNDING: f64 = 1e-4;
/// Single precision moves each pixel by an error of its own, and so each parameter by that share of the
/// bound, if its errors were equal everywhere. The last digit of a coordinate is worth twice as much beyond
/// each power of two.
const SINGLE_PRECISION: f64 = 2.0;
/// Cost above this library's, in variances, from which on a camera is another minimum: a tenth of a standard
/// deviation.
const OTHER_MINIMUM: f64 = 0.01;
/// Stated standard deviations that an error without warning may not exceed: of honest answers one in 500
/// million does.
const MISLEADING: f64 = 6.0;

/// A program with its trials.
struct Measured {
    program: &'static Program,
    rows: Vec<Row>,
}

impl Measured {
    fn in_cell<'a>(&'a self, place: &'a Place) -> Judged<'a> {
        Judged::new(place, &self.rows)
    }
}

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let measured = read()?;
    for m in &measured {
        record.input(format!("golden/other-solvers/{}.csv", m.program.name), m.program.committed.as_bytes());
    }
    let places = places().map_err(ExperimentError::at("the studies"))?;
    let repeated = trials::ask(Builtin, REPEATED).map_err(ExperimentError::at("the repeated trials"))?;
    claim_current(&mut record, &measured, places.len());
    claim_repeated(&mut record, &measured[0], &repeated);
    report_sizes(&mut record, &places, &measured);
    claim_answered(&mut record, &places, &measured);
    claim_errors(&mut record, &places, &measured);
    claim_stated(&mut record, &places, &measured);
    claim_pairs(&mut record, &places, &measured, &rounding(&repeated, places.len()));
    record.table(tables::determined(&places, &measured));
    record.table(tables::weak(&places, &measured));
    record.table(tables::cells(&places, &measured));
    record.table(tables::fairness(&measured));
    record.figure(figures::spread(&places, &measured, joint(&places, &measured)));
    record.figure(figures::pairs(&places, &measured, &rounding(&repeated, places.len())));
    Ok(record)
}

fn read() -> Result<Vec<Measured>, ExperimentError> {
    let one = |program: &'static Program| {
        let mut lines = program.committed.lines().skip(1);
        let rows = (lines.next() == Some(HEADER))
            .then(|| lines.map(Row::read).collect::<Option<Vec<_>>>())
            .flatten();
        let broken =
            || format!("golden/other-solvers/{}.csv is broken: run {}", program.name, program.command());
        Ok(Measured { program, rows: rows.ok_or_else(|| ExperimentError::Input(broken()))? })
    };
    PROGRAMS.iter().map(one).collect()
}

/// The committed trials are those of this code, and of these adapters.
fn claim_current(record: &mut Record, measured: &[Measured], cells: usize) {
    let case = |m: &Measured| {
        let Program { name, trials, committed, .. } = m.program;
        let present = match m.program.adapter {
            None => Fingerprint::of_other_solvers(),
            Some(_) => Fingerprint::of_other_solvers_scenes(),
        };
        let (what, held) = present.case(&format!("{name}.csv"), committed, &m.program.command());
        let adapter = m.program.told("adapter") == Some(m.program.adapter_hash().as_str());
        let whole = m.rows.len() as u64 == trials * cells as u64;
        let told = match (held, adapter && whole) {
            (true, false) => {
                format!("{name}.csv is of another adapter or of other trials: run {}", m.program.command())
            }
            _ => what,
        };
        (told, held && adapter && whole)
    };
    record
        .claim_that(
            "trials-are-current",
            "every committed trial was drawn by the present code and asked by the present adapter",
        )
        .every("programs", measured.iter().map(case))
        .because(
            "SHA-256 of the code lines that draw the trials, of the adapters and, for this library, of its \
             solver",
        );
}

/// The first trials of each cell, repeated with this library's solver.
fn claim_repeated(record: &mut Record, ours: &Measured, repeated: &Asked) {
    let committed: Vec<&Row> = ours.rows.iter().filter(|row| row.trial < REPEATED).collect();
    let count = repeated.rows.len();
    let case = |row: &Row| {
        let same = committed.iter().any(|then| then.text() == row.text());
        (format!("cell {}, trial {}: run {}", row.cell, row.trial, ours.program.command()), same)
    };
    record.exact("").count(
        "trials-repeated",
        count,
        "trials of this library's solver that every run repeats",
    );
    record
        .claim_that(
            "share-is-repeated",
            "the trials repeated in this run give the committed errors, stated deviations and costs to every \
             digit",
        )
        .every("trials", repeated.rows.iter().map(case))
        .because("streams are keyed by seed and trial, and every sum has its order");
}

fn report_sizes(record: &mut Record, places: &[Place], measured: &[Measured]) {
    let determined = places.iter().filter(|place| place.is_determined()).count();
    record
        .exact("")
        .count("cells", places.len(), "cells that every program was asked")
        .count("determined-cells", determined, "of them with a bound of sd(fx)/fx below 2 %")
        .count("trials", measured.iter().map(|m| m.rows.len()).sum(), "trials of all programs");
}

/// Cells that determine the camera, each with every program.
fn determined<'a>(places: &'a [Place], measured: &'a [Measured]) -> Vec<(&'static str, Judged<'a>)> {
    let cells = || places.iter().filter(|place| place.is_determined());
    measured.iter().flat_map(|m| cells().map(|place| (m.program.name, m.in_cell(place)))).collect()
}

/// Rate of each of the intervals that are judged together: of two quantities, in every cell that determines
/// the camera, of every program.
fn joint(places: &[Place], measured: &[Measured]) -> f64 {
    each_of(JUDGED.len() * determined(places, measured).len(), FALSE_ALARM)
}

/// Who answers, and with what warning.
fn claim_answered(record: &mut Record, places: &[Place], measured: &[Measured]) {
    for m in measured {
        report_answered(record, places, m);
    }
    let case = |(name, cell): &(&str, Judged)| {
        let (answered, trials) = (cell.answered(), cell.trials());
        (format!("{name}, {}: {answered} of {trials}", cell.place.name), answered == trials)
    };
    record
        .claim_that(
            "determined-is-answered",
            "where the data determine the camera every trial is answered by every program",
        )
        .every("cells", determined(places, measured).iter().map(case))
        .because("noise of 0.1 px leaves the focal length known to two hundredths: any start is near enough");
}

fn report_answered(record: &mut Record, places: &[Place], m: &Measured) {
    let (known, weak): (Vec<Judged>, Vec<Judged>) =
        places.iter().map(|place| m.in_cell(place)).partition(|cell| cell.place.is_determined());
    let share = |cells: &[Judged], count: &dyn Fn(&Judged) -> usize| {
        let trials: usize = cells.iter().map(|cell| cell.trials()).sum();
        cells.iter().map(count).sum::<usize>() as f64 / trials as f64
    };
    let misleading = weak.iter().filter_map(|cell| cell.misleading(MISLEADING)).sum();
    // Those cells in which most trials were refused.
    let survivors = weak.iter().filter(|cell| 2 * cell.answered() < cell.trials());
    let surviving: Vec<f64> = survivors.flat_map(|cell| cell.squares_stated(0).unwrap_or_default()).collect();
    let mut numbers = record.exact("");
    numbers
        .suffix(format!("-{}", m.program.name), format!(", {}", m.program.name))
        .number("answered-determined", share(&known, &|c| c.answered()), "share answered, determined cells")
        .number("answered-weak", share(&weak, &|c| c.answered()), "share answered, other cells")
        .number("warned-weak", share(&weak, &|c| c.warned()), "share answered with a warning, other cells")
        .count(
            "misleading-weak",
            misleading,
            "answers without warning whose fx is off by more than six stated standard deviations, other cells",
        );
    if !surviving.is_empty() {
        let what = "answers in cells where most trials are refused";
        numbers.count("survivors", surviving.len(), what).number(
            "survivors-square",
            stats::mean(&surviving),
            "mean square of the error of fx over the stated deviation of those answers",
        );
    }
}

/// What terms of second order in the noise may do to a parameter, in units of its bound or relative to its
/// spread: twice the relative standard deviation of the focal length, since the pixels tell its square or its
/// inverse rather than itself.
fn second_order(place: &Place) -> f64 {
    2.0 * place.relative
}

fn claim_errors(record: &mut Record, places: &[Place], measured: &[Measured]) {
    let each = joint(places, measured);
    let (mut spreads, mut biases) = (Vec::new(), Vec::new());
    for (name, cell) in &determined(places, measured) {
        for (quantity, parameter) in JUDGED.iter().enumerate() {
            let errors = cell.errors(quantity);
            let slack = second_order(cell.place);
            let chance = Interval::of_deviation_ratio(errors.count() as usize, each);
            let (low, high) = (chance.low * (1.0 - slack), chance.high * (1.0 + slack));
            let what = |value: f64| format!("{name}, {}, {parameter}: {value:.4}", cell.place.name);
            spreads.push((
                format!("{}, not in [{low:.4}, {high:.4}]", what(errors.sd())),
                (low..=high).contains(&errors.sd()),
            ));
            let most = normal_two_sided(each) / (errors.count() as f64).sqrt() + slack;
            biases
                .push((format!("{}, more than {most:.4}", what(errors.mean())), errors.mean().abs() <= most));
        }
    }
    record
        .claim_that(
            "bound-attained",
            "where the data determine the camera, fx and k2 of every program spread as the Cramer-Rao bound \
             says",
        )
        .every("spreads", spreads)
        .at_rate(FALSE_ALARM)
        .because(
            "sqrt(chi2 / (n - 1)), Bonferroni over programs, cells and both parameters, which holds although \
             they move together; terms of second order",
        );
    record
        .claim_that(
            "unbiased",
            "there the mean error of fx and k2 of every program is zero within the uncertainty of the mean",
        )
        .every("means", biases)
        .at_rate(FALSE_ALARM)
        .because(
            "the bound over the root of the trials, normal, Bonferroni over programs, cells and both \
             parameters; terms of second order",
        );
}

fn claim_stated(record: &mut Record, places: &[Place], measured: &[Measured]) {
    let all = determined(places, measured);
    let free = 6;
    let mut found = Vec::new();
    for (name, cell) in &all {
        for (quantity, parameter) in JUDGED.iter().enumerate() {
            found.push((name, cell, parameter.name(), 1, cell.mean_square_stated(quantity)));
        }
        found.push((name, cell, "all", free, cell.mean_nees()));
    }
    let stated: Vec<_> = found
        .into_iter()
        .filter_map(|(name, cell, what, freedom, mean)| Some((name, cell, what, freedom, mean?)))
        .collect();
    let each = each_of(stated.len(), FALSE_ALARM);
    let cases = stated.iter().map(|(name, cell, what, freedom, mean)| {
        // Where sigma is estimated the square is Fisher's F, whose mean and variance are larger by two and
        // four parts in its freedom.
        let slack = 2.0 * second_order(cell.place) + 4.0 / cell.place.freedom;
        let chance = Interval::of_mean_chi_squared(*freedom, cell.answered(), each);
        let (low, high) = (chance.low * (1.0 - slack), chance.high * (1.0 + slack));
        (
            format!("{name}, {}, {what}: {mean:.3}, not in [{low:.3}, {high:.3}]", cell.place.name),
            (low..=high).contains(mean),
        )
    });
    record
        .claim_that(
            "stated-uncertainty-is-true",
            "there the squared errors are as large as each program states: of fx, of k2 and, where a \
             covariance is stated, of all intrinsics",
        )
        .every("means", cases)
        .at_rate(FALSE_ALARM)
        .because("chi-squared over the trials, Bonferroni over all that is stated; Fisher's F and terms of second order");
}

/// What single precision moves a parameter by, in each cell, in units of the bound.
fn rounding(repeated: &Asked, cells: usize) -> Vec<f64> {
    let of = |cell: usize| {
        let those = repeated.rows.iter().zip(&repeated.rounding).filter(move |(row, _)| row.cell == cell);
        stats::root_mean_square(those.map(|(_, rounding)| *rounding))
    };
    (0..cells).map(of).collect()
}

/// How a program differs from this library in a cell, in one parameter.
struct Difference {
    /// Program, cell and parameter.
    what: String,
    /// Number of the cell.
    place: usize,
    /// Root mean square over the trials, over the bound.
    rms: f64,
    /// Largest, over the bound.
    largest: f64,
}

/// Its differences in the cells that determine the camera.
fn differences(places: &[Place], m: &Measured, ours: &Measured) -> Vec<Difference> {
    let one = |(place, quantity): (&Place, usize)| {
        let found = m.in_cell(place).differences(&ours.in_cell(place), quantity);
        Difference {
            what: format!("{}, {}, {}", m.program.name, place.name, JUDGED[quantity]),
            place: place.index,
            largest: stats::largest(found.iter().map(|d| d.abs())),
            rms: stats::root_mean_square(found),
        }
    };
    let cells = places.iter().filter(|place| place.is_determined());
    cells.flat_map(|place| (0..JUDGED.len()).map(move |quantity| (place, quantity))).map(one).collect()
}

/// Trials of these cells that end at a higher or a lower minimum than this library's.
fn elsewhere<'a>(places: impl Iterator<Item = &'a Place>, m: &Measured, ours: &Measured) -> usize {
    let excesses = places.flat_map(|place| m.in_cell(place).excesses(&ours.in_cell(place)));
    excesses.filter(|excess| excess.abs() > OTHER_MINIMUM).count()
}

fn report_pairs(record: &mut Record, places: &[Place], m: &Measured, ours: &Measured, found: &[Difference]) {
    let name = m.program.name;
    let band = Band::relative(1e-6, "committed estimates over the bound, which is the library's");
    record
        .group("", band)
        .suffix(format!("-{name}"), format!(", {name}"))
        .number(
            "difference-rms",
            stats::root_mean_square(found.iter().map(|d| d.rms)),
            "root mean square difference from this library's estimate over the bound, determined cells",
        )
        .number("difference-largest", stats::largest(found.iter().map(|d| d.largest)), "largest of them");
    record.exact("").suffix(format!("-{name}"), format!(", {name}")).count(
        "elsewhere",
        elsewhere(places.iter(), m, ours),
        "trials, of all cells, that both answered with different minima",
    );
}

fn claim_pairs(record: &mut Record, places: &[Place], measured: &[Measured], rounding: &[f64]) {
    let (ours, others) = measured.split_first().expect("the first is this library");
    let (mut double, mut single) = (Vec::new(), Vec::new());
    for m in others {
        let found = differences(places, m, ours);
        report_pairs(record, places, m, ours, &found);
        if m.program.is_single_precision {
            single.extend(found);
        } else {
            double.extend(found);
        }
    }
    let within = |d: &Difference| (format!("{}: {:.1e}", d.what, d.largest), d.largest <= ROUNDING);
    let as_rounded = |d: &Difference| {
        let ratio = d.rms / rounding[d.place];
        let range = 1.0 / SINGLE_PRECISION..=SINGLE_PRECISION;
        (format!("{}: {ratio:.3} of what rounding does", d.what), range.contains(&ratio))
    };
    let ratios = || single.iter().map(|d| d.rms / rounding[d.place]);
    record
        .group("", Band::relative(1e-6, "committed estimates over the bound, which is the library's"))
        .number(
            "rounding-least",
            stats::smallest(ratios()),
            "OpenCV's difference over what rounding the pixels does, least of the cells",
        )
        .number("rounding-most", stats::largest(ratios()), "the same, most of the cells");
    record
        .claim_that(
            "same-to-rounding",
            "where the data determine the camera, programs of double precision give this library's fx and k2 \
             in every trial, to 1e-4 of the bound",
        )
        .every("cells", double.iter().map(within))
        .because(
            "one sum of squares has one minimum there; stopping rules of 1e-15 of the cost leave a millionth, \
             a slow search a hundredfold",
        );
    record
        .claim_that(
            "single-precision-shows",
            "there OpenCV differs from this library by what single precision does to the pixels, within a \
             factor of 2",
        )
        .every("cells", single.iter().map(as_rounded))
        .because(
            "errors of rounding are independent from pixel to pixel, like noise: they move each parameter by \
             their share of the bound",
        );
}
