//! Which loss is right when some marks are wrong? Three losses on the same views, one mark in twenty moved by
//! ten pixels.
//!
//! `cargo run --release --example own_loss`
#![allow(clippy::print_stdout, reason = "an example shows what it finds")]

use calibench::board::View;
use calibench::calibrate::{Loss, Settings, calibrate};
use calibench::geometry::Vec2;
use calibench::synth::{Scene, Stream, StreamKey};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let errors = run()?;
    let [squares, robust] = [errors[0], errors[1].max(errors[2])];
    if robust < squares { Ok(()) } else { Err("a robust loss should have helped".into()) }
}

/// The error of the focal length under each loss, px.
pub fn run() -> Result<Vec<f64>, Box<dyn Error>> {
    let scene = Scene::example();
    let mut stream = Stream::open(StreamKey { seed: 1, scenario: "losses", trial: 0, purpose: "noise" });
    let views = scene.observe(0.1, &mut stream).iter().map(astray).collect::<Result<Vec<View>, _>>()?;
    let losses = [Loss::Squares, Loss::Huber { delta_px: 0.3 }, Loss::Cauchy { scale_px: 0.3 }];
    let mut errors = Vec::new();
    for loss in losses {
        let result = calibrate(&views, &Settings::standard().with_loss(loss))?;
        let error = (result.camera.fx - scene.truth.camera.fx).abs();
        println!("{loss:?}: fx is off by {error:.3} px, {} warnings", result.warnings.len());
        errors.push(error);
    }
    Ok(errors)
}

/// The view with every twentieth mark moved by ten pixels.
fn astray(view: &View) -> Result<View, Box<dyn Error>> {
    let moved = |(i, pixel): (usize, &Vec2)| if i % 20 == 7 { pixel + Vec2::new(6.0, -8.0) } else { *pixel };
    Ok(View::new(view.points().to_vec(), view.pixels().iter().enumerate().map(moved).collect())?)
}
