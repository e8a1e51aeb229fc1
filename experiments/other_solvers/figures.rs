//! Spread, answers and paired differences against how well the data determine the camera.

use super::Measured;
use super::judged::{DETERMINED, Judged, Place};
use super::programs::PROGRAMS;
use calibench::evaluate::Interval;
use calibench_harness::{Dash, Figure, Look, Plot, stats};

/// The fewest answers whose spread is drawn: it is known to a fifth then.
const FEWEST: usize = 50;
const AXIS: &str = "Cramer-Rao bound of sd(fx) / fx (%)";

fn percent(place: &Place) -> f64 {
    100.0 * place.relative
}

fn beside(plot: Plot) -> Plot {
    plot.size(430.0, 360.0).log_x().vline("2 %", 100.0 * DETERMINED)
}

/// Spread over the bound, and the share of trials that are answered.
pub fn spread(places: &[Place], measured: &[Measured], each: f64) -> Figure {
    let trials = PROGRAMS[0].trials as usize;
    let chance = Interval::of_deviation_ratio(trials, each);
    let (first, last) =
        (stats::smallest(places.iter().map(percent)), stats::largest(places.iter().map(percent)));
    let band = [(first, chance.low, chance.high), (last, chance.low, chance.high)];
    let mut spread = beside(Plot::new("answers: sd(fx) over the bound", AXIS, "sd / bound").log_y())
        .band_as("chance", band, Look::ink())
        .hline_as("", 1.0, Look::ink().dash(Dash::Dotted));
    let mut answers =
        beside(Plot::new("share of trials that are answered", AXIS, "share")).y_range(-0.03, 1.03);
    for (i, m) in measured.iter().enumerate() {
        let cells: Vec<Judged> = places.iter().map(|place| m.in_cell(place)).collect();
        // A spread of a few says nothing.
        let known = cells.iter().filter(|cell| cell.answered() >= FEWEST);
        spread = spread.points_as(
            m.program.name,
            known.map(|cell| (percent(cell.place), cell.errors(0).sd())),
            look(i),
        );
        let share = |cell: &Judged| cell.answered() as f64 / cell.trials() as f64;
        answers = answers.points_as(
            m.program.name,
            cells.iter().map(|cell| (percent(cell.place), share(cell))),
            look(i),
        );
    }
    let caption = format!(
        "Left: standard deviation of fx over its bound, against how well the data determine it: a point a program and \
         cell with {FEWEST} answers or more, of {trials} trials ({} of minimal, {} of scipy); noise 0.1 px, seeds of the \
         studies. Grey: where such a ratio of {trials} trials lies if the bound is attained, all together at 1e-4. \
         Right: the share of trials that gave a camera. Notice how far the programs lie apart left \
         of the dashed line and right of it. All met the same noise, and so did the cells of a study, which therefore \
         move together; where some trials are refused the spread is that of the others alone.",
        trials_of("minimal"),
        trials_of("scipy"),
    );
    Figure::panels("spread", &[spread, answers], 2, caption)
}

/// Differences from this library's estimates on the same noise.
pub fn pairs(places: &[Place], measured: &[Measured], rounding: &[f64]) -> Figure {
    let (ours, others) = measured.split_first().expect("the first is this library");
    let panel = |quantity: usize, name: &str| {
        let mut ordered: Vec<&Place> = places.iter().collect();
        ordered.sort_by(|a, b| a.relative.total_cmp(&b.relative));
        let title = format!("{name}: difference from calibench's");
        let predicted = ordered.iter().map(|place| (percent(place), rounding[place.index]));
        let mut plot = beside(Plot::new(title, AXIS, "rms difference / bound")).log_y().line_as(
            "pixels in single precision",
            predicted,
            Look::ink().dash(Dash::Dotted),
        );
        for (i, m) in others.iter().enumerate() {
            let difference = |place: &Place| {
                let differences = m.in_cell(place).differences(&ours.in_cell(place), quantity);
                (percent(place), stats::root_mean_square(differences))
            };
            plot = plot.points_as(m.program.name, places.iter().map(difference), look(i + 1));
        }
        plot
    };
    let determined = || places.iter().filter(|place| place.is_determined());
    let of = |place: &Place, m: &Measured| {
        let found = m.in_cell(place).differences(&ours.in_cell(place), 0);
        stats::largest(found.iter().map(|d| d.abs()))
    };
    let largest = stats::largest(others.iter().flat_map(|m| determined().map(move |place| of(place, m))));
    let caption = format!(
        "Root mean square difference of fx and k2 from this library's estimate in the same trial, over the bound: a point \
         a program and cell, of the trials that both answered. Dotted: what rounding the pixels to single precision \
         moves a parameter by. Notice how small all of it is: left of the dashed line, where the data determine the \
         camera, no fx differs by more than {largest:.1e} of its standard deviation in any trial."
    );
    Figure::panels("pairs", &[panel(0, "fx"), panel(1, "k2")], 2, caption)
}

fn look(program: usize) -> Look {
    Look::series(program).size(4.2 - 0.4 * program as f64)
}

fn trials_of(name: &str) -> u64 {
    PROGRAMS.iter().filter(|program| program.name == name).map(|program| program.trials).sum()
}
