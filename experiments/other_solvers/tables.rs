//! What was found, as tables.

use super::judged::{Judged, Place};
use super::row::Ending;
use super::{FALSE_ALARM, MISLEADING, Measured, OTHER_MINIMUM, joint};
use calibench_harness::{Cell, Table, stats};

/// Cells that determine the camera, a program a row.
pub fn determined(places: &[Place], measured: &[Measured]) -> Table {
    let columns = [
        ("program", ""),
        ("trials_a_cell", ""),
        ("answered", ""),
        ("sd_fx_least", ""),
        ("sd_fx_most", ""),
        ("sd_k2_least", ""),
        ("sd_k2_most", ""),
        ("bias_fx", ""),
        ("bias_k2", ""),
        ("square_fx", ""),
        ("square_k2", ""),
        ("nees", ""),
    ];
    let caption = "Cells that determine the camera: least and most of sd over the bound, largest mean error over the bound, mean squares of errors \
                   over stated standard deviations (1 expected) and under the stated covariance (6 expected)";
    let mut table = Table::new("determined", caption, &columns);
    for m in measured {
        let cells: Vec<Judged> =
            places.iter().filter(|place| place.is_determined()).map(|place| m.in_cell(place)).collect();
        let sds = |quantity: usize| cells.iter().map(move |cell| cell.errors(quantity).sd());
        let bias =
            |quantity: usize| stats::largest(cells.iter().map(|cell| cell.errors(quantity).mean().abs()));
        let mean = |of: &dyn Fn(&Judged) -> Option<f64>| {
            let all: Option<Vec<f64>> = cells.iter().map(of).collect();
            all.map_or(Cell::from("not stated"), |all| stats::mean(&all).into())
        };
        let answered: usize = cells.iter().map(Judged::answered).sum();
        table.push::<Cell>([
            m.program.name.into(),
            (m.program.trials as usize).into(),
            answered.into(),
            stats::smallest(sds(0)).into(),
            stats::largest(sds(0)).into(),
            stats::smallest(sds(1)).into(),
            stats::largest(sds(1)).into(),
            bias(0).into(),
            bias(1).into(),
            mean(&|cell| cell.mean_square_stated(0)),
            mean(&|cell| cell.mean_square_stated(1)),
            mean(&|cell| cell.mean_nees()),
        ]);
    }
    table
}

/// Cells that hardly determine the camera, a cell and program a row.
pub fn weak(places: &[Place], measured: &[Measured]) -> Table {
    let columns = [
        ("cell", ""),
        ("bound", "%"),
        ("program", ""),
        ("trials", ""),
        ("answered", ""),
        ("warned", ""),
        ("refused", ""),
        ("sd_fx", ""),
        ("bias_fx", ""),
        ("square_fx", ""),
        ("nees", ""),
        ("misleading", ""),
        ("elsewhere", ""),
    ];
    let caption = "Cells that hardly determine the camera: bound of sd(fx)/fx; of the answers, sd and mean error of fx \
                   over the bound, mean square of its error over the stated standard deviation (1 expected), squared \
                   error of all intrinsics under the stated covariance (6 expected), answers off by more than six \
                   stated standard deviations without a warning, and those at another minimum than this library's";
    let mut table = Table::new("weak", caption, &columns);
    for place in places.iter().filter(|place| !place.is_determined()) {
        let ours = measured[0].in_cell(place);
        for m in measured {
            let cell = m.in_cell(place);
            let errors = cell.errors(0);
            let few = errors.count() < 4;
            let told = |value: f64| if few { Cell::from("-") } else { value.into() };
            let elsewhere = cell.excesses(&ours).iter().filter(|excess| **excess > OTHER_MINIMUM).count();
            table.push::<Cell>([
                place.name.clone().into(),
                (100.0 * place.relative).into(),
                m.program.name.into(),
                cell.trials().into(),
                cell.answered().into(),
                cell.warned().into(),
                cell.ended(Ending::Refused).into(),
                told(errors.sd()),
                told(errors.mean()),
                cell.mean_square_stated(0).map_or(Cell::from("-"), told),
                cell.mean_nees().map_or(Cell::from("-"), told),
                cell.misleading(MISLEADING).map_or(Cell::from("-"), Cell::from),
                elsewhere.into(),
            ]);
        }
    }
    table
}

/// Everything, a cell and program a row.
pub fn cells(places: &[Place], measured: &[Measured]) -> Table {
    let columns = [
        ("cell", ""),
        ("bound_fx", "px"),
        ("bound_k2", ""),
        ("program", ""),
        ("trials", ""),
        ("answered", ""),
        ("sd_fx", ""),
        ("sd_fx_low", ""),
        ("sd_fx_high", ""),
        ("sd_k2", ""),
        ("sd_k2_low", ""),
        ("sd_k2_high", ""),
        ("bias_fx", ""),
        ("bias_k2", ""),
        ("difference_fx", ""),
        ("difference_k2", ""),
    ];
    let each = joint(places, measured);
    let caption = format!(
        "Every cell and program: sd and mean error over the bound, with intervals that hold together at {FALSE_ALARM} (Bonferroni), and the root \
         mean square difference from this library's estimate over the bound"
    );
    let mut table = Table::new("cells", caption, &columns);
    let number = |value: f64| if value.is_finite() { Cell::from(value) } else { Cell::from("-") };
    for place in places {
        let ours = measured[0].in_cell(place);
        for m in measured {
            let cell = m.in_cell(place);
            let spread = |quantity: usize| match cell.spread(quantity, each) {
                Some(sd) => [sd.value, sd.low, sd.high].map(Cell::from),
                None => ["-", "-", "-"].map(Cell::from),
            };
            let difference =
                |quantity: usize| number(stats::root_mean_square(cell.differences(&ours, quantity)));
            let mut row: Vec<Cell> = vec![
                place.name.clone().into(),
                place.bounds[0].into(),
                place.bounds[1].into(),
                m.program.name.into(),
                cell.trials().into(),
                cell.answered().into(),
            ];
            row.extend(spread(0));
            row.extend(spread(1));
            row.extend([
                number(cell.errors(0).mean()),
                number(cell.errors(1).mean()),
                difference(0),
                difference(1),
            ]);
            table.push(row);
        }
    }
    table
}

/// How each was asked.
pub fn fairness(measured: &[Measured]) -> Table {
    let rows = measured.iter().map(|m| {
        [m.program.name, m.program.told("versions").unwrap_or("-"), m.program.note].map(String::from)
    });
    let caption = "What was asked, and what is fair to say of each";
    Table::of_arrays(
        "fairness",
        caption,
        [("program", ""), ("versions", ""), ("fairness", "")],
        &rows.collect::<Vec<_>>(),
    )
}
