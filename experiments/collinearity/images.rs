//! The photograph rectified by the true model and by the calibration: do the images agree as the maps do?

use super::*;

/// A rectified image and the map that made it.
pub struct Rectified {
    pub image: Raster<u8>,
    pub map: RectifyMap,
}

impl Rectified {
    /// `ideal` gives the ideal pixel that an output pixel shows.
    pub fn new(
        photo: &Raster<u8>,
        camera: &Camera,
        ideal: impl Fn(&Vec2) -> Vec2,
    ) -> Result<Rectified, ExperimentError> {
        let size = (photo.width(), photo.height());
        let radius = camera.distortion.monotone_radius();
        let source = |pixel: &Vec2| {
            let seen = ideal(pixel);
            (camera.normalised_from_pixel(&seen).norm() <= radius).then(|| camera.distort_pixel(&seen))
        };
        let map = RectifyMap::new(size, size, source).map_err(ExperimentError::at("rectification"))?;
        let image = map.apply(photo, 0).map_err(ExperimentError::at("rectification"))?;
        Ok(Rectified { image, map })
    }

    pub fn without_data(&self) -> usize {
        self.map.mask().samples().iter().filter(|&&has_data| !has_data).count()
    }
}

/// How two rectified images differ where both have data.
#[derive(Default)]
pub struct Difference {
    pub pixels: usize,
    /// Pixels with data in one only.
    pub masks_differ: usize,
    pub level_sum: f64,
    pub level_square: f64,
    pub level_max: f64,
    pub shift_square: f64,
    pub shift_max: f64,
    /// Pixels whose levels differ by more than their shift explains.
    pub unexplained: usize,
}

impl Difference {
    pub fn new(a: &Rectified, b: &Rectified, photo: &Raster<u8>) -> Difference {
        let mut d = Difference::default();
        let slope = steepest(photo);
        for y in 0..photo.height() {
            for x in 0..photo.width() {
                match (a.map.source(x, y), b.map.source(x, y)) {
                    (Some(p), Some(q)) => {
                        let level = f64::from(a.image.get(x, y)) - f64::from(b.image.get(x, y));
                        d.add(level, p - q, slope);
                    }
                    (None, None) => {}
                    _ => d.masks_differ += 1,
                }
            }
        }
        d
    }

    pub fn add(&mut self, level: f64, shift: Vec2, slope: (f64, f64)) {
        self.pixels += 1;
        self.level_sum += level.abs();
        self.level_square += level * level;
        self.level_max = self.level_max.max(level.abs());
        self.shift_square += shift.norm_squared();
        self.shift_max = self.shift_max.max(shift.norm());
        // Each level is rounded by half, and mixed with weights that move it by 0.02 at most.
        let explained = slope.0 * shift.x.abs() + slope.1 * shift.y.abs() + 1.0 + 0.04;
        self.unexplained += usize::from(level.abs() > explained);
    }

    pub fn mean(&self, sum: f64) -> f64 {
        sum / self.pixels as f64
    }
}

/// Largest step between neighbouring samples along u and v: the steepest that bilinear interpolation can be.
pub fn steepest(photo: &Raster<u8>) -> (f64, f64) {
    let (mut along_u, mut along_v) = (0u8, 0u8);
    for y in 0..photo.height() {
        for pair in photo.row(y).windows(2) {
            along_u = along_u.max(pair[0].abs_diff(pair[1]));
        }
        if y > 0 {
            let steps = photo.row(y - 1).iter().zip(photo.row(y)).map(|(a, b)| a.abs_diff(*b));
            along_v = along_v.max(steps.max().unwrap_or(0));
        }
    }
    (f64::from(along_u), f64::from(along_v))
}

pub fn rectify(record: &mut Record, ours: &[Found]) -> Result<(), ExperimentError> {
    let truth = Truth::example_camera();
    let size = Truth::EXAMPLE_IMAGE;
    let pose = looking_at_centre([0.0; 3], DISTANCE_MM);
    let photo = photograph(&truth, size, &Truth::example_board(), &pose, &Imaging::default())
        .map_err(ExperimentError::at("photograph"))?
        .image
        .to_u8();
    let everything =
        output_camera(&truth, size, OutputView::AllPixels).map_err(ExperimentError::at("output camera"))?;
    let same = |pixel: &Vec2| *pixel;
    let all = |pixel: &Vec2| truth.pixel_from_normalised(&everything.normalised_from_pixel(pixel));
    let mut compared = Vec::new();
    for (view, ideal) in [("same", &same as &dyn Fn(&Vec2) -> Vec2), ("all", &all)] {
        let by_truth = Rectified::new(&photo, &truth, ideal)?;
        for (found, centre) in ours.iter().zip(CENTRES) {
            let by_plane = Rectified::new(&photo, &found.plane.lens_camera(), ideal)?;
            let d = Difference::new(&by_truth, &by_plane, &photo);
            if centre == CENTRES[MAIN] {
                report_rectified(record, view, &by_truth, &by_plane, &d);
                draw_rectified(record, view, &photo, (&by_truth, &by_plane), &d);
            }
            compared.push((view, centre, by_plane.without_data(), d));
        }
    }
    let caption = "images rectified by the single-plane calibration against those by the true model, where \
                   both have data";
    record.table(
        Table::of("rectified", caption, &compared)
            .column("view", "", |(view, ..)| *view)
            .column("lens", "", |(_, centre, ..)| centre.name())
            .column("compared", "px", |(.., d)| d.pixels)
            .column("without_data", "px", |(.., without_data, _)| *without_data)
            .column("data_in_one_only", "px", |(.., d)| d.masks_differ)
            .column("shift_rms", "px", |(.., d)| d.mean(d.shift_square).sqrt())
            .column("shift_max", "px", |(.., d)| d.shift_max)
            .column("level_mean", "grey", |(.., d)| d.mean(d.level_sum))
            .column("level_rms", "grey", |(.., d)| d.mean(d.level_square).sqrt())
            .column("level_max", "grey", |(.., d)| d.level_max),
    );
    let cases = compared.iter().map(|(view, centre, _, d)| {
        (format!("{view}, {}: {} pixels", centre.name(), d.unexplained), d.unexplained == 0)
    });
    record
        .claim_that(
            "images-agree-as-their-maps-do",
            "no grey level differs by more than the shift between the two maps explains",
        )
        .every("images", cases)
        .because(
            "bilinear interpolation is no steeper than the largest step between neighbouring samples; \
             rounding of both levels",
        );
    let shifts = shift_figure(ours, record.seed())?;
    record.figure(shifts);
    let top_row = line(&self::scene(DISTANCE_MM)?.pixels()[0][TOP_ROW])?.max_deviation();
    let caption = format!(
        "The target through the chapter's lens at {DISTANCE_MM} mm, rendered without noise, {} x {} px. \
         Notice the bowed rows: the top one leaves its regression line by {top_row:.2} px.",
        size.0, size.1
    );
    record.figure(Figure::photo("photo", &photo, caption));
    Ok(())
}

