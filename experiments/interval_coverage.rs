//! Do a study's intervals hold the truth as often as they say, also after few trials?
//!
//! Expected: errors of parameters are nearly normal, so that the intervals of their bias and of their spread
//! hold 95 times in 100 from ten trials on. NEES has the law of chi-squared with six degrees of freedom,
//! whose tail a few trials do not show: the interval of its spread holds less often.
//!
//! What it cannot show: coverage where theory of first order fails, near degenerate scenes or in strong
//! noise.

use super::sweep::Sweep;
use calibench_harness::{Band, Context, Experiment, ExperimentError, Record, Rows, Table};
use calibench_study::{Estimated, Moments};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "interval-coverage",
    title: "What an interval of few trials is worth",
    question: "A study of 40 000 trials is cut into studies of 10, 20 and 100. How often do their intervals of bias and spread hold what all the \
               trials say? Expected: 95 times in 100 for the errors of parameters, less often for the spread of NEES, whose law has a tail.",
    seed: 23,
    takes_image: false,
    run,
};

const STUDY: &str = r#"
name = "interval-coverage"
question = "Do intervals hold the truth as often as they say?"
seed = 0
scene.image = [640, 480]
scene.camera = { fx = 600.0, fy = 600.0, cx = 326.0, cy = 243.0, k1 = -0.18, k2 = 0.05 }
scene.target = { columns = 9, rows = 7, spacing_mm = 10.0 }
scene.poses = { kind = "spread", views = 4, tilt_deg = 20.0, distance_mm = 120.0 }
scene.noise_px = 0.1
trials = { per_cell = 40000, batch = 4000 }

[[factor]]
name = "views"
set = ["scene.poses.views"]
levels = [4]
"#;

/// Trials of the studies that the whole is cut into.
const SIZES: [usize; 3] = [10, 20, 100];
/// Quantities whose law is nearly normal, and one whose law is not.
const NORMAL: [&str; 3] = ["fx", "cx", "k1"];
const SKEWED: &str = "nees";
/// What the intervals of a study leave out.
const FALSE_ALARM: f64 = 0.05;
/// Chance that right intervals fail one of the claims: four binomial standard deviations, two-sided, eighteen
/// and six cases.
const CHANCE: f64 = 2e-3;
/// What the terms of small samples leave at ten trials of a normal law, by simulation in another language:
/// 0.940 to 0.951.
const APPROXIMATION: f64 = 0.012;
/// The same for the spread of chi-squared with six degrees of freedom, and for the mean: 0.90 to 0.95.
const APPROXIMATION_SKEWED: f64 = 0.05;

/// How often the intervals of one quantity hold, over studies of one size.
struct Coverage {
    quantity: &'static str,
    size: usize,
    studies: usize,
    mean: f64,
    sd: f64,
}

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let mut trials = Vec::new();
    let sweep = Sweep::run(context, &mut record, "study", STUDY, |trial| trials.push(trial.values.clone()))?;
    let values = |name: &str| -> Vec<f64> {
        let at = sweep.engine.quantities.iter().position(|q| q.name() == name);
        at.map(|at| trials.iter().filter_map(|values| values[at]).collect()).unwrap_or_default()
    };
    let mut found = Vec::new();
    for quantity in NORMAL.into_iter().chain([SKEWED]) {
        let values = values(quantity);
        found.extend(SIZES.map(|size| coverage(quantity, &values, size)));
    }
    report(&mut record, &found);
    claim(&mut record, &found);
    record.table(table(&found));
    Ok(record)
}

fn moments(values: &[f64]) -> Moments {
    let mut moments = Moments::default();
    values.iter().for_each(|&x| moments.add(x));
    moments
}

fn coverage(quantity: &'static str, values: &[f64], size: usize) -> Coverage {
    let whole = moments(values);
    let studies: Vec<Moments> = values.chunks_exact(size).map(moments).collect();
    let share = |interval: &dyn Fn(&Moments) -> Option<Estimated>, truth: f64| {
        let held = studies.iter().filter(|study| interval(study).is_some_and(|i| i.contains(truth))).count();
        held as f64 / studies.len() as f64
    };
    Coverage {
        quantity,
        size,
        studies: studies.len(),
        mean: share(&|study| study.mean_interval(FALSE_ALARM), whole.mean()),
        sd: share(&|study| study.sd_interval(FALSE_ALARM), whole.sd()),
    }
}

fn report(record: &mut Record, found: &[Coverage]) {
    let reason = "other last bits of a solver move an estimate across the end of an interval now and then";
    for c in found {
        let Coverage { quantity, size, .. } = c;
        let mut numbers = record.group("", Band::absolute(0.01, reason));
        for (what, share) in [("mean", c.mean), ("sd", c.sd)] {
            let said =
                format!("share of studies of {size} trials whose interval of the {what} of {quantity} holds");
            numbers.number(format!("{quantity}-{what}-{size}"), share, said);
        }
    }
}

fn claim(record: &mut Record, found: &[Coverage]) {
    let cases = |skewed: bool, within: f64| {
        let of = found.iter().filter(move |c| (c.quantity == SKEWED) == skewed);
        of.flat_map(move |c| {
            let sd = (FALSE_ALARM * (1.0 - FALSE_ALARM) / c.studies as f64).sqrt();
            [("mean", c.mean), ("sd", c.sd)].map(|(what, share)| {
                let near = (share - (1.0 - FALSE_ALARM)).abs() <= within + 4.0 * sd;
                (format!("{what} of {} in {} trials", c.quantity, c.size), near)
            })
        })
    };
    record
        .claim_that(
            "parameters-are-held",
            "intervals of bias and spread of a parameter hold 95 times in 100, within what the approximation and the number of studies leave",
        )
        .every("intervals", cases(false, APPROXIMATION))
        .at_rate(CHANCE)
        .because("Student's t for the mean; for the spread Bonett 2006, whose terms for small samples cover normal laws to a hundredth from ten values on");
    record
        .claim_that("nees-is-held", "intervals of mean and spread of NEES hold at least 90 times in 100, within what the number of studies leaves")
        .every("intervals", cases(true, APPROXIMATION_SKEWED))
        .at_rate(CHANCE)
        .because("chi-squared with six degrees of freedom has kurtosis 5, which few values do not show");
}

fn table(found: &[Coverage]) -> Table {
    let rows: Rows<&Coverage> = Table::of("coverage", "how often intervals of 95 % hold", found);
    rows.column("quantity", "", |c| c.quantity)
        .column("trials", "", |c| c.size)
        .column("studies", "", |c| c.studies)
        .column("of_the_mean", "", |c| c.mean)
        .column("of_the_spread", "", |c| c.sd)
        .into()
}
