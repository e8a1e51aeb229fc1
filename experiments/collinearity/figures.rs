//! The figures of the points: the top row, the predicted distributions, the residuals.

use super::*;

pub fn row_figure(ours: &Found, exact: &Found, book: &Book, seed: u64) -> Figure {
    let panel = |title: &str, fits: [&LineFit; 2], published: &Entry| {
        let along =
            |fit: &LineFit| TOP_ROW.zip(fit.deviations.clone()).map(|(i, d)| (10.0 * (i as f64 - 4.0), d));
        Plot::new(title, "X on the target (mm)", "deviation (px), down positive")
            .size(440.0, 360.0)
            .y_down()
            .line("without noise", along(fits[0]))
            .points_as("our draw", along(fits[1]), Look::series(1))
            .hline(format!("\u{b1}{} px, as published", published.printed), published.value())
            .hline("", -published.value())
    };
    let panels = [
        panel("Top row, as photographed", [&exact.row_before, &ours.row_before], book[1]),
        panel("Top row, corrected", [&exact.row_after, &ours.row_after], book[2]),
    ];
    let caption = format!(
        "Signed distance of the nine points of the target's top row from their regression line, in pixels, \
         before and after correction by the single-plane calibration (seed {seed}, sigma {SIGMA_PX} px, \
         centre free). Notice the two scales: our draw reaches {:.3} px before and {:.3} px after.",
        ours.row_before.max_deviation(),
        ours.row_after.max_deviation()
    );
    Figure::panels("top-row", &panels, 2, caption)
}

/// Title and axis of each of [`QUANTITIES`].
const QUANTITY_NAMES: [[&str; 2]; 5] = [
    ["Single-plane calibration", "RMS residual"],
    ["Top row as photographed", "largest deviation"],
    ["Top row corrected", "largest deviation"],
    ["Affine fit", "RMS residual"],
    ["Affine fit", "largest residual"],
];

pub fn predicted_figure(ours: &[Found], draws: &[Draw], book: &Book, seed: u64) -> Figure {
    let drawn = ours[MAIN].quantities();
    let panels: Vec<Plot> = QUANTITIES
        .iter()
        .enumerate()
        .map(|(q, (_, unit, _))| {
            let free = column(draws, MAIN, q);
            let range = (0..CENTRES.len()).fold((f64::INFINITY, 0.0f64), |(low, high), centre| {
                let spread = moments(&column(draws, centre, q));
                let reach = 4.5 * spread.standard_deviation(0);
                (low.min((spread.mean(0) - reach).max(0.0)), high.max(spread.mean(0) + reach))
            });
            let outline = |centre: usize| {
                let bins = density(&column(draws, centre, q), range, 60);
                bins.into_iter().map(|(left, right, height)| (0.5 * (left + right), height))
            };
            let [title, axis] = QUANTITY_NAMES[q];
            Plot::new(title, format!("{axis} ({unit})"), format!("density (1/{unit})"))
                .size(400.0, 330.0)
                .histogram("centre free", density(&free, range, 60))
                .line("held at truth", outline(1))
                .line("held at image centre", outline(0))
                .line("the same, p1, p2 free", outline(3))
                .vline_as("our draw", drawn[q], Look::series(3))
                .vline("published", book[q].value())
        })
        .collect();
    let caption = format!(
        "Predicted distributions of the five published quantities over {TRIALS} draws of the noise (seed \
         {seed}, sigma {SIGMA_PX} px), for four treatments of the lens. Shares of the draws whose affine \
         residual is below the published one: centre held at the image's {:.1} %, the same with p1, p2 free \
         {:.1} %, held at truth {:.1} %, free {:.1} %.",
        percent_below(&column(draws, 0, 3), book[3].value()),
        percent_below(&column(draws, 3, 3), book[3].value()),
        percent_below(&column(draws, 1, 3), book[3].value()),
        percent_below(&column(draws, MAIN, 3), book[3].value())
    );
    Figure::panels("predicted", &panels, 3, caption)
}

pub fn residual_figure(view: &View, found: &Found, seed: u64) -> Figure {
    // The arrow that shows the scale stands below the points, at the left.
    let panel = |plot: Plot,
                 label: &str,
                 at: &[Vec2],
                 residuals: &[Vec2],
                 scale: f64,
                 (length, unit): (f64, &str)| {
        let arrows = at.iter().zip(residuals).map(|(p, r)| (p.x, p.y, scale * r.x, scale * r.y));
        let left = stats::smallest(at.iter().map(|p| p.x));
        let (top, bottom) = (stats::smallest(at.iter().map(|p| p.y)), stats::largest(at.iter().map(|p| p.y)));
        let reference = (left, bottom + 0.17 * (bottom - top), scale * length, 0.0);
        plot.size(460.0, 400.0)
            .equal_aspect()
            .y_down()
            .arrows(format!("{label}, \u{d7} {scale}"), arrows)
            .arrows(format!("this long: {length} {unit}"), [reference])
    };
    let plane = Plot::new("Single-plane calibration", "u (px)", "v (px)");
    let affine = Plot::new("Affine fit to the target", "X (mm)", "Y (mm)");
    let panels = [
        panel(plane, "predicted minus seen", view.pixels(), &found.plane.residuals_px, 150.0, (0.2, "px")),
        panel(affine, "fitted minus target", view.points(), &found.affine_residuals, 100.0, (0.05, "mm")),
    ];
    let caption = format!(
        "Residuals of the {} points of our draw (seed {seed}, sigma {SIGMA_PX} px, centre free): of the \
         calibration in pixels, and of the affine fit of corrected points in millimetres. Look for a \
         pattern: noise has none. Their RMS is {:.3} px and {:.4} mm.",
        view.len(),
        rms(&found.plane.residuals_px),
        rms(&found.affine_residuals)
    );
    Figure::panels("residuals", &panels, 2, caption)
}