pub fn report_rectified(
    record: &mut Record,
    view: &str,
    truth: &Rectified,
    plane: &Rectified,
    d: &Difference,
) {
    let shift = d.mean(d.shift_square).sqrt();
    let grey = d.mean(d.level_square).sqrt();
    let band = Band::relative(1e-3, "a source that moves by 1e-8 px turns the rounding of few levels");
    record
        .exact("px")
        .prefix(format!("{view}-"))
        .count("empty-true-model", truth.without_data(), "pixels without data, true model")
        .count("empty-single-plane", plane.without_data(), "pixels without data, single-plane calibration")
        .count("data-in-one-only", d.masks_differ, "pixels with data in one of the two images only")
        .band(converged())
        .number("shift-rms", shift, "RMS shift between the two maps")
        .group("grey", band)
        .number("grey-rms", grey, "RMS difference of the two images, of 255 levels");
}

pub fn draw_rectified(
    record: &mut Record,
    view: &str,
    photo: &Raster<u8>,
    (truth, plane): (&Rectified, &Rectified),
    d: &Difference,
) {
    let what = if view == "same" { "the same K" } else { "every pixel of the photograph" };
    let (a, b) = (truth.map.mask(), plane.map.mask());
    let difference = Raster::from_fn(photo.width(), photo.height(), |x, y| {
        if !(a.get(x, y) && b.get(x, y)) {
            return 0;
        }
        let level = i32::from(truth.image.get(x, y)) - i32::from(plane.image.get(x, y));
        (128 + 2 * level).clamp(1, 255) as u8
    });
    let caption = |by: &str| {
        format!(
            "The photograph rectified by {by}, showing {what}. Black: no data. Compare its rows with the \
             photograph's."
        )
    };
    record.figure(Figure::photo(format!("rectified-{view}-true"), &truth.image, caption("the true model")));
    let by = "the single-plane calibration, centre free";
    record.figure(Figure::photo(format!("rectified-{view}-plane"), &plane.image, caption(by)));
    let caption = format!(
        "True model minus single-plane calibration (seed {}, sigma {SIGMA_PX} px), showing {what}: grey 128 \
         is no difference, two levels stand for one; black: no data in one of them. Notice at which edges \
         the two differ; over all pixels by {:.2} levels RMS, by {:.0} at most.",
        record.seed(),
        d.mean(d.level_square).sqrt(),
        d.level_max
    );
    record.figure(Figure::photo(format!("difference-{view}"), &difference, caption));
}

/// Distance between the sources of the two maps over the image.
pub fn shift_figure(ours: &[Found], seed: u64) -> Result<Figure, ExperimentError> {
    let truth = Truth::example_camera();
    let columns: Vec<u32> = (0..=8).map(|i| 80 * i).collect();
    let rows: Vec<u32> = (0..=6).rev().map(|i| 80 * i).collect();
    let names = |levels: &[u32]| levels.iter().map(u32::to_string).collect();
    let shifts = |plane: &Camera| -> Vec<f64> {
        let shift = |u: u32, v: u32| {
            let pixel = Vec2::new(f64::from(u), f64::from(v));
            (truth.distort_pixel(&pixel) - plane.distort_pixel(&pixel)).norm()
        };
        let places = rows.iter().flat_map(|&v| columns.iter().map(move |&u| (u, v)));
        places.map(|(u, v)| shift(u, v)).collect()
    };
    let panel = |title: &str, values: Vec<f64>| -> Result<Plot, ExperimentError> {
        let heat = HeatMap::new("shift (px)", names(&columns), names(&rows), values)
            .map_err(ExperimentError::at("heat map"))?
            .range(0.0, 2.0)
            .decimals(2);
        Ok(Plot::heat_map(title, "u (px)", "v (px)", heat).size(520.0, 380.0))
    };
    let (held, free) = (shifts(&ours[0].plane.lens_camera()), shifts(&ours[MAIN].plane.lens_camera()));
    let largest = |values: &[f64]| stats::largest(values.iter().copied());
    let caption = format!(
        "Distance in the photograph between the places at which the true model and the single-plane \
         calibration (seed {seed}, sigma {SIGMA_PX} px) sample an output pixel: up to {:.2} px with the \
         centre held at a wrong place, up to {:.2} px with a free one.",
        largest(&held),
        largest(&free)
    );
    let panels = [panel("centre held at (320, 240)", held)?, panel("centre free", free)?];
    Ok(Figure::panels("map-shift", &panels, 2, caption))
}
