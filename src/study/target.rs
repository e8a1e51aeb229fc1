//! What is photographed? A grid of marks, or marks of a file.

use super::inputs::Inputs;
use super::spec_error::SpecError;
use calibench::board::Board;
use calibench::geometry::Vec2;
use calibench::geometry::scatter::Scatter;
use calibench::io::scene_tables::parse_target_marks;
use serde::{Deserialize, Serialize};

/// The target of a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "TargetText", into = "TargetText")]
pub enum TargetSpec {
    /// A grid of marks, centred.
    Grid {
        /// Marks along X.
        columns: usize,
        /// Marks along Y.
        rows: usize,
        /// Distance of neighbours.
        spacing_mm: f64,
    },
    /// Marks of a file, see [`parse_target_marks`].
    File {
        /// Its name, from the folder of the study's own file.
        file: String,
        /// Whose marks, where it holds those of several cells.
        cell: Option<usize>,
        /// The marks, mm; none until the file is read.
        marks: Vec<Vec2>,
    },
}

/// A target as a file says it.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct TargetText {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    columns: Option<usize>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rows: Option<usize>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    spacing_mm: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    file: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    cell: Option<usize>,
}

impl TryFrom<TargetText> for TargetSpec {
    type Error = String;

    fn try_from(text: TargetText) -> Result<TargetSpec, String> {
        let missing = |field: &str| format!("missing field `{field}` of a grid; or `file`, a table of marks");
        match text {
            TargetText { file: Some(file), cell, columns: None, rows: None, spacing_mm: None } => {
                Ok(TargetSpec::File { file, cell, marks: Vec::new() })
            }
            TargetText { file: Some(_), .. } => {
                Err("a target is a grid (columns, rows, spacing_mm) or a `file`, not both".to_string())
            }
            TargetText { cell: Some(_), .. } => Err("`cell` chooses among the marks of a `file`".to_string()),
            TargetText { columns, rows, spacing_mm, .. } => Ok(TargetSpec::Grid {
                columns: columns.ok_or_else(|| missing("columns"))?,
                rows: rows.ok_or_else(|| missing("rows"))?,
                spacing_mm: spacing_mm.ok_or_else(|| missing("spacing_mm"))?,
            }),
        }
    }
}

impl From<TargetSpec> for TargetText {
    fn from(target: TargetSpec) -> TargetText {
        let none = TargetText { columns: None, rows: None, spacing_mm: None, file: None, cell: None };
        match target {
            TargetSpec::Grid { columns, rows, spacing_mm } => {
                TargetText { columns: Some(columns), rows: Some(rows), spacing_mm: Some(spacing_mm), ..none }
            }
            TargetSpec::File { file, cell, .. } => TargetText { file: Some(file), cell, ..none },
        }
    }
}

/// A homography takes four points.
const LEAST_MARKS: usize = 4;

impl TargetSpec {
    /// The same, with the marks of its file.
    pub(super) fn read(self, inputs: &Inputs) -> Result<TargetSpec, SpecError> {
        let TargetSpec::File { file, cell, .. } = self else { return Ok(self) };
        let marks = parse_target_marks(&file, inputs.get(&file)?.as_bytes(), cell)
            .map_err(|error| SpecError::Table(error.to_string()))?;
        let unusable = |what: &str| Err(SpecError::Table(format!("{file}: {what}")));
        if marks.len() < LEAST_MARKS {
            return unusable(&format!("{} marks: a target needs {LEAST_MARKS} at least", marks.len()));
        }
        if !Scatter::of(&marks).spans_a_plane() {
            return unusable("the marks lie on a line: no view of them determines a pose");
        }
        Ok(TargetSpec::File { file, cell, marks })
    }

    /// How many marks there are.
    pub fn count(&self) -> usize {
        match self {
            TargetSpec::Grid { columns, rows, .. } => columns.saturating_mul(*rows),
            TargetSpec::File { marks, .. } => marks.len(),
        }
    }

    /// Marks in a row, of a grid.
    pub fn columns(&self) -> Option<usize> {
        match self {
            TargetSpec::Grid { columns, .. } => Some(*columns),
            TargetSpec::File { .. } => None,
        }
    }

    /// Refuses a grid that is no board.
    pub(super) fn check(&self) -> Result<(), SpecError> {
        match self {
            TargetSpec::Grid { .. } => self.points().map(|_| ()),
            TargetSpec::File { .. } => Ok(()),
        }
    }

    /// Its points, mm.
    pub fn points(&self) -> Result<Vec<Vec2>, SpecError> {
        match self {
            TargetSpec::Grid { columns, rows, spacing_mm } => {
                let board = Board::chessboard(*columns, *rows, *spacing_mm);
                board.map(|board| board.points()).map_err(|e| SpecError::Target(e.to_string()))
            }
            TargetSpec::File { marks, .. } => Ok(marks.clone()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(rows: &str) -> Result<TargetSpec, SpecError> {
        let text = serde_json::json!({ "marks.csv": format!("X,Y\n{rows}") }).to_string();
        let file = TargetSpec::File { file: "marks.csv".into(), cell: None, marks: Vec::new() };
        file.read(&Inputs::parse(&text).unwrap())
    }

    #[test]
    fn a_target_of_a_file_has_four_marks_that_do_not_lie_on_a_line() {
        assert_eq!(read("0,0\n9,0\n0,9\n9,9\n").unwrap().count(), 4);
        for (rows, told) in [
            ("0,0\n9,0\n0,9\n", "3 marks: a target needs 4 at least"),
            ("0,0\n9,0\n", "2 marks"),
            ("0,0\n1,1\n2,2\n3,3\n", "lie on a line"),
        ] {
            let refused = read(rows).unwrap_err().to_string();
            assert!(refused.contains(told), "{refused}");
        }
    }

    #[test]
    fn a_grid_has_columns_times_rows_marks_and_a_file_no_columns() {
        let grid = TargetSpec::Grid { columns: 5, rows: 4, spacing_mm: 2.0 };
        assert_eq!((grid.count(), grid.columns(), grid.points().unwrap().len()), (20, Some(5), 20));
        assert_eq!(read("0,0\n9,0\n0,9\n9,9\n").unwrap().columns(), None);
    }
}
