//! Many draws of the four poses: does the solver attain the bound, and what does the reprojection error know
//! of the errors?

use super::*;
use calibench_harness::stats;

pub fn claim_attained(record: &mut Record, draw: &Draw, trials: &Outcome) {
    record.exact("").count("converged", trials.converged(), "trials that converged");
    record
        .claim_that("every-trial-converges", "every trial of the Monte Carlo converges")
        .at_least(trials.converged() as f64, TRIALS as f64)
        .because(format!("the scene is well conditioned; endings: {:?}", trials.endings));
    let errors = trials.errors();
    let each = each_of(2 * FreeParameters::STANDARD.len(), RATE);
    let ratio_interval = Interval::of_deviation_ratio(trials.converged(), each);
    for (i, parameter) in FreeParameters::STANDARD.iter().enumerate() {
        let (name, sd) = (parameter.name(), draw.sd(parameter));
        let (bias, ratio) = (errors.bias(i), errors.standard_deviation(i) / sd);
        let no_bias = Interval::of_mean(0.0, sd, trials.converged(), each);
        record
            .group(parameter.unit(), of_deviation(sd))
            .number(format!("{name}-bias"), bias, "mean error of the trials")
            .group("", relative())
            .number(format!("{name}-sd-ratio"), ratio, "spread of the trials over the bound");
        record
            .claim_that(
                format!("{name}-unbiased"),
                format!("the mean error of {name} is zero within the uncertainty of the mean"),
            )
            .within(bias, no_bias)
            .unit(parameter.unit())
            .at_rate(each)
            .because("the bound's standard deviation over the root of the number of trials, normal");
        record
            .claim_that(
                format!("{name}-attains-bound"),
                format!("the spread of {name} equals the Cramer-Rao bound"),
            )
            .within(ratio, ratio_interval)
            .at_rate(each)
            .because("sample deviation of Gaussian values: root of chi-squared over its degrees of freedom");
    }
    let caption = format!("bias and spread of {TRIALS} trials against the bound");
    let sampled = |i: usize| errors.standard_deviation(i);
    let predicted = |parameter: &Parameter| draw.sd(*parameter);
    let no_bias = |p: &Parameter| Interval::of_mean(0.0, predicted(p), trials.converged(), each);
    record.table(
        Table::of("monte-carlo", caption, FreeParameters::STANDARD.iter().enumerate())
            .column("parameter", "", |(_, p)| p.name())
            .column("mean_error", "", |(i, _)| errors.bias(*i))
            .column("mean_error_bound", "", |(_, p)| no_bias(p).high)
            .column("sd", "", |(i, _)| sampled(*i))
            .column("predicted_sd", "", |(_, p)| predicted(p))
            .column("sd_ratio", "", |(i, p)| sampled(*i) / predicted(p))
            .column("sd_ratio_low", "", |_| ratio_interval.low)
            .column("sd_ratio_high", "", |_| ratio_interval.high),
    );
    claim_consistent(record, draw, trials);
}

/// The errors are jointly as large as the bound says, and as each estimate says of itself.
fn claim_consistent(record: &mut Record, draw: &Draw, trials: &Outcome) {
    let (n, dof) = (trials.converged(), FreeParameters::STANDARD.len());
    let mean = trials.mean_normalised_error_squared(&draw.bound);
    let interval = Interval::of_mean_chi_squared(dof, n, RATE);
    let what = "mean normalised estimation error squared under the bound";
    record.group("", relative()).number("nees", mean, what);
    record
        .claim_that(
            "errors-jointly-as-predicted",
            "the mean normalised estimation error squared under the bound is the number of parameters",
        )
        .within(mean, interval)
        .at_rate(RATE)
        .because("the sum over trials is chi-squared with 6 degrees of freedom a trial");

    let freedom = draw.rmse.degrees_of_freedom();
    let covered = |e: &Estimate| {
        let f = e.normalised_error_squared / dof as f64;
        if fisher_cdf(f, dof, freedom) <= COVERAGE { 1.0 } else { 0.0 }
    };
    let share = trials.mean(covered);
    let interval = Interval::of_mean(COVERAGE, (COVERAGE * (1.0 - COVERAGE)).sqrt(), n, RATE);
    let count_band = Band::absolute(1.5 / TRIALS as f64, "one trial on the region's edge may change sides");
    let what = "share of 95 % confidence regions that hold the truth";
    record.group("", count_band).number("coverage", share, what);
    record
        .claim_that(
            "own-covariance-covers",
            "the 95 % region that each estimate states of itself holds the truth in 95 % of the trials",
        )
        .within(share, interval)
        .at_rate(RATE)
        .because(
            "F distribution with 6 and 474 degrees of freedom, as sigma is estimated too; binomial, normal \
             approximation",
        );
}

