//! Truths, layouts, what was taken, what it cost, and every candidate's camera.

use super::chosen::{Criterion, Trial};
use super::layout::LAYOUTS;
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

/// The angle between the rays of two pixels at the ends of the middle row or of a diagonal, through the optical axis.
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
    let columns = [
        ("truth", ""),
        ("marks", ""),
        ("trials", ""),
        ("rmse", ""),
        ("bic", ""),
        ("hold_out", ""),
        ("auto", ""),
    ];
    let caption = "What each criterion takes most often, and in how many trials";
    let mut table = Table::new("taken", caption, &columns);
    for truth in &TRUTHS {
        for marks in LAYOUTS.map(|layout| layout.marks()) {
            let all = of(trials, truth, marks);
            let most = |criterion: Criterion| -> Cell {
                let times = |i: usize| all.iter().filter(|t| t.chosen(criterion) == Some(i)).count();
                // Of equals the first, which has fewer coefficients.
                let first = (0..CANDIDATES.len()).rev().max_by_key(|&i| times(i)).unwrap_or(0);
                format!("{} ({})", CANDIDATES[first], times(first)).into()
            };
            let mut row: Vec<Cell> = vec![truth.name.into(), marks.into(), all.len().into()];
            row.extend(Criterion::JUDGED.map(most));
            table.push(row);
        }
    }
    table
}

/// What each criterion costs, truth by truth.
pub fn costs(trials: &[Trial<'_>]) -> Table {
    let names = Criterion::ALL.map(|criterion| criterion.name().replace('-', "_"));
    let mut columns = vec![("truth", ""), ("marks", ""), ("best", "px")];
    columns.extend(names.iter().map(|name| (name.as_str(), "")));
    let caption = "Median difference from the truth over the frame of the best candidate of each trial, and how many times as far what a \
                   criterion takes is, median";
    let mut table = Table::new("costs", caption, &columns);
    for truth in &TRUTHS {
        for marks in LAYOUTS.map(|layout| layout.marks()) {
            let best = |t: &Trial<'_>| stats::smallest((0..CANDIDATES.len()).map(|i| t.frame_px(i)));
            let mut row: Vec<Cell> =
                vec![truth.name.into(), marks.into(), finite(middle(trials, truth, marks, best))];
            row.extend(Criterion::ALL.map(|criterion| {
                let ratio = |t: &&Trial<'_>| t.ratio(criterion);
                finite(stats::median(&of(trials, truth, marks).iter().filter_map(ratio).collect::<Vec<_>>()))
            }));
            table.push(row);
        }
    }
    table
}

/// Other differences of the criterion that count as none.
pub fn differences(trials: &[Trial<'_>]) -> Table {
    let caption = format!(
        "`--model auto` with other differences of BIC that count as no evidence, so that views left out decide: the share that it picks \
         right, mean of the truths that are among the candidates, and the share of all trials whose camera is over {FAR} times as far from \
         the truth as the best candidate's"
    );
    let marks = LAYOUTS.map(|layout| layout.marks());
    let names: Vec<String> = ["right", "far"]
        .iter()
        .flat_map(|what| marks.iter().map(move |marks| format!("{what}_{marks}")))
        .collect();
    let mut columns = vec![("difference", "")];
    columns.extend(names.iter().map(|name| (name.as_str(), "")));
    let mut table = Table::new("differences", caption, &columns);
    let alone = ("BIC alone".to_string(), Criterion::Bic);
    let within = DIFFERENCES.map(|difference| (format!("{difference}"), Criterion::Within(difference)));
    let none = ("views left out alone".to_string(), Criterion::HoldOut);
    for (name, criterion) in [alone].into_iter().chain(within).chain([none]) {
        let mut row: Vec<Cell> = vec![name.into()];
        row.extend(marks.map(|marks| Cell::from(right(trials, marks, criterion).value)));
        row.extend(marks.map(|marks| Cell::from(far(trials, marks, criterion).value)));
        table.push(row);
    }
    table
}

/// Every candidate's camera against every truth.
pub fn fitted(trials: &[Trial<'_>]) -> Table {
    let columns = [
        ("truth", ""),
        ("candidate", ""),
        ("marks", ""),
        ("trials", ""),
        ("fitted", ""),
        ("frame", "px"),
        ("worst", "px"),
        ("fx_bias", "px"),
        ("fx_sd", "px"),
        ("cx_bias", "px"),
        ("cx_sd", "px"),
        ("cy_bias", "px"),
        ("cy_sd", "px"),
    ];
    let caption = "Every candidate fitted to every truth: how many trials determine it, median of the root mean square and of the largest \
                   difference from the truth over the frame, mean and standard deviation of the errors of focal length and principal point";
    let mut table = Table::new("fitted", caption, &columns);
    for truth in &TRUTHS {
        for (candidate, name) in CANDIDATES.iter().enumerate() {
            for marks in LAYOUTS.map(|layout| layout.marks()) {
                let all = of(trials, truth, marks);
                let found: Vec<_> = all.iter().filter_map(|t| t.fitted(candidate)).collect();
                let moments = |k: usize| {
                    let errors: Vec<f64> = found.iter().map(|f| f.errors_px[k]).collect();
                    let mean = stats::mean(&errors);
                    [finite(mean), finite(stats::root_mean_square(errors.iter().map(|e| e - mean)))]
                };
                let worst = stats::median(&found.iter().map(|f| f.worst_px).collect::<Vec<_>>());
                let mut row: Vec<Cell> = vec![
                    truth.name.into(),
                    (*name).into(),
                    marks.into(),
                    all.len().into(),
                    found.len().into(),
                ];
                row.extend([finite(middle(trials, truth, marks, |t| t.frame_px(candidate))), finite(worst)]);
                row.extend([0, 2, 3].into_iter().flat_map(moments));
                table.push(row);
            }
        }
    }
    table
}

/// A number, or a dash where most cameras do not show the frame.
fn finite(value: f64) -> Cell {
    if value.is_finite() { value.into() } else { "-".into() }
}

/// The median ratio of a criterion over all trials with so many marks.
pub fn median_ratio(trials: &[Trial<'_>], marks: usize, criterion: Criterion) -> f64 {
    stats::median(&ratios(trials, marks, criterion))
}
