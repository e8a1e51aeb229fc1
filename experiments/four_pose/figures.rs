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
            let seen = view.pixels().iter().map(|p| (p.x, p.y));
            Plot::new(name, "u (px)", "v (px)")
                .size(420.0, 370.0)
                .equal_aspect()
                .y_down()
                .line_as("image border", border(truth.image_size), Look::ink().dash(Dash::Dotted))
                .points_as("points as seen", seen, Look::series(0).size(2.2))
                .points_as("principal point", [(camera.cx, camera.cy)], Look::ink())
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

/// Camera and target in space, from above and from the side: the optical axis runs to the right.
pub fn space(draw: &Draw) -> Figure {
    const REACH_MM: f64 = 170.0;
    let truth = &draw.scene.truth;
    let (width, height) = Truth::EXAMPLE_IMAGE;
    let rays = |low: f64, high: f64| [(REACH_MM, REACH_MM * low), (0.0, 0.0), (REACH_MM, REACH_MM * high)];
    let panel = |title: &str, label: &str, axis: usize, (first, last): (f64, f64)| {
        let camera = &truth.camera;
        let normalised =
            |pixel: f64| [(pixel - camera.cx) / camera.fx, (pixel - camera.cy) / camera.fy][axis];
        let plot = Plot::new(title, "Z, along the optical axis (mm)", label)
            .size(440.0, 380.0)
            .equal_aspect()
            .y_down()
            .x_range(-10.0, REACH_MM)
            .y_range(-85.0, 85.0)
            .line_as(
                "what the image shows",
                rays(normalised(first), normalised(last)),
                Look::ink().dash(Dash::Dotted),
            )
            .points_as("camera", [(0.0, 0.0)], Look::ink().marker(Marker::Square));
        truth.cam_from_target.iter().zip(POSE_NAMES).enumerate().fold(plot, |plot, (i, (pose, name))| {
            let outline = CORNERS_MM.map(|[x, y]| pose.apply(&Vec3::new(x, y, 0.0))).map(|p| (p.z, p[axis]));
            plot.line_as(name, outline, Look::series(i))
        })
    };
    let panels = [
        panel("From above", "X, to the right (mm)", 0, (-0.5, width as f64 - 0.5)),
        panel("From the side", "Y, down (mm)", 1, (-0.5, height as f64 - 0.5)),
    ];
    let caption = format!(
        "The virtual camera and the outlines of its target in the four poses, all {} mm away, without the lens's bending. Notice that \
         a facing target is a line here, at one depth, and that tilt brings other depths.",
        truth.cam_from_target[0].translation.z
    );
    Figure::panels("space", &panels, 2, caption)
}

/// The target's outermost points, once around.
const CORNERS_MM: [[f64; 2]; 5] =
    [[-40.0, -30.0], [40.0, -30.0], [40.0, 30.0], [-40.0, 30.0], [-40.0, -30.0]];

pub fn residuals(draw: &Draw) -> Result<Figure, ExperimentError> {
    let others = neighbours_in_other_draws(draw)?;
    let panels: Vec<Plot> = draw
        .views
        .iter()
        .zip(&draw.calibration.residuals)
        .zip(POSE_NAMES)
        .map(|((view, residuals), name)| {
            let arrow = |(p, r): (&Vec2, &Vec2)| (p.x, p.y, ARROW_SCALE * r.x, ARROW_SCALE * r.y);
            let arrows = view.pixels().iter().zip(residuals).map(arrow);
            let reference = (90.0, 462.0, ARROW_SCALE * REFERENCE_PX, 0.0);
            Plot::new(name, "u (px)", "v (px)")
                .size(420.0, 400.0)
                .equal_aspect()
                .x_range(70.0, 590.0)
                .y_range(10.0, 475.0)
                .y_down()
                .arrows(format!("predicted \u{2212} observed, \u{d7} {ARROW_SCALE}"), arrows)
                .arrows(format!("this long: {REFERENCE_PX} px"), [reference])
        })
        .collect();
    let caption = format!(
        "Residuals (predicted minus observed) of the calibrated camera in the four views, drawn \
         {ARROW_SCALE} times longer than they are; the arrow at the lower left is {REFERENCE_PX} px long. \
         Seed {}, noise {SIGMA_PX} px. Notice how little neighbours agree: the residuals of points side by \
         side correlate by {:.2}, where {PATTERN_TRIALS} other draws make {:.2} \u{b1} {:.2}.",
        draw.seed,
        neighbours_agree(&draw.scene.truth.points, &draw.calibration),
        others.mean(0),
        others.standard_deviation(0)
    );
    Ok(Figure::panels("residuals", &panels, 2, caption))
}

