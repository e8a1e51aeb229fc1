//! Many draws of the four poses: does the solver attain the bound, and what does the reprojection error know of the errors?

use super::*;

pub fn claim_attained(record: &mut Record, draw: &Draw, trials: &Outcome) {
    record.number("converged", trials.converged() as f64, "", Band::Exact, "trials that converged");
    record.claim(Claim::at_least(
        "every-trial-converges",
        "every trial of the Monte Carlo converges",
        trials.converged() as f64,
        TRIALS as f64,
        format!("the scene is well conditioned; endings: {:?}", trials.endings),
    ));
    let errors = trials.errors();
    let columns = [
        ("parameter", ""),
        ("mean_error", ""),
        ("mean_error_bound", ""),
        ("sd", ""),
        ("predicted_sd", ""),
        ("sd_ratio", ""),
        ("sd_ratio_low", ""),
        ("sd_ratio_high", ""),
    ];
    let mut table = Table::new("monte-carlo", "bias and spread of 2000 trials against the bound", &columns);
    let each = each_of(2 * FreeParameters::CHAPTER.len(), RATE);
    let ratio_interval = Interval::of_deviation_ratio(trials.converged(), each);
    for (i, parameter) in FreeParameters::CHAPTER.iter().enumerate() {
        let (name, sd) = (parameter.name(), draw.sd(parameter));
        let (bias, ratio) = (errors.bias(i), errors.standard_deviation(i) / sd);
        let no_bias = Interval::of_mean(0.0, sd, trials.converged(), each);
        record.number(
            format!("{name}-bias"),
            bias,
            parameter.unit(),
            of_deviation(sd),
            "mean error of the trials",
        );
        record.number(
            format!("{name}-sd-ratio"),
            ratio,
            "",
            relative(),
            "spread of the trials over the bound",
        );
        let claim = Claim::within(
            format!("{name}-unbiased"),
            format!("the mean error of {name} is zero within the uncertainty of the mean"),
            bias,
            (no_bias.low, no_bias.high),
            "the bound's standard deviation over the root of the number of trials, normal",
        );
        record.claim(claim.in_unit(parameter.unit()).with_false_alarm_rate(each));
        let claim = Claim::within(
            format!("{name}-attains-bound"),
            format!("the spread of {name} equals the Cramer-Rao bound"),
            ratio,
            (ratio_interval.low, ratio_interval.high),
            "sample deviation of Gaussian values: root of chi-squared over its degrees of freedom",
        );
        record.claim(claim.with_false_alarm_rate(each));
        let row = [
            bias,
            no_bias.high,
            errors.standard_deviation(i),
            sd,
            ratio,
            ratio_interval.low,
            ratio_interval.high,
        ];
        table.push(std::iter::once(Cell::from(name)).chain(row.map(Cell::from)));
    }
    record.table(table);
    claim_consistent(record, draw, trials);
}

/// The errors are jointly as large as the bound says, and as each estimate says of itself.
fn claim_consistent(record: &mut Record, draw: &Draw, trials: &Outcome) {
    let (n, dof) = (trials.converged(), FreeParameters::CHAPTER.len());
    let mean = trials.mean_normalised_error_squared(&draw.bound);
    let interval = Interval::of_mean_chi_squared(dof, n, RATE);
    record.number("nees", mean, "", relative(), "mean normalised estimation error squared under the bound");
    let claim = Claim::within(
        "errors-jointly-as-predicted",
        "the mean normalised estimation error squared under the bound is the number of parameters",
        mean,
        (interval.low, interval.high),
        "the sum over trials is chi-squared with 6 degrees of freedom a trial",
    );
    record.claim(claim.with_false_alarm_rate(RATE));

    let freedom = draw.rmse.degrees_of_freedom();
    let covered = |e: &Estimate| {
        let f = e.normalised_error_squared / dof as f64;
        if fisher_cdf(f, dof, freedom) <= COVERAGE { 1.0 } else { 0.0 }
    };
    let share = trials.mean(covered);
    let interval = Interval::of_mean(COVERAGE, (COVERAGE * (1.0 - COVERAGE)).sqrt(), n, RATE);
    let count_band = Band::absolute(1.5 / TRIALS as f64, "one trial on the region's edge may change sides");
    record.number("coverage", share, "", count_band, "share of 95 % confidence regions that hold the truth");
    let claim = Claim::within(
        "own-covariance-covers",
        "the 95 % region that each estimate states of itself holds the truth in 95 % of the trials",
        share,
        (interval.low, interval.high),
        "F distribution with 6 and 474 degrees of freedom, as sigma is estimated too; binomial, normal approximation",
    );
    record.claim(claim.with_false_alarm_rate(RATE));
}

