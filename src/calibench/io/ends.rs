//! Which lengths are to be measured? Pairs of pixels: `length,u1,v1,u2,v2`, one line a length.

use super::lines::open;
use super::table::{Column, Row, TableError, read_table};
use crate::geometry::Vec2;
use std::path::Path;

/// The pixels at both ends of a length.
#[derive(Debug, Clone, PartialEq)]
pub struct PixelEnds {
    /// Name of the length, as it stands in the file.
    pub name: String,
    /// Its ends, px.
    pub pixels: [Vec2; 2],
}

/// Reads a file of pixel pairs.
///
/// # Errors
/// See [`TableError`].
pub fn read_pixel_ends(path: &Path) -> Result<Vec<PixelEnds>, TableError> {
    let (file, bytes) = open(path)?;
    parse_pixel_ends(&file, &bytes)
}

/// Reads pixel pairs from bytes; `file` names them in errors.
///
/// # Errors
/// See [`TableError`].
///
/// ```
/// use calibench::io::parse_pixel_ends;
///
/// let ends = parse_pixel_ends("slots.csv", b"length,u1,v1,u2,v2\nslot,100,50.5,220,51\n")?;
/// assert_eq!(ends[0].pixels[1].x, 220.0);
/// # Ok::<(), calibench::io::TableError>(())
/// ```
pub fn parse_pixel_ends(file: &str, bytes: &[u8]) -> Result<Vec<PixelEnds>, TableError> {
    let rows = read_table(file, bytes, ["length"], ["u1", "v1", "u2", "v2"].map(Column::pixels))?;
    let ends = |Row { names: [name], numbers: [u1, v1, u2, v2], .. }: Row<1, 4>| PixelEnds {
        name,
        pixels: [Vec2::new(u1, v1), Vec2::new(u2, v2)],
    };
    Ok(rows.into_iter().map(ends).collect())
}
