//! How the gate works, drawn.

use calibench_gate::Property;
use calibench_harness::{Align, Dash, Drawing, Figure, Look};

/// From truth to verdict: who sees what.
pub fn steps(scenarios: usize, faults: usize) -> Figure {
    const WIDTH: f64 = 232.0;
    const GAP: f64 = 58.0;
    let left = [12.0, 12.0 + WIDTH + GAP, 12.0 + 2.0 * (WIDTH + GAP)];
    let top = [12.0, 12.0 + Drawing::box_height(4) + 66.0];
    let boxes: [(usize, usize, &str, Vec<String>); 6] = [
        (
            0,
            0,
            "Truth",
            vec![
                format!("{scenarios} scenarios:"),
                "camera, poses, target,".into(),
                "size of the noise, and what".into(),
                "is to be estimated".into(),
            ],
        ),
        (
            1,
            0,
            "Problem",
            vec![
                "points and noisy pixels,".into(),
                "many samples a scenario;".into(),
                "also turned, reordered,".into(),
                "scaled, poor, or broken".into(),
            ],
        ),
        (
            2,
            0,
            "The solver under test",
            vec![
                "any program: reads a line,".into(),
                "writes a line. Or, to try".into(),
                format!("the gate: one of {faults} planted"),
                "faults".into(),
            ],
        ),
        (
            2,
            1,
            "Answer",
            vec!["camera, poses, residual,".into(), "covariance".into(), "or: refused, and why".into()],
        ),
        (
            1,
            1,
            "One check a property",
            vec![
                format!("{} properties, each", Property::ALL.len()),
                "with its own p-value, or".into(),
                "with nothing left to chance".into(),
            ],
        ),
        (
            0,
            1,
            "Verdict",
            vec![
                "one false-alarm rate for".into(),
                "all checks together (Holm)".into(),
                "trusted, or failed by name".into(),
            ],
        ),
    ];
    let sheet = Drawing::new(left[2] + WIDTH + 12.0, top[1] + Drawing::box_height(3) + 12.0);
    let drawing = boxes.iter().enumerate().fold(sheet, |drawing, (k, (column, row, heading, rows))| {
        drawing.boxed((left[*column], top[*row]), WIDTH, *heading, rows, Look::series(k))
    });
    let (upper, lower) = (top[0] + 0.5 * Drawing::box_height(4), top[1] + 0.5 * Drawing::box_height(3));
    let bottom = top[0] + Drawing::box_height(4);
    let (arrow, around) = (Look::ink().width(1.6), Look::ink().width(1.6).dash(Dash::Dashed));
    let drawing = drawing
        .arrow((left[0] + WIDTH + 4.0, upper), (left[1] - 4.0, upper), arrow)
        .words("noise", (left[1] - 0.5 * GAP, upper - 12.0), Align::Middle)
        .arrow((left[1] + WIDTH + 4.0, upper), (left[2] - 4.0, upper), arrow)
        .arrow((left[2] + 0.5 * WIDTH, bottom + 4.0), (left[2] + 0.5 * WIDTH, top[1] - 4.0), arrow)
        .arrow((left[2] - 4.0, lower), (left[1] + WIDTH + 4.0, lower), arrow)
        .arrow((left[1] - 4.0, lower), (left[0] + WIDTH + 4.0, lower), arrow)
        .line(
            [
                (left[0] + 0.5 * WIDTH, bottom + 4.0),
                (left[0] + 0.5 * WIDTH, bottom + 33.0),
                (left[1] + 0.5 * WIDTH, bottom + 33.0),
            ],
            around,
        )
        .arrow((left[1] + 0.5 * WIDTH, bottom + 33.0), (left[1] + 0.5 * WIDTH, top[1] - 4.0), around)
        .words(
            "truth and its Cramer-Rao bound, past the solver",
            (left[0] + 0.5 * WIDTH + 8.0, bottom + 22.0),
            Align::Start,
        );
    let caption = format!(
        "From truth to verdict. The solver sees the problems and nothing else; only the judge sees the truth. Notice the way around the \
         solver: what it says of its own precision is held against the bound, not believed. A quick run asks {} samples of each scenario.",
        calibench_gate::QUICK
    );
    Figure::drawing("steps", &drawing, caption)
}
