//! Many draws of the four poses: their estimates, and what they say together.

use super::calibration::{PARAMETERS, parameters};
use super::questions::{Answer, count, exactly};
use super::scene::{KNOBS, Knobs, SEED};
use calibench::calibrate::{Settings, calibrate};
use calibench::evaluate::Sample;
use calibench::synth::{Stream, StreamKey};

/// Most trials of one call, so that a page is never kept waiting.
const MOST: u32 = 10_000;

/// What a trial says: the errors of the parameters and its RMSE.
const OF_A_TRIAL: usize = PARAMETERS + 1;

/// Knobs, the number of the first trial, and how many -> estimate less truth of the six parameters and RMSE,
/// px, trial by trial; NaN where the data were refused or the search ended in no minimum.
pub(crate) fn trials(numbers: &[f64]) -> Answer {
    let [knobs @ .., first, many] = exactly::<{ KNOBS + 2 }>(numbers)?;
    let knobs = Knobs::read(knobs)?;
    let scene = knobs.scene()?;
    let truth = parameters(&scene.truth.camera);
    let settings = Settings::standard();
    let mut answer = Vec::new();
    for trial in first as u64..first as u64 + count(many, "trials", 0, MOST)? as u64 {
        let key = StreamKey { seed: SEED, scenario: "four-pose/monte-carlo", trial, purpose: "noise" };
        let views = scene.observe(knobs.sigma_px, &mut Stream::open(key));
        match calibrate(&views, &settings) {
            Ok(found) if found.termination.is_minimum() => {
                answer.extend(
                    parameters(&found.camera).iter().zip(&truth).map(|(estimate, truth)| estimate - truth),
                );
                answer.push(found.rmse_px);
            }
            _ => answer.extend([f64::NAN; OF_A_TRIAL]),
        }
    }
    Ok(answer)
}

/// The trials' answers, one after the other -> how many have an estimate; standard deviation of the six
/// errors; mean RMSE, px. NaN where there are too few.
pub(crate) fn spread(numbers: &[f64]) -> Answer {
    let (trials, rest) = numbers.as_chunks::<OF_A_TRIAL>();
    if !rest.is_empty() {
        return Err(format!("a trial has {OF_A_TRIAL} numbers, and {} are left over", rest.len()));
    }
    let estimated = || trials.iter().filter(|trial| !trial[0].is_nan());
    let mut errors = Sample::about(&[0.0; PARAMETERS]);
    estimated().for_each(|trial| errors.add(&trial[..PARAMETERS]));
    let mut answer = vec![errors.count() as f64];
    answer.extend((0..PARAMETERS).map(|i| errors.standard_deviation(i)));
    answer.push(estimated().map(|trial| trial[PARAMETERS]).sum::<f64>() / errors.count() as f64);
    Ok(answer)
}

#[cfg(test)]
mod tests {
    use super::super::scene::CHAPTER;
    use super::*;

    #[test]
    fn trials_can_be_asked_for_in_any_portions() {
        let ask = |first: f64, many: f64| trials(&[&CHAPTER[..], &[first, many]].concat()).unwrap();
        let together = ask(0.0, 5.0);
        assert_eq!(together.len(), 5 * OF_A_TRIAL);
        assert_eq!([ask(0.0, 2.0), ask(2.0, 3.0)].concat(), together);
    }

    #[test]
    fn refused_trials_are_counted_out() {
        let refused = trials(&[&[0.0], &CHAPTER[1..], &[0.0, 2.0]].concat()).unwrap();
        assert!(refused.len() == 2 * OF_A_TRIAL && refused.iter().all(|number| number.is_nan()));
        let one = |x: f64| [x, 0.0, 0.0, 0.0, 0.0, 2.0 * x, 0.1 * x];
        let answer = spread(&[&refused[..], &one(1.0), &one(3.0)].concat()).unwrap();
        assert_eq!(answer[0], 2.0);
        // Of 1 and 3: sqrt(2).
        assert!(
            (answer[1] - std::f64::consts::SQRT_2).abs() < 1e-15
                && (answer[6] - 2.0 * answer[1]).abs() < 1e-15
        );
        assert!((answer[7] - 0.2).abs() < 1e-15);
        assert!(spread(&[1.0]).is_err());
    }
}