/// RMSE: where it settles, and that it knows nothing of the errors.
pub fn claim_rmse_blind(record: &mut Record, draw: &Draw, trials: &Outcome) {
    let n = trials.converged();
    let (mean, sd, floor) =
        (draw.rmse.mean_px(), draw.rmse.standard_deviation_px(), draw.rmse.noise_floor_px());
    let settled = trials.mean(|e| e.rmse_px);
    let interval = Interval::of_mean(mean, sd, n, RATE);
    record.group("px", relative()).number("rmse-mean", settled, "mean RMSE of the trials");
    record
        .claim_that(
            "rmse-settles-under-the-floor",
            "the mean RMSE is the predicted one, under the noise floor because 30 parameters absorb noise",
        )
        .within(settled, Interval { low: interval.low, high: interval.high.min(floor) })
        .unit("px")
        .at_rate(RATE)
        .because(
            "sigma / sqrt(N) times the mean of chi with 2 N - 30 degrees of freedom; cut off at the floor \
             sqrt(2) sigma",
        );

    let values: Vec<f64> = trials.estimates.iter().map(|e| e.rmse_px).collect();
    let distance = stats::kolmogorov_distance(&values, |v| draw.rmse.cdf(v));
    let bound = stats::kolmogorov_limit(n, RATE);
    let what = "largest distance of the distribution of RMSE from its prediction";
    record.group("", relative()).number("rmse-kolmogorov", distance, what);
    record
        .claim_that(
            "rmse-distributed-as-predicted",
            "the RMSE of the trials follows its predicted distribution as a whole",
        )
        .at_most(distance, bound)
        .at_rate(RATE)
        .because("Kolmogorov's distance exceeds d with probability below 2 exp(-2 n d^2) (Massart 1990)");

    let (k1, k2) = (position(Parameter::K1), position(Parameter::K2));
    let predicted = draw.bound.correlation(Parameter::K1, Parameter::K2).unwrap_or(f64::NAN);
    let sampled = trials.errors().correlation(k1, k2);
    let focal = draw.bound.correlation(Parameter::Fx, Parameter::Fy).unwrap_or(f64::NAN);
    record
        .group("", relative())
        .number("k1-k2-correlation", predicted, "correlation of k1 and k2 in the bound")
        .number("fx-fy-correlation", focal, "correlation of fx and fy in the bound")
        .number("k1-k2-correlation-trials", sampled, "the same over the trials");
    let around = Interval::of_correlation(predicted, n, RATE);
    record
        .claim_that(
            "k1-k2-compensate",
            "errors of k1 and k2 are as strongly negatively correlated over the trials as the bound says",
        )
        .within(sampled, Interval { low: around.low, high: around.high.min(0.0) })
        .at_rate(RATE)
        .because("Fisher's transformation of the sample correlation, about the bound's");

    let blind = k2_and_rmse(trials).correlation(0, 1);
    let chance = libm::tanh(normal_two_sided(RATE) / (n as f64 - 3.0).sqrt());
    let what = "correlation of |error of k2| and RMSE";
    record.group("", of_deviation(1.0)).number("k2-error-rmse-correlation", blind, what);
    record
        .claim_that("rmse-does-not-notice", "the size of the error of k2 and the RMSE are uncorrelated")
        .within(blind, Interval::around(0.0, chance))
        .at_rate(RATE)
        .because(
            "residuals of a linear Gaussian fit are independent of its estimate; Fisher's interval about \
             zero",
        );
}

/// `|error of k2|` and RMSE of every trial.
fn k2_and_rmse(trials: &Outcome) -> Sample {
    let k2 = position(Parameter::K2);
    let mut sample = Sample::about(&[0.0, std::f64::consts::SQRT_2 * SIGMA_PX]);
    trials.estimates.iter().for_each(|e| sample.add(&[e.errors[k2].abs(), e.rmse_px]));
    sample
}
