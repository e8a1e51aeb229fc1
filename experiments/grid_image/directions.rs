//! Forward and inverse mapping, pixel by pixel, in a corner of the image.

use super::*;
use calibench_harness::{Align, Drawing, Look, Marker};

/// The part of the output that is shown, from its first pixel on: columns and rows.
const SHOWN: (usize, usize) = (13, 10);
/// Side of a pixel on the sheet, px.
const CELL_PX: f64 = 28.0;
const TOP_PX: f64 = 44.0;
/// The output pixel whose four neighbours are drawn.
const CHOSEN: (usize, usize) = (6, 5);

/// One grid of pixels on the sheet, its first pixel `from`.
struct Grid {
    left_px: f64,
    from: (f64, f64),
}

impl Grid {
    fn place(&self, p: &Vec2) -> (f64, f64) {
        (self.left_px + CELL_PX * (p.x - self.from.0 + 0.5), TOP_PX + CELL_PX * (p.y - self.from.1 + 0.5))
    }

    fn draw(&self, sheet: Drawing) -> Drawing {
        let faint = Look::ink().width(0.4);
        let (right, bottom) = (SHOWN.0 as f64 - 0.5, SHOWN.1 as f64 - 0.5);
        let at = |x: f64, y: f64| self.place(&Vec2::new(self.from.0 + x, self.from.1 + y));
        let upright = (0..=SHOWN.0).map(|k| k as f64 - 0.5).map(|x| [at(x, -0.5), at(x, bottom)]);
        let level = (0..=SHOWN.1).map(|k| k as f64 - 0.5).map(|y| [at(-0.5, y), at(right, y)]);
        upright.chain(level).fold(sheet, |sheet, line| sheet.line(line, faint))
    }

    /// Whether a point lies on the part that is shown, with a margin of so many pixels.
    fn shows(&self, p: &Vec2, margin: f64) -> bool {
        let within = |at: f64, from: f64, count: usize| {
            at > from - 0.5 + margin && at < from + count as f64 - 0.5 - margin
        };
        within(p.x, self.from.0, SHOWN.0) && within(p.y, self.from.1, SHOWN.1)
    }
}

/// The corner of the output, filled forwards; and the corner of the photograph that inverse mapping reads.
pub fn figure(camera: &Camera) -> Result<Figure, ExperimentError> {
    let output = Grid { left_px: 14.0, from: (0.0, 0.0) };
    let first_source = camera.distort_pixel(&Vec2::new(0.0, 0.0));
    let photograph = Grid {
        left_px: 14.0 + CELL_PX * SHOWN.0 as f64 + 40.0,
        from: (libm::floor(first_source.x), libm::floor(first_source.y)),
    };
    let sheet = Drawing::new(
        photograph.left_px + CELL_PX * SHOWN.0 as f64 + 14.0,
        TOP_PX + CELL_PX * SHOWN.1 as f64 + 54.0,
    );
    let (sheet, holes) = forwards(sheet, &output, camera)?;
    let drawing = inverse(sheet, &photograph, camera);
    let caption = format!(
        "The first {} x {} pixels of the corrected image. Left, mapping forwards: a dot is a pixel of the photograph, at the place to which \
         the lens is undone; it fills the pixel in which it falls, and the {holes} dark pixels receive none. Right, inverse mapping: a square is \
         a pixel of the output, at the place where the photograph shows it; its level is mixed from the four pixels around, drawn for one. \
         Notice that no output pixel is left out, and that their places lie nearer together than pixels: here the lens has shrunk the scene.",
        SHOWN.0, SHOWN.1
    );
    Ok(Figure::drawing("directions", &drawing, caption))
}

