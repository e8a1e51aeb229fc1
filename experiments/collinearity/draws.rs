//! Other draws of the noise: the distributions that book and harness are held against, and theory for the
//! RMS.

use super::*;

/// The five quantities under each treatment.
pub type Draw = [[f64; 5]; CENTRES.len()];

pub fn simulate(context: &Context, scene: &Scene) -> Result<Vec<Draw>, ExperimentError> {
    let progress = context.progress("other draws of the noise", TRIALS);
    (1..=TRIALS)
        .into_par_iter()
        .map(|trial| {
            let view = draw(scene, context.seed, trial);
            let mut all = [[0.0; 5]; CENTRES.len()];
            for (quantities, &centre) in all.iter_mut().zip(&CENTRES) {
                *quantities = Found::new(&view, centre)?.quantities();
            }
            progress.step();
            Ok(all)
        })
        .collect()
}

pub fn column(draws: &[Draw], centre: usize, quantity: usize) -> Vec<f64> {
    draws.iter().map(|d| d[centre][quantity]).collect()
}

pub fn moments(values: &[f64]) -> Sample {
    let mut sample = Sample::about(&values[..1]);
    values.iter().for_each(|&v| sample.add(&[v]));
    sample
}

/// The distribution of a quantity over the draws, with a free centre: what book and harness are held against.
pub fn predicted(draws: &[Draw], quantity: usize) -> Predicted {
    let what = "single-plane calibration of the fronto-parallel pose, centre free";
    Predicted::from_draws(&column(draws, MAIN, quantity), 1, what)
}

/// The chapter does not say whether the RMS of its affine fit is per point, as all its others, or per
/// coordinate, smaller by the root of two. The ratio of the largest residual to the RMS depends little on the
/// noise, so it tells the readings apart.
pub fn readings_table(draws: &[Draw], book: &Book) -> Table {
    let caption = "the published affine residual read as RMS per point and per coordinate: where it and its \
                   ratio to the largest residual lie among the draws";
    let readings = [("per point", 1.0), ("per coordinate", std::f64::consts::SQRT_2)];
    let rows = (0..CENTRES.len())
        .flat_map(|i| readings.map(|(reading, factor)| (i, reading, factor * book[3].value())));
    let ratio = |published: f64| book[4].value() / published;
    let ratios = |i: usize| -> Vec<f64> { draws.iter().map(|d| d[i][4] / d[i][3]).collect() };
    Table::of("readings", caption, rows)
        .column("centre", "", |(i, ..)| CENTRES[*i].name())
        .column("reading", "", |(_, reading, _)| *reading)
        .column("book_rms_per_point", "mm", |(.., published)| *published)
        .column("draws_below_rms", "%", |(i, _, published)| percent_below(&column(draws, *i, 3), *published))
        .column("book_max_over_rms", "", |(.., published)| ratio(*published))
        .column("draws_below_ratio", "%", |(i, _, published)| percent_below(&ratios(*i), ratio(*published)))
        .into()
}

pub fn percent_below(values: &[f64], x: f64) -> f64 {
    100.0 * values.iter().filter(|&&v| v < x).count() as f64 / values.len() as f64
}

/// `N RMS^2 / sigma^2` follows chi-squared with `d = 2 N - p` degrees of freedom, non-central where the
/// centre is held at a wrong place: `lambda` is the same sum of a fit without noise. Mean `d + lambda`,
/// variance `2 (d + 2 lambda)`, excess kurtosis `12 (d + 4 lambda) / (d + 2 lambda)^2`.
pub fn claim_theory(record: &mut Record, ours: &[Found], noise_free: &[Found], draws: &[Draw]) {
    for (i, centre) in CENTRES.iter().enumerate() {
        let name = centre.name();
        let points = noise_free[i].corrected.len() as f64;
        let per_noise = |rms: f64| points * rms * rms / (SIGMA_PX * SIGMA_PX);
        let freedom = 2.0 * points - centre.parameters() as f64;
        let lambda = per_noise(noise_free[i].plane.rms_px);
        let sums: Vec<f64> = column(draws, i, 0).into_iter().map(per_noise).collect();
        let sample = moments(&sums);
        let variance = 2.0 * (freedom + 2.0 * lambda);
        let mean = Interval::of_mean(freedom + lambda, variance.sqrt(), TRIALS, THEORY_RATE);
        record
            .claim_that(
                format!("chi-squared-mean-{name}"),
                format!(
                    "over the draws the sum of squares has the mean of its chi-squared distribution: {}",
                    centre.in_words()
                ),
            )
            .within(sample.mean(0), mean)
            .at_rate(THEORY_RATE)
            .because(format!(
                "{freedom} degrees of freedom, non-centrality {lambda:.3} from a fit without noise; central \
                 limit"
            ));
        let excess = 12.0 * (freedom + 4.0 * lambda) / ((freedom + 2.0 * lambda) * (freedom + 2.0 * lambda));
        let half = normal_two_sided(THEORY_RATE) * ((2.0 + excess) / TRIALS as f64).sqrt();
        record
            .claim_that(
                format!("chi-squared-variance-{name}"),
                format!(
                    "over the draws the sum of squares has the variance of its chi-squared distribution: {}",
                    centre.in_words()
                ),
            )
            .within(sample.covariance(0, 0) / variance, Interval::around(1.0, half))
            .at_rate(THEORY_RATE)
            .because(
                "ratio of sample variance to 2 (d + 2 lambda); its spread from the kurtosis, central limit",
            );
        if centre.is_exact() {
            let predicted = Predicted::Chi { scale: SIGMA_PX / points.sqrt(), dof: freedom };
            record
                .claim_that(
                    format!("rms-{name}"),
                    format!(
                        "our RMS comes from the distribution of residuals under the right model: {}",
                        centre.in_words()
                    ),
                )
                .drawn_from(ours[i].plane.rms_px, &predicted, FALSE_ALARM_RATE)
                .unit("px")
                .because("2 N coordinates less the parameters");
        }
    }
    // Half of the digits of a coordinate near 640 px: where the sum of squares stops to show a change.
    let bound = 640.0 * f64::EPSILON.sqrt();
    let exact = noise_free.iter().zip(CENTRES).filter(|(_, centre)| centre.is_exact());
    let worst = exact.map(|(f, _)| f.row_after.max_deviation().max(f.plane.rms_px)).fold(0.0, f64::max);
    record
        .claim_that(
            "exact-without-noise",
            "without noise the model with its true or a free centre straightens the top row and leaves no \
             residual",
        )
        .at_most(worst, bound)
        .unit("px")
        .because("a minimum is found to half of the digits of a coordinate");
}
