//! A camera from marks in a layout of one's own, which is no lattice: rings about a middle, each view showing
//! other marks.
//!
//! `cargo run --release --example own_layout`. The same marks as a file are `calibench calibrate rings.csv`;
//! marks that were measured, in space and with standard deviations, are `--target`, and `calibench::measured`
//! in the library.
#![allow(clippy::print_stdout, reason = "an example shows what it finds")]

use calibench::board::View;
use calibench::calibrate::{Settings, calibrate};
use calibench::camera::Parameter;
use calibench::geometry::Vec2;
use calibench::synth::{Scene, Stream, StreamKey, Truth};
use std::error::Error;
use std::fmt::Write;

fn main() -> Result<(), Box<dyn Error>> {
    let far = run()?;
    if far < 4.0 { Ok(()) } else { Err(format!("fx is off by {far:.1} standard deviations").into()) }
}

/// A mark in the middle and rings of 8, 16 and 24 about it, 10 mm apart.
pub fn rings() -> Vec<Vec2> {
    let ring = |k: u32| {
        let angle = move |i: u32| std::f64::consts::TAU * f64::from(i) / f64::from(8 * k);
        (0..8 * k).map(move |i| 10.0 * f64::from(k) * Vec2::new(libm::cos(angle(i)), libm::sin(angle(i))))
    };
    std::iter::once(Vec2::zeros()).chain((1..4).flat_map(ring)).collect()
}

/// Four views with noise of a tenth of a pixel; view i does not show the last 3 i marks.
pub fn views() -> Result<Vec<View>, Box<dyn Error>> {
    let scene = Scene::new(Truth { points: rings(), ..Truth::example() })?;
    let mut noise = Stream::open(StreamKey { seed: 1, scenario: "rings", trial: 0, purpose: "noise" });
    let part = |(i, view): (usize, View)| {
        let shown = view.len() - 3 * i;
        Ok(View::new(view.points()[..shown].to_vec(), view.pixels()[..shown].to_vec())?)
    };
    scene.observe(0.1, &mut noise).into_iter().enumerate().map(part).collect()
}

/// The views as the file that `calibench calibrate` reads: a line a mark, with its place on the target.
pub fn corner_file() -> Result<String, Box<dyn Error>> {
    let mut text = String::from("view,point,X,Y,u,v\n");
    for (i, view) in views()?.iter().enumerate() {
        for (point, (at, pixel)) in view.pairs().enumerate() {
            writeln!(text, "{i},{point},{},{},{},{}", at.x, at.y, pixel.x, pixel.y)?;
        }
    }
    Ok(text)
}

/// Calibrates; by how many standard deviations the focal length is off.
pub fn run() -> Result<f64, Box<dyn Error>> {
    let result = calibrate(&views()?, &Settings::standard().with_image_size(Truth::EXAMPLE_IMAGE))?;
    let deviation = result.covariance.standard_deviation(Parameter::Fx).ok_or("fx is free")?;
    println!("fx = {:.2} +- {deviation:.2} px", result.camera.fx);
    Ok((result.camera.fx - Truth::example_camera().fx).abs() / deviation)
}
