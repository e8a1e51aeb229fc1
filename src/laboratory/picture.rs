//! A grid of lines, photographed through a lens and corrected as an image.

use super::lens::camera;
use super::questions::{Answer, exactly};
use calibench::geometry::Vec2;
use calibench::raster::Raster;
use calibench::rectify::RectifyMap;
use calibench::synth::Truth;

/// Lines of the grid, ideal pixels: upright ones every 60 px from 20 to 620, level ones every 60 px from 60
/// to 420.
const FIRST_PX: (f64, f64) = (20.0, 60.0);
const SPACING_PX: f64 = 60.0;
const SPACES: (f64, f64) = (10.0, 6.0);
/// Half of a line's width, ideal pixels.
const HALF_WIDTH_PX: f64 = 1.5;
const PAPER: f64 = 230.0;
const INK: f64 = 30.0;
/// Where the photograph shows nothing.
const BORDER: u8 = 0;

/// k1 and k2 -> the levels of a photograph of the grid, row by row. Each pixel is the level at its middle.
pub(crate) fn photograph(numbers: &[f64]) -> Answer {
    let [k1, k2] = exactly(numbers)?;
    let camera = camera(k1, k2);
    let (width, height) = Truth::EXAMPLE_IMAGE;
    let level_at = |x: usize, y: usize| {
        let ideal = camera.correct_pixel(&Vec2::new(x as f64, y as f64));
        // Beyond the lens's reach there is paper.
        libm::round(ideal.map_or(PAPER, |ideal| level(&ideal)))
    };
    Ok((0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| level_at(x, y)).collect())
}

/// The level of the grid at an ideal pixel. Ink thins out over one pixel at the edge of a line.
fn level(ideal: &Vec2) -> f64 {
    let ink = |distance: f64| (HALF_WIDTH_PX + 0.5 - distance).clamp(0.0, 1.0);
    // In units of the spacing from the first line; within the grid, or how far beyond it.
    let along = |at: f64, first: f64| (at - first) / SPACING_PX;
    let (s, t) = (along(ideal.x, FIRST_PX.0), along(ideal.y, FIRST_PX.1));
    let nearest = |at: f64, last: f64| SPACING_PX * (at - libm::round(at).clamp(0.0, last)).abs();
    let beyond = |at: f64, last: f64| SPACING_PX * (-at).max(at - last);
    let upright = ink(nearest(s, SPACES.0)).min(ink(beyond(t, SPACES.1)));
    let level = ink(nearest(t, SPACES.1)).min(ink(beyond(s, SPACES.0)));
    PAPER - (PAPER - INK) * upright.max(level)
}

/// k1 and k2 of the lens that is taken for the true one, and the levels of a photograph -> those of the
/// corrected image.
pub(crate) fn rectify(numbers: &[f64]) -> Answer {
    let [k1, k2, levels @ ..] = numbers else { return Err("a lens has k1 and k2".to_string()) };
    let camera = camera(*k1, *k2);
    let size = Truth::EXAMPLE_IMAGE;
    let levels = levels.iter().map(|&level| level as u8).collect();
    let photograph = Raster::from_samples(size.0, size.1, levels).map_err(|error| error.to_string())?;
    let map = RectifyMap::new(size, size, |ideal| Some(camera.distort_pixel(ideal)))
        .map_err(|error| error.to_string())?;
    let corrected = map.apply(&photograph, BORDER).map_err(|error| error.to_string())?;
    let pixels = (0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y)));
    Ok(pixels.map(|(x, y)| f64::from(corrected.get(x, y))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corrected_photograph_is_the_grid_without_a_lens_but_for_interpolation() {
        let (ideal, bent) = (photograph(&[0.0, 0.0]).unwrap(), photograph(&[-0.18, 0.05]).unwrap());
        let corrected = rectify(&[&[-0.18, 0.05], &bent[..]].concat()).unwrap();
        let apart = |image: &[f64]| {
            let inside =
                (0..ideal.len()).filter(|k| (40..600).contains(&(k % 640)) && (40..440).contains(&(k / 640)));
            let (sum, count) =
                inside.fold((0.0, 0), |(sum, n), k| (sum + (image[k] - ideal[k]).abs(), n + 1));
            sum / f64::from(count)
        };
        // Lines cover a tenth of the image and are 200 levels darker; interpolation softens their edges.
        assert!(apart(&corrected) < 0.25 * apart(&bent), "{} against {}", apart(&corrected), apart(&bent));
    }

    #[test]
    fn a_level_line_ends_with_the_grid() {
        let dark = |x: f64, y: f64| level(&Vec2::new(x, y));
        assert_eq!((dark(50.0, 60.0), dark(50.0, 61.5), dark(50.0, 62.5)), (INK, 130.0, PAPER));
        assert_eq!((dark(10.0, 60.0), dark(620.0, 300.0), dark(300.0, 500.0)), (PAPER, INK, PAPER));
    }

    #[test]
    fn an_image_of_another_size_is_refused_in_words() {
        assert!(rectify(&[0.0, 0.0, 1.0]).is_err_and(|words| words.contains("640 x 480")));
    }
}
