//! What does the lens do to a photograph? One of them as it was taken, and as an ideal lens would have shown
//! it.

use super::finished::Finished;
use super::html::{heading, paragraph, picture};
use calibench::camera::{Camera, Lens};
use calibench::geometry::{Pose, Vec2};
use calibench::io::{ImageError, Memory, Overlay, ShownPath, image_extent, read_image};
use calibench::raster::Raster;
use calibench::rectify::{OutputView, Projection, RectifyMap, output_camera};
use std::path::Path;

/// The longer side of the pictures, px at most.
const LONGEST_SIDE_PX: usize = 1000;

/// Colour of the lines between the ends of a row.
const STRAIGHT: [u8; 3] = [255, 60, 60];

/// Two pictures, as PNG, or why there are none.
pub(super) struct BeforeAfter {
    place: usize,
    pictures: Result<[Vec<u8>; 2], String>,
}

/// The pictures' places in the output folder.
const FILES: [&str; 2] = ["undistorted/before.png", "undistorted/after.png"];

impl BeforeAfter {
    /// Of the photograph whose marks reach farthest out; `None` without photographs.
    pub(super) fn of(finished: &Finished, memory: u64) -> Option<BeforeAfter> {
        let view = farthest_out(finished)?;
        let place = finished.names.place(view);
        let path = finished.photos.get(place)?;
        Some(BeforeAfter { place, pictures: pictures(finished, view, path, memory) })
    }

    /// Places and contents.
    pub(super) fn files(&self) -> Vec<(&'static str, Vec<u8>)> {
        self.pictures.iter().flat_map(|pictures| FILES.into_iter().zip(pictures.clone())).collect()
    }

    pub(super) fn section(&self, page: &mut String, finished: &Finished) {
        heading(page, "Before and after undistortion");
        let name = finished.names.label_at(self.place);
        if let Err(reason) = &self.pictures {
            paragraph(page, &format!("{name} could not be shown: {reason}"));
            return;
        }
        paragraph(
            page,
            "The photograph whose marks reach farthest out, as it was taken and as a lens without distortion of the same focal \
             length would have shown it. The red lines join the ends of the board's outer rows and columns: after undistortion \
             the marks lie on them. Black has no data.",
        );
        page.push_str("<div class=\"figures\">\n");
        for (file, what) in FILES.into_iter().zip(["before", "after"]) {
            let caption = format!("{}, {what}", finished.called(self.place));
            picture(page, file, &format!("{name}, {what} undistortion"), &caption);
        }
        page.push_str("</div>\n");
    }
}

/// The fitted view with the mark farthest from the principal point.
fn farthest_out(finished: &Finished) -> Option<usize> {
    let camera = &finished.fit.calibration.camera;
    let centre = Vec2::new(camera.cx, camera.cy);
    let reach = |view: usize| {
        finished.fit.views[view].pixels().iter().map(|p| (p - centre).norm()).fold(0.0, f64::max)
    };
    (0..finished.fit.views.len()).max_by(|&a, &b| reach(a).total_cmp(&reach(b)))
}

fn pictures(finished: &Finished, view: usize, path: &Path, memory: u64) -> Result<[Vec<u8>; 2], String> {
    let photo = shrunk(path, memory).map_err(|error| {
        let text = error.to_string();
        text.strip_prefix(&format!("{}: ", path.shown())).map(str::to_string).unwrap_or(text)
    })?;
    let (small, times) = photo;
    let camera = smaller(&finished.fit.calibration.camera, times);
    let size = (small.width(), small.height());
    let map = undistorting(&camera, size)?;
    let after = map.apply(&small, 0).map_err(|error| error.to_string())?;
    let lines = outer_lines(finished.fit.views[view].points());
    let pose = &finished.fit.calibration.cam_from_target[view];
    let ideal = Projection::Pinhole.camera(&camera);
    let before = drawn(&small, &lines, &camera, pose);
    let after = drawn(&after, &lines, &ideal.unwrap_or(camera), pose);
    let png = |overlay: Overlay| overlay.png().map_err(|error| error.to_string());
    Ok([png(before)?, png(after)?])
}

/// The photograph, so many times smaller.
fn shrunk(path: &Path, memory: u64) -> Result<(Raster<u8>, usize), ImageError> {
    let needed = image_extent(path)?.memory_to_detect();
    let memory = Memory::new(memory);
    let _taken = memory.take(path, needed).map_err(ImageError::Input)?;
    let photo = read_image(path)?.to_u8();
    let times = photo.width().max(photo.height()).div_ceil(LONGEST_SIDE_PX).max(1);
    Ok((averaged(&photo, times), times))
}

