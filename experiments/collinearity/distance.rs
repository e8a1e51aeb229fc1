//! The distance of the target, which two published numbers fix, one of them the mistake of reading pixels as
//! millimetres.

use super::*;

/// Distances of the sweep, mm.
pub const DISTANCES_MM: std::ops::RangeInclusive<u32> = 110..=130;

/// RMS per point of corrected pixel minus target millimetre, both as plain numbers.
pub fn pixels_minus_millimetres(corrected: &[Vec2], points: &[Vec2]) -> f64 {
    rms(&corrected.iter().zip(points).map(|(pixel, point)| pixel - point).collect::<Vec<_>>())
}

/// The chapter's second finding about its interface: a call documented to return world coordinates returns
/// corrected pixels.
pub fn report_units_mistake(
    record: &mut Record,
    exact: &View,
    ours: &Found,
    view: &View,
) -> Result<(), ExperimentError> {
    let truth = Truth::example_camera();
    let mistake = pixels_minus_millimetres(&corrected(&truth, exact.pixels())?, exact.points());
    let band = Band::absolute(ROUNDING_PX, "rounding of coordinates below 640 px over 40 operations");
    let what = "RMS per point of corrected pixel minus target millimetre, true model, no noise";
    let noisy = pixels_minus_millimetres(&ours.corrected, view.points());
    record
        .group("", band)
        .number("units-mistake", mistake, what)
        .rounds_to_printed()
        .band(converged())
        .number("units-mistake-calibrated", noisy, "the same of our noisy single-plane calibration");
    // That it is the geometry and no accuracy is a claim of `interface`.
    Ok(())
}

/// Two published numbers fix the distance that the chapter does not give.
pub fn report_distances(record: &mut Record, draws: &[Draw], book: &Book) -> Result<(), ExperimentError> {
    let truth = Truth::example_camera();
    let mut rows = Vec::new();
    for distance in DISTANCES_MM.map(f64::from) {
        let view = scene(distance)?.exact().remove(0);
        let row = line(&view.pixels()[TOP_ROW])?.max_deviation();
        let mistake = pixels_minus_millimetres(&corrected(&truth, view.pixels())?, view.points());
        rows.push([distance, row, mistake]);
    }
    let columns = [("distance", "mm"), ("top_row_before", "px"), ("units_mistake", "")];
    let caption = "both numbers without noise against the target's distance";
    record.table(Table::of_arrays("distances", caption, columns, &rows));
    let sd = moments(&column(draws, MAIN, 1)).standard_deviation(0);
    let whole: Vec<f64> = rows.iter().filter(|[.., m]| m.round() == 427.0).map(|[z, ..]| *z).collect();
    let sigmas = |z: f64| {
        let row = rows.iter().find(|[at, ..]| *at == z);
        row.map_or(f64::NAN, |[_, d, _]| (d - book[1].value()).abs() / sd)
    };
    record
        .claim_that(
            "distance-is-120-mm",
            "the printed 427 leaves 119, 120 and 121 mm of all whole distances, and the published top row \
             agrees with 120",
        )
        .every(
            "cases",
            [
                (
                    format!("427 at {whole:?} mm"),
                    whole == [DISTANCE_MM - 1.0, DISTANCE_MM, DISTANCE_MM + 1.0],
                ),
                ("top row within 3 standard deviations at 120 mm".to_string(), sigmas(DISTANCE_MM) < 3.0),
            ],
        )
        .because(
            "the 'residual' in pixels minus millimetres falls by 0.4 a millimetre, so its printed digits \
             allow a range of 2.4 mm",
        );
    let band = rows.iter().map(|[z, d, _]| (*z, d - 3.0 * sd, d + 3.0 * sd));
    let size = |plot: Plot| plot.size(440.0, 340.0);
    let panels = [
        size(Plot::new("Top row against the distance", "distance (mm)", "largest deviation (px)"))
            .band("noise, \u{b1}3 sd", band)
            .line("without noise", rows.iter().map(|[z, d, _]| (*z, *d)))
            .hline(format!("published: {} px", book[1].printed), book[1].value()),
        size(Plot::new("Pixels read as millimetres", "distance (mm)", "RMS of pixel minus mm"))
            .line("without noise", rows.iter().map(|[z, _, mistake]| (*z, *mistake)))
            .hline("published: 427", 427.0)
            .vline("120 mm", DISTANCE_MM),
    ];
    let caption = format!(
        "Largest deviation of the target's top row in pixels, and corrected pixels minus target \
         millimetres, against the target's distance, without noise; the band is three standard deviations \
         of {TRIALS} draws at {DISTANCE_MM} mm. Notice that of all whole distances {:.0} to {:.0} mm print \
         427, and that at {DISTANCE_MM} mm the top row is {:.2} standard deviations from its published \
         number.",
        stats::smallest(whole.iter().copied()),
        stats::largest(whole.iter().copied()),
        sigmas(DISTANCE_MM)
    );
    record.figure(Figure::panels("distance", &panels, 2, caption));
    Ok(())
}
