//! Which lens model should one choose, and which criterion picks right how often?
//!
//! Expected: the RMSE takes the richest candidate that is fitted, whatever the truth. Schwarz's criterion
//! takes the right one the more often the more marks there are, and one that is too rich as often as Fisher's
//! distribution says; where the marks cannot tell two families apart it takes the one with fewer
//! coefficients. What matters, the error over the frame, depends less on the choice than the choice on the
//! criterion.
//!
//! What it cannot show: noise of another size or shape, boards that are not flat, poses that are chosen with
//! care, lenses that no model describes but for two. The candidates are those of `calibench calibrate --model
//! auto`.
//!
//! The fits take minutes: the command `model-choice-trials` made them and wrote golden/model-choice/, which
//! is read. It is refused as stale when a line of the solver, of the truths or of the layouts has changed
//! since, unless the changed code has made an eighth of the trials again, bit for bit.

use calibench::calibrate::{Candidate, calibrate_lens};
use calibench::evaluate::Interval;
use calibench::evaluate::distribution::fisher_tail;
use calibench_harness::fingerprint::Fingerprint;
use calibench_harness::{Context, Experiment, ExperimentError, Record, stats};
use rayon::prelude::*;
use statrs::distribution::{Binomial, ContinuousCDF, DiscreteCDF, FisherSnedecor, StudentsT};

pub mod campaign;
mod chosen;
mod figures;
pub mod layout;
pub mod row;
mod tables;
pub mod trial;
pub mod truths;

use chosen::{Criterion, Trial, Verdict};
use layout::{LAYOUTS, Layout};
use row::{HEADER, Row};
use truths::{CANDIDATES, TRUTHS, Truth};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "model-choice",
    title: "Which lens model, and who chooses it",
    question: "Ten true lenses of eight models, photographed with 48 to 5040 marks and noise of 0.1 px; the eight candidates of \
               `--model auto` are fitted to each. How often do RMSE, BIC, the error on views left out and `auto` pick the true model, \
               and how much farther from the truth is what they pick than the best candidate? Expected: the RMSE never picks right \
               where a richer model is fitted; BIC does the more often the more marks there are.",
    seed: SEED,
    takes_image: false,
    run,
};

/// Seed of every trial; not chosen for its result.
const SEED: u64 = 1;
/// The command that makes all trials and writes golden/model-choice/.
const COMMAND: &str = "cargo run --release --bin model-choice-trials";
/// Chance that a correct program fails one of the statistical claims.
const FALSE_ALARM: f64 = 1e-4;
/// Coverage of the intervals that are drawn.
const DRAWN: f64 = 0.05;
/// A choice whose camera is this many times as far from the truth as the best candidate's is called far.
const FAR: f64 = 2.0;
/// Differences of Schwarz's criterion that count as no evidence, tried in the place of the library's 2.
const DIFFERENCES: [f64; 6] = [1.0, 2.0, 3.0, 6.0, 10.0, 20.0];
/// One of them, of which the book speaks.
const WIDER: f64 = 10.0;
/// The library's.
const NO_EVIDENCE: f64 = 2.0;
/// Candidates that contain each other, the smaller first.
const NESTED: [(usize, usize); 6] = [(0, 1), (0, 2), (1, 3), (2, 3), (0, 3), (3, 4)];
/// How much worse a fit with more coefficients may be: a refinement ends where a further step would gain
/// less.
const AS_GOOD: f64 = 1e-5;

