//! Scenes that say little: fewer points, which overfit, two views, which suffice, and views that face the
//! camera, which determine no camera.

use super::*;

/// The four poses with fewer points on the same target.
pub struct Grid {
    pub points_per_view: usize,
    pub rmse: RmseDistribution,
    pub k2_sd: f64,
    pub trials: Outcome,
}

impl Grid {
    pub fn mean_rmse_px(&self) -> f64 {
        self.trials.mean(|e| e.rmse_px)
    }

    pub fn sampled_k2_sd(&self) -> f64 {
        self.trials.errors().standard_deviation(position(Parameter::K2))
    }
}

pub fn few_points(context: &Context) -> Result<Vec<Grid>, ExperimentError> {
    let progress = context.progress("fewer points", GRIDS.len() * GRID_TRIALS);
    GRIDS
        .iter()
        .map(|&(columns, rows)| {
            let at = |i: usize, count: usize, width: f64| width * (i as f64 / (count - 1) as f64 - 0.5);
            let points: Vec<Vec2> = (0..rows)
                .flat_map(|j| (0..columns).map(move |i| (i, j)))
                .map(|(i, j)| Vec2::new(at(i, columns, 80.0), at(j, rows, 60.0)))
                .collect();
            let scene =
                Scene::new(Truth { points, ..Truth::example() }).map_err(ExperimentError::at("scene"))?;
            let bound = cramer_rao(&scene.truth, FreeParameters::STANDARD, SIGMA_PX)
                .map_err(ExperimentError::at("Cramer-Rao bound"))?;
            let scenario = format!("four-pose/grid-{columns}x{rows}");
            Ok(Grid {
                points_per_view: columns * rows,
                rmse: predicted_rmse(&scene),
                k2_sd: bound.standard_deviation(Parameter::K2).unwrap_or(f64::NAN),
                trials: monte_carlo(&scene, context.seed, &scenario, GRID_TRIALS, &progress),
            })
        })
        .collect()
}

pub fn claim_overfitting(record: &mut Record, grids: &[Grid]) {
    record.table(
        Table::of("few-points", "RMSE and spread of k2 with fewer points on the same target", grids)
            .column("points_per_view", "", |grid| grid.points_per_view)
            .column("rmse_mean", "px", |grid| grid.mean_rmse_px())
            .column("rmse_predicted", "px", |grid| grid.rmse.mean_px())
            .column("k2_sd", "", |grid| grid.sampled_k2_sd())
            .column("k2_sd_predicted", "", |grid| grid.k2_sd)
            .column("converged", "", |grid| grid.trials.converged()),
    );
    let each = each_of(2 * grids.len(), RATE);
    let mut cases = Vec::new();
    for grid in grids {
        let n = grid.trials.converged();
        let (rmse, sd) = (grid.mean_rmse_px(), grid.sampled_k2_sd());
        let around = Interval::of_mean(grid.rmse.mean_px(), grid.rmse.standard_deviation_px(), n, each);
        let name = format!("{} points a view", grid.points_per_view);
        cases.push((format!("{name}: all {GRID_TRIALS} converge, {n} did"), n == GRID_TRIALS));
        cases.push((
            format!("{name}: mean RMSE {rmse} px in [{}, {}]", around.low, around.high),
            around.contains(rmse),
        ));
        let ratio = Interval::of_deviation_ratio(n, each);
        cases.push((
            format!("{name}: spread of k2 over the bound {}", sd / grid.k2_sd),
            ratio.contains(sd / grid.k2_sd),
        ));
    }
    record
        .claim_that(
            "low-rmse-is-overfitting",
            "with fewer points on the same target the RMSE falls under the floor as sqrt(1 - 30 / 2N) says, \
             while k2 gets worse as the bound says",
        )
        .every("cases", cases)
        .at_rate(RATE)
        .because(
            "mean of chi with 2 N - 30 degrees of freedom, and sample deviation of Gaussian values, \
             Bonferroni over all grids",
        );
    let (few, all) = (&grids[0], &grids[grids.len() - 1]);
    let (over_floor, growth) = (few.mean_rmse_px() / few.rmse.noise_floor_px(), few.k2_sd / all.k2_sd);
    record
        .group("", relative())
        .prefix("few-points-")
        .number("rmse-over-floor", over_floor, "mean RMSE over the noise floor with 9 points a view")
        .number("k2-sd-factor", growth, "growth of the bound of k2 from 63 points a view to 9");
}

