//! Which marks fit worst?

use super::finished::Finished;
use super::html::{given, number};
use calibench::geometry::Vec2;

/// Marks that the table has.
pub(super) const SHOWN: usize = 10;

/// A mark by its place in the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Mark {
    view: usize,
    point: usize,
    /// Length of its residual times its weight, px.
    length: f64,
}

/// The marks with the longest residuals, each times its weight, the longest first.
fn worst(residuals: &[Vec<Vec2>]) -> Vec<Mark> {
    let of_view = |(view, residuals): (usize, &Vec<Vec2>)| {
        let lengths = residuals.iter().map(|residual| residual.norm()).enumerate();
        lengths.map(move |(point, length)| Mark { view, point, length }).collect::<Vec<_>>()
    };
    let mut marks: Vec<Mark> = residuals.iter().enumerate().flat_map(of_view).collect();
    marks.sort_by(|a, b| b.length.total_cmp(&a.length));
    marks.truncate(SHOWN);
    marks
}

/// Column names of [`rows`].
pub(super) fn header(finished: &Finished) -> Vec<String> {
    let unit = &finished.unit;
    // Names that are numbers need no others.
    let first = usize::from(finished.names.are_numbers());
    let columns = ["no.", "view", "point"].map(String::from).into_iter().skip(first);
    let of_board = ["X", "Y"].map(|axis| format!("{axis} ({unit})"));
    let of_image = ["u (px)", "v (px)", "du (px)", "dv (px)", "length (px)", "in sigma"].map(String::from);
    columns.chain(of_board).chain(of_image).collect()
}

/// A row of HTML cells for each.
pub(super) fn rows(finished: &Finished) -> Vec<Vec<String>> {
    let calibration = &finished.fit.calibration;
    let row = |mark: Mark| {
        let Mark { view, point, length } = mark;
        let residual = calibration.residuals[view][point];
        let (at, seen) = (finished.fit.views[view].points()[point], finished.fit.views[view].pixels()[point]);
        let digits = [(seen.x, 6), (seen.y, 6), (residual.x, 3), (residual.y, 3)];
        let place = finished.names.place(view);
        let names = [finished.names.number(view).to_string(), finished.linked(place), point.to_string()];
        let names = names.into_iter().skip(usize::from(finished.names.are_numbers()));
        let lengths = [(residual.norm(), 3), (length / calibration.sigma_px, 2)];
        let numbers = digits.into_iter().chain(lengths).map(|(x, digits)| number(x, digits));
        names.chain([given(at.x), given(at.y)]).chain(numbers).collect()
    };
    worst(&finished.weighted_residuals()).into_iter().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_come_first_and_no_more_than_are_shown() {
        let view = |lengths: &[f64]| lengths.iter().map(|&x| Vec2::new(0.0, -x)).collect::<Vec<_>>();
        let found = worst(&[view(&[0.1, 3.0]), view(&[0.2; 20]), view(&[7.0])]);
        assert_eq!(found.len(), SHOWN);
        assert_eq!((found[0].view, found[0].point), (2, 0));
        assert_eq!((found[1].view, found[1].point), (0, 1));
        assert_eq!((found[2].view, found[2].point), (1, 0));
    }
}