/// What was committed of each truth.
const COMMITTED: [&str; 10] = [
    include_str!("../golden/model-choice/two-radial.csv"),
    include_str!("../golden/model-choice/tangential.csv"),
    include_str!("../golden/model-choice/three-radial.csv"),
    include_str!("../golden/model-choice/rational.csv"),
    include_str!("../golden/model-choice/kannala-brandt.csv"),
    include_str!("../golden/model-choice/double-sphere.csv"),
    include_str!("../golden/model-choice/division.csv"),
    include_str!("../golden/model-choice/tilted-sensor.csv"),
    include_str!("../golden/model-choice/thin-prism.csv"),
    include_str!("../golden/model-choice/halcon-polynomial.csv"),
];

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let rows: Vec<Vec<Row>> = TRUTHS.iter().zip(COMMITTED).map(read).collect::<Result<_, _>>()?;
    let whole = |(truth, rows): (&'static Truth, &'_ Vec<Row>)| Trial::all(truth, rows).is_some();
    if !TRUTHS.iter().zip(&rows).all(whole) {
        return Err(ExperimentError::Input(format!("golden/model-choice lacks candidates: run {COMMAND}")));
    }
    let trials: Vec<Trial<'_>> =
        TRUTHS.iter().zip(&rows).filter_map(|(truth, rows)| Trial::all(truth, rows)).flatten().collect();
    for (truth, text) in TRUTHS.iter().zip(COMMITTED) {
        record.input(format!("golden/model-choice/{}.csv", truth.name), text.as_bytes());
    }
    claim_current(&mut record, &trials);
    claim_repeated(&mut record, context)?;
    report(&mut record, &trials);
    claim_exact(&mut record)?;
    claim_rmse(&mut record, &trials);
    claim_bic(&mut record, &trials);
    claim_auto(&mut record, &trials)?;
    claim_camera(&mut record, &trials)?;
    record.table(tables::truths());
    record.table(tables::layouts());
    record.table(tables::taken(&trials));
    record.table(tables::costs(&trials));
    record.table(tables::differences(&trials));
    record.table(tables::fitted(&trials));
    record.figure(figures::right(&trials));
    record.figure(figures::too_rich(&trials));
    record.figure(figures::frame(&trials)?);
    record.figure(figures::cost(&trials));
    Ok(record)
}

fn read((truth, text): (&Truth, &str)) -> Result<Vec<Row>, ExperimentError> {
    let mut lines = text.lines().skip(1);
    let rows =
        (lines.next() == Some(HEADER)).then(|| lines.map(Row::read).collect::<Option<Vec<_>>>()).flatten();
    let broken = || format!("golden/model-choice/{}.csv is broken: run {COMMAND}", truth.name);
    rows.ok_or_else(|| ExperimentError::Input(broken()))
}

/// The committed trials are those of this code, and all are there.
fn claim_current(record: &mut Record, trials: &[Trial<'_>]) {
    let present = Fingerprint::of_model_choice();
    let case = |(truth, text): (&'static Truth, &str)| {
        let (what, held) = present.case(&format!("{}.csv", truth.name), text, COMMAND);
        let whole = |layout: &Layout| {
            count(trials, |t| t.truth.name == truth.name && t.marks == layout.marks()) as u64
                == layout.trials(truth)
        };
        (what, held && LAYOUTS.iter().all(whole))
    };
    record
        .claim_that("trials-are-current", "every committed trial was drawn and fitted by the present code, or by code of which the present has made an eighth again, bit for bit")
        .every("tables", TRUTHS.iter().zip(COMMITTED).map(case))
        .because(
            "SHA-256 of the code lines of solver, truths and layouts, and the versions of the numeric crates",
        );
}

/// The first trial of each truth with the fewest marks is made again in every run.
fn claim_repeated(record: &mut Record, context: &Context) -> Result<(), ExperimentError> {
    if context.seed != SEED {
        record.note("Another seed draws other trials than the committed ones: none is compared.");
        return Ok(());
    }
    let progress = context.progress("trials", TRUTHS.len());
    let again = |truth: &Truth| {
        let rows = trial::Photographs::new(truth, LAYOUTS[0], SEED, 0).map(|photographs| photographs.rows());
        progress.step();
        rows.ok_or("the board does not fit").map_err(ExperimentError::at(truth.name))
    };
    let again: Vec<Vec<Row>> = TRUTHS.par_iter().map(again).collect::<Result<_, _>>()?;
    let case = |((row, truth), text): ((&Row, &Truth), &str)| {
        let what = format!("{}, {}: run {COMMAND}", truth.name, CANDIDATES[row.candidate]);
        (what, text.lines().any(|line| line == row.text()))
    };
    let cases: Vec<(String, bool)> = again
        .iter()
        .zip(&TRUTHS)
        .zip(COMMITTED)
        .flat_map(|((rows, truth), text)| rows.iter().map(move |row| ((row, truth), text)))
        .map(case)
        .collect();
    record.exact("").count("fits-repeated", cases.len(), "candidates that every run fits again");
    record
        .claim_that(
            "share-is-repeated",
            "the trials repeated in this run give the committed fits, choices and differences, bit for bit",
        )
        .every("fits", cases)
        .because("streams are keyed by seed, truth, marks and trial, and every sum has its order");
    Ok(())
}

/// How far from the truth the camera of exact marks may be, px: their refinement ends where a step would gain
/// less than rounding.
const EXACT_PX: f64 = 1e-3;

/// Without noise the true model is the truth.
fn claim_exact(record: &mut Record) -> Result<(), ExperimentError> {
    let mut cases = Vec::new();
    for truth in known() {
        let scene = trial::Photographs::new(truth, LAYOUTS[1], SEED, 0).ok_or("the board does not fit");
        let views = scene.map_err(ExperimentError::at(truth.name))?.exact();
        let Some(right) = truth.right() else { continue };
        let settings = Candidate::usual()[right].settings(&trial::settings(truth));
        let found = calibrate_lens(&views, &settings).map_err(ExperimentError::at(truth.name))?;
        let worst_px = trial::Frame::of(truth, &found.camera).worst_px;
        cases.push((format!("{}: {worst_px:.1e} px", truth.name), worst_px <= EXACT_PX));
    }
    record
        .claim_that(
            "exact-marks-give-the-truth",
            "from marks without noise the true model finds the truth, nowhere in the frame off by more than a thousandth of a pixel",
        )
        .every("truths", cases)
        .because("the cost is zero at the truth; what is left is where the refinement ends");
    Ok(())
}

fn count(trials: &[Trial<'_>], condition: impl Fn(&Trial<'_>) -> bool) -> usize {
    trials.iter().filter(|trial| condition(trial)).count()
}

/// A share with its interval.
#[derive(Debug, Clone, Copy)]
struct Share {
    value: f64,
    interval: Interval,
}

impl Share {
    fn of(part: usize, all: usize) -> Share {
        Share { value: part as f64 / all as f64, interval: Interval::of_proportion(part, all, DRAWN) }
    }

    /// The mean of shares that are independent, with its interval: half-widths add as squares.
    fn mean(shares: &[Share]) -> Share {
        let value = stats::mean(&shares.iter().map(|s| s.value).collect::<Vec<_>>());
        let side = |distance: &dyn Fn(&Share) -> f64| {
            shares.iter().map(|s| distance(s) * distance(s)).sum::<f64>().sqrt() / shares.len() as f64
        };
        let (below, above) = (side(&|s| s.value - s.interval.low), side(&|s| s.interval.high - s.value));
        Share { value, interval: Interval { low: value - below, high: value + above } }
    }
}

/// Truths that are among the candidates.
fn known() -> impl Iterator<Item = &'static Truth> {
    TRUTHS.iter().filter(|truth| truth.right().is_some())
}

