//! Where is the solver refused or hard? Shares over the bound, the tilt and the number of views.

use super::ENDINGS;
use super::committed::Line;
use super::judged::Class;
use calibench_harness::{ExperimentError, Figure, HeatMap, Plot, Record, Table};

/// Upper ends of the classes of the bound of sd(fx)/fx; the last has none.
const BOUNDS: [f64; 8] = [0.001, 0.003, 0.01, 0.02, 0.05, 0.2, 1.0, f64::INFINITY];
const BOUND_NAMES: [&str; 8] = ["<0.1", "<0.3", "<1", "<2", "<5", "<20", "<100", "more"];
/// Upper ends of the classes of the largest tilt, degrees.
const TILTS: [f64; 5] = [5.0, 10.0, 20.0, 40.0, 61.0];
const TILT_NAMES: [&str; 5] = ["2-5", "5-10", "10-20", "20-40", "40-60"];
/// Upper ends of the classes of the number of views.
const VIEWS: [f64; 6] = [2.5, 4.5, 8.5, 16.5, 30.5, 51.0];
const VIEW_NAMES: [&str; 6] = ["2", "3-4", "5-8", "9-16", "17-30", "31-50"];

fn place(ends: &[f64], value: f64) -> usize {
    ends.iter().position(|&end| value < end).unwrap_or(ends.len() - 1)
}

/// The map as table and figure.
pub fn report(record: &mut Record, lines: &[Line]) -> Result<(), ExperimentError> {
    record.table(by_bound(lines));
    record.figure(figure(lines)?);
    Ok(())
}

fn by_bound(lines: &[Line]) -> Table {
    let inside = |class: usize| lines.iter().filter(move |l| place(&BOUNDS, l.bound) == class);
    Table::of(
        "by-bound",
        "random scenes by their bound of sd(fx)/fx in per cent: how they ended",
        BOUND_NAMES.into_iter().enumerate(),
    )
    .column("bound_percent", "", |(_, name)| *name)
    .column("scenes", "", |(class, _)| inside(*class).count())
    .columns(ENDINGS, "", |(class, _)| {
        Class::ALL.map(|end| inside(*class).filter(|l| l.class == end).count())
    })
    .into()
}

/// Per cent of the scenes in each cell of bound (across) and another quantity (up); NaN where there is none.
fn shares(
    lines: &[Line],
    rows: &[f64],
    of: impl Fn(&Line) -> f64,
    counts: impl Fn(&Line) -> bool,
) -> Vec<f64> {
    let mut all = vec![0.0; rows.len() * BOUNDS.len()];
    let mut counted = all.clone();
    for line in lines {
        let cell = place(rows, of(line)) * BOUNDS.len() + place(&BOUNDS, line.bound);
        all[cell] += 1.0;
        counted[cell] += f64::from(u8::from(counts(line)));
    }
    counted
        .iter()
        .zip(&all)
        .map(|(counted, all)| if *all > 0.0 { 100.0 * counted / all } else { f64::NAN })
        .collect()
}

fn figure(lines: &[Line]) -> Result<Figure, ExperimentError> {
    let is_refused = |l: &Line| l.class == Class::Refused;
    let is_bad = |l: &Line| matches!(l.class, Class::Wrong | Class::NotConverged);
    let panel = |title: &str,
                 up: &str,
                 rows: &[f64],
                 names: &[&str],
                 of: fn(&Line) -> f64,
                 counts: fn(&Line) -> bool| {
        let columns = BOUND_NAMES.map(String::from).to_vec();
        let names = names.iter().map(|n| n.to_string()).collect();
        let heat = HeatMap::new("share (%)", columns, names, shares(lines, rows, of, counts))
            .map_err(ExperimentError::at("heat map"))?;
        Ok::<Plot, ExperimentError>(
            Plot::heat_map(title, "bound of sd(fx)/fx (%)", up, heat.range(0.0, 100.0)).size(560.0, 330.0),
        )
    };
    let views = |l: &Line| l.views as f64;
    let tilt = |l: &Line| l.tilt_deg;
    let panels = [
        panel("refused", "largest tilt (deg)", &TILTS, &TILT_NAMES, tilt, is_refused)?,
        panel("refused", "views", &VIEWS, &VIEW_NAMES, views, is_refused)?,
        panel("wrong or not converged", "largest tilt (deg)", &TILTS, &TILT_NAMES, tilt, is_bad)?,
        panel("wrong or not converged", "views", &VIEWS, &VIEW_NAMES, views, is_bad)?,
    ];
    let (refused, known) = (
        lines.iter().filter(|l| is_refused(l)).count(),
        lines.iter().filter(|l| is_refused(l) && l.is_determined()).count(),
    );
    let caption = format!(
        "{} random scenes: per cent that the solver refuses, and per cent that it accepts at a higher cost than a search from the truth or \
         does not converge, over the Cramer-Rao bound of sd(fx)/fx and the largest tilt or the number of views (seed {}); a dash where \
         there is no scene. Of {refused} refusals {known} are of scenes with a bound below 2 %.",
        lines.len(),
        super::SEED
    );
    Ok(Figure::panels("map", &panels, 2, caption))
}
