//! Truths, layouts, what was taken, what it cost, and every candidate's camera.

use super::chosen::{Criterion, Trial};
use super::layout::LAYOUTS;
use super::row::Fitted;
use super::trial::NOISE_PX;
use super::truths::{CANDIDATES, TRUTHS, Truth};
use super::{DIFFERENCES, FAR, far, middle, of, ratios, right};
use calibench::geometry::Vec2;
use calibench_harness::{Cell, Table, stats};

/// The true lenses.
pub fn truths() -> Table {
    Table::of(
        "truths",
        "The true lenses. The field of view is that of the middle row, and of a diagonal",
        &TRUTHS,
    )
    .column("truth", "", |truth| truth.name)
    .column("lens", "", |truth| truth.about)
    .column("width", "px", |truth| truth.size.0)
    .column("height", "px", |truth| truth.size.1)
    .column("across", "deg", |truth| field_deg(truth, false))
    .column("diagonal", "deg", |truth| field_deg(truth, true))
    .column("right", "", |truth| truth.right().map_or("none", |i| CANDIDATES[i]))
    .into()
}

/// The angle between the rays of two pixels at the ends of the middle row or of a diagonal, through the
/// optical axis.
fn field_deg(truth: &Truth, diagonal: bool) -> f64 {
    let (camera, (width, height)) = (truth.camera(), truth.size);
    let (right, bottom) = (width as f64 - 1.0, height as f64 - 1.0);
    let ends = match diagonal {
        true => [Vec2::zeros(), Vec2::new(right, bottom)],
        false => [Vec2::new(0.0, 0.5 * bottom), Vec2::new(right, 0.5 * bottom)],
    };
    let off_axis = |pixel: Vec2| {
        camera.ray(&pixel).map_or(f64::NAN, |ray| libm::atan2(ray.xy().norm(), ray.z).to_degrees())
    };
    ends.map(off_axis).iter().sum()
}

/// The layouts.
pub fn layouts() -> Table {
    let caption = format!(
        "The layouts: views of one board, {NOISE_PX} px of noise on each coordinate, and the trials of a truth; fewer of truths that are slow \
         (rational, Kannala-Brandt, double sphere, tilted sensor)"
    );
    Table::of("layouts", caption, &LAYOUTS)
        .column("marks", "", |layout| layout.marks())
        .column("views", "", |layout| layout.views)
        .column("columns", "", |layout| layout.columns)
        .column("rows", "", |layout| layout.rows)
        .column("trials", "", |layout| layout.trials(&TRUTHS[0]) as usize)
        .column("trials_slow", "", |layout| layout.trials(&TRUTHS[3]) as usize)
        .into()
}

