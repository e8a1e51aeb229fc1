//! The tables and figures.

use super::{
    DISTANCES_MM, FAR, FAR_MM, FOUND_MM, GROWTHS, LOSSES, MODELS, Results, STRAYS_MM, TAUGHT_MM, TRIALS,
    draws, predicted, rms, rms_of_loss, stated, told,
};
use calibench_harness::{Figure, Look, Plot, Table};

pub(super) fn tables(results: &Results) -> [Table; 3] {
    let mut by_distance = Table::of(
        "distance",
        "error of the gripping point by its distance from the marks' middle, and what is stated",
        0..DISTANCES_MM.len(),
    )
    .column("distance", "mm", |i| DISTANCES_MM[*i]);
    for (model, (name, of)) in MODELS.iter().enumerate() {
        by_distance = by_distance
            .column(&format!("{name}_rms"), "mm", |i| rms(&results.as_taught, model, *i))
            .column(&format!("{name}_stated"), "mm", |i| stated(&results.as_taught, model, *i))
            .column(&format!("{name}_predicted"), "mm", |i| {
                predicted(*of, DISTANCES_MM[*i], &draws::marks()).trace().sqrt()
            });
    }
    let mut by_growth = Table::of(
        "growth",
        "error 200 mm away with a part that has grown since it was taught",
        0..GROWTHS.len(),
    )
    .column("growth", "", |i| GROWTHS[*i]);
    for (model, (name, _)) in MODELS.iter().enumerate() {
        by_growth = by_growth.column(&format!("{name}_rms"), "mm", |i| rms(&results.grown[*i], model, FAR));
    }
    let by_growth = by_growth.column("rigid_told", "", |i| told(&results.grown[*i]));
    let mut by_stray =
        Table::of("stray", "error 200 mm away with one mark of six astray, rigid map", 0..STRAYS_MM.len())
            .column("stray", "mm", |i| STRAYS_MM[*i]);
    for (loss, (name, _, _)) in LOSSES.iter().enumerate() {
        by_stray = by_stray.column(&format!("{name}_rms"), "mm", |i| rms_of_loss(&results.stray[*i], loss));
    }
    let by_stray = by_stray.column("told", "", |i| told(&results.stray[*i]));
    [by_distance.into(), by_growth.into(), by_stray.into()]
}

pub(super) fn figures(results: &Results, seed: u64) -> [Figure; 2] {
    [distance(results, seed), wrong(results, seed)]
}

/// Error against the distance of the gripping point.
fn distance(results: &Results, seed: u64) -> Figure {
    let mut plot = Plot::new(
        "Error of the gripping point",
        "distance from the marks' middle (mm)",
        "root mean square error (mm)",
    );
    for (model, (name, of)) in MODELS.iter().enumerate() {
        let law = (0..=80).map(|i| {
            let d = 5.0 * f64::from(i);
            (d, predicted(*of, d, &draws::marks()).trace().sqrt())
        });
        let measured = DISTANCES_MM.iter().enumerate().map(|(i, d)| (*d, rms(&results.as_taught, model, i)));
        plot = plot.line_as(format!("{name}: by the marks' geometry"), law, Look::series(model)).points_as(
            format!("{name}: measured"),
            measured,
            Look::series(model),
        );
    }
    let at = |model: usize| rms(&results.as_taught, model, FAR);
    let caption = format!(
        "Root mean square error of the gripping point against its distance from the marks' middle, six marks of a plate of 100 x 60 mm, \
         known to {TAUGHT_MM} mm when taught and to {FOUND_MM} mm when found, {TRIALS} parts, seed {seed}. Notice that {FAR_MM} mm away a similarity errs by \
         {:.1} times and an affine map by {:.1} times what a rigid map does.",
        at(1) / at(0),
        at(2) / at(0)
    );
    Figure::plot("distance", &plot, caption)
}

/// Error with a part that has grown, and with a stray mark.
fn wrong(results: &Results, seed: u64) -> Figure {
    let mut growth =
        Plot::new("A part that has grown", "growth (1e-3)", "root mean square error (mm)").log_y();
    for (model, (name, _)) in MODELS.iter().enumerate() {
        let along = GROWTHS.iter().zip(&results.grown).map(|(g, trials)| (1e3 * g, rms(trials, model, FAR)));
        growth = growth.line_as(*name, along.collect::<Vec<_>>(), Look::series(model));
    }
    let mut stray =
        Plot::new("A stray mark", "distance from its place (mm)", "root mean square error (mm)").log_y();
    for (loss, (_, title, _)) in LOSSES.iter().enumerate() {
        let along = STRAYS_MM.iter().zip(&results.stray).map(|(mm, trials)| (*mm, rms_of_loss(trials, loss)));
        stray = stray.line_as(*title, along.collect::<Vec<_>>(), Look::series(loss));
    }
    let [clean, .., astray] = results.stray.as_slice() else { unreachable!("there are six levels") };
    let caption = format!(
        "Root mean square error {FAR_MM} mm from the marks' middle: left, by three maps, with a part that has grown since it was taught; right, \
         by three losses of a rigid map, with one mark of six astray. {TRIALS} parts a point, seed {seed}. Notice that squares follow the stray mark \
         to {:.2} mm while Cauchy's loss errs by {:.2} mm, {:.1} times what it does without one.",
        rms_of_loss(astray, 0),
        rms_of_loss(astray, 2),
        rms_of_loss(astray, 2) / rms_of_loss(clean, 2)
    );
    Figure::panels("wrong", &[growth, stray], 2, caption)
}
