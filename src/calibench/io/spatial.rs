//! What was seen of a target in three dimensions? Corner files with a column Z: `view,point,X,Y,Z,u,v`.

use super::corners::{by_view, parse_corners};
use super::table::{Column, Row, TableError, columns, read_table};
use crate::tsai::SpatialView;

/// The views of a file, in order of first appearance.
#[derive(Debug, Clone, PartialEq)]
pub struct SpatialFile {
    /// Name of each view, as it stands in the file.
    pub view_names: Vec<String>,
    /// Correspondences of each view, in the file's order.
    pub views: Vec<SpatialView>,
}

const COLUMNS: [Column; 5] =
    [Column::length("X"), Column::length("Y"), Column::length("Z"), Column::pixels("u"), Column::pixels("v")];

/// Reads corners with or without a column Z, which is 0 where there is none; `file` names the source in
/// errors.
///
/// # Errors
/// See [`TableError`].
///
/// ```
/// use calibench::io::parse_spatial;
///
/// let text = "view,point,X,Y,Z,u,v\nfront,0,0,0,5,320.5,240\nfront,1,10,0,0,371.2,239.4\n";
/// let file = parse_spatial("target.csv", text.as_bytes())?;
/// assert_eq!((file.view_names[0].as_str(), file.views[0].points()[0].z), ("front", 5.0));
/// # Ok::<(), calibench::io::TableError>(())
/// ```
pub fn parse_spatial(file: &str, bytes: &[u8]) -> Result<SpatialFile, TableError> {
    if !columns(bytes).iter().any(|column| column == "Z") {
        let flat = parse_corners(file, bytes)?;
        let views = flat.views.iter().map(SpatialView::from).collect();
        return Ok(SpatialFile { view_names: flat.view_names, views });
    }
    let rows: Vec<Row<2, 5>> = read_table(file, bytes, ["view", "point"], COLUMNS)?;
    let (view_names, views) = by_view(file, rows, |marks| {
        let points = marks.iter().map(|[x, y, z, ..]| [*x, *y, *z].into()).collect();
        let pixels = marks.iter().map(|[.., u, v]| [*u, *v].into()).collect();
        SpatialView::new(points, pixels)
    })?;
    Ok(SpatialFile { view_names, views })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_without_z_is_flat_and_complaints_say_where() {
        let flat = parse_spatial("t", b"view,point,X,Y,u,v\n0,0,1,2,3,4\n").unwrap();
        assert_eq!(flat.views[0].points()[0].z, 0.0);
        let fail = |text: &str| parse_spatial("t", text.as_bytes()).unwrap_err().to_string();
        assert_eq!(
            fail("view,point,X,Y,Z,u,v\n0,0,1,2,z,3,4\n"),
            "t:2: column 'Z' (field 5): 'z' is not a number"
        );
        let twice = "view,point,X,Y,Z,u,v\n0,0,1,2,5,3,4\n0,0,1,2,5,3,4\n";
        assert_eq!(fail(twice), "t:3: point '0' of view '0' was given on line 2 already");
    }
}