/// Correlation of residuals of points that are side by side on the target, along its rows and its columns.
fn neighbours_agree(points: &[Vec2], calibration: &Calibration) -> f64 {
    let spacing = (points[1] - points[0]).norm();
    let pairs = (0..points.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let beside = pairs.filter(|&(i, j)| (points[i] - points[j]).norm() < 1.1 * spacing);
    stats::correlation_about_zero(beside.flat_map(|(i, j)| {
        calibration.residuals.iter().flat_map(move |r| [(r[i].x, r[j].x), (r[i].y, r[j].y)])
    }))
}

/// The same of other draws of the noise: the fit takes up what neighbours have in common, so zero is not to
/// be expected.
fn neighbours_in_other_draws(draw: &Draw) -> Result<Sample, ExperimentError> {
    let mut sample = Sample::about(&[0.0]);
    for trial in 0..PATTERN_TRIALS as u64 {
        let key = StreamKey { seed: draw.seed, scenario: "four-pose/neighbours", trial, purpose: "noise" };
        let views = draw.scene.observe(SIGMA_PX, &mut Stream::open(key));
        let calibration =
            calibrate(&views, &Settings::standard()).map_err(ExperimentError::at("calibration"))?;
        sample.add(&[neighbours_agree(&draw.scene.truth.points, &calibration)]);
    }
    Ok(sample)
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
    let curve = steps(range.0, range.1, 200).map(|z| (z, normal_density(z)));
    // Counts of a bin scatter by the root of their expectation (binomial).
    let n = draw.standardised.len() as f64;
    let expected = bars.iter().map(|&(left, right, _)| {
        let share = normal_cdf(right) - normal_cdf(left);
        let (mean, sd) = (share / (right - left), (share * (1.0 - share) / n).sqrt() / (right - left));
        (0.5 * (left + right), (mean - 2.0 * sd).max(0.0), mean + 2.0 * sd)
    });
    let plot = Plot::new(
        "Residuals against the noise model",
        "residual over its predicted standard deviation",
        "density",
    )
    .x_range(range.0, range.1)
    .histogram(format!("{} residual coordinates", draw.standardised.len()), &bars)
    .error_bars_as("expected, two standard deviations of a bin", expected, Look::ink())
    .line_as("standard normal", curve, Look::series(1).dash(Dash::Solid).width(2.0));
    let caption = format!(
        "Every residual coordinate of the calibrated camera over its own predicted standard deviation, \
         {SIGMA_PX} px times sqrt(1 - leverage), with the standard normal density (seed {}). Notice that \
         once the leverage, {} in {} on average, is allowed for, their root mean square is {:.3}.",
        draw.seed,
        draw.rmse.parameters,
        draw.standardised.len(),
        stats::root_mean_square(draw.standardised.iter().copied())
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
    // Of a Gaussian in the plane a share p lies within the radius sqrt(-2 ln(1 - p)), in standard deviations.
    let radius = |p: f64| (-2.0 * libm::log(1.0 - p)).sqrt();
    let plot = regions.iter().fold(plot, |plot, &(name, p, dash)| {
        plot.ellipse_as(
            format!("predicted, {name}"),
            truth,
            &covariance,
            radius(p),
            Look::ink().dash(dash).width(1.6),
        )
    });
    let plot = plot
        .points_as("truth", [(truth.x, truth.y)], Look::ink().size(7.0))
        .points_as("ours", of(&draw.calibration.camera), Look::series(0).marker(Marker::Square).size(5.0))
        .points_as("book", of(&book.camera), Look::series(1).marker(Marker::Diamond).size(5.0));
    let whitened = nalgebra::Cholesky::new(covariance).map(|c| c.l());
    let distance = |&(k1, k2): &(f64, f64)| {
        let error = Vec2::new(k1, k2) - truth;
        let solved = whitened.and_then(|l| l.solve_lower_triangular(&error));
        solved.map_or(f64::NAN, |white| white.norm())
    };
    let held = regions.map(|(_, p, _)| 100.0 * stats::share(&cloud, |trial| distance(trial) <= radius(p)));
    let caption = format!(
        "k1 and k2 of our draw (seed {}), of the book's and of {CLOUD} trials, about the truth, with the \
         regions that the Cramer-Rao bound predicts to hold 68, 95 and 99.7 % of draws; they hold {:.0}, \
         {:.0} and {:.1} % of these trials. Notice that an error of one is made up by the other: over all \
         {TRIALS} trials they correlate by {:.3}, in the bound by {:.3}.",
        draw.seed,
        held[0],
        held[1],
        held[2],
        trials.errors().correlation(i, j),
        draw.bound.correlation(Parameter::K1, Parameter::K2).unwrap_or(f64::NAN)
    );
    Figure::plot("k1-k2", &plot, caption)
}

pub fn rmse(draw: &Draw, book: &Book, trials: &Outcome) -> Figure {
    let predicted = &draw.rmse;
    let (mean, sd) = (predicted.mean_px(), predicted.standard_deviation_px());
    let range = (mean - 4.0 * sd, mean + 4.0 * sd);
    let values: Vec<f64> = trials.estimates.iter().map(|e| e.rmse_px).collect();
    let half = 0.02 * sd;
    let under_floor = |rmse_px: f64| 100.0 * (1.0 - rmse_px / predicted.noise_floor_px());
    let slope = |x: f64| (predicted.cdf(x + half) - predicted.cdf(x - half)) / (2.0 * half);
    let curve = steps(range.0, range.1, 160).map(|x| (x, slope(x)));
    let plot = Plot::new("Reprojection error over many draws", "RMSE (px)", "density (1/px)")
        .size(600.0, 420.0)
        .x_range(range.0, range.1)
        .histogram(format!("{TRIALS} trials"), density(&values, range, 40))
        .line_as("predicted", curve, Look::series(1).dash(Dash::Solid).width(2.0))
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
         pixels, and the predicted density: chi with {} degrees of freedom. Notice that, as {} parameters \
         absorb noise, the mean lies {:.1} % under the noise floor, where {:.1} % are predicted.",
        draw.seed,
        predicted.degrees_of_freedom(),
        predicted.parameters,
        under_floor(stats::mean(&values)),
        under_floor(mean)
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
    let mean_rmse = |chosen: &dyn Fn(f64) -> bool| {
        let rmse: Vec<f64> =
            cloud.iter().filter(|(error, _)| chosen(*error)).map(|(_, rmse)| *rmse).collect();
        stats::mean(&rmse)
    };
    let caption = format!(
        "RMSE against the size of the error of k2 (one standard deviation is {sd:.4}) in {CLOUD} trials \
         (seed {}). Notice that the trials whose k2 is off by more than one standard deviation have a mean \
         RMSE of {:.4} px, the others {:.4} px.",
        draw.seed,
        mean_rmse(&|error| error > 1.0),
        mean_rmse(&|error| error <= 1.0)
    );
    Figure::plot("rmse-and-k2", &plot, caption)
}

pub fn overfitting(grids: &[Grid]) -> Figure {
    let over = |f: fn(&Grid) -> f64| grids.iter().map(move |g| (g.points_per_view as f64, f(g)));
    let intervals = grids.iter().map(|g| {
        let sd = g.rmse.standard_deviation_px();
        let around = Interval::of_mean(g.mean_rmse_px(), sd, g.trials.converged(), 0.05);
        (g.points_per_view as f64, around.low, around.high)
    });
    let spreads = grids.iter().map(|g| {
        let ratio = Interval::of_deviation_ratio(g.trials.converged(), 0.05);
        (g.points_per_view as f64, g.sampled_k2_sd() / ratio.high, g.sampled_k2_sd() / ratio.low)
    });
    let (theory, sampled) = (Look::series(1).dash(Dash::Solid), Look::series(0));
    let rmse = Plot::new("RMSE with fewer points", "points a view", "RMSE (px)")
        .size(430.0, 380.0)
        .line_as("predicted", over(|g| g.rmse.mean_px()), theory)
        .points_as(format!("mean of {GRID_TRIALS} trials, 95 %"), over(Grid::mean_rmse_px), sampled)
        .error_bars_as("", intervals, sampled)
        .line_as("noise floor", over(|g| g.rmse.noise_floor_px()), Look::ink().dash(Dash::Dotted).width(2.0))
        .log_x();
    let k2 = Plot::new("k2 with fewer points", "points a view", "standard deviation of k2")
        .size(430.0, 380.0)
        .line_as("Cramer-Rao bound", over(|g| g.k2_sd), theory)
        .points_as(format!("{GRID_TRIALS} trials, 95 %"), over(Grid::sampled_k2_sd), sampled)
        .error_bars_as("", spreads, sampled)
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
        few.mean_rmse_px() / few.rmse.noise_floor_px(),
        few.k2_sd / all.k2_sd,
        all.points_per_view
    );
    Figure::panels("few-points", &[rmse, k2], 2, caption)
}
