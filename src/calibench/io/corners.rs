//! What was seen where? Corner files: `view,point,X,Y,u,v`, one line an observed point, and if it is known
//! how well each was seen, `weight` or `sigma_px`.

use super::lines::{open, read_lines};
use super::table::{Column, Row, TableError, columns, read_table, refuse_misspelt};
use crate::board::{View, ViewError};
use crate::geometry::Vec2;
use std::collections::BTreeMap;
use std::io::Read;
use std::ops::RangeInclusive;
use std::path::Path;

/// The views of a corner file, in order of first appearance.
#[derive(Debug, Clone, PartialEq)]
pub struct CornerFile {
    /// Name of each view, as it stands in the file.
    pub view_names: Vec<String>,
    /// Correspondences of each view, in the file's order. Target coordinates in the target's unit, pixels
    /// with (0, 0) at the centre of the top-left pixel.
    pub views: Vec<View>,
}

/// Where on the target a line's mark is.
pub(super) const PLACES: [Column; 2] = [Column::length("X"), Column::length("Y")];
/// The numbers of a line.
const COLUMNS: [Column; 4] = [PLACES[0], PLACES[1], Column::pixels("u"), Column::pixels("v")];

/// Reads a corner file.
///
/// # Errors
/// See [`TableError`].
///
/// ```
/// use calibench::io::{read_corners, write_atomically};
///
/// let file = std::env::temp_dir().join("calibench-example-corners.csv");
/// write_atomically(&file, b"view,point,X,Y,u,v\nleft,0,0,0,320.5,240\nleft,1,10,0,371.2,239.4\n")?;
/// let corners = read_corners(&file)?;
/// assert_eq!((corners.view_names[0].as_str(), corners.views[0].len()), ("left", 2));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_corners(path: &Path) -> Result<CornerFile, TableError> {
    let (file, input) = open(path)?;
    parse_corners(&file, input.as_slice())
}

/// Reads corners from any source; `file` names it in errors. Lines of one view need not stand together.
///
/// A column `weight` has the factor of each mark's residual, a column `sigma_px` the standard deviation of
/// its coordinates: 1 over the weight ([`View::with_weights`]).
///
/// # Errors
/// See [`TableError`]; both columns at once; a column that is not read and looks like one that is.
///
/// ```
/// use calibench::io::parse_corners;
///
/// let text = "view,point,X,Y,u,v\nleft,0,0,0,320.5,240\nleft,1,10,0,371.2,239.4\n";
/// let corners = parse_corners("corners.csv", text.as_bytes())?;
/// assert_eq!((corners.view_names[0].as_str(), corners.views[0].len()), ("left", 2));
/// // What is wrong is named with its line and column.
/// let broken = parse_corners("corners.csv", text.replace("371.2", "?").as_bytes()).unwrap_err();
/// assert!(broken.to_string().starts_with("corners.csv:3: column 'u'"));
/// # Ok::<(), calibench::io::TableError>(())
/// ```
pub fn parse_corners(file: &str, input: impl Read) -> Result<CornerFile, TableError> {
    let unreadable = |message: String| TableError::Unreadable { file: file.into(), line: 1, message };
    let bytes = read_lines(file, input)?;
    let header = columns(&bytes);
    refuse_misspelt(file, &header, &["view", "point", "X", "Y", "u", "v", "weight", "sigma_px"])?;
    let has = |name: &str| header.iter().any(|column| column == name);
    match (has("weight"), has("sigma_px")) {
        (true, true) => {
            Err(unreadable("columns 'weight' and 'sigma_px' say the same twice: keep one of them".into()))
        }
        (true, false) => weighted(file, &bytes),
        (false, true) => spread(file, &bytes),
        (false, false) => {
            let rows = read_table(file, bytes.as_slice(), ["view", "point"], COLUMNS)?;
            grouped(file, rows, |_| None)
        }
    }
}

/// Weights, and standard deviations in px, with which marks are weighed against each other: their squares are
/// summed.
pub const WEIGHTS: RangeInclusive<f64> = 1e-9..=1e9;

fn weighted(file: &str, bytes: &[u8]) -> Result<CornerFile, TableError> {
    let rows = with_column(file, bytes, Column::length("weight"))?;
    refuse_extreme(file, "weight", &rows)?;
    grouped(file, rows, |numbers| Some(numbers[4]))
}

/// Refuses what is positive and outside of [`WEIGHTS`].
fn refuse_extreme(file: &str, column: &str, rows: &[Row<2, 5>]) -> Result<(), TableError> {
    let is_extreme = |value: f64| value > 0.0 && !WEIGHTS.contains(&value);
    let Some(Row { numbers, line, .. }) = rows.iter().find(|row| is_extreme(row.numbers[4])) else {
        return Ok(());
    };
    let (least, most) = (WEIGHTS.start(), WEIGHTS.end());
    let message = format!(
        "column '{column}': {:e} is not within {least:e} to {most:e}, which can be weighed",
        numbers[4]
    );
    Err(TableError::Unreadable { file: file.into(), line: *line, message })
}

