//! The chapter's numbers: do they follow from each other, do their residuals look like noise, do ours agree?

use super::*;

pub const SPACING_ROUNDING_PX: f64 = 0.005;

/// The mean of the nine centres, to 0.001 px: not printed, but it follows from the printed translation and
/// scales.
const CENTRE_PX: (f64, f64) = (714.708, 565.993);
pub const CENTRE_ROUNDING_PX: f64 = 0.0005;

/// Draws behind the distribution of the residuals' shape; one more leaves it with probability 2 / (TRIALS +
/// 1) = 1e-4.
pub const TRIALS: usize = 19_999;

pub const FALSE_ALARM_RATE: f64 = 1e-4;

/// A published number of this experiment.
pub fn entry(id: &str) -> Result<&'static Entry, ExperimentError> {
    published::entry(EXPERIMENT.id, id).map_err(ExperimentError::at("published values"))
}

/// The interval of values that print as the published digits.
pub fn before_rounding(id: &str) -> Result<(f64, f64), ExperimentError> {
    let entry = entry(id)?;
    Ok((entry.value() - entry.rounding(), entry.value() + entry.rounding()))
}

/// Do the chapter's own numbers follow from each other, within their printed digits?
pub fn claim_published_consistent(record: &mut Record) -> Result<(), ExperimentError> {
    let value = |id: &str| entry(id).map(Entry::value);
    let overlap = |a: (f64, f64), b: (f64, f64)| a.0 <= b.1 && b.0 <= a.1;
    let over = |a: (f64, f64), b: (f64, f64)| (a.0 / b.1, a.1 / b.0);
    let (sx, sy) = (before_rounding("sx")?, before_rounding("sy")?);
    let centre = |at: f64| (at - CENTRE_ROUNDING_PX, at + CENTRE_ROUNDING_PX);
    let times = |a: (f64, f64), b: (f64, f64)| (a.0 * b.0, a.1 * b.1);
    let minus_tx = (-before_rounding("tx")?.1, -before_rounding("tx")?.0);
    let both = (sx.0, sy.1);
    let middle = 0.5 * (value("spacing-rows")? + value("spacing-columns")?);
    let cases = [
        ("1 / sx is the column spacing", overlap(over((1.0, 1.0), sx), before_rounding("spacing-columns")?)),
        ("1 / sy is the row spacing", overlap(over((1.0, 1.0), sy), before_rounding("spacing-rows")?)),
        ("the mean spacing prints as 236.2", entry("spacing")?.rounds_from(middle)),
        ("-tx is sx times the centre's u", overlap(times(sx, centre(CENTRE_PX.0)), minus_tx)),
        ("ty is sy times the centre's v", overlap(times(sy, centre(CENTRE_PX.1)), before_rounding("ty")?)),
        ("RMS in pixels", overlap(over(before_rounding("rms")?, both), before_rounding("rms-px")?)),
        ("maximum in pixels", overlap(over(before_rounding("max")?, both), before_rounding("max-px")?)),
    ];
    record
        .claim_that(
            "book-agrees-with-itself",
            "the chapter's spacings, scales, translations and residuals follow from each other within their \
             printed digits",
        )
        .every("relations", cases)
        .because("interval arithmetic over half a unit of each last printed digit");
    Ok(())
}

/// The size of a residual is the real image's, but largest over RMS of nine points is the same for any size
/// of the noise.
pub fn claim_residual_shape(record: &mut Record, context: &Context) -> Result<(), ExperimentError> {
    let key = StreamKey { seed: context.seed, scenario: "nine-point", trial: 0, purpose: "noise" };
    let mut stream = Stream::open(key);
    let world = unit_grid();
    let mut ratios = Vec::with_capacity(TRIALS);
    for _ in 0..TRIALS {
        let seen: Vec<Vec2> =
            world.iter().map(|w| w + Vec2::new(stream.normal(), stream.normal()) * 1e-4).collect();
        let affine = Affine::fit(&seen, &world).map_err(ExperimentError::at("affine fit"))?;
        let squares: Vec<f64> =
            seen.iter().zip(&world).map(|(s, w)| (affine.apply(s) - w).norm_squared()).collect();
        let largest = squares.iter().copied().fold(0.0, f64::max);
        ratios.push((largest * 9.0 / squares.iter().sum::<f64>()).sqrt());
    }
    let ratio = entry("max")?.value() / entry("rms")?.value();
    record.exact("").number("book-max-over-rms", ratio, "largest over RMS residual, as published");
    let predicted = Predicted::from_draws(&ratios, 1, "affine fits of nine points with Gaussian errors");
    record
        .claim_that(
            "book-residuals-look-like-noise",
            "the published largest residual stands to the RMS as it does for nine centres with Gaussian \
             errors",
        )
        .drawn_from(ratio, &predicted, FALSE_ALARM_RATE)
        .because("the ratio does not depend on the size of the errors");
    Ok(())
}

