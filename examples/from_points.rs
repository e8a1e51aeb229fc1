//! A camera from corners that were found elsewhere: a file with the columns `view,point,X,Y,u,v`.
//!
//! `cargo run --release --example from_points -- corners.csv`; without a file, one is made up.
#![allow(clippy::print_stdout, reason = "an example shows what it finds")]

use calibench::calibrate::{Settings, calibrate};
use calibench::camera::Parameter;
use calibench::io::parse_corners;
use calibench::synth::{Scene, Stream, StreamKey};
use std::error::Error;
use std::fmt::Write;

fn main() -> Result<(), Box<dyn Error>> {
    let text = match std::env::args().nth(1) {
        Some(file) => std::fs::read_to_string(file)?,
        None => made_up(),
    };
    run(&text)
}

/// Calibrates and prints every parameter with its standard deviation.
pub fn run(text: &str) -> Result<(), Box<dyn Error>> {
    let file = parse_corners("corners", text.as_bytes())?;
    let result = calibrate(&file.views, &Settings::standard().with_image_size((640, 480)))?;
    for parameter in result.free.iter() {
        let value = result.camera.get(parameter);
        let deviation = result.covariance.standard_deviation(parameter).ok_or("not estimated")?;
        println!("{parameter:>2} = {value:10.4} +- {deviation:.4} {}", parameter.unit());
    }
    println!("RMSE {:.4} px, ended: {}", result.rmse_px, result.termination.name());
    for warning in &result.warnings {
        println!("warning: {warning}");
    }
    let fx = result.covariance.standard_deviation(Parameter::Fx).ok_or("fx is free")?;
    if fx > 0.05 * result.camera.fx { Err("these views hardly tell the focal length".into()) } else { Ok(()) }
}

/// Corners of four views with noise of a tenth of a pixel.
pub fn made_up() -> String {
    let mut stream = Stream::open(StreamKey { seed: 1, scenario: "example", trial: 0, purpose: "noise" });
    let mut text = String::from("view,point,X,Y,u,v\n");
    for (view, marks) in Scene::example().observe(0.1, &mut stream).iter().enumerate() {
        for (point, (target, pixel)) in marks.pairs().enumerate() {
            let _ = writeln!(text, "{view},{point},{},{},{},{}", target.x, target.y, pixel.x, pixel.y);
        }
    }
    text
}
