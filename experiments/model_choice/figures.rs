//! How often each criterion picks right, how often too rich, what each candidate's camera is worth, and what
//! a choice costs.

use super::chosen::{Criterion, Trial, Verdict};
use super::layout::LAYOUTS;
use super::tables::median_ratio;
use super::truths::{CANDIDATES, TRUTHS, Truth};
use super::{FAR, SEED, Share, far, known, middle, of, right as right_share, share, too_rich_at_most};
use calibench_harness::figure::HeatMap;
use calibench_harness::{Dash, ExperimentError, Figure, Look, Plot, stats};

const MARKS: &str = "marks";
/// Neighbouring criteria are drawn this part apart, so that their intervals stay legible.
const APART: f64 = 1.07;

fn marks() -> [usize; 5] {
    LAYOUTS.map(|layout| layout.marks())
}

fn beside(title: &str, y: &str) -> Plot {
    Plot::new(title, MARKS, y).size(360.0, 290.0).log_x().x_range(35.0, 7000.0)
}

/// A share against the marks for each of some criteria.
fn shares(mut plot: Plot, criteria: &[Criterion], value: impl Fn(Criterion, usize) -> Share) -> Plot {
    for (k, &criterion) in criteria.iter().enumerate() {
        let shift = libm::pow(APART, 2.0 * k as f64 - criteria.len() as f64 + 1.0);
        let found = marks().map(|marks| {
            let Share { value, interval } = value(criterion, marks);
            (marks as f64 * shift, value, interval.low, interval.high)
        });
        let look = Look::series(k);
        plot = plot.line_as("", found.iter().map(|&(x, y, ..)| (x, y)), look).measured_as(
            criterion.label(),
            found,
            look,
        );
    }
    plot.y_range(-0.03, 1.03)
}

/// The share picked right, truth by truth and on the mean.
pub fn right(trials: &[Trial<'_>]) -> Figure {
    let of_truth = |truth: &'static Truth| {
        shares(beside(truth.name, "share picked right"), &Criterion::JUDGED, |criterion, marks| {
            share(trials, truth, marks, criterion, Verdict::Right)
        })
    };
    let mean =
        shares(beside("mean of the seven", "share picked right"), &Criterion::JUDGED, |criterion, marks| {
            right_share(trials, marks, criterion)
        });
    let plots: Vec<Plot> = known().map(of_truth).chain([mean]).collect();
    let at = |criterion: Criterion, marks: usize| 100.0 * right_share(trials, marks, criterion).value;
    let [fewest, .., most] = marks();
    let caption = format!(
        "Share of trials in which each criterion picks the true model with its coefficients, against the marks of all views; noise 0.1 px, \
         seed {SEED}, intervals of 95 %. Notice that the RMSE is hardly ever right where another candidate follows the marks as well, and that with few marks \
         division is taken for Brown-Conrady: {:.0} % of the choices of auto are right on the mean with {fewest} marks and {:.0} % with \
         {most}, {:.0} % and {:.0} % of those of BIC.",
        at(Criterion::Auto, fewest),
        at(Criterion::Auto, most),
        at(Criterion::Bic, fewest),
        at(Criterion::Bic, most),
    );
    Figure::panels("right", &plots, 3, caption)
}