/// The corners of a table with standard deviations, which are told here as what they are: as weights nobody
/// wrote them.
fn spread(file: &str, bytes: &[u8]) -> Result<CornerFile, TableError> {
    let rows = with_column(file, bytes, Column::pixels("sigma_px"))?;
    refuse_extreme(file, "sigma_px", &rows)?;
    if let Some(Row { numbers, line, .. }) = rows.iter().find(|row| row.numbers[4] <= 0.0) {
        let message =
            format!("column 'sigma_px': {} is no standard deviation: give a positive number", numbers[4]);
        return Err(TableError::Unreadable { file: file.into(), line: *line, message });
    }
    grouped(file, rows, |numbers| Some(1.0 / numbers[4]))
}

fn with_column(file: &str, bytes: &[u8], column: Column) -> Result<Vec<Row<2, 5>>, TableError> {
    let [x, y, u, v] = COLUMNS;
    read_table(file, bytes, ["view", "point"], [x, y, u, v, column])
}

/// The view of rows of points and pixels, weighted if `weight` tells any.
fn view_of<const N: usize>(
    rows: &[[f64; N]],
    weight: impl Fn(&[f64; N]) -> Option<f64>,
) -> Result<View, ViewError> {
    let points = rows.iter().map(|row| Vec2::new(row[0], row[1])).collect();
    let pixels = rows.iter().map(|row| Vec2::new(row[2], row[3])).collect();
    let weights: Vec<f64> = rows.iter().filter_map(weight).collect();
    let view = View::new(points, pixels)?;
    if weights.is_empty() { Ok(view) } else { view.with_weights(weights) }
}

fn grouped<const N: usize>(
    file: &str,
    rows: Vec<Row<2, N>>,
    weight: impl Fn(&[f64; N]) -> Option<f64>,
) -> Result<CornerFile, TableError> {
    let (view_names, views) = by_view(file, rows, |rows| view_of(rows, &weight))?;
    refuse_one_place(file, &view_names, &views)?;
    Ok(CornerFile { view_names, views })
}

/// Marks of a view of which it makes no sense that they all stand at one place of the target.
const SEVERAL: usize = 4;

/// Refuses a view whose marks all are at one place: one mark in all views, taken for one view.
fn refuse_one_place(file: &str, names: &[String], views: &[View]) -> Result<(), TableError> {
    let at_one_place =
        |view: &View| view.points().len() >= SEVERAL && view.points().iter().all(|p| *p == view.points()[0]);
    match names.iter().zip(views).find(|(_, view)| at_one_place(view)) {
        Some((view, seen)) => {
            Err(TableError::OnePlace { file: file.into(), view: view.clone(), marks: seen.points().len() })
        }
        None => Ok(()),
    }
}

/// Names and views of rows `view, point`, both in order of first appearance.
pub(super) fn by_view<const N: usize, V>(
    file: &str,
    rows: Vec<Row<2, N>>,
    view_of: impl Fn(&[[f64; N]]) -> Result<V, ViewError>,
) -> Result<(Vec<String>, Vec<V>), TableError> {
    refuse_repeated_points(file, &rows)?;
    let mut index_of = BTreeMap::new();
    let mut groups: Vec<(String, Vec<[f64; N]>)> = Vec::new();
    for Row { names: [view, _], numbers, .. } in rows {
        let index = *index_of.entry(view.clone()).or_insert_with(|| {
            groups.push((view, Vec::new()));
            groups.len() - 1
        });
        groups[index].1.push(numbers);
    }
    let of_group = |(view, rows): (String, Vec<[f64; N]>)| match view_of(&rows) {
        Ok(seen) => Ok((view, seen)),
        Err(cause) => Err(TableError::View { file: file.into(), view, cause }),
    };
    Ok(groups.into_iter().map(of_group).collect::<Result<Vec<_>, _>>()?.into_iter().unzip())
}

