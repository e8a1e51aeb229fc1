//! Which bits do the questions of the laboratory give natively? First the fingerprint of the sources, then
//! one case a line, for `.ci/laboratory` to ask the WebAssembly the same: `question | its numbers | the bits
//! of the answer, hexadecimal`, or the words of a refusal.

use calibench_laboratory::{CHAPTER, answer};
use std::io::{BufWriter, Write};

/// Draws of the four poses that are compared.
const DRAWS: u32 = 200;

fn main() -> std::io::Result<()> {
    let mut out = BufWriter::new(std::io::stdout().lock());
    writeln!(out, "fingerprint | {}", env!("LABORATORY_FINGERPRINT"))?;
    for (question, numbers) in cases() {
        let shown = numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
        let found = answer(question, &numbers);
        let found = found.map(|all| {
            all.iter().map(|number| format!("{:016x}", number.to_bits())).collect::<Vec<_>>().join(" ")
        });
        writeln!(
            out,
            "{question} | {shown} | {}",
            found.unwrap_or_else(|words| format!("refused: {words}"))
        )?;
    }
    out.flush()
}

/// Every question, at the chapter's numbers and at others.
fn cases() -> Vec<(&'static str, Vec<f64>)> {
    let with = |knobs: &[f64], more: &[f64]| [knobs, more].concat();
    let mut cases: Vec<(&str, Vec<f64>)> =
        (0..DRAWS).map(|draw| ("calibrate", with(&CHAPTER, &[f64::from(draw)]))).collect();
    let scenes = [
        CHAPTER,
        [0.0, 120.0, 0.0, 4.0, 0.1, -0.18, 0.05, 9.0, 7.0],
        [20.0, 200.0, 60.0, 4.0, 0.1, -0.18, 0.05, 9.0, 7.0],
        [35.0, 150.0, 5.0, 2.0, 0.5, 0.1, -0.02, 13.0, 9.0],
        [5.0, 105.0, 0.0, 12.0, 0.02, -0.3, 0.1, 3.0, 3.0],
        // A lens that folds back within the frame.
        [20.0, 120.0, 0.0, 4.0, 0.1, -0.3, -0.1, 9.0, 7.0],
        [45.0, 20.0, 0.0, 4.0, 0.1, -0.18, 0.05, 9.0, 7.0],
    ];
    for scene in scenes {
        cases.push(("predict", scene.to_vec()));
        cases.push(("observe", with(&scene, &[2.0])));
        cases.push(("calibrate", with(&scene, &[1.0])));
        cases.push(("trials", with(&scene, &[7.0, 5.0])));
        cases.extend([0.0, 1.0].map(|used_for| ("uncertainty", with(&scene, &[used_for]))));
    }
    for lens in [[-0.18, 0.05], [0.18, 0.05], [-0.9, 0.0], [0.0, 0.0]] {
        cases.push(("distort", with(&lens, &[0.0, 0.0, 639.0, 479.0, 326.0, 243.0, 20.5, 60.25])));
        cases.extend([60.0, 243.0, -20.0].map(|v| ("bend", with(&lens, &[-0.18, 0.05, v]))));
        cases.extend([60.0, 243.0].map(|v| ("bend", with(&[-0.18, 0.05], &[lens[0], lens[1], v]))));
        cases.push(("photograph", lens.to_vec()));
    }
    let levels: Vec<f64> = (0..640 * 480).map(|k| f64::from(k * 7 % 251)).collect();
    cases.push(("rectify", with(&[-0.18, 0.05], &levels)));
    let dots = |wrong: f64| -> Vec<f64> {
        let dot = |i: u32| [(i % 3, 236.23, 714.708), (i / 3, 236.19, 565.993)];
        let place = |(k, spacing, middle): (u32, f64, f64)| middle + spacing * (f64::from(k) - 1.0);
        let noise = |k: u32| wrong * libm::sin(f64::from(3 * k + 1));
        (0..9).flat_map(|i| dot(i).map(place)).zip(0..).map(|(at, k)| at + noise(k)).collect()
    };
    cases.extend([0.0, 0.1, 20.0].map(|wrong| ("nine_points", dots(wrong))));
    cases.push(("spread", (0..70).map(|k| libm::sin(f64::from(k))).collect()));
    cases
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench_laboratory::questions;

    #[test]
    fn every_question_is_compared() {
        let cases = cases();
        for question in questions() {
            assert!(cases.iter().any(|(name, _)| *name == question), "`{question}` is asked nowhere");
        }
    }
}
