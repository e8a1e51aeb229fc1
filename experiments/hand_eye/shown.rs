//! The tables and figures.

use super::TRIALS;
use super::cases::{DESIGNS, Sweep};
use super::trial::{Cell, METHODS};
use calibench_harness::{Figure, Look, Marker, Plot, Table};

/// A sweep's cells.
pub(super) fn table(sweep: &Sweep, cells: &[Cell]) -> Table {
    let caption = format!("{}: root mean square errors of X, the bound, and what is stated", sweep.title);
    let mut rows = Table::of(sweep.id, caption, cells)
        .column("case", "", |cell| cell.case.what.clone())
        .column("bound_deg", "deg", |cell| cell.bound_deg());
    for (method, (name, _)) in METHODS.iter().enumerate() {
        rows = rows.column(&format!("{}_deg", name.replace('-', "_")), "deg", |cell| cell.error_deg(method));
    }
    rows = rows.column("bound_mm", "mm", |cell| cell.bound_mm());
    for (method, (name, _)) in METHODS.iter().enumerate() {
        rows = rows.column(&format!("{}_mm", name.replace('-', "_")), "mm", |cell| cell.error_mm(method));
    }
    rows.column("nees", "", |cell| cell.nees())
        .column("refused", "", |cell| (TRIALS - cell.trials.len()) as f64)
        .into()
}

/// What a figure shows of a cell: the bound, and each method.
struct Quantity {
    axis: &'static str,
    bound: fn(&Cell) -> f64,
    error: fn(&Cell, usize) -> f64,
}

const ROTATION: Quantity =
    Quantity { axis: "rotation of X (deg)", bound: Cell::bound_deg, error: Cell::error_deg };
const TRANSLATION: Quantity =
    Quantity { axis: "translation of X (mm)", bound: Cell::bound_mm, error: Cell::error_mm };

fn panel(sweep: &Sweep, cells: &[Cell], shown: &Quantity) -> Plot {
    let along = |of: &dyn Fn(&Cell) -> f64| cells.iter().map(|c| (c.case.level, of(c))).collect::<Vec<_>>();
    let mut plot = Plot::new(sweep.title, sweep.axis, shown.axis).log_y().line_as(
        "Cramer-Rao bound",
        along(&shown.bound),
        Look::ink(),
    );
    if sweep.id != "designs" {
        plot = plot.log_x();
    }
    for (method, (_, title)) in METHODS.iter().enumerate() {
        plot = plot.points_as(*title, along(&|cell| (shown.error)(cell, method)), look(method));
    }
    plot
}

/// Shah's X lies on Park & Martin's: the one is drawn around the other.
fn look(method: usize) -> Look {
    match METHODS[method].0 {
        "park-martin" => Look::series(method).marker(Marker::Circle).size(6.0),
        _ => Look::series(method),
    }
}

/// Rotation and translation against what is varied.
pub(super) fn figures(found: &[(&Sweep, Vec<Cell>)], seed: u64) -> [Figure; 2] {
    let panels = |shown: &Quantity| -> Vec<Plot> {
        let swept = found.iter().filter(|(sweep, _)| sweep.id != "set-ups");
        swept.map(|(sweep, cells)| panel(sweep, cells, shown)).collect()
    };
    let designs = DESIGNS.iter().zip(1..).map(|((_, what, _), i)| format!("{i}: {what}")).collect::<Vec<_>>();
    let ends = |id: &str| {
        let cells = found.iter().find(|(sweep, _)| sweep.id == id).map(|(_, cells)| cells.as_slice());
        let [first, .., last] = cells.unwrap_or_default() else { return f64::NAN };
        first.bound_deg() / last.bound_deg()
    };
    let common = format!(
        "{TRIALS} trials a point, seed {seed}; elsewhere twelve stations, turns of up to 30 deg about any axis, 0.1 px, a robot that repeats \
         0.05 mm and 0.02 deg. Designs: {}.",
        designs.join("; ")
    );
    [
        Figure::panels(
            "rotation",
            &panels(&ROTATION),
            2,
            format!(
                "Root mean square error of the camera's rotation on the gripper. {common} Notice that axes within 10 deg of one \
                 cost {:.0} times what spread axes do, and turns of 5 deg {:.0} times those of 40 deg, and that only the most likely \
                 mounting lies on the bound everywhere.",
                ends("cone"),
                ends("angle")
            ),
        ),
        Figure::panels(
            "translation",
            &panels(&TRANSLATION),
            2,
            format!(
                "Root mean square error of the camera's position on the gripper. {common} Notice which methods come near the \
                 bound where the robot is good and the camera poor, or the reverse."
            ),
        ),
    ]
}
