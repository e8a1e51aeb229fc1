//! Do intervals by the profile of the cost contain the truth as often as they say, where the standard
//! deviation misleads?
//!
//! Four views of a target tilted by four degrees through a long lens: the focal length is known to some eight
//! per cent, and is bounded better below than above. Intervals by the standard deviation are then too low,
//! and miss on one side.

use calibench::calibrate::{Settings, calibrate};
use calibench::camera::{Camera, Parameter};
use calibench::synth::scene::looking_at_centre;
use calibench::synth::{Scene, Stream, StreamKey, Truth};
use calibench_harness::stats::Interval;
use calibench_harness::{Band, ExperimentError, Record};
use rayon::prelude::*;

/// Draws of the noise.
const DRAWS: usize = 600;
/// Coverage that is asked for.
const COVERAGE: f64 = 0.95;
/// Noise of a coordinate, px.
const NOISE_PX: f64 = 0.1;
/// Turns of the views about x, y and z, degrees.
const TURNS_DEG: [[f64; 3]; 4] = [[4.0, 0.0, 0.0], [0.0, -4.0, 0.0], [-3.3, 3.3, 10.0], [3.3, 3.3, -20.0]];
/// Distance of the target, mm.
const DISTANCE_MM: f64 = 1200.0;
/// Probability that the claim fails although the coverage is right.
const FALSE_ALARM: f64 = 1e-4;

/// Misses of the true focal length: the interval lies above it, or below.
#[derive(Debug, Clone, Copy, Default)]
struct Misses {
    above: usize,
    below: usize,
}

impl Misses {
    fn add(&mut self, truth: f64, low: Option<f64>, high: Option<f64>) {
        self.above += usize::from(low.is_some_and(|low| low > truth));
        self.below += usize::from(high.is_some_and(|high| high < truth));
    }

    fn covered(&self, draws: usize) -> usize {
        draws - self.above - self.below
    }
}

/// Draws, counts and claims.
pub fn report(record: &mut Record, seed: u64) -> Result<(), ExperimentError> {
    let truth = Truth {
        camera: Camera::pinhole(3000.0, 3000.0, 640.0, 480.0),
        image_size: (1280, 960),
        cam_from_target: TURNS_DEG.map(|turn| looking_at_centre(turn, DISTANCE_MM)).to_vec(),
        ..Truth::example()
    };
    let scene = Scene::new(truth).map_err(ExperimentError::at("the long lens"))?;
    let free = "fx,fy,cx,cy".parse().map_err(ExperimentError::at("the free parameters"))?;
    let settings = Settings::new(free).with_image_size((1280, 960)).with_profile_intervals(COVERAGE);
    let answers: Vec<_> = (0..DRAWS as u64)
        .into_par_iter()
        .map(|trial| {
            let key = StreamKey { seed, scenario: "global-minimum/intervals", trial, purpose: "noise" };
            calibrate(&scene.observe(NOISE_PX, &mut Stream::open(key)), &settings).ok()
        })
        .collect();
    let (mut by_profile, mut by_deviation, mut answered) = (Misses::default(), Misses::default(), 0);
    for calibration in answers.iter().flatten() {
        let Some(fx) = calibration.intervals.iter().find(|i| i.parameter == Parameter::Fx) else { continue };
        answered += 1;
        by_profile.add(scene.truth.camera.fx, fx.low, fx.high);
        by_deviation.add(scene.truth.camera.fx, Some(fx.linear.0), Some(fx.linear.1));
    }
    let count = |record: &mut Record, id: &str, value: usize, what: &str| {
        record.exact("").count(id, value, what);
    };
    count(record, "intervals-draws", answered, "draws of the weak long lens that were answered");
    let sides = [("profile", by_profile), ("deviation", by_deviation)];
    for (name, misses) in sides {
        let what = format!("intervals of 95 % for fx that lie above the true one, by the {name}");
        count(record, &format!("intervals-{name}-above"), misses.above, &what);
        let what = format!("intervals of 95 % for fx that lie below the true one, by the {name}");
        count(record, &format!("intervals-{name}-below"), misses.below, &what);
    }
    let share = by_profile.covered(answered) as f64 / answered.max(1) as f64;
    let possible = Interval::of_proportion(by_profile.covered(answered), answered, FALSE_ALARM);
    record.group("1", Band::absolute(1e-9, "a share of counts")).number(
        "intervals-coverage",
        share,
        "share of the intervals by the profile of the cost that contain the true fx; 0.95 was asked for",
    );
    record
        .claim_that(
            "profile-intervals-cover",
            "where the standard deviation misleads, intervals by the profile contain the true focal length \
             as often as they say",
        )
        .every(
            "cases",
            [(
                format!(
                    "{:.4} of {answered}, compatible with {:.4} to {:.4}",
                    share, possible.low, possible.high
                ),
                possible.contains(COVERAGE) && answered == DRAWS,
            )],
        )
        .at_rate(FALSE_ALARM)
        .because(
            "Wilson's interval (1927) of the counted share contains the stated coverage; every draw is \
             answered",
        );
    Ok(())
}