fn refuse_repeated_points<const N: usize>(file: &str, rows: &[Row<2, N>]) -> Result<(), TableError> {
    let mut first_line = BTreeMap::new();
    for row in rows {
        if let Some(first) = first_line.insert(&row.names, row.line) {
            let [view, point] = &row.names;
            return Err(TableError::RepeatedPoint {
                file: file.into(),
                line: row.line,
                point: point.clone(),
                place: format!("of view '{view}'"),
                first,
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<CornerFile, TableError> {
        parse_corners("c.csv", text.as_bytes())
    }

    fn complaint(text: &str) -> String {
        parse(text).unwrap_err().to_string()
    }

    #[test]
    fn views_are_grouped_in_order_of_first_appearance() {
        let corners = parse("view,point,X,Y,u,v\n7,0,0,0,1,2\n3,0,0,0,3,4\n7,1,1,0,5,6\n").unwrap();
        assert_eq!(corners.view_names, ["7", "3"]);
        assert_eq!(corners.views[0].pixels(), [Vec2::new(1.0, 2.0), Vec2::new(5.0, 6.0)]);
        assert_eq!(corners.views[1].points(), [Vec2::zeros()]);
    }

    #[test]
    fn marks_may_have_weights_or_standard_deviations() {
        let weighted = parse("view,point,X,Y,u,v,weight\n0,0,0,0,1,2,0.5\n0,1,1,0,3,4,2\n").unwrap();
        assert_eq!(weighted.views[0].weights(), Some([0.5, 2.0].as_slice()));
        let spread = parse("sigma_px,view,point,X,Y,u,v\n2,0,0,0,0,1,2\n0.5,0,1,1,0,3,4\n").unwrap();
        assert_eq!(spread, weighted);
        assert_eq!(parse("view,point,X,Y,u,v\n0,0,0,0,1,2\n").unwrap().views[0].weights(), None);
        let nothing = complaint("view,point,X,Y,u,v,weight\n7,0,0,0,1,2,0\n");
        assert_eq!(
            nothing,
            "c.csv: view '7': point 0 has weight 0: a weight is positive; leave the mark out instead"
        );
        for none in ["0", "-0.1"] {
            assert_eq!(
                complaint(&format!("view,point,X,Y,u,v,sigma_px\n7,0,0,0,1,2,1\n7,1,1,0,1,2,{none}\n")),
                format!(
                    "c.csv:3: column 'sigma_px': {none} is no standard deviation: give a positive number"
                )
            );
        }
        assert!(
            complaint("view,point,X,Y,u,v,weight,sigma_px\n0,0,0,0,1,2,1,1\n").contains("keep one of them")
        );
    }

    #[test]
    fn marks_blanks_line_ends_and_column_order_are_harmless() {
        let plain = parse("view,point,X,Y,u,v\n0,0,1,2,3.5,4\n").unwrap();
        let other = parse("\u{feff}u, v ,note,X,Y,point,view\r\n 3.5 ,4e0,hello,1,2,0,0\r\n\r\n").unwrap();
        assert_eq!(plain, other);
    }

    #[test]
    fn every_complaint_says_where() {
        let header = "view,point,X,Y,u,v\n";
        let cases = [
            ("", "c.csv: no data: expected the header view,point,X,Y,u,v and at least one line below it"),
            (header, "c.csv: no data: expected the header view,point,X,Y,u,v and at least one line below it"),
            (
                "view;point;X;Y;u;v\n0;0;1;2;3;4\n",
                "c.csv:1: column 'view' is missing: the header is 'view;point;X;Y;u;v', expected view,point,X,Y,u,v \
                 separated by commas",
            ),
            (
                "view,point,X,Y,u,u,v\n0,0,1,2,3,4,5\n",
                "c.csv:1: column 'u' stands more than once in the header",
            ),
            (&format!("{header}0,0,1,2,3,4\n0,1,1,2,3\n"), "c.csv:3: 5 fields where the header has 6"),
            (
                &format!("{header}0,0,1,2,3,4\n\n0,1,1,2,3,4,5\n"),
                "c.csv:4: 7 fields where the header has 6: a comma is no decimal point here",
            ),
            (
                "view,point,X,Y,u,v\r\n0,0,1,2,3,4\r\n\r\n0,1,1,2,3,x\r\n",
                "c.csv:4: column 'v' (field 6): 'x' is not a number",
            ),
            (&format!("{header}0,0,1,2,3,4px\n"), "c.csv:2: column 'v' (field 6): '4px' is not a number"),
            (&format!("{header}0,0,1,,3,4\n"), "c.csv:2: column 'Y' (field 4): '' is not a number"),
            (
                &format!("{header}0,0,NaN,2,3,4\n"),
                "c.csv:2: column 'X' (field 3): 'NaN' is not a finite number",
            ),
            (
                &format!("{header}0,0,1,2,1e999,4\n"),
                "c.csv:2: column 'u' (field 5): '1e999' is not a finite number",
            ),
            (
                &format!("{header}0,0,1,2,1e300,4\n"),
                "c.csv:2: column 'u' (field 5): '1e300' is beyond 1.048576e6, the most there may be",
            ),
            (
                &format!("{header}0,0,1,-1e31,3,4\n"),
                "c.csv:2: column 'Y' (field 4): '-1e31' is beyond 1e30, the most there may be",
            ),
            (
                &format!("{header}0,0,1,2,3,\"4\nall held\"\n"),
                "c.csv:2: column 'v' (field 6): '4\\u000aall held' is not a number",
            ),
            (&format!("{header},0,1,2,3,4\n"), "c.csv:2: column 'view' (field 1) is empty"),
            (
                &format!("{header}0,5,1,2,3,4\n1,5,1,2,3,4\n0,5,1,2,3,4\n"),
                "c.csv:4: point '5' of view '0' was given on line 2 already",
            ),
        ];
        for (text, expected) in cases {
            assert_eq!(complaint(text), expected);
        }
    }

    #[test]
    fn text_that_is_not_utf8_and_files_that_are_not_there_are_named() {
        let error = parse_corners("c.csv", &b"view,point,X,Y,u,v\n0,0,1,2,3,\xff\n"[..]).unwrap_err();
        assert_eq!(error.to_string(), "c.csv:2: field 6 is not UTF-8 text");
        let error = read_corners(Path::new("no/such/file.csv")).unwrap_err();
        assert!(error.to_string().starts_with("no/such/file.csv: "), "{error}");
    }
}
