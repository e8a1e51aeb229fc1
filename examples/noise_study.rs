//! How does the error of the focal length grow with the noise? A study of one's own: draw, calibrate, compare
//! with the Cramer-Rao bound.
//!
//! `cargo run --release --example noise_study`
#![allow(clippy::print_stdout, reason = "an example shows what it finds")]

use calibench::calibrate::{Settings, calibrate};
use calibench::camera::{FreeParameters, Parameter};
use calibench::evaluate::cramer_rao;
use calibench::synth::{Scene, Stream, StreamKey};
use std::error::Error;

/// Draws for each level of noise.
const TRIALS: u64 = 100;

fn main() -> Result<(), Box<dyn Error>> {
    // The spread of 100 draws is known to a fourteenth: four of its standard deviations.
    let off = run()?.into_iter().find(|ratio| (ratio - 1.0).abs() > 4.0 / 14.0);
    off.map_or(Ok(()), |ratio| Err(format!("the spread is {ratio:.2} times the bound").into()))
}

/// Spread of the focal length over its bound, one a level of noise.
pub fn run() -> Result<Vec<f64>, Box<dyn Error>> {
    let scene = Scene::example();
    let mut ratios = Vec::new();
    for sigma_px in [0.05, 0.1, 0.2] {
        let bound = cramer_rao(&scene.truth, FreeParameters::STANDARD, sigma_px)?;
        let bound = bound.standard_deviation(Parameter::Fx).ok_or("fx is free")?;
        let mut squares = 0.0;
        for trial in 0..TRIALS {
            // A stream of its own for every trial: one more draw elsewhere shifts nothing.
            let key = StreamKey { seed: 1, scenario: "noise study", trial, purpose: "noise" };
            let result = calibrate(&scene.observe(sigma_px, &mut Stream::open(key)), &Settings::standard())?;
            let error = result.camera.fx - scene.truth.camera.fx;
            squares += error * error;
        }
        let spread = (squares / TRIALS as f64).sqrt();
        println!("noise {sigma_px} px: fx spreads by {spread:.3} px, the bound is {bound:.3} px");
        ratios.push(spread / bound);
    }
    Ok(ratios)
}
