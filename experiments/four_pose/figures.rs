//! The figures of the four-pose experiment.

use super::weak::Grid;
use super::*;
use calibench_harness::stats::{self, normal_quantile};

const POSE_NAMES: [&str; 4] = [
    "facing the camera",
    "turned +20\u{b0} about X",
    "turned \u{2212}20\u{b0} about Y",
    "turned (\u{2212}15\u{b0}, 15\u{b0}, 10\u{b0})",
];
/// Length of the arrow that states the scale of residuals, px.
const REFERENCE_PX: f64 = 0.2;

/// The image's border: pixel (0, 0) is the centre of the first pixel.
fn border((width, height): (usize, usize)) -> [(f64, f64); 5] {
    let (right, bottom) = (width as f64 - 0.5, height as f64 - 0.5);
    [(-0.5, -0.5), (right, -0.5), (right, bottom), (-0.5, bottom), (-0.5, -0.5)]
}

pub fn views(draw: &Draw) -> Figure {
    let truth = &draw.scene.truth;
    let camera = &truth.camera;
    let panels: Vec<Plot> = draw
        .views
        .iter()
        .zip(POSE_NAMES)
        .map(|(view, name)| {
            let seen: Vec<(f64, f64)> = view.pixels().iter().map(|p| (p.x, p.y)).collect();
            Plot::new(name, "u (px)", "v (px)")
                .size(420.0, 370.0)
                .equal_aspect()
                .y_down()
                .line_as("image border", &border(truth.image_size), Look::ink().dash(Dash::Dotted))
                .points_as("points as seen", &seen, Look::series(0).size(2.2))
                .points_as("principal point", &[(camera.cx, camera.cy)], Look::ink())
        })
        .collect();
    let corners = &border(truth.image_size)[1..];
    let to_corner =
        |p: &Vec2| corners.iter().map(|&(u, v)| (p - Vec2::new(u, v)).norm()).fold(f64::INFINITY, f64::min);
    let nearest = stats::smallest(draw.views.iter().flat_map(|view| view.pixels().iter().map(to_corner)));
    let caption = format!(
        "The target's {} points in the {} views of the virtual camera, {} mm away, with {SIGMA_PX} px of \
         noise (seed {}), in pixels. Notice that no point comes nearer to a corner of the image, where the \
         distortion is largest, than {nearest:.0} px.",
        truth.points.len(),
        draw.views.len(),
        truth.cam_from_target[0].translation.z,
        draw.seed
    );
    Figure::panels("views", &panels, 2, caption)
}

pub fn residuals(draw: &Draw) -> Figure {
    let panels: Vec<Plot> = draw
        .views
        .iter()
        .zip(&draw.calibration.residuals)
        .zip(POSE_NAMES)
        .map(|((view, residuals), name)| {
            let arrows: Vec<_> = view
                .pixels()
                .iter()
                .zip(residuals)
                .map(|(p, r)| (p.x, p.y, ARROW_SCALE * r.x, ARROW_SCALE * r.y))
                .collect();
            let reference = (90.0, 462.0, ARROW_SCALE * REFERENCE_PX, 0.0);
            Plot::new(name, "u (px)", "v (px)")
                .size(420.0, 400.0)
                .equal_aspect()
                .x_range(70.0, 590.0)
                .y_range(10.0, 475.0)
                .y_down()
                .arrows(format!("predicted \u{2212} observed, \u{d7} {ARROW_SCALE}"), &arrows)
                .arrows(format!("this long: {REFERENCE_PX} px"), &[reference])
        })
        .collect();
    let caption = format!(
        "Residuals (predicted minus observed) of the calibrated camera in the four views, drawn \
         {ARROW_SCALE} times longer than they are; the arrow at the lower left is {REFERENCE_PX} px long. \
         Seed {}, noise {SIGMA_PX} px. Notice that they have no pattern: what is left is noise.",
        draw.seed
    );
    Figure::panels("residuals", &panels, 2, caption)
}

fn normal_density(z: f64) -> f64 {
    libm::exp(-0.5 * z * z) / std::f64::consts::TAU.sqrt()
}

/// `count + 1` even steps between two ends.
fn steps(low: f64, high: f64, count: u32) -> impl Iterator<Item = f64> {
    (0..=count).map(move |i| low + (high - low) * f64::from(i) / f64::from(count))
}