/// The share that has superfluous coefficients, of the three truths that other candidates contain.
pub fn too_rich(trials: &[Trial<'_>]) -> Figure {
    let truths: Vec<&'static Truth> = known().filter(|truth| truth.right().is_some_and(|i| i < 3)).collect();
    let pooled = |criterion: Criterion, marks: usize| {
        let all: Vec<&Trial<'_>> = truths.iter().flat_map(|truth| of(trials, truth, marks)).collect();
        Share::of(all.iter().filter(|t| t.verdict(criterion) == Verdict::TooRich).count(), all.len())
    };
    let expected = LAYOUTS.map(|layout| {
        let chances: Vec<f64> = truths.iter().map(|truth| too_rich_at_most(&layout, truth)).collect();
        (layout.marks() as f64, stats::mean(&chances))
    });
    let plot = Plot::new("superfluous coefficients", MARKS, "share of trials").log_x().line_as(
        "BIC at most, Fisher's F",
        expected,
        Look::ink().dash(Dash::Dotted),
    );
    let plot = shares(plot, &Criterion::JUDGED, pooled);
    let all = |criterion: Criterion| marks().map(|marks| 100.0 * pooled(criterion, marks).value);
    let caption = format!(
        "Share of trials in which a criterion takes the true lens with superfluous coefficients, of the three Brown-Conrady truths together; \
         noise 0.1 px, seed {SEED}, intervals of 95 %. Dotted: the most that Fisher's F lets BIC take. Notice that the RMSE takes too \
         many in {:.0} % of the trials or more whatever the marks, BIC in {:.0} % at most.",
        stats::smallest(all(Criterion::Rmse)),
        stats::largest(all(Criterion::Bic)),
    );
    Figure::plot("too-rich", &plot, caption)
}

/// Difference over the frame of every candidate's camera from every truth.
pub fn frame(trials: &[Trial<'_>]) -> Result<Figure, ExperimentError> {
    let panel = |marks: usize| {
        let names: Vec<String> = TRUTHS.iter().rev().map(|truth| truth.name.to_string()).collect();
        let values = TRUTHS
            .iter()
            .rev()
            .flat_map(|truth| {
                (0..CANDIDATES.len()).map(move |i| middle(trials, truth, marks, |t| t.frame_px(i)))
            })
            .collect();
        let columns = CANDIDATES.iter().enumerate().map(|(i, _)| SHORT[i].to_string()).collect();
        let heat =
            HeatMap::new("median (px)", columns, names, values).map_err(ExperimentError::at("figure"))?;
        let heat = heat.logarithmic().range(0.01, 100.0);
        Ok::<Plot, ExperimentError>(
            Plot::heat_map(format!("{marks} marks"), "fitted", "truth", heat).size(760.0, 400.0),
        )
    };
    let [_, few, .., most] = marks();
    let right = |marks: usize| {
        let found: Vec<f64> = known()
            .filter_map(|truth| {
                let right = truth.right()?;
                Some(middle(trials, truth, marks, |t| t.frame_px(right)))
            })
            .collect();
        (stats::smallest(found.iter().copied()), stats::largest(found.iter().copied()))
    };
    let ((few_least, few_most), (least, largest)) = (right(few), right(most));
    let caption = format!(
        "Median over the trials of the root mean square difference from the truth over the frame, the best rotation taken out: truths as rows, \
         candidates as columns (numbers of coefficients are those of Brown-Conrady; t: with tangential terms), noise 0.1 px, seed {SEED}. A dash: \
         in more than half of the trials the candidate is refused or does not show the frame. Notice that the true model's camera is off by \
         {few_least:.2} to {few_most:.2} px with {few} marks and by {least:.2} to {largest:.2} px with {most}, and that what cannot follow \
         the lens stays where it is."
    );
    Ok(Figure::panels("frame", &[panel(few)?, panel(most)?], 1, caption))
}

/// The candidates in a word that fits over a column.
const SHORT: [&str; CANDIDATES.len()] =
    ["k1 k2", "k1 k2 k3", "k1 k2 t", "k1 k2 k3 t", "rational", "Kannala-B.", "double s.", "division"];

/// How much farther from the truth a choice is than the best candidate.
pub fn cost(trials: &[Trial<'_>]) -> Figure {
    let mut middle = Plot::new("median", MARKS, "frame error over the best candidate's").log_x().log_y();
    for (k, criterion) in Criterion::ALL.into_iter().enumerate() {
        let found: Vec<(f64, f64)> = marks()
            .into_iter()
            .map(|marks| (marks as f64, median_ratio(trials, marks, criterion)))
            .filter(|(_, ratio)| ratio.is_finite())
            .collect();
        let look = if criterion == Criterion::Known { Look::ink() } else { Look::series(k) };
        middle = middle.line_as("", found.clone(), look).points_as(criterion.label(), found, look);
    }
    let title = format!("over {FAR} times the best candidate's");
    let shared =
        shares(Plot::new(title, MARKS, "share of trials").log_x(), &Criterion::JUDGED, |criterion, marks| {
            far(trials, marks, criterion)
        });
    let of_auto = marks().map(|marks| median_ratio(trials, marks, Criterion::Auto));
    let caption = format!(
        "Difference from the truth over the frame of what a criterion takes, over that of the trial's best candidate, of all ten truths: median, \
         and share of trials in which it is over {FAR} times as large, with intervals of 95 %; noise 0.1 px, seed {SEED}. What shows \
         less than the frame in most trials has no median. Notice that knowing \
         the true model brings {:.2} with {} marks, where auto brings {:.2}: the best candidate of a trial is known afterwards only.",
        median_ratio(trials, marks()[0], Criterion::Known),
        marks()[0],
        of_auto[0],
    );
    Figure::panels("cost", &[middle, shared], 2, caption)
}