/// Means over squares of so many pixels; what is left at the right and at the bottom is cut off.
fn averaged(photo: &Raster<u8>, times: usize) -> Raster<u8> {
    if times == 1 {
        return photo.clone();
    }
    let (width, height) = ((photo.width() / times).max(1), (photo.height() / times).max(1));
    Raster::from_fn(width, height, |x, y| {
        let rows = (y * times..(y + 1) * times).filter(|&row| row < photo.height());
        let levels = rows.flat_map(|row| {
            let columns = (x * times..(x + 1) * times).filter(|&column| column < photo.width());
            columns.map(move |column| u32::from(photo.get(column, row)))
        });
        let (count, sum) = levels.fold((0, 0), |(count, sum), level| (count + 1, sum + level));
        ((sum + count / 2) / count.max(1)) as u8
    })
}

/// The camera of a photograph that is so many times smaller: a pixel's centre stays in its middle.
fn smaller(camera: &Camera<Lens>, times: usize) -> Camera<Lens> {
    let times = times as f64;
    let place = |x: f64| (x + 0.5) / times - 0.5;
    Camera {
        fx: camera.fx / times,
        fy: camera.fy / times,
        cx: place(camera.cx),
        cy: place(camera.cy),
        skew: camera.skew / times,
        distortion: camera.distortion,
    }
}

/// As `calibench undistort` does it by default.
fn undistorting(camera: &Camera<Lens>, size: (usize, usize)) -> Result<RectifyMap, String> {
    match camera.brown_conrady() {
        Some(camera) => {
            let output =
                output_camera(&camera, size, OutputView::SameK).map_err(|error| error.to_string())?;
            RectifyMap::between(&camera, size, &output, size).map_err(|error| error.to_string())
        }
        None => {
            RectifyMap::through_lens(camera, size, Projection::Pinhole).map_err(|error| error.to_string())
        }
    }
}

/// The ends of the outer rows and columns of marks on the board, where marks stand in rows.
fn outer_lines(points: &[Vec2]) -> Vec<[Vec2; 2]> {
    let low = points.iter().fold(Vec2::repeat(f64::INFINITY), |low, p| low.inf(p));
    let high = points.iter().fold(Vec2::repeat(f64::NEG_INFINITY), |high, p| high.sup(p));
    let near = 1e-6 * (high - low).amax();
    let along = |axis: usize, value: f64| {
        let other = 1 - axis;
        let row = || points.iter().filter(move |p| (p[axis] - value).abs() <= near);
        let first = row().min_by(|a, b| a[other].total_cmp(&b[other]))?;
        let last = row().max_by(|a, b| a[other].total_cmp(&b[other]))?;
        (row().count() > 2).then_some([*first, *last])
    };
    [(1, low.y), (1, high.y), (0, low.x), (0, high.x)]
        .into_iter()
        .filter_map(|(axis, value)| along(axis, value))
        .collect()
}

/// A picture with the lines between their ends as a camera shows these.
fn drawn(photo: &Raster<u8>, lines: &[[Vec2; 2]], camera: &Camera<Lens>, pose: &Pose) -> Overlay {
    let mut overlay = Overlay::new(photo, 1);
    for ends in lines {
        if let [Some(from), Some(to)] = ends.map(|p| camera.pixel(&pose.apply(&p.push(0.0)))) {
            // Two pixels wide, to be seen where the picture is shown smaller.
            for shift in [Vec2::zeros(), Vec2::new(1.0, 0.0), Vec2::new(0.0, 1.0)] {
                overlay.line(from + shift, to + shift, STRAIGHT);
            }
        }
    }
    overlay
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench::camera::Model;
    use calibench::geometry::Vec3;

    #[test]
    fn a_smaller_photograph_shows_the_same_ray_at_the_same_place() {
        let lens = Lens::new(Model::KannalaBrandt, &[0.02, -0.003, 0.0, 0.0]).unwrap();
        let camera = Camera::with_lens(600.0, 610.0, 700.3, 500.1, lens);
        let ray = Vec3::new(0.3, -0.2, 1.0);
        let (large, small) = (camera.pixel(&ray).unwrap(), smaller(&camera, 3).pixel(&ray).unwrap());
        // The pixels 3 k, 3 k + 1 and 3 k + 2 become pixel k.
        assert!((small - (large - Vec2::new(1.0, 1.0)) / 3.0).norm() < 1e-9, "{large} {small}");
        let ramp = Raster::from_fn(9, 7, |x, y| (10 * x + y) as u8);
        let means = averaged(&ramp, 3);
        assert_eq!((means.width(), means.height(), means.get(1, 1)), (3, 2, 44));
    }

    #[test]
    fn lines_are_those_of_the_outer_rows() {
        let grid: Vec<Vec2> = (0..12).map(|i| Vec2::new(f64::from(i % 4), f64::from(i / 4))).collect();
        let lines = outer_lines(&grid);
        assert_eq!(lines.len(), 4);
        assert_eq!(lines[1], [Vec2::new(0.0, 2.0), Vec2::new(3.0, 2.0)]);
        // A mark alone makes no row.
        assert!(outer_lines(&grid[..1]).is_empty());
    }
}