pub fn residual_distribution(draw: &Draw) -> Figure {
    const BINS: usize = 32;
    let range = (-4.0, 4.0);
    let bars = density(&draw.standardised, range, BINS);
    let curve: Vec<_> = steps(range.0, range.1, 200).map(|z| (z, normal_density(z))).collect();
    // Counts of a bin scatter by the root of their expectation (binomial).
    let n = draw.standardised.len() as f64;
    let expected: Vec<_> = bars
        .iter()
        .map(|&(left, right, _)| {
            let share = normal_cdf(right) - normal_cdf(left);
            let (mean, sd) = (share / (right - left), (share * (1.0 - share) / n).sqrt() / (right - left));
            (0.5 * (left + right), (mean - 2.0 * sd).max(0.0), mean + 2.0 * sd)
        })
        .collect();
    let plot = Plot::new(
        "Residuals against the noise model",
        "residual over its predicted standard deviation",
        "density",
    )
    .x_range(range.0, range.1)
    .histogram(format!("{} residual coordinates", draw.standardised.len()), &bars)
    .error_bars_as("expected, two standard deviations of a bin", &expected, Look::ink())
    .line_as("standard normal", &curve, Look::series(1).dash(Dash::Solid).width(2.0));
    let caption = format!(
        "Every residual coordinate of the calibrated camera over its own predicted standard deviation, \
         {SIGMA_PX} px times sqrt(1 - leverage), with the standard normal density (seed {}). Notice that \
         the noise model is met once the leverage, {} in {} on average, is allowed for.",
        draw.seed,
        draw.rmse.parameters,
        draw.standardised.len()
    );
    Figure::plot("residual-distribution", &plot, caption)
}

pub fn ellipse(draw: &Draw, book: &Book, trials: &Outcome) -> Figure {
    let (i, j) = (position(Parameter::K1), position(Parameter::K2));
    let covariance = nalgebra::Matrix2::from_fn(|r, c| draw.bound.intrinsics[([i, j][r], [i, j][c])]);
    let lens = &draw.scene.truth.camera.distortion;
    let truth = Vec2::new(lens.k1, lens.k2);
    let cloud: Vec<_> =
        trials.estimates.iter().take(CLOUD).map(|e| (truth.x + e.errors[i], truth.y + e.errors[j])).collect();
    let of = |camera: &Camera| [(camera.distortion.k1, camera.distortion.k2)];
    let faint = Look::series(4).marker(Marker::Dot);
    let plot = Plot::new("Errors of k1 and k2", "k1", "k2").size(560.0, 470.0).cloud(
        format!("first {CLOUD} trials"),
        &cloud,
        faint,
    );
    let regions =
        [("68 %", 0.68, Dash::Solid), ("95 %", 0.95, Dash::Dashed), ("99.7 %", 0.997, Dash::Dotted)];
    let plot = regions.iter().fold(plot, |plot, &(name, p, dash)| {
        plot.ellipse_as(
            format!("predicted, {name}"),
            truth,
            &covariance,
            (-2.0 * libm::log(1.0 - p)).sqrt(),
            Look::ink().dash(dash).width(1.6),
        )
    });
    let plot = plot
        .points_as("truth", &[(truth.x, truth.y)], Look::ink().size(7.0))
        .points_as("ours", &of(&draw.calibration.camera), Look::series(0).marker(Marker::Square).size(5.0))
        .points_as("book", &of(&book.camera), Look::series(1).marker(Marker::Diamond).size(5.0));
    let caption = format!(
        "k1 and k2 of our draw (seed {}), of the book's and of {CLOUD} trials, about the truth, with the \
         regions that the Cramer-Rao bound predicts to hold 68, 95 and 99.7 % of draws. Notice that an \
         error of one is made up by the other.",
        draw.seed
    );
    Figure::plot("k1-k2", &plot, caption)
}

pub fn rmse(draw: &Draw, book: &Book, trials: &Outcome) -> Figure {
    let predicted = &draw.rmse;
    let (mean, sd) = (predicted.mean_px(), predicted.standard_deviation_px());
    let range = (mean - 4.0 * sd, mean + 4.0 * sd);
    let values: Vec<f64> = trials.estimates.iter().map(|e| e.rmse_px).collect();
    let half = 0.02 * sd;
    let slope = |x: f64| (predicted.cdf(x + half) - predicted.cdf(x - half)) / (2.0 * half);
    let curve: Vec<_> = steps(range.0, range.1, 160).map(|x| (x, slope(x))).collect();
    let plot = Plot::new("Reprojection error over many draws", "RMSE (px)", "density (1/px)")
        .size(600.0, 420.0)
        .x_range(range.0, range.1)
        .histogram(format!("{TRIALS} trials"), &density(&values, range, 40))
        .line_as("predicted", &curve, Look::series(1).dash(Dash::Solid).width(2.0))
        .vline_as(
            format!("book {} px", book.rmse_px),
            book.rmse_px,
            Look::series(2).dash(Dash::Dashed).width(2.0),
        )
        .vline_as(
            format!("ours {:.4} px", draw.calibration.rmse_px),
            draw.calibration.rmse_px,
            Look::series(3).dash(Dash::DashDot).width(2.0),
        )
        .vline_as(
            format!("noise floor {:.4} px", predicted.noise_floor_px()),
            predicted.noise_floor_px(),
            Look::ink().dash(Dash::Dotted).width(2.0),
        );
    let caption = format!(
        "RMSE of {TRIALS} calibrations of the four views with fresh noise of {SIGMA_PX} px (seed {}), in \
         pixels, and the predicted density: chi with {} degrees of freedom. Notice that it lies just under \
         the noise floor, as {} parameters absorb noise.",
        draw.seed,
        predicted.degrees_of_freedom(),
        predicted.parameters
    );
    Figure::plot("rmse", &plot, caption)
}