/// The trials of a truth with so many marks.
fn of<'t, 'a>(trials: &'t [Trial<'a>], truth: &Truth, marks: usize) -> Vec<&'t Trial<'a>> {
    trials.iter().filter(|t| t.truth.name == truth.name && t.marks == marks).collect()
}

/// How often a criterion comes to a verdict.
fn share(trials: &[Trial<'_>], truth: &Truth, marks: usize, criterion: Criterion, verdict: Verdict) -> Share {
    let all = of(trials, truth, marks);
    Share::of(all.iter().filter(|t| t.verdict(criterion) == verdict).count(), all.len())
}

/// The mean over all truths that are among the candidates of how often a criterion picks right.
fn right(trials: &[Trial<'_>], marks: usize, criterion: Criterion) -> Share {
    let shares: Vec<Share> =
        known().map(|truth| share(trials, truth, marks, criterion, Verdict::Right)).collect();
    Share::mean(&shares)
}

/// How far what a criterion takes is from the truth, over the best candidate: in all trials with so many
/// marks that take anything.
fn ratios(trials: &[Trial<'_>], marks: usize, criterion: Criterion) -> Vec<f64> {
    trials.iter().filter(|t| t.marks == marks).filter_map(|t| t.ratio(criterion)).collect()
}

/// How often that is more than twice as far.
fn far(trials: &[Trial<'_>], marks: usize, criterion: Criterion) -> Share {
    let all = ratios(trials, marks, criterion);
    Share::of(all.iter().filter(|ratio| **ratio > FAR).count(), all.len())
}

/// The middle of a quantity of a candidate over the trials of a truth with so many marks, refused ones
/// counted as infinite.
fn middle(trials: &[Trial<'_>], truth: &Truth, marks: usize, value: impl Fn(&Trial<'_>) -> f64) -> f64 {
    stats::median(&of(trials, truth, marks).into_iter().map(value).collect::<Vec<_>>())
}

fn report(record: &mut Record, trials: &[Trial<'_>]) {
    record
        .exact("")
        .count("truths", TRUTHS.len(), "true lenses")
        .count("trials", trials.len(), "trials of all truths and layouts")
        .count("fits", trials.len() * CANDIDATES.len(), "candidates in all trials");
    for marks in LAYOUTS.map(|layout| layout.marks()) {
        for criterion in Criterion::JUDGED {
            record.exact("").number(
                format!("right-{}-{marks}", criterion.name()),
                right(trials, marks, criterion).value,
                format!(
                    "share that {} picks right with {marks} marks, mean of seven truths",
                    criterion.label()
                ),
            );
        }
        let wider = Criterion::Within(WIDER);
        record
            .exact("")
            .suffix(
                format!("-within-{WIDER}-{marks}"),
                format!(
                    ", views left out among those whose BIC is within {WIDER} of the least, {marks} marks"
                ),
            )
            .number(
                "right",
                right(trials, marks, wider).value,
                "share that the least error on them picks right, mean of seven truths",
            )
            .number(
                "far",
                far(trials, marks, wider).value,
                "share of trials over twice the best candidate's frame error",
            );
        for criterion in Criterion::ALL {
            let mut group = record.exact("");
            group.suffix(
                format!("-{}-{marks}", criterion.name()),
                format!(", {}, {marks} marks", criterion.label()),
            );
            let median = stats::median(&ratios(trials, marks, criterion));
            // There is none where more than half of the choices do not show the frame.
            if median.is_finite() {
                group.number("ratio", median, "median of the frame error over the best candidate's");
            }
            group.number(
                "far",
                far(trials, marks, criterion).value,
                "share of trials in which it is over twice that",
            );
        }
        for (name, truth) in [("division", &TRUTHS[0]), ("division-of-tangential", &TRUTHS[1])] {
            let taken = of(trials, truth, marks);
            let division = |t: &&&Trial<'_>| t.chosen(Criterion::Auto) == Some(CANDIDATES.len() - 1);
            record.exact("").number(
                format!("takes-{name}-{marks}"),
                taken.iter().filter(division).count() as f64 / taken.len() as f64,
                format!(
                    "share that auto takes the division model of the truth {}, {marks} marks",
                    truth.name
                ),
            );
        }
        for truth in &TRUTHS {
            let of_auto = |t: &Trial<'_>| t.chosen(Criterion::Auto).map_or(f64::INFINITY, |i| t.frame_px(i));
            let told = |t: &&&Trial<'_>| {
                t.chosen(Criterion::Auto).and_then(|i| t.fitted(i)).is_some_and(|fitted| fitted.told)
            };
            let all = of(trials, truth, marks);
            record
                .exact("px")
                .suffix(format!("-{}-{marks}", truth.name), format!(", {}, {marks} marks", truth.name))
                .number(
                    "frame",
                    middle(trials, truth, marks, of_auto),
                    "median frame error of what auto takes",
                )
                .unit("")
                .number(
                    "told",
                    all.iter().filter(told).count() as f64 / all.len() as f64,
                    "share in which what auto takes comes with a warning that the model does not hold",
                );
        }
    }
}

/// The RMSE cannot choose.
fn claim_rmse(record: &mut Record, trials: &[Trial<'_>]) {
    let pair = |t: &Trial<'_>, (small, large): (usize, usize)| {
        let (a, b) = (t.fitted(small)?.rmse_px, t.fitted(large)?.rmse_px);
        let what = format!(
            "{}, {} marks, trial {}: {} {b:.6}, {} {a:.6}",
            t.truth.name, t.marks, t.number, CANDIDATES[large], CANDIDATES[small]
        );
        Some((what, b <= a * (1.0 + AS_GOOD)))
    };
    let of_brown = || trials.iter().filter(|t| t.truth.right().is_some_and(|i| i < 3));
    record
        .claim_that(
            "more-coefficients-fit-no-worse",
            "where the truth is Brown-Conrady's, a candidate that contains another never leaves larger residuals",
        )
        .every("pairs", of_brown().flat_map(|t| NESTED.iter().filter_map(|&nested| pair(t, nested))))
        .because("the larger set of cameras contains the smaller one's best; rounding of the table and end of the refinement");
    let all = Candidate::usual();
    let case = |t: &Trial<'_>| {
        let own = t.truth.right().and_then(|i| t.fitted(i)).map_or(f64::INFINITY, |f| f.rmse_px);
        let rivals = (0..all.len()).filter(|&i| Some(i) != t.truth.right() && t.truth.is_within(&all[i]));
        let as_small = rivals.filter_map(|i| t.fitted(i)).any(|f| f.rmse_px <= own);
        (format!("{}, {} marks, trial {}", t.truth.name, t.marks, t.number), as_small)
    };
    record
        .claim_that(
            "rmse-never-tells-the-truth-from-more",
            "in every trial a candidate that contains the true lens and more leaves an RMSE as small as the true one's, or smaller",
        )
        .every("trials", of_brown().map(case))
        .because("one coefficient more follows some noise, if only beyond the digits of the table");
}

/// Chance that Schwarz's criterion prefers a candidate with `more` coefficients than the true one: `n ln(1 +
/// d F / f) > d ln n`, F Fisher's with d and f degrees of freedom.
fn preferred(layout: &Layout, true_coefficients: usize, more: usize) -> f64 {
    let n = 2.0 * layout.marks() as f64;
    let freedom = 2 * layout.marks() - 4 - true_coefficients - more - 6 * layout.views;
    let needed = libm::expm1(more as f64 * libm::log(n) / n) * freedom as f64 / more as f64;
    fisher_tail(needed, more, freedom)
}

/// The chance that it prefers any that contains the truth, at most.
fn too_rich_at_most(layout: &Layout, truth: &Truth) -> f64 {
    let all = Candidate::usual();
    let own = truth.right().map_or(0, |i| all[i].coefficients.len());
    let richer = all.iter().filter(|c| truth.is_within(c) && c.coefficients.len() > own);
    richer.map(|c| preferred(layout, own, c.coefficients.len() - own)).sum::<f64>().min(1.0)
}

/// Schwarz's criterion picks too rich a model no more often than theory says, and one that contains the truth
/// more and more often.
fn claim_bic(record: &mut Record, trials: &[Trial<'_>]) {
    let truths = || known().filter(|truth| truth.right().is_some_and(|i| i < 3));
    let each = stats::each_of(LAYOUTS.len(), FALSE_ALARM);
    let case = |layout: &Layout| {
        let all: Vec<&Trial<'_>> = truths().flat_map(|truth| of(trials, truth, layout.marks())).collect();
        let found = all.iter().filter(|t| t.verdict(Criterion::Bic) == Verdict::TooRich).count();
        let chance = stats::mean(&all.iter().map(|t| too_rich_at_most(layout, t.truth)).collect::<Vec<_>>());
        let beyond = found.checked_sub(1).map_or(1.0, |fewer| {
            Binomial::new(chance, all.len() as u64).map_or(0.0, |binomial| binomial.sf(fewer as u64))
        });
        let what = format!(
            "{} marks: {found} of {}, expected {:.1}",
            layout.marks(),
            all.len(),
            chance * all.len() as f64
        );
        (what, beyond > each)
    };
    record
        .claim_that(
            "bic-is-too-rich-as-fisher-says",
            "where the truth is Brown-Conrady's, BIC takes too many coefficients no more often than Fisher's distribution says",
        )
        .every("layouts", LAYOUTS.iter().map(case))
        .at_rate(FALSE_ALARM)
        .because("the chance of each richer candidate, added over them; a binomial count over the trials, Bonferroni over layouts");
    for layout in LAYOUTS {
        let expected: Vec<f64> = truths().map(|truth| too_rich_at_most(&layout, truth)).collect();
        record.exact("").number(
            format!("bic-too-rich-{}", layout.marks()),
            stats::largest(expected),
            format!(
                "chance that BIC takes too many coefficients, at most, {} marks, the largest of three truths",
                layout.marks()
            ),
        );
    }
}

/// What `auto` is, and what its choice costs.
fn claim_auto(record: &mut Record, trials: &[Trial<'_>]) -> Result<(), ExperimentError> {
    let name = |t: &Trial<'_>| format!("{}, {} marks, trial {}", t.truth.name, t.marks, t.number);
    let as_said =
        |t: &Trial<'_>| (name(t), t.chosen(Criterion::Auto) == t.chosen(Criterion::Within(NO_EVIDENCE)));
    record
        .claim_that(
            "auto-is-what-it-says",
            "`--model auto` takes, of those in their model's range whose BIC is within 2 of the least, the one with the least error on views \
             left out",
        )
        .every("trials", trials.iter().map(as_said))
        .because(
            "the definition, applied to the committed table, in which what is out of its range stands behind candidates of a higher BIC",
        );
    let is_right = |t: &Trial<'_>, criterion: Criterion| t.verdict(criterion) == Verdict::Right;
    let only = |one: Criterion, other: Criterion| count(trials, |t| is_right(t, one) && !is_right(t, other));
    let (bic, hold_out) =
        (only(Criterion::Bic, Criterion::HoldOut), only(Criterion::HoldOut, Criterion::Bic));
    record
        .exact("")
        .count(
            "bic-alone-right",
            bic,
            "trials in which BIC is right and the least error on views left out is not",
        )
        .count("hold-out-alone-right", hold_out, "trials in which it is the other way round");
    let differing = (bic + hold_out) as u64;
    let fair = Binomial::new(0.5, differing).map_err(ExperimentError::at("a fair coin"))?;
    record
        .claim_that(
            "bic-is-right-more-often-than-views-left-out",
            "of the trials in which one of both is right, BIC is in more",
        )
        .at_least(bic as f64, fair.inverse_cdf(1.0 - FALSE_ALARM) as f64)
        .at_rate(FALSE_ALARM)
        .because("the sign test; the false-alarm rate is that of two criteria equally good");
    Ok(())
}

/// The camera: unbiased where the model is true, biased where a term is missing.
fn claim_camera(record: &mut Record, trials: &[Trial<'_>]) -> Result<(), ExperimentError> {
    const MARKS: usize = 504;
    let names = ["fx", "fy", "cx", "cy"];
    let errors = |truth: &Truth, candidate: usize, k: usize| -> Vec<f64> {
        let fitted = of(trials, truth, MARKS).into_iter().filter_map(|t| t.fitted(candidate));
        fitted.map(|f| f.errors_px[k]).collect()
    };
    let t_value = |truth: &Truth, candidate: usize, k: usize| {
        let errors = errors(truth, candidate, k);
        let (n, mean) = (errors.len() as f64, stats::mean(&errors));
        let variance = errors.iter().map(|e| (e - mean) * (e - mean)).sum::<f64>() / (n - 1.0);
        (mean / (variance / n).sqrt(), errors.len())
    };
    let limit = |count: usize, each: f64| -> Result<f64, ExperimentError> {
        let t = StudentsT::new(0.0, 1.0, count as f64 - 1.0).map_err(ExperimentError::at("Student's t"))?;
        Ok(t.inverse_cdf(1.0 - 0.5 * each))
    };
    let each = stats::each_of(names.len() * known().count(), FALSE_ALARM);
    let mut cases = Vec::new();
    for truth in known() {
        let Some(candidate) = truth.right() else { continue };
        for (k, name) in names.iter().enumerate() {
            let (t, count) = t_value(truth, candidate, k);
            cases.push((
                format!("{}, {name}: t = {t:.2} of {count}", truth.name),
                t.abs() <= limit(count, each)?,
            ));
        }
    }
    record
        .claim_that(
            "the-true-model-is-unbiased",
            "fitted with the true model, focal lengths and principal point of 504 marks have no mean error",
        )
        .every("means", cases)
        .at_rate(FALSE_ALARM)
        .because("Student's t over trials whose poses and noise are drawn anew, Bonferroni over truths and parameters");
    for (truth, candidate) in
        [(&TRUTHS[1], 0), (&TRUTHS[1], 2), (&TRUTHS[2], 0), (&TRUTHS[2], 1), (&TRUTHS[7], 2), (&TRUTHS[8], 2)]
    {
        for (k, name) in names.iter().enumerate() {
            record.exact("px").number(
                format!("error-{name}-{}-{}", CANDIDATES[candidate], truth.name),
                stats::root_mean_square(errors(truth, candidate, k)),
                format!(
                    "root mean square error of {name} of {} fitted to {}, {MARKS} marks",
                    CANDIDATES[candidate], truth.name
                ),
            );
        }
    }
    let square = |candidate: usize| {
        let errors = errors(&TRUTHS[2], candidate, 0);
        errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64
    };
    let freedom = errors(&TRUTHS[2], 0, 0).len() as f64;
    let fisher = FisherSnedecor::new(freedom, freedom).map_err(ExperimentError::at("Fisher's F"))?;
    record
        .claim_that(
            "a-missing-term-costs",
            "k1 and k2 fitted to a lens with a strong k3 err more in the focal length, mean square, than the true model does",
        )
        .at_least(square(0) / square(1), fisher.inverse_cdf(1.0 - FALSE_ALARM))
        .at_rate(FALSE_ALARM)
        .because("Fisher's F; the false-alarm rate is that of a term that costs nothing. Its bias depends on the poses, so that over trials it spreads");
    Ok(())
}
