//! A camera from photographs of a circle grid.
//!
//! `cargo run --release --example from_photographs -- PHOTO...`; without photographs, some are rendered.
#![allow(clippy::print_stdout, reason = "an example shows what it finds")]

use calibench::board::View;
use calibench::calibrate::{Settings, calibrate};
use calibench::detect::circle_grid;
use calibench::io::read_image;
use calibench::raster::Raster;
use calibench::synth::Truth;
use calibench::synth::render::{Imaging, photograph};
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let files: Vec<String> = std::env::args().skip(1).collect();
    let read = |file: &String| Ok(read_image(Path::new(file))?.to_f32());
    let photographs: Result<_, Box<dyn Error>> = files.iter().map(read).collect();
    let photographs: Vec<Raster<f32>> = if files.is_empty() { rendered()? } else { photographs? };
    println!("fx = {:.3} px", run(&photographs)?);
    Ok(())
}

/// What a camera with a focal length of 600 px sees of the board in four poses, through a slightly blurred
/// lens.
pub fn rendered() -> Result<Vec<Raster<f32>>, Box<dyn Error>> {
    let Truth { camera, image_size, cam_from_target, .. } = Truth::example();
    let imaging = Imaging { blur_px: 0.7, ..Imaging::default() };
    let see = |pose| Ok(photograph(&camera, image_size, &Truth::example_board(), pose, &imaging)?.image);
    cam_from_target.iter().map(see).collect()
}

/// Finds the 9 x 7 discs of every photograph and calibrates; the focal length, px.
pub fn run(photographs: &[Raster<f32>]) -> Result<f64, Box<dyn Error>> {
    let points = Truth::example_board().points();
    let mut views = Vec::new();
    for image in photographs {
        let grid = circle_grid(image, 9, 7)?;
        views.push(View::new(points.clone(), grid.centres_px())?);
    }
    let result = calibrate(&views, &Settings::standard())?;
    println!("{} photographs, RMSE {:.4} px", views.len(), result.rmse_px);
    Ok(result.camera.fx)
}
