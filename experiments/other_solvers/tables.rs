//! What was found, as tables.

use super::judged::{Judged, Place};
use super::row::Ending;
use super::{FALSE_ALARM, MISLEADING, Measured, OTHER_MINIMUM, joint};
use calibench_harness::{Cell, Table, stats};

/// Cells that determine the camera, a program a row.
pub fn determined(places: &[Place], measured: &[Measured]) -> Table {
    let caption = "Cells that determine the camera: least and most of sd over the bound, largest mean error over the bound, mean squares of errors \
                   over stated standard deviations (1 expected) and under the stated covariance (6 expected)";
    let rows = measured.iter().map(|m| {
        let determined = places.iter().filter(|place| place.is_determined());
        (m.program, determined.map(|place| m.in_cell(place)).collect::<Vec<Judged>>())
    });
    Table::of("determined", caption, rows)
        .column("program", "", |(program, _)| program.name)
        .column("trials_a_cell", "", |(program, _)| program.trials as usize)
        .column("answered", "", |(_, cells)| cells.iter().map(Judged::answered).sum::<usize>())
        .columns(["sd_fx_least", "sd_fx_most"], "", |(_, cells)| sd_range(cells, 0))
        .columns(["sd_k2_least", "sd_k2_most"], "", |(_, cells)| sd_range(cells, 1))
        .columns(["bias_fx", "bias_k2"], "", |(_, cells)| {
            [0, 1].map(|quantity| largest_bias(cells, quantity))
        })
        .column("square_fx", "", |(_, cells)| mean_stated(cells, |cell| cell.mean_square_stated(0)))
        .column("square_k2", "", |(_, cells)| mean_stated(cells, |cell| cell.mean_square_stated(1)))
        .column("nees", "", |(_, cells)| mean_stated(cells, Judged::mean_nees))
        .into()
}

/// The least and the largest spread of a quantity.
fn sd_range(cells: &[Judged], quantity: usize) -> [f64; 2] {
    let sds = || cells.iter().map(|cell| cell.errors(quantity).sd());
    [stats::smallest(sds()), stats::largest(sds())]
}

fn largest_bias(cells: &[Judged], quantity: usize) -> f64 {
    stats::largest(cells.iter().map(|cell| cell.errors(quantity).mean().abs()))
}

/// The mean over cells of what all of them state.
fn mean_stated<'a>(cells: &[Judged<'a>], of: impl Fn(&Judged<'a>) -> Option<f64>) -> Cell {
    let all: Option<Vec<f64>> = cells.iter().map(of).collect();
    all.map_or(Cell::from("not stated"), |all| stats::mean(&all).into())
}

/// What a program did in a cell, beside this library.
struct Beside<'a> {
    place: &'a Place,
    program: &'static str,
    cell: Judged<'a>,
    ours: Judged<'a>,
}

/// Every cell of `places` with every program.
fn beside<'a>(
    places: impl Iterator<Item = &'a Place>,
    measured: &'a [Measured],
) -> impl Iterator<Item = Beside<'a>> {
    places.flat_map(move |place| {
        measured.iter().map(move |m| Beside {
            place,
            program: m.program.name,
            cell: m.in_cell(place),
            ours: measured[0].in_cell(place),
        })
    })
}

/// Cells that hardly determine the camera, a cell and program a row.
pub fn weak(places: &[Place], measured: &[Measured]) -> Table {
    let caption = "Cells that hardly determine the camera: bound of sd(fx)/fx; of the answers, sd and mean error of fx \
                   over the bound, mean square of its error over the stated standard deviation (1 expected), squared \
                   error of all intrinsics under the stated covariance (6 expected), answers off by more than six \
                   stated standard deviations without a warning, and those at another minimum than this library's";
    // Of few answers no spread is told.
    let told = |b: &Beside, value: Option<f64>| {
        let enough = b.cell.errors(0).count() >= 4;
        value.filter(|_| enough).map_or(Cell::from("-"), Cell::from)
    };
    let elsewhere =
        |b: &Beside| b.cell.excesses(&b.ours).iter().filter(|excess| **excess > OTHER_MINIMUM).count();
    Table::of("weak", caption, beside(places.iter().filter(|place| !place.is_determined()), measured))
        .column("cell", "", |b| b.place.name.clone())
        .column("bound", "%", |b| 100.0 * b.place.relative)
        .column("program", "", |b| b.program)
        .column("trials", "", |b| b.cell.trials())
        .column("answered", "", |b| b.cell.answered())
        .column("warned", "", |b| b.cell.warned())
        .column("refused", "", |b| b.cell.ended(Ending::Refused))
        .column("sd_fx", "", |b| told(b, Some(b.cell.errors(0).sd())))
        .column("bias_fx", "", |b| told(b, Some(b.cell.errors(0).mean())))
        .column("square_fx", "", |b| told(b, b.cell.mean_square_stated(0)))
        .column("nees", "", |b| told(b, b.cell.mean_nees()))
        .column("misleading", "", |b| b.cell.misleading(MISLEADING).map_or(Cell::from("-"), Cell::from))
        .column("elsewhere", "", elsewhere)
        .into()
}

/// Everything, a cell and program a row.
pub fn cells(places: &[Place], measured: &[Measured]) -> Table {
    let each = joint(places, measured);
    let caption = format!(
        "Every cell and program: sd and mean error over the bound, with intervals that hold together at {FALSE_ALARM} (Bonferroni), and the root \
         mean square difference from this library's estimate over the bound"
    );
    let number = |value: f64| if value.is_finite() { Cell::from(value) } else { Cell::from("-") };
    let spread = |b: &Beside, quantity: usize| match b.cell.spread(quantity, each) {
        Some(sd) => [sd.value, sd.low, sd.high].map(Cell::from),
        None => ["-", "-", "-"].map(Cell::from),
    };
    let bias = |b: &Beside| [0, 1].map(|quantity| number(b.cell.errors(quantity).mean()));
    let difference = |b: &Beside| {
        [0, 1].map(|quantity| number(stats::root_mean_square(b.cell.differences(&b.ours, quantity))))
    };
    Table::of("cells", caption, beside(places.iter(), measured))
        .column("cell", "", |b| b.place.name.clone())
        .column("bound_fx", "px", |b| b.place.bounds[0])
        .column("bound_k2", "", |b| b.place.bounds[1])
        .column("program", "", |b| b.program)
        .column("trials", "", |b| b.cell.trials())
        .column("answered", "", |b| b.cell.answered())
        .columns(["sd_fx", "sd_fx_low", "sd_fx_high"], "", |b| spread(b, 0))
        .columns(["sd_k2", "sd_k2_low", "sd_k2_high"], "", |b| spread(b, 1))
        .columns(["bias_fx", "bias_k2"], "", bias)
        .columns(["difference_fx", "difference_k2"], "", difference)
        .into()
}

/// How each was asked.
pub fn fairness(measured: &[Measured]) -> Table {
    Table::of("fairness", "What was asked, and what is fair to say of each", measured)
        .column("program", "", |m| m.program.name)
        .column("versions", "", |m| m.program.told("versions").unwrap_or("-"))
        .column("fairness", "", |m| m.program.note)
        .into()
}
