//! Where are the marks of a part? Mark files: `point,X,Y`, and if known their standard deviations, `sd` for
//! both coordinates or `sd_X,sd_Y`.

use super::lines::open;
use super::table::{Column, Row, TableError, columns, read_table, refuse_misspelt};
use crate::downstream::Mark;
use crate::geometry::Vec2;
use std::collections::BTreeMap;
use std::path::Path;

/// The marks of a file by name, in its order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MarkFile {
    /// Name of each mark, as it stands in the file.
    pub names: Vec<String>,
    /// The marks; their deviations are 0 where the file gives none.
    pub marks: Vec<Mark>,
}

/// Reads a mark file.
///
/// # Errors
/// See [`TableError`].
pub fn read_marks(path: &Path) -> Result<MarkFile, TableError> {
    let (file, bytes) = open(path)?;
    parse_marks(&file, &bytes)
}

/// Reads marks from bytes; `file` names them in errors.
///
/// # Errors
/// See [`TableError`].
///
/// ```
/// use calibench::io::parse_marks;
///
/// let file = parse_marks("taught.csv", b"point,X,Y,sd\nhole,12.5,40,0.01\n")?;
/// assert_eq!((file.names[0].as_str(), file.marks[0].deviations.y), ("hole", 0.01));
/// # Ok::<(), calibench::io::TableError>(())
/// ```
pub fn parse_marks(file: &str, bytes: &[u8]) -> Result<MarkFile, TableError> {
    let named = columns(bytes);
    refuse_misspelt(file, &named, &["point", "X", "Y", "sd", "sd_X", "sd_Y"])?;
    let has = |name: &str| named.iter().any(|column| column == name);
    if has("sd") && (has("sd_X") || has("sd_Y")) {
        let message = "columns 'sd' and 'sd_X' or 'sd_Y' say the same twice: keep one or two of them".into();
        return Err(TableError::Unreadable { file: file.into(), line: 1, message });
    }
    let rows: Vec<(u64, String, Mark)> = if has("sd_X") || has("sd_Y") {
        let rows = read_table(file, bytes, ["point"], ["X", "Y", "sd_X", "sd_Y"].map(Column::length))?;
        rows.into_iter().map(|row| marked(row, |n: &[f64; 4]| Vec2::new(n[2], n[3]))).collect()
    } else if has("sd") {
        let rows = read_table(file, bytes, ["point"], ["X", "Y", "sd"].map(Column::length))?;
        rows.into_iter().map(|row| marked(row, |n: &[f64; 3]| Vec2::new(n[2], n[2]))).collect()
    } else {
        let rows = read_table(file, bytes, ["point"], ["X", "Y"].map(Column::length))?;
        rows.into_iter().map(|row| marked(row, |_: &[f64; 2]| Vec2::zeros())).collect()
    };
    let (mut marks, mut first_line) = (MarkFile::default(), BTreeMap::new());
    for (line, point, mark) in rows {
        if let Some(first) = first_line.insert(point.clone(), line) {
            let place = "of the list".to_string();
            return Err(TableError::RepeatedPoint { file: file.into(), line, point, place, first });
        }
        marks.names.push(point);
        marks.marks.push(mark);
    }
    Ok(marks)
}

/// Line, name and mark of a row whose first two numbers are the place.
fn marked<const N: usize>(row: Row<1, N>, deviations: impl Fn(&[f64; N]) -> Vec2) -> (u64, String, Mark) {
    let [point] = row.names;
    let at = Vec2::new(row.numbers[0], row.numbers[1]);
    (row.line, point, Mark { at, deviations: deviations(&row.numbers) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deviations_are_read_in_either_form() {
        let read = |text: &str| parse_marks("m.csv", text.as_bytes()).unwrap().marks[0].deviations;
        assert_eq!(read("point,X,Y\na,1,2\n"), Vec2::zeros());
        assert_eq!(read("sd,point,X,Y\n0.5,a,1,2\n"), Vec2::new(0.5, 0.5));
        assert_eq!(read("point,X,Y,sd_X,sd_Y\na,1,2,0.1,0.2\n"), Vec2::new(0.1, 0.2));
    }

    #[test]
    fn half_a_pair_of_deviations_and_a_name_given_twice_are_refused() {
        let fail = |text: &str| parse_marks("m.csv", text.as_bytes()).unwrap_err().to_string();
        assert!(fail("point,X,Y,sd_X\na,1,2,0.1\n").contains("column 'sd_Y' is missing"));
        assert_eq!(
            fail("point,X,Y\na,1,2\na,1,2\n"),
            "m.csv:3: point 'a' of the list was given on line 2 already"
        );
    }
}