pub fn claim_facing_views(record: &mut Record, context: &Context) -> Result<(), ExperimentError> {
    let poses = FACING_MM.map(|z| looking_at_centre([0.0; 3], z)).to_vec();
    let scene = Scene::new(Truth { cam_from_target: poses, ..Truth::example() })
        .map_err(ExperimentError::at("views that face the camera"))?;
    let progress = context.progress("views that face the camera", FACING_TRIALS);
    let trials = monte_carlo(&scene, context.seed, "four-pose/facing", FACING_TRIALS, &progress);
    let refused = trials.refused_naming(&["focal length", "distance"]) as f64;
    let what = "of 200 trials with facing views only, those refused for focal length and distance";
    record.exact("").number("facing-refused", refused, what);
    record
        .claim_that(
            "facing-views-are-refused",
            "four views that face the camera, at 100, 120, 140 and 160 mm, are refused, and focal length \
             and distance are named as inseparable",
        )
        .at_least(refused, FACING_TRIALS as f64)
        .at_rate(FACING_TRIALS as f64 * 1e-9)
        .because(format!(
            "1e-9 a trial: the rate at which planes that are parallel pass for tilted; endings: {:?}",
            trials.endings
        ));
    let bound = cramer_rao(&scene.truth, FreeParameters::STANDARD, SIGMA_PX);
    record
        .claim_that(
            "facing-views-have-no-bound",
            "the information of these views is singular: no unbiased estimate exists",
        )
        .every(
            "cases",
            [(
                format!("{:?}", bound.as_ref().map(|b| b.standard_deviation(Parameter::Fx))),
                matches!(bound, Err(BoundError::Singular { .. })),
            )],
        )
        .because("f and the distances enter only through their ratio (Zhang 2000, section 4)");
    Ok(())
}

/// Largest error of a focal length or a coordinate of the principal point from exact pixels, px: coordinates
/// below 1000 px are rounded by 1.1e-13 px, and the worst pair of views makes 25 px of a pixel's error; the
/// refinement ends within the square root of that relative gain.
const TWO_VIEWS_PX: f64 = 1e-4;

/// Four unknowns of K, and two equations from every view: two views are enough, and three are not needed.
pub fn claim_two_views(record: &mut Record) -> Result<(), ExperimentError> {
    let chapter = Truth::example();
    let mut cases = Vec::new();
    let mut sds = Vec::new();
    for first in 0..chapter.cam_from_target.len() {
        for second in first + 1..chapter.cam_from_target.len() {
            let poses = vec![chapter.cam_from_target[first], chapter.cam_from_target[second]];
            let truth = Truth { cam_from_target: poses, ..chapter.clone() };
            let bound = cramer_rao(&truth, FreeParameters::STANDARD, SIGMA_PX)
                .map_err(ExperimentError::at("Cramer-Rao bound of two views"))?;
            sds.push(bound.standard_deviation(Parameter::Fx).unwrap_or(f64::NAN));
            let scene = Scene::new(truth).map_err(ExperimentError::at("two views"))?;
            let found = calibrate(&scene.exact(), &Settings::standard());
            let error = found.as_ref().map_or(f64::INFINITY, |c| {
                let off = |p: Parameter| (c.camera.get(p) - scene.truth.camera.get(p)).abs();
                [Parameter::Fx, Parameter::Fy, Parameter::Cx, Parameter::Cy]
                    .map(off)
                    .into_iter()
                    .fold(0.0, f64::max)
            });
            cases.push((format!("views {first} and {second}: off by {error} px"), error <= TWO_VIEWS_PX));
        }
    }
    let best = sds.iter().copied().fold(f64::INFINITY, f64::min);
    let worst = sds.iter().copied().fold(0.0, f64::max);
    record
        .group("px", relative())
        .number("two-views-fx-sd-best", best, "bound of fx from the best pair of the four views")
        .number("two-views-fx-sd-worst", worst, "bound of fx from the worst pair");
    record
        .claim_that(
            "two-views-suffice",
            "without noise every pair of the four views gives the camera exactly",
        )
        .every("pairs", cases)
        .because(
            "without skew K has four unknowns, and each view gives two equations (Zhang 2000, section 3.1)",
        );
    Ok(())
}
