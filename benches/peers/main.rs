//! This library's side of the comparison with its peers: exports the problems, and answers to requests line
//! by line.
//!
//! `peers export FOLDER` writes the problems as raw numbers. `peers serve` reads `time ROW SECONDS`, works
//! for about that long and answers with the seconds one repetition took, or `answer ROW FILE`, and writes the
//! row's numbers there.

#[path = "../common.rs"]
mod common;
#[path = "../works.rs"]
mod works;

use calibench::board::View;
use calibench::calibrate::{Settings, calibrate, calibrate_lens, closed_form, pose_from_homography};
use calibench::camera::Camera;
use calibench::geometry::{Homography, Vec2};
use std::collections::BTreeMap;
use std::io::{BufRead, Write};
use std::path::Path;
use std::time::Instant;
use std::{env, fs, io};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["export", folder] => export(Path::new(folder))?,
        ["serve"] => serve()?,
        _ => return Err("usage: peers export FOLDER | peers serve".into()),
    }
    Ok(())
}

fn serve() -> Result<(), Box<dyn std::error::Error>> {
    let mut works = BTreeMap::new();
    for line in io::stdin().lock().lines() {
        let line = line?;
        let words: Vec<&str> = line.split(' ').collect();
        let [request, row, argument] = words[..] else { return Err(format!("no request: {line}").into()) };
        if !works.contains_key(row) {
            let work = works::named(row).ok_or_else(|| format!("no row {row}"))?;
            works.insert(row.to_string(), work);
        }
        let work = works.get_mut(row).ok_or("it was just put there")?;
        let reply = match request {
            "time" => seconds(work.as_mut(), argument.parse()?).to_string(),
            _ => {
                write_numbers(Path::new(argument), &work.answer())?;
                "done".to_string()
            }
        };
        let mut out = io::stdout().lock();
        writeln!(out, "{reply}")?;
        out.flush()?;
    }
    Ok(())
}

/// Seconds of one repetition: the median over about `budget` seconds of work, timed in groups long enough for
/// the clock.
fn seconds(work: &mut dyn works::Work, budget: f64) -> f64 {
    const GROUP_SECONDS: f64 = 20e-6;
    let timed = |work: &mut dyn works::Work, times: usize| {
        let start = Instant::now();
        work.repeat(times);
        start.elapsed().as_secs_f64()
    };
    let first = timed(work, 1);
    let group = (GROUP_SECONDS / first).ceil().clamp(1.0, 1000.0) as usize;
    let mut groups = Vec::new();
    let start = Instant::now();
    while groups.is_empty() || start.elapsed().as_secs_f64() < budget {
        groups.push(timed(work, group) / group as f64);
    }
    groups.sort_by(f64::total_cmp);
    groups[groups.len() / 2]
}

fn export(folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    for count in works::VIEWS {
        let views = common::views(count);
        write_numbers(&folder.join(format!("views-{count}")), &works::pairs(&views))?;
        let (start, optimum) = (closed_form_state(&views), optimum(&views));
        write_numbers(&folder.join(format!("start-{count}")), &start)?;
        write_numbers(&folder.join(format!("found-{count}")), &optimum)?;
    }
    for kind in ["wide", "rational"] {
        for count in works::WIDE_VIEWS {
            let views = common::wide_views(works::wide_model(kind), count);
            write_numbers(&folder.join(format!("{kind}-views-{count}")), &works::pairs(&views))?;
            let settings = Settings::of_model(works::wide_model(kind));
            let found = calibrate_lens(&views, &settings).expect("it can be calibrated");
            let mut state = works::free_values(&found);
            state.extend(numbers_of(found.cam_from_target.iter().copied()));
            write_numbers(&folder.join(format!("{kind}-found-{count}")), &state)?;
        }
    }
    let view = common::views(4).remove(3);
    write_numbers(&folder.join("homography"), &works::pairs(&[view]))?;
    let (pixels, world) = works::nine_points();
    let nine = View::new(pixels, world).expect("finite points");
    write_numbers(&folder.join("affine"), &works::pairs(&[nine]))?;
    write_numbers(&folder.join("points"), &flat(&works::pixels()))?;
    for size in works::FRAMES {
        fs::write(folder.join(format!("frame-{}x{}", size.0, size.1)), works::frame(size).samples())?;
    }
    for (name, (image, centres)) in [("grid", works::grid()), ("dots", works::dots())] {
        fs::write(folder.join(name), image.samples())?;
        write_numbers(&folder.join(format!("{name}-true")), &flat(&centres))?;
    }
    Ok(())
}

/// Where solvers without a start of their own begin: Zhang's closed form, no distortion.
fn closed_form_state(views: &[View]) -> Vec<f64> {
    let homographies: Vec<Homography> = views
        .iter()
        .map(|v| Homography::fit(v.points(), v.pixels()).expect("63 points").homography)
        .collect();
    let camera = closed_form(&homographies, false).expect("the views are tilted");
    let poses =
        homographies.iter().map(|h| pose_from_homography(&camera, h).expect("in front of the camera"));
    state(&camera, poses)
}

/// This library's estimate, which the reference begins from.
fn optimum(views: &[View]) -> Vec<f64> {
    let found = calibrate(views, &Settings::standard()).expect("it can be calibrated");
    state(&found.camera, found.cam_from_target.iter().copied())
}

/// fx, fy, cx, cy, k1, k2; then rotation, row by row, and translation of every view.
fn state(camera: &Camera, poses: impl Iterator<Item = calibench::geometry::Pose>) -> Vec<f64> {
    let lens = &camera.distortion;
    let mut numbers = vec![camera.fx, camera.fy, camera.cx, camera.cy, lens.k1, lens.k2];
    numbers.extend(numbers_of(poses));
    numbers
}

fn numbers_of(poses: impl Iterator<Item = calibench::geometry::Pose>) -> Vec<f64> {
    let mut numbers = Vec::new();
    for pose in poses {
        numbers.extend(pose.rotation.transpose().iter());
        numbers.extend(pose.translation.iter());
    }
    numbers
}

fn flat(points: &[Vec2]) -> Vec<f64> {
    points.iter().flat_map(|p| [p.x, p.y]).collect()
}

fn write_numbers(path: &Path, numbers: &[f64]) -> io::Result<()> {
    fs::write(path, numbers.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>())
}