/// What each criterion takes most often.
pub fn taken(trials: &[Trial<'_>]) -> Table {
    let caption = "What each criterion takes most often, and in how many trials";
    let most = |all: &[&Trial<'_>], criterion: Criterion| {
        let times = |i: usize| all.iter().filter(|t| t.chosen(criterion) == Some(i)).count();
        // Of equals the first, which has fewer coefficients.
        let first = (0..CANDIDATES.len()).rev().max_by_key(|&i| times(i)).unwrap_or(0);
        format!("{} ({})", CANDIDATES[first], times(first))
    };
    Table::of(
        "taken",
        caption,
        of_each_layout().map(|(truth, marks)| (truth, marks, of(trials, truth, marks))),
    )
    .column("truth", "", |(truth, ..)| truth.name)
    .column("marks", "", |(_, marks, _)| *marks)
    .column("trials", "", |(.., all)| all.len())
    .columns(Criterion::JUDGED.map(column_name), "", |(.., all)| {
        Criterion::JUDGED.map(|criterion| most(all, criterion))
    })
    .into()
}

/// Every truth with the marks of every layout.
fn of_each_layout() -> impl Iterator<Item = (&'static Truth, usize)> {
    TRUTHS.iter().flat_map(|truth| LAYOUTS.map(|layout| (truth, layout.marks())))
}

fn column_name(criterion: Criterion) -> String {
    criterion.name().replace('-', "_")
}

/// What each criterion costs, truth by truth.
pub fn costs(trials: &[Trial<'_>]) -> Table {
    let caption = "Median difference from the truth over the frame of the best candidate of each trial, and how many times as far what a \
                   criterion takes is, median";
    let best = |t: &Trial<'_>| stats::smallest((0..CANDIDATES.len()).map(|i| t.frame_px(i)));
    let cost = |truth, marks, criterion| {
        let ratios = of(trials, truth, marks).into_iter().filter_map(|t| t.ratio(criterion));
        finite(stats::median(&ratios.collect::<Vec<_>>()))
    };
    Table::of("costs", caption, of_each_layout())
        .column("truth", "", |(truth, _)| truth.name)
        .column("marks", "", |(_, marks)| *marks)
        .column("best", "px", |(truth, marks)| finite(middle(trials, truth, *marks, best)))
        .columns(Criterion::ALL.map(column_name), "", |&(truth, marks)| {
            Criterion::ALL.map(|criterion| cost(truth, marks, criterion))
        })
        .into()
}

/// Other differences of the criterion that count as none.
pub fn differences(trials: &[Trial<'_>]) -> Table {
    let caption = format!(
        "`--model auto` with other differences of BIC that count as no evidence, so that views left out decide: the share that it picks \
         right, mean of the truths that are among the candidates, and the share of all trials whose camera is over {FAR} times as far from \
         the truth as the best candidate's"
    );
    let marks = LAYOUTS.map(|layout| layout.marks());
    let alone = ("BIC alone".to_string(), Criterion::Bic);
    let within = DIFFERENCES.map(|difference| (format!("{difference}"), Criterion::Within(difference)));
    let none = ("views left out alone".to_string(), Criterion::HoldOut);
    let named = |what: &str| marks.map(|marks| format!("{what}_{marks}"));
    Table::of("differences", caption, [alone].into_iter().chain(within).chain([none]))
        .column("difference", "", |(name, _)| name.clone())
        .columns(named("right"), "", |&(_, criterion)| {
            marks.map(|marks| right(trials, marks, criterion).value)
        })
        .columns(named("far"), "", |&(_, criterion)| marks.map(|marks| far(trials, marks, criterion).value))
        .into()
}

/// Every candidate's camera against every truth.
pub fn fitted(trials: &[Trial<'_>]) -> Table {
    let caption = "Every candidate fitted to every truth: how many trials determine it, median of the root mean square and of the largest \
                   difference from the truth over the frame, mean and standard deviation of the errors of focal length and principal point";
    let rows = TRUTHS.iter().flat_map(|truth| {
        (0..CANDIDATES.len()).flat_map(move |candidate| {
            LAYOUTS.map(|layout| Fits {
                truth,
                candidate,
                all: of(trials, truth, layout.marks()),
                marks: layout.marks(),
            })
        })
    });
    Table::of("fitted", caption, rows)
        .column("truth", "", |fits| fits.truth.name)
        .column("candidate", "", |fits| CANDIDATES[fits.candidate])
        .column("marks", "", |fits| fits.marks)
        .column("trials", "", |fits| fits.all.len())
        .column("fitted", "", |fits| fits.found().count())
        .column("frame", "px", |fits| {
            finite(middle(trials, fits.truth, fits.marks, |t| t.frame_px(fits.candidate)))
        })
        .column("worst", "px", |fits| {
            finite(stats::median(&fits.found().map(|f| f.worst_px).collect::<Vec<_>>()))
        })
        .columns(["fx_bias", "fx_sd"], "px", |fits| fits.moments(0))
        .columns(["cx_bias", "cx_sd"], "px", |fits| fits.moments(2))
        .columns(["cy_bias", "cy_sd"], "px", |fits| fits.moments(3))
        .into()
}

/// A candidate fitted to the trials of a truth with so many marks.
struct Fits<'a> {
    truth: &'static Truth,
    candidate: usize,
    marks: usize,
    all: Vec<&'a Trial<'a>>,
}

impl Fits<'_> {
    /// The trials that determine it.
    fn found(&self) -> impl Iterator<Item = &Fitted> {
        self.all.iter().filter_map(|t| t.fitted(self.candidate))
    }

    /// Mean and standard deviation of the error of a linear parameter.
    fn moments(&self, parameter: usize) -> [Cell; 2] {
        let errors: Vec<f64> = self.found().map(|f| f.errors_px[parameter]).collect();
        let mean = stats::mean(&errors);
        [mean, stats::root_mean_square(errors.iter().map(|e| e - mean))].map(finite)
    }
}

/// A number, or a dash where most cameras do not show the frame.
fn finite(value: f64) -> Cell {
    if value.is_finite() { value.into() } else { "-".into() }
}

/// The median ratio of a criterion over all trials with so many marks.
pub fn median_ratio(trials: &[Trial<'_>], marks: usize, criterion: Criterion) -> f64 {
    stats::median(&ratios(trials, marks, criterion))
}
