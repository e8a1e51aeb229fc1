//! mrcal's corners: `corners.vnl`, a line an observed corner: `filename x y level`.
//!
//! Corners of an image stand row by row, x fastest, every one of the board's; one that was not found has `-`
//! or a negative level. The centre of the first pixel is (0, 0). The board is not in the file. (mrcal
//! documentation, "Formulation", `mrcal.observations_from_vnl`; vnlog.)

use super::super::corners::CornerFile;
use super::super::table::MOST_ROWS;
use super::decimal::decimal;
use super::error::FormatError;
use super::node::{Source, shortened};
use crate::board::{View, ViewError};
use crate::geometry::Vec2;
use std::collections::BTreeMap;

/// The board of such a file: a grid of corners.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VnlBoard {
    /// Corners along a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// Distance of neighbours, in the unit of the corner file.
    pub spacing: f64,
}

impl VnlBoard {
    fn point(&self, index: usize) -> Vec2 {
        Vec2::new((index % self.columns) as f64 * self.spacing, (index / self.columns) as f64 * self.spacing)
    }
}

/// Whether a text is a table of vnlog with corners.
pub fn looks_like_vnl(text: &str) -> bool {
    legend(text).is_some_and(|(_, names)| names.starts_with(&["filename", "x", "y"]))
}

/// Line and names of the first comment that is not doubled: vnlog's legend.
fn legend(text: &str) -> Option<(usize, Vec<&str>)> {
    let mut lines = text.lines().enumerate();
    let (line, legend) = lines
        .find(|(_, line)| line.starts_with('#') && !line.starts_with("##") && !line.starts_with("#!"))?;
    Some((line, legend.trim_start_matches('#').split_whitespace().collect()))
}

/// Reads corners of a board, and what is to be said of them.
///
/// # Errors
/// See [`FormatError`].
pub fn parse_vnl(file: &str, text: &str, board: &VnlBoard) -> Result<(CornerFile, Vec<String>), FormatError> {
    let source = Source { file, text };
    if !looks_like_vnl(text) {
        return Err(source.syntax(0, "the legend `# filename x y level` is expected"));
    }
    let mut order: Vec<&str> = Vec::new();
    let mut images: BTreeMap<&str, Image> = BTreeMap::new();
    let mut weights = false;
    let mut offset = 0;
    for (number, line) in text.split_inclusive('\n').enumerate() {
        let start = offset;
        offset += line.len();
        let words: Vec<&str> = line.split_whitespace().collect();
        if words.is_empty() || words[0].starts_with('#') {
            continue;
        }
        if number == MOST_ROWS {
            return Err(source.syntax(start, format!("more than {MOST_ROWS} lines")));
        }
        let [name, x, y, further @ ..] = &words[..] else {
            return Err(source.syntax(start, "filename, x and y are expected"));
        };
        let image = images.entry(name).or_insert_with(|| {
            order.push(name);
            Image { start, corners: Vec::new() }
        });
        let level = further.first().copied().filter(|level| *level != "-");
        let level = level.map(|level| source.number(start, "level", level)).transpose()?;
        weights |= level.is_some_and(|level| level > 0.0);
        let found = *x != "-" && *y != "-" && level.is_none_or(|level| level >= 0.0);
        let pixel =
            || Ok::<_, FormatError>(Vec2::new(source.number(start, "x", x)?, source.number(start, "y", y)?));
        image.corners.push(found.then(pixel).transpose()?);
    }
    let mut corners = CornerFile { view_names: Vec::new(), views: Vec::new() };
    let mut notes = Vec::new();
    for name in order {
        match images[name].view(&source, name, board)? {
            Some(view) => {
                corners.view_names.push(name.to_string());
                corners.views.push(view);
            }
            None => notes.push(format!("no corner was found in {}: it is left out", shortened(name))),
        }
    }
    if corners.views.is_empty() {
        return Err(source.syntax(0, "no image in which corners were found"));
    }
    if weights {
        notes.push("the levels, at which mrcal weighs corners less, are not kept".to_string());
    }
    Ok((corners, notes))
}

/// The corners of one image in the file's order; `None` was not found.
struct Image {
    start: usize,
    corners: Vec<Option<Vec2>>,
}

impl Image {
    fn view(&self, source: &Source, name: &str, board: &VnlBoard) -> Result<Option<View>, FormatError> {
        let found =
            self.corners.iter().enumerate().filter_map(|(i, pixel)| Some((board.point(i), (*pixel)?)));
        let (points, pixels): (Vec<Vec2>, Vec<Vec2>) = found.unzip();
        if pixels.is_empty() {
            return Ok(None);
        }
        let (got, need) = (self.corners.len(), board.columns.saturating_mul(board.rows));
        if got != need {
            let message =
                format!("{got} corners, where a board of {} x {} has {need}", board.columns, board.rows);
            return Err(source.value(self.start, &shortened(name), message));
        }
        let wrong = |error: ViewError| source.value(self.start, &shortened(name), error.to_string());
        View::new(points, pixels).map(Some).map_err(wrong)
    }
}

