//! The table and figures.

use super::trial::{Cell, OFF_CENTRE, REFINED, Several, TSAI};
use super::{SIGMA_PX, TILT_DEG, TRIALS};
use calibench_harness::{Figure, Look, Plot, Table};

pub(super) fn tilt_table(tilts: &[Cell]) -> Table {
    Table::of(
        "tilt",
        "One view: what is answered, bound and RMS errors of f, and what a wrong principal point does",
        tilts,
    )
    .column("tilt", "deg", |cell| cell.tilt_deg)
    .column("answered", "", |cell| cell.answered())
    .column("bound_fx", "px", |cell| cell.bound_of(0))
    .column("refined_fx", "px", |cell| cell.rms(REFINED, 0))
    .column("tsai_fx", "px", |cell| cell.rms(TSAI, 0))
    .column("bias_off_centre", "px", |cell| cell.bias(OFF_CENTRE, 0))
    .column("coverage_off_centre", "", |cell| cell.coverage(OFF_CENTRE))
    .into()
}

pub(super) fn tilt_figure(tilts: &[Cell], seed: u64) -> Figure {
    let answered = || tilts.iter().filter(|cell| cell.is_answered_always());
    let panel = |title: &str, unit: &str, k: usize| {
        let tilted = tilts.iter().filter(|cell| cell.bound.is_some() && cell.tilt_deg > 0.0);
        Plot::new(title, "tilt (deg)", unit)
            .line_as(
                "Cram\u{e9}r-Rao bound",
                tilted.map(|cell| (cell.tilt_deg, cell.bound_of(k))),
                Look::ink(),
            )
            .points_as(
                "refined",
                answered().map(|cell| (cell.tilt_deg, cell.rms(REFINED, k))),
                Look::series(0),
            )
            .points_as(
                "Tsai's own answer",
                answered().map(|cell| (cell.tilt_deg, cell.rms(TSAI, k))),
                Look::series(1),
            )
            .points_as(
                "refined, principal point 7 px off",
                answered().map(|cell| (cell.tilt_deg, cell.rms(OFF_CENTRE, k))),
                Look::series(2),
            )
            .log_x()
            .log_y()
    };
    let panels = [
        panel("Focal length", "RMS error (px)", 0),
        panel("Distance", "RMS error (mm)", 1),
        panel("k1", "RMS error", 2),
    ];
    let caption = format!(
        "RMS error of one view against its tilt, {TRIALS} photographs a point where all are answered, noise {SIGMA_PX} px, seed {seed}. Notice how far \
         refinement stays from the bound, and what more tilt is worth with a wrong principal point."
    );
    Figure::panels("tilt", &panels, 3, caption)
}

pub(super) fn noise_figure(noises: &[Cell], seed: u64) -> Figure {
    let answered = || noises.iter().filter(|cell| cell.is_answered_always());
    let plot =
        Plot::new("One view, tilted by 30 degrees", "noise of a coordinate (px)", "RMS error of f (px)")
            .line_as(
                "Cram\u{e9}r-Rao bound",
                noises.iter().map(|cell| (cell.sigma_px, cell.bound_of(0))),
                Look::ink(),
            )
            .points_as(
                "refined",
                answered().map(|cell| (cell.sigma_px, cell.rms(REFINED, 0))),
                Look::series(0),
            )
            .points_as(
                "Tsai's own answer",
                answered().map(|cell| (cell.sigma_px, cell.rms(TSAI, 0))),
                Look::series(1),
            )
            .points_as(
                "refined, principal point 7 px off",
                answered().map(|cell| (cell.sigma_px, cell.rms(OFF_CENTRE, 0))),
                Look::series(2),
            )
            .log_x()
            .log_y();
    let caption = format!(
        "RMS error of f against the noise, {TRIALS} photographs a point, seed {seed}. With the principal point wrong, better marks stop helping: notice the floor."
    );
    Figure::plot("noise", &plot, caption)
}

pub(super) fn views_figure(several: &[Several], tilts: &[Cell], seed: u64) -> Figure {
    let mut plot = Plot::new("Views with a free principal point", "number of views", "RMS error of f (px)")
        .line_as("Cram\u{e9}r-Rao bound", several.iter().map(|s| (s.views as f64, s.bound_fx)), Look::ink())
        .points_as("principal point free", several.iter().map(|s| (s.views as f64, s.rms())), Look::series(0))
        .log_x()
        .log_y();
    if let Some(one) = tilts.iter().find(|cell| cell.tilt_deg == TILT_DEG) {
        plot = plot
            .hline_as("one view, principal point right", one.rms(REFINED, 0), Look::series(1))
            .hline_as("one view, principal point 7 px off", one.rms(OFF_CENTRE, 0), Look::series(2));
    }
    let caption = format!(
        "RMS error of f against the number of views, all tilted by {TILT_DEG} degrees about different axes, {TRIALS} sets a point, noise {SIGMA_PX} px, seed {seed}. \
         Notice where the points cross the two lines of one view."
    );
    Figure::plot("views", &plot, caption)
}