fn forwards(sheet: Drawing, output: &Grid, camera: &Camera) -> Result<(Drawing, usize), ExperimentError> {
    let (width, height) = Truth::EXAMPLE_IMAGE;
    let mut landed = Vec::new();
    for (x, y) in (0..height / 2).flat_map(|y| (0..width / 2).map(move |x| (x, y))) {
        let ideal = camera.correct_pixel(&Vec2::new(x as f64, y as f64));
        let ideal = ideal.map_err(ExperimentError::at("correction of a pixel"))?;
        if output.shows(&ideal, 0.0) {
            landed.push(ideal);
        }
    }
    let is_hit = |x: usize, y: usize| {
        landed.iter().any(|p| libm::round(p.x) == x as f64 && libm::round(p.y) == y as f64)
    };
    let cells = || (0..SHOWN.1).flat_map(|y| (0..SHOWN.0).map(move |x| (x, y)));
    let holes: Vec<Vec2> =
        cells().filter(|&(x, y)| !is_hit(x, y)).map(|(x, y)| Vec2::new(x as f64, y as f64)).collect();
    let corner = |p: &Vec2, dx: f64, dy: f64| output.place(&(p + Vec2::new(dx, dy)));
    let around =
        |p: &Vec2| [corner(p, -0.5, -0.5), corner(p, 0.5, -0.5), corner(p, 0.5, 0.5), corner(p, -0.5, 0.5)];
    let sheet = sheet.heading(
        "Forwards: where each pixel of the photograph goes",
        (output.left_px, 22.0),
        Align::Start,
    );
    let sheet = holes.iter().fold(sheet, |sheet, hole| sheet.area(around(hole), Look::ink(), 0.75));
    let sheet = output.draw(sheet);
    let dot = Look::series(0).marker(Marker::Disc).size(3.0);
    let sheet = landed.iter().fold(sheet, |sheet, p| sheet.mark(output.place(p), dot));
    let key = TOP_PX + CELL_PX * SHOWN.1 as f64 + 26.0;
    let sheet = sheet
        .mark((output.left_px + 8.0, key), dot)
        .words("pixel of the photograph", (output.left_px + 20.0, key), Align::Start)
        .area(
            [(190.0, key - 7.0), (204.0, key - 7.0), (204.0, key + 7.0), (190.0, key + 7.0)],
            Look::ink(),
            0.75,
        )
        .words("hole: nothing falls here", (212.0, key), Align::Start);
    Ok((sheet, holes.len()))
}

fn inverse(sheet: Drawing, photograph: &Grid, camera: &Camera) -> Drawing {
    let sheet = sheet.heading(
        "Inverse: where each pixel of the output is read",
        (photograph.left_px, 22.0),
        Align::Start,
    );
    let sheet = photograph.draw(sheet);
    let square = Look::series(1).marker(Marker::Square).size(3.2);
    let dot = Look::series(0).marker(Marker::Disc).size(2.0);
    let place = |x: usize, y: usize| Vec2::new(photograph.from.0 + x as f64, photograph.from.1 + y as f64);
    let centres = (0..SHOWN.1).flat_map(|y| (0..SHOWN.0).map(move |x| (x, y)));
    let sheet = centres.fold(sheet, |sheet, (x, y)| sheet.mark(photograph.place(&place(x, y)), dot));
    let source = |x: usize, y: usize| camera.distort_pixel(&Vec2::new(x as f64, y as f64));
    // More of the output than the first pixels lies on this part of the photograph.
    let outputs = (0..2 * SHOWN.1).flat_map(|y| (0..2 * SHOWN.0).map(move |x| source(x, y)));
    let sheet = outputs
        .filter(|p| photograph.shows(p, 0.15))
        .fold(sheet, |sheet, p| sheet.mark(photograph.place(&p), square));
    let chosen = source(CHOSEN.0, CHOSEN.1);
    let (x, y) = (libm::floor(chosen.x), libm::floor(chosen.y));
    let neighbours = [(x, y), (x + 1.0, y), (x, y + 1.0), (x + 1.0, y + 1.0)];
    let sheet = neighbours.iter().fold(sheet, |sheet, &(x, y)| {
        sheet.line([photograph.place(&Vec2::new(x, y)), photograph.place(&chosen)], Look::ink().width(1.8))
    });
    let sheet = sheet.mark(photograph.place(&chosen), square.size(5.0));
    let key = TOP_PX + CELL_PX * SHOWN.1 as f64 + 26.0;
    sheet
        .mark((photograph.left_px + 8.0, key), square)
        .words("pixel of the output", (photograph.left_px + 20.0, key), Align::Start)
        .mark((photograph.left_px + 166.0, key), dot)
        .words("pixel of the photograph", (photograph.left_px + 178.0, key), Align::Start)
}