pub fn blind(draw: &Draw, trials: &Outcome) -> Figure {
    let (k2, sd) = (position(Parameter::K2), draw.sd(Parameter::K2));
    let shown = || trials.estimates.iter().take(CLOUD);
    let cloud: Vec<_> = shown().map(|e| (e.errors[k2].abs() / sd, e.rmse_px)).collect();
    let plot = Plot::new(
        "The reprojection error does not notice",
        "|error of k2| (predicted standard deviations)",
        "RMSE (px)",
    )
    .cloud(format!("first {CLOUD} trials"), &cloud, Look::series(0))
    .hline_as("expected RMSE", draw.rmse.mean_px(), Look::series(1).dash(Dash::Solid))
    .hline_as("noise floor", draw.rmse.noise_floor_px(), Look::ink().dash(Dash::Dotted).width(2.0))
    .x_range(0.0, normal_quantile(0.9999));
    let caption = format!(
        "RMSE against the size of the error of k2 (one standard deviation is {sd:.4}) in {CLOUD} trials \
         (seed {}). Notice that a calibration with a large error of k2 reprojects as well as one without.",
        draw.seed
    );
    Figure::plot("rmse-and-k2", &plot, caption)
}

pub fn overfitting(grids: &[Grid]) -> Figure {
    let over = |f: &dyn Fn(&Grid) -> f64| -> Vec<(f64, f64)> {
        grids.iter().map(|g| (g.points_per_view as f64, f(g))).collect()
    };
    let k2 = position(Parameter::K2);
    let floor = |g: &Grid| g.rmse.noise_floor_px();
    let intervals: Vec<_> = grids
        .iter()
        .map(|g| {
            let mean = g.trials.mean(|e| e.rmse_px);
            let around = Interval::of_mean(mean, g.rmse.standard_deviation_px(), g.trials.converged(), 0.05);
            (g.points_per_view as f64, around.low, around.high)
        })
        .collect();
    let spreads: Vec<_> = grids
        .iter()
        .map(|g| {
            let sd = g.trials.errors().standard_deviation(k2);
            let ratio = Interval::of_deviation_ratio(g.trials.converged(), 0.05);
            (g.points_per_view as f64, sd / ratio.high, sd / ratio.low)
        })
        .collect();
    let (theory, sampled) = (Look::series(1).dash(Dash::Solid), Look::series(0));
    let rmse = Plot::new("RMSE with fewer points", "points a view", "RMSE (px)")
        .size(430.0, 380.0)
        .line_as("predicted", &over(&|g| g.rmse.mean_px()), theory)
        .points_as(
            format!("mean of {GRID_TRIALS} trials, 95 %"),
            &over(&|g| g.trials.mean(|e| e.rmse_px)),
            sampled,
        )
        .error_bars_as("", &intervals, sampled)
        .line_as("noise floor", &over(&floor), Look::ink().dash(Dash::Dotted).width(2.0))
        .log_x();
    let k2 = Plot::new("k2 with fewer points", "points a view", "standard deviation of k2")
        .size(430.0, 380.0)
        .line_as("Cramer-Rao bound", &over(&|g| g.k2_sd), theory)
        .points_as(
            format!("{GRID_TRIALS} trials, 95 %"),
            &over(&|g| g.trials.errors().standard_deviation(k2)),
            sampled,
        )
        .error_bars_as("", &spreads, sampled)
        .log_x()
        .log_y()
        .y_range(0.01, 0.1);
    let grid_name = |(columns, rows): (usize, usize)| format!("{columns} x {rows}");
    let (few, all) = (&grids[0], &grids[grids.len() - 1]);
    let caption = format!(
        "The four views with fewer points on the same 80 x 60 mm ({} to {}), {GRID_TRIALS} trials each: \
         RMSE in pixels and spread of k2, with 95 % intervals and predictions. Notice that with {} points a \
         view the RMSE falls to {:.2} of the floor, while the bound of k2 is {:.1} times that with {}: the \
         RMSE is low because the parameters fit the noise.",
        grid_name(GRIDS[0]),
        grid_name(GRIDS[GRIDS.len() - 1]),
        few.points_per_view,
        few.trials.mean(|e| e.rmse_px) / few.rmse.noise_floor_px(),
        few.k2_sd / all.k2_sd,
        all.points_per_view
    );
    Figure::panels("few-points", &[rmse, k2], 2, caption)
}
