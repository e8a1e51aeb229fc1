//! The report of a plane's map as a page: the map, what each point leaves over, and how well the map is known
//! there.

use super::html::{self, escaped, given, heading, note, number, paragraph, picture, table};
use super::plots::{round_down, whole_ticks};
use super::view_names::ViewNames;
use calibench::geometry::{Handedness, Vec2};
use calibench::io::significant;
use calibench::planar::{PlaneCalibration, PlaneModel};
use calibench_harness::{Figure, Look, Plot};

/// A calibrated plane with all that is said of it.
pub(crate) struct PlaneReport<'a> {
    /// What the page calls the input.
    pub(crate) title: String,
    /// The points' names, in order.
    pub(crate) names: &'a [String],
    pub(crate) pixels: &'a [Vec2],
    pub(crate) world: &'a [Vec2],
    pub(crate) plane: &'a PlaneCalibration,
    /// Picture of the points, beside the page.
    pub(crate) overlay: Option<&'a str>,
}

impl PlaneReport<'_> {
    /// The page and the plots in it, as files of the output folder.
    pub(crate) fn files(&self) -> Vec<(String, Vec<u8>)> {
        let figures = self.figures();
        let page = self.html(&figures).into_bytes();
        let plots = figures.into_iter().map(|figure| (figure.file_name(), figure.bytes));
        plots.chain([("report.html".to_string(), page)]).collect()
    }

    fn html(&self, figures: &[Figure]) -> String {
        let plane = self.plane;
        let mut page = html::begin(&format!("Map of a plane from {}", self.title));
        paragraph(&mut page, &self.summary());
        if plane.degrees_of_freedom == 0 {
            html::warning(
                &mut page,
                "As many unknowns as measurements: the map goes through every point, and the residuals say nothing about its error. \
                 Give a fifth point or more.",
            );
        }
        self.matrix(&mut page);
        self.points(&mut page);
        heading(&mut page, "Figures");
        html::figures(&mut page, figures);
        if let Some(overlay) = self.overlay {
            heading(&mut page, "Photograph and the points found");
            picture(
                &mut page,
                overlay,
                "points found in the photograph",
                "Each point with a cross, rows in the colours of their order.",
            );
        }
        html::end(&mut page);
        page
    }

    fn summary(&self) -> String {
        let plane = self.plane;
        let per_px = 0.5 * (plane.scale_x + plane.scale_y);
        let sigma = plane.spread.as_ref().map_or(String::new(), |spread| {
            format!(" Standard deviation of a world coordinate: {}.", significant(spread.sigma, 4))
        });
        format!(
            "{} of {} points, {} degrees of freedom{}. Residual RMS {} world units per point ({} px), largest {} ({} px).{sigma}",
            match plane.model {
                PlaneModel::Affine => "Affine map (planar)",
                PlaneModel::Projective => "Projective map (tilted)",
                PlaneModel::Similarity => "Similarity",
            },
            self.pixels.len(),
            plane.degrees_of_freedom,
            match plane.handedness {
                Handedness::Mirrored => ", mirrored, as where v points down and Y up",
                Handedness::Proper => "",
            },
            significant(plane.rms_point, 4),
            significant(plane.rms_point / per_px, 4),
            significant(plane.max_point, 4),
            significant(plane.max_point / per_px, 4),
        )
    }

    fn matrix(&self, page: &mut String) {
        heading(page, "World from pixel");
        let matrix = self.plane.map.matrix();
        let covariance = self.plane.spread.as_ref().and_then(|spread| spread.covariance);
        let deviation = |entry: usize| match covariance {
            // The last is 1 by the choice of the matrix's scale.
            Some(covariance) if entry < 8 => covariance[(entry, entry)].max(0.0).sqrt(),
            _ => f64::NAN,
        };
        let row = |entry: usize| {
            let (i, j) = (entry / 3, entry % 3);
            let sd = deviation(entry);
            // An entry that the family holds does not scatter.
            let sd = if sd > 0.0 { number(sd, 3) } else { String::new() };
            vec![format!("m{}{}", i + 1, j + 1), number(matrix[(i, j)], 10), sd]
        };
        let mut rows: Vec<Vec<String>> = (0..9).map(row).collect();
        let scale = |name: &str, value: f64| vec![name.to_string(), number(value, 8), String::new()];
        rows.push(scale("world units per px along u", self.plane.scale_x));
        rows.push(scale("world units per px along v", self.plane.scale_y));
        table(page, 1, &["quantity", "value", "standard deviation"], &rows);
        note(
            page,
            "s [X Y 1] = M [u v 1], at the scale m33 = 1. Without standard deviation are entries that are held by the kind of map, all of \
             them where no degree of freedom is left or where pixel (0, 0) lies on the horizon, and the scales, for which none is computed.",
        );
    }

    fn points(&self, page: &mut String) {
        heading(page, "Points");
        let per_px = 0.5 * (self.plane.scale_x + self.plane.scale_y);
        let counted = self.counted();
        // Names that are numbers need no others.
        let first = usize::from(counted.are_numbers());
        let row = |(k, name): (usize, &String)| {
            let (pixel, world, residual) = (self.pixels[k], self.world[k], self.plane.residuals[k]);
            let [sd_x, sd_y] = self.deviations(&pixel);
            let numbers = [
                (residual.x, 3),
                (residual.y, 3),
                (residual.norm(), 3),
                (residual.norm() / per_px, 3),
                (sd_x, 3),
                (sd_y, 3),
            ];
            let numbers = numbers.into_iter().map(|(x, digits)| number(x, digits));
            let as_given = [pixel.x, pixel.y, world.x, world.y].map(given);
            let names = [counted.number_at(k).to_string(), escaped(name)].into_iter().skip(first);
            names.chain(as_given).chain(numbers).collect()
        };
        let rows: Vec<Vec<String>> = self.names.iter().enumerate().map(row).collect();
        let header = [
            "no.",
            "point",
            "u (px)",
            "v (px)",
            "X",
            "Y",
            "dX",
            "dY",
            "length",
            "length (px)",
            "sd of X",
            "sd of Y",
        ];
        table(page, 2 - first, &header[first..], &rows);
        let sd = match self.plane.spread {
            Some(_) => {
                "sd: standard deviation of the world point that the map gives for this pixel, the map's error alone."
            }
            None => "There are no standard deviations: no degree of freedom is left to estimate them from.",
        };
        note(
            page,
            &format!("dX, dY: predicted \u{2212} given, world units; length (px): at the mean scale. {sd}"),
        );
    }

    /// The points' numbers.
    fn counted(&self) -> ViewNames {
        ViewNames::new(self.names.to_vec(), Vec::new())
    }

    /// Standard deviations of the world coordinates that the map gives for a pixel; NaN where they are not
    /// known.
    fn deviations(&self, pixel: &Vec2) -> [f64; 2] {
        let covariance = self.plane.spread.as_ref().and_then(|spread| spread.world_covariance(pixel));
        covariance.map_or([f64::NAN; 2], |c| [0, 1].map(|k| c[(k, k)].sqrt()))
    }

    fn figures(&self) -> Vec<Figure> {
        let plane = self.plane;
        let low = self.world.iter().fold(Vec2::repeat(f64::INFINITY), |low, p| low.inf(p));
        let high = self.world.iter().fold(Vec2::repeat(f64::NEG_INFINITY), |high, p| high.sup(p));
        if plane.max_point <= 0.0 {
            return Vec::new();
        }
        // The longest arrow takes an eighth of the plane; a round factor is easier to undo by eye.
        let factor = round_down((high - low).amax() / 8.0 / plane.max_point);
        let pairs = self.world.iter().zip(&plane.residuals);
        let arrows: Vec<(f64, f64, f64, f64)> =
            pairs.map(|(at, r)| (at.x, at.y, factor * r.x, factor * r.y)).collect();
        let at: Vec<(f64, f64)> = self.world.iter().map(|p| (p.x, p.y)).collect();
        let title = format!("Residuals, predicted \u{2212} given, {factor} times enlarged");
        let on_plane = Plot::new(title, "X (world units)", "Y (world units)")
            .equal_aspect()
            .points_as("a point", &at, Look::series(1).size(2.0))
            .arrows("", &arrows);
        let counted = self.counted();
        let length = |(k, residual): (usize, &Vec2)| (counted.number_at(k) as f64, residual.norm());
        let lengths: Vec<(f64, f64)> = plane.residuals.iter().enumerate().map(length).collect();
        let first = lengths.iter().map(|at| at.0).fold(f64::INFINITY, f64::min);
        let last = lengths.iter().map(|at| at.0).fold(f64::NEG_INFINITY, f64::max);
        let by_point = Plot::new("Residual of each point", "number of the point", "length (world units)")
            .points("a point", &lengths)
            .hline("RMS", plane.rms_point)
            .x_range(first - 0.5, whole_ticks(first, last))
            .y_range(0.0, 1.15 * plane.max_point);
        vec![
            Figure::plot(
                "residuals",
                &on_plane,
                "Residual of every point where it was given on the plane. Arrows that turn or grow together show that the kind of map \
                 misses something: a tilt, or the lens.",
            ),
            Figure::plot(
                "points",
                &by_point,
                "Length of each point's residual. One far above the rest is a stray, or badly measured.",
            ),
        ]
    }
}
