//! Which pixel shows which world point? Point-pair files: `point,px,py,X,Y`, one line a pair.

use super::lines::open;
use super::table::{Column, Row, TableError, read_table};
use crate::geometry::Vec2;
use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

/// The pairs of a file, in its order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PointPairs {
    /// Name of each pair, as it stands in the file.
    pub names: Vec<String>,
    /// Pixels.
    pub pixels: Vec<Vec2>,
    /// World points.
    pub world: Vec<Vec2>,
}

/// The numbers of a line.
const COLUMNS: [Column; 4] =
    [Column::pixels("px"), Column::pixels("py"), Column::length("X"), Column::length("Y")];

/// Reads a point-pair file.
///
/// # Errors
/// See [`TableError`].
pub fn read_point_pairs(path: &Path) -> Result<PointPairs, TableError> {
    let (file, input) = open(path)?;
    parse_point_pairs(&file, input.as_slice())
}

/// Reads point pairs from any source; `file` names it in errors.
///
/// # Errors
/// See [`TableError`].
///
/// ```
/// use calibench::io::parse_point_pairs;
///
/// let pairs = parse_point_pairs("pairs.csv", "point,px,py,X,Y\na,100,50,0,0\nb,140,50,10,0\n".as_bytes())?;
/// assert_eq!(pairs.names, ["a", "b"]);
/// assert_eq!(pairs.world[1].x, 10.0);
/// # Ok::<(), calibench::io::TableError>(())
/// ```
pub fn parse_point_pairs(file: &str, input: impl Read) -> Result<PointPairs, TableError> {
    let mut pairs = PointPairs::default();
    let mut first_line = BTreeMap::new();
    for Row { line, names: [point], numbers: [px, py, x, y] } in read_table(file, input, ["point"], COLUMNS)?
    {
        if let Some(first) = first_line.insert(point.clone(), line) {
            let place = "of the list".to_string();
            return Err(TableError::RepeatedPoint { file: file.into(), line, point, place, first });
        }
        pairs.names.push(point);
        pairs.pixels.push(Vec2::new(px, py));
        pairs.world.push(Vec2::new(x, y));
    }
    Ok(pairs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_keep_their_order_and_names() {
        let pairs = parse_point_pairs("p.csv", &b"point,px,py,X,Y\nb,1,2,3,4\na,5,6,7,8\n"[..]).unwrap();
        assert_eq!(pairs.names, ["b", "a"]);
        assert_eq!(pairs.pixels, [Vec2::new(1.0, 2.0), Vec2::new(5.0, 6.0)]);
        assert_eq!(pairs.world, [Vec2::new(3.0, 4.0), Vec2::new(7.0, 8.0)]);
    }

    #[test]
    fn a_point_given_twice_is_refused() {
        let error = parse_point_pairs("p.csv", &b"point,px,py,X,Y\n0,1,2,3,4\n0,5,6,7,8\n"[..]).unwrap_err();
        assert_eq!(error.to_string(), "p.csv:3: point '0' of the list was given on line 2 already");
    }
}