/// A corner may lie this part of the spacing beside its place on the grid: decimals of a file, not another
/// board.
const OFF_GRID: f64 = 1e-6;

/// Writes corners that are those of a board, `-` where one was not found.
///
/// # Errors
/// [`FormatError::CannotHold`] where a point is no corner of the board, or a name is none that a word can be.
pub fn vnl_text(corners: &CornerFile, board: &VnlBoard) -> Result<String, FormatError> {
    let refuse =
        |what: String, help: &str| FormatError::CannotHold { format: "corners.vnl", what, help: help.into() };
    let points = || corners.views.iter().flat_map(|view| view.points());
    let least = |of: fn(&Vec2) -> f64| points().map(of).fold(f64::INFINITY, f64::min);
    let origin = Vec2::new(least(|p| p.x), least(|p| p.y));
    let mut text = "# filename x y level\n".to_string();
    for (name, view) in corners.view_names.iter().zip(&corners.views) {
        if name.contains(char::is_whitespace) || name.starts_with('#') {
            return Err(refuse(
                format!("the view's name `{}`", shortened(name)),
                "rename it without blanks or #",
            ));
        }
        let mut seen = vec![None; board.columns * board.rows];
        for (point, pixel) in view.pairs() {
            let at = (point - origin) / board.spacing;
            let (i, j) = (at.x.round(), at.y.round());
            let on_grid = (at.x - i).abs() <= OFF_GRID && (at.y - j).abs() <= OFF_GRID;
            if !on_grid || i >= board.columns as f64 || j >= board.rows as f64 {
                let what = format!("the point ({}, {}) of view {name}", point.x, point.y);
                return Err(refuse(what, "it is no corner of the board given with --board"));
            }
            seen[j as usize * board.columns + i as usize] = Some(pixel);
        }
        for pixel in seen {
            text += &match pixel {
                Some(pixel) => format!("{name} {} {} 0\n", decimal(pixel.x), decimal(pixel.y)),
                None => format!("{name} - - -\n"),
            };
        }
    }
    Ok(text)
}

/// The corner file of this library: `view,point,X,Y,u,v`.
pub fn corner_text(corners: &CornerFile) -> String {
    let mut text = "view,point,X,Y,u,v\n".to_string();
    for (name, view) in corners.view_names.iter().zip(&corners.views) {
        let quoted = name.contains([',', '"', '\n', '\r']);
        let name = if quoted { format!("\"{}\"", name.replace('"', "\"\"")) } else { name.clone() };
        for (index, (point, pixel)) in view.pairs().enumerate() {
            text += &format!("{name},{index},{},{},{},{}\n", point.x, point.y, pixel.x, pixel.y);
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::parse_corners;

    const BOARD: VnlBoard = VnlBoard { columns: 3, rows: 2, spacing: 10.0 };

    #[test]
    fn corners_survive_the_way_through_both_files_and_what_was_not_found_stays_out() {
        let text = "## written by a program\n# filename x y level\na 1.5 2 0\na 3 4 0\na - - -\na 5 6 0\na 7 8 -1\na 9 10 0\nb - - -\n";
        let (corners, notes) = parse_vnl("c.vnl", text, &BOARD).unwrap();
        assert_eq!(corners.view_names, ["a"]);
        assert_eq!(corners.views[0].points()[2], Vec2::new(0.0, 10.0));
        assert_eq!(notes, ["no corner was found in b: it is left out"]);
        let again = parse_vnl("c.vnl", &vnl_text(&corners, &BOARD).unwrap(), &BOARD).unwrap().0;
        assert_eq!(again, corners);
        assert_eq!(parse_corners("c.csv", corner_text(&corners).as_bytes()).unwrap(), corners);
    }

    #[test]
    fn complaints_say_where() {
        let cases = [
            ("a 1 2 3\n", "c.vnl:1:1: the legend `# filename x y level` is expected"),
            ("# filename x y level\na 1 2 0\n", "c.vnl:2:1: a: 1 corners, where a board of 3 x 2 has 6"),
            ("# filename x y level\na 1 z 0\n", "c.vnl:2:1: y: `z` is not a number"),
            ("# filename x y level\na 1\n", "c.vnl:2:1: filename, x and y are expected"),
            ("# filename x y level\na - - -\n", "c.vnl:1:1: no image in which corners were found"),
        ];
        for (text, expected) in cases {
            assert_eq!(parse_vnl("c.vnl", text, &BOARD).unwrap_err().to_string(), expected);
        }
    }
}