/// RMSE: where it settles, and that it knows nothing of the errors.
pub fn claim_rmse_blind(record: &mut Record, draw: &Draw, trials: &Outcome) {
    let n = trials.converged();
    let (mean, sd, floor) =
        (draw.rmse.mean_px(), draw.rmse.standard_deviation_px(), draw.rmse.noise_floor_px());
    let settled = trials.mean(|e| e.rmse_px);
    let interval = Interval::of_mean(mean, sd, n, RATE);
    record.number("rmse-mean", settled, "px", relative(), "mean RMSE of the trials");
    let claim = Claim::within(
        "rmse-settles-under-the-floor",
        "the mean RMSE is the predicted one, under the noise floor because 30 parameters absorb noise",
        settled,
        (interval.low, interval.high.min(floor)),
        "sigma / sqrt(N) times the mean of chi with 2 N - 30 degrees of freedom; cut off at the floor sqrt(2) sigma",
    );
    record.claim(claim.in_unit("px").with_false_alarm_rate(RATE));

    let mut values: Vec<f64> = trials.estimates.iter().map(|e| e.rmse_px).collect();
    values.sort_by(f64::total_cmp);
    let step = |i: usize| i as f64 / n as f64;
    let distance = values
        .iter()
        .map(|&v| draw.rmse.cdf(v))
        .enumerate()
        .fold(0.0f64, |m, (i, p)| m.max(p - step(i)).max(step(i + 1) - p));
    let bound = (libm::log(2.0 / RATE) / (2.0 * n as f64)).sqrt();
    record.number(
        "rmse-kolmogorov",
        distance,
        "",
        relative(),
        "largest distance of the distribution of RMSE from its prediction",
    );
    let claim = Claim::at_most(
        "rmse-distributed-as-predicted",
        "the RMSE of the trials follows its predicted distribution as a whole",
        distance,
        bound,
        "Kolmogorov's distance exceeds d with probability below 2 exp(-2 n d^2) (Massart 1990)",
    );
    record.claim(claim.with_false_alarm_rate(RATE));

    let (k1, k2) = (position(Parameter::K1), position(Parameter::K2));
    let predicted = draw.bound.correlation(Parameter::K1, Parameter::K2).unwrap_or(f64::NAN);
    let sampled = trials.errors().correlation(k1, k2);
    record.number("k1-k2-correlation", predicted, "", relative(), "correlation of k1 and k2 in the bound");
    let focal = draw.bound.correlation(Parameter::Fx, Parameter::Fy).unwrap_or(f64::NAN);
    record.number("fx-fy-correlation", focal, "", relative(), "correlation of fx and fy in the bound");
    record.number("k1-k2-correlation-trials", sampled, "", relative(), "the same over the trials");
    let around = Interval::of_correlation(predicted, n, RATE);
    let claim = Claim::within(
        "k1-k2-compensate",
        "errors of k1 and k2 are as strongly negatively correlated over the trials as the bound says",
        sampled,
        (around.low, around.high.min(0.0)),
        "Fisher's transformation of the sample correlation, about the bound's",
    );
    record.claim(claim.with_false_alarm_rate(RATE));

    let blind = k2_and_rmse(trials).correlation(0, 1);
    let chance = libm::tanh(normal_two_sided(RATE) / (n as f64 - 3.0).sqrt());
    record.number(
        "k2-error-rmse-correlation",
        blind,
        "",
        of_deviation(1.0),
        "correlation of |error of k2| and RMSE",
    );
    let claim = Claim::within(
        "rmse-does-not-notice",
        "the size of the error of k2 and the RMSE are uncorrelated",
        blind,
        (-chance, chance),
        "residuals of a linear Gaussian fit are independent of its estimate; Fisher's interval about zero",
    );
    record.claim(claim.with_false_alarm_rate(RATE));
}

/// `|error of k2|` and RMSE of every trial.
fn k2_and_rmse(trials: &Outcome) -> Sample {
    let k2 = position(Parameter::K2);
    let mut sample = Sample::about(&[0.0, std::f64::consts::SQRT_2 * SIGMA_PX]);
    trials.estimates.iter().for_each(|e| sample.add(&[e.errors[k2].abs(), e.rmse_px]));
    sample
}