/// Printed numbers that follow from other printed ones.
pub fn report_derived(record: &mut Record) -> Result<(), ExperimentError> {
    let value = |id: &str| entry(id).map(Entry::value);
    let per_px = 0.5 * (value("sx")? + value("sy")?);
    let gap =
        |ours: &str, gui: &str| -> Result<f64, ExperimentError> { Ok((value(gui)? - value(ours)?).abs()) };
    let (rms, max) = (value("rms")? / per_px, value("max")? / per_px);
    record
        .group("px", Band::relative(1e-12, "a few operations on printed digits"))
        .number("rms-px", rms, "printed residual RMS over the mean printed scale")
        .number("max-px", max, "printed largest residual over the mean printed scale")
        .unit("")
        .number("gui-gap", gap("tx", "gui-tx")?, "gap of the two printed translations along x")
        .number("gui-gap-y", gap("ty", "gui-ty")?, "gap of the two printed translations along y");
    Ok(())
}

/// Accuracy to which the chapter says that the two programs' scales agree.
const SAID_TO_AGREE: f64 = 1e-6;

/// The chapter says that the linear coefficients and scales of both programs agree to the level of 1e-6.
/// Differences of scales are to be judged relative to the scale: 1e-6 units a pixel is one part in four
/// thousand.
pub fn claim_scales_differ(record: &mut Record) -> Result<(), ExperimentError> {
    let value = |id: &str| entry(id).map(Entry::value);
    for (axis, ours, gui, along) in [("x", "sx", "gui-sx", "u"), ("y", "sy", "gui-sy", "v")] {
        let relative = (value(gui)? / value(ours)? - 1.0).abs();
        // A cell of the grid is one unit: 1 / s pixels.
        let px = relative / value(ours)?;
        let what = format!("relative difference of the two printed scales along {axis}");
        record
            .group("%", Band::relative(1e-9, "a difference of printed digits"))
            .prefix(format!("gui-scale-{axis}"))
            .number("-percent", 100.0 * relative, what)
            .unit("px")
            .number("-px", px, format!("what that makes of one spacing along {along}"));
    }
    let (sy, gui) = (before_rounding("sy")?, before_rounding("gui-sy")?);
    record
        .claim_that(
            "scales-do-not-agree-to-a-millionth",
            "the two printed scales along y differ by far more than a millionth of their value",
        )
        .at_least((gui.0 / sy.1 - 1.0).abs().min((gui.1 / sy.0 - 1.0).abs()), SAID_TO_AGREE)
        .because(
            "the smallest relative difference that the printed digits allow, against the accuracy that the \
             chapter states",
        );
    Ok(())
}

pub fn reconcile(record: &mut Record, stand_in: &str) -> Result<(), ExperimentError> {
    let relative = (SPACING_ROUNDING_PX + DETECTION_PX) / SPACING_PX.1;
    let pixels = "; tolerance from the printed digits and 0.005 px of detection";
    for id in ["image-width", "image-height"] {
        record.reconcile(id).near_printed(0.0, stand_in);
    }
    for id in ["spacing", "spacing-rows", "spacing-columns", "m11", "m22", "sx", "sy"] {
        let entry = entry(id)?;
        let tolerance = entry.rounding() + relative * entry.value().abs();
        record.reconcile(id).near_printed(tolerance, format!("{stand_in}{pixels}"));
    }
    for id in ["tx", "ty"] {
        let entry = entry(id)?;
        let shift = (CENTRE_ROUNDING_PX + DETECTION_PX) / SPACING_PX.1;
        let tolerance = entry.rounding() + relative * entry.value().abs() + shift;
        record.reconcile(id).near_printed(tolerance, format!("{stand_in}{pixels}"));
    }
    for id in GUI {
        let reason = "affine fit to centres on half pixels near ours; must print the published digits";
        record.reconcile(id).near_printed(entry(id)?.rounding(), reason);
    }
    for id in ["rms-px", "max-px", "gui-gap"] {
        record.reconcile(id).rounds_to_printed();
    }
    Ok(())
}
