//! What are the data behind a figure? Columns with units, rows of numbers and words; written as CSV.

use super::record_error::RecordError;

/// A column: a name and a unit (empty for a pure number or a word).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// Name, in snake_case.
    pub name: String,
    /// Unit, such as `px`.
    pub unit: String,
}

impl Column {
    /// `name [unit]`, as the CSV file has it.
    pub fn header(&self) -> String {
        match self.unit.as_str() {
            "" => self.name.clone(),
            unit => format!("{} [{unit}]", self.name),
        }
    }
}

/// One entry of a table.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// A measured or computed number, written with all its digits.
    Number(f64),
    /// A count or an index.
    Integer(i64),
    /// A word.
    Text(String),
}

impl From<f64> for Cell {
    fn from(value: f64) -> Cell {
        Cell::Number(value)
    }
}

impl From<usize> for Cell {
    fn from(value: usize) -> Cell {
        Cell::Integer(value as i64)
    }
}

impl From<i64> for Cell {
    fn from(value: i64) -> Cell {
        Cell::Integer(value)
    }
}

impl From<&str> for Cell {
    fn from(value: &str) -> Cell {
        Cell::Text(value.to_string())
    }
}

impl From<String> for Cell {
    fn from(value: String) -> Cell {
        Cell::Text(value)
    }
}

impl Cell {
    /// Numbers with as many digits as bring the same bits back.
    fn text(&self) -> String {
        match self {
            Cell::Number(value) => format!("{value:?}"),
            Cell::Integer(value) => value.to_string(),
            Cell::Text(text) => text.clone(),
        }
    }
}

/// A table of an experiment, written to `out/<experiment>/<name>.csv`.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// File name without extension, in kebab-case.
    pub name: String,
    /// What the rows are.
    pub caption: String,
    columns: Vec<Column>,
    rows: Vec<Vec<Cell>>,
    /// Whether every machine gives the same bits; false where a third party's code stands in the path.
    pub reproducible: bool,
}

impl Table {
    /// An empty table. Columns are `(name, unit)`.
    pub fn new(name: impl Into<String>, caption: impl Into<String>, columns: &[(&str, &str)]) -> Table {
        let column = |&(name, unit): &(&str, &str)| Column { name: name.to_string(), unit: unit.to_string() };
        Table {
            name: name.into(),
            caption: caption.into(),
            columns: columns.iter().map(column).collect(),
            rows: Vec::new(),
            reproducible: true,
        }
    }

    /// A table whose rows are arrays, one cell for each of the columns `(name, unit)`.
    pub fn of_arrays<C: Into<Cell> + Clone, const N: usize>(
        name: impl Into<String>,
        caption: impl Into<String>,
        columns: [(&str, &str); N],
        rows: &[[C; N]],
    ) -> Table {
        let mut table = Table::new(name, caption, &columns);
        rows.iter().for_each(|row| table.push(row.iter().cloned()));
        table
    }

    /// Adds a row. A row of another length than the columns is reported when the record is closed.
    pub fn push<C: Into<Cell>>(&mut self, row: impl IntoIterator<Item = C>) {
        self.rows.push(row.into_iter().map(Into::into).collect());
    }

    /// The columns.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// The rows.
    pub fn rows(&self) -> &[Vec<Cell>] {
        &self.rows
    }

    /// The table as CSV, a header of `name [unit]` first.
    pub fn to_csv(&self) -> String {
        let mut writer = csv::WriterBuilder::new().flexible(true).from_writer(Vec::new());
        let records = std::iter::once(self.columns.iter().map(Column::header).collect())
            .chain(self.rows.iter().map(|r| r.iter().map(Cell::text).collect()));
        for record in records {
            let record: Vec<String> = record;
            writer.write_record(&record).expect("writing to memory cannot fail");
        }
        let bytes = writer.into_inner().expect("writing to memory cannot fail");
        String::from_utf8(bytes).expect("cells are text")
    }

    /// Whether every row has one cell a column.
    pub(super) fn validate(&self) -> Result<(), RecordError> {
        let need = self.columns.len();
        match self.rows.iter().position(|r| r.len() != need) {
            None => Ok(()),
            Some(row) => Err(RecordError::RaggedTable {
                table: self.name.clone(),
                row,
                need,
                got: self.rows[row].len(),
            }),
        }
    }
}

/// A table whose columns are being said, each with its name, its unit and the cell it takes from a row: what
/// belongs together stands in one line, which a struct with a field, a unit and a value for each column would
/// need three places for.
#[derive(Debug)]
pub struct Rows<R> {
    table: Table,
    rows: Vec<R>,
}

impl Table {
    /// Begins a table of such rows; [`Record::table`](super::Record::table) takes it once all columns are
    /// said.
    pub fn of<R>(
        name: impl Into<String>,
        caption: impl Into<String>,
        rows: impl IntoIterator<Item = R>,
    ) -> Rows<R> {
        let rows: Vec<R> = rows.into_iter().collect();
        let mut table = Table::new(name, caption, &[]);
        table.rows = vec![Vec::new(); rows.len()];
        Rows { table, rows }
    }
}

impl<R> Rows<R> {
    /// Adds a column.
    pub fn column<C: Into<Cell>>(mut self, name: &str, unit: &str, cell: impl Fn(&R) -> C) -> Rows<R> {
        self.table.columns.push(Column { name: name.to_string(), unit: unit.to_string() });
        for (row, cells) in self.rows.iter().zip(&mut self.table.rows) {
            cells.push(cell(row).into());
        }
        self
    }

    /// Adds columns of one unit that belong together, such as a value and the ends of its interval: each row
    /// has a cell for every one of them.
    pub fn columns<C: Into<Cell>, I: IntoIterator<Item = C>>(
        mut self,
        names: impl IntoIterator<Item = impl Into<String>>,
        unit: &str,
        cells: impl Fn(&R) -> I,
    ) -> Rows<R> {
        let named = names.into_iter().map(|name| Column { name: name.into(), unit: unit.to_string() });
        self.table.columns.extend(named);
        for (row, own) in self.rows.iter().zip(&mut self.table.rows) {
            own.extend(cells(row).into_iter().map(Into::into));
        }
        self
    }
}

impl<R> From<Rows<R>> for Table {
    fn from(rows: Rows<R>) -> Table {
        rows.table
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_written_with_units_and_all_digits() {
        let mut table = Table::new("t", "two rows", &[("u", "px"), ("label", "")]);
        table.push([Cell::from(0.1), Cell::from("a, b")]);
        table.push([Cell::from(1.0 / 3.0), Cell::from(2usize)]);
        assert_eq!(table.to_csv(), "u [px],label\n0.1,\"a, b\"\n0.3333333333333333,2\n");
        assert!(table.validate().is_ok());
    }

    #[test]
    fn columns_take_their_cells_from_rows() {
        let rows = [(0.1, "a, b"), (1.0 / 3.0, "c")];
        let table = Table::of("t", "two rows", rows).column("u", "px", |r| r.0).column("label", "", |r| r.1);
        assert_eq!(Table::from(table).to_csv(), "u [px],label\n0.1,\"a, b\"\n0.3333333333333333,c\n");
    }

    #[test]
    fn columns_that_belong_together_are_said_together() {
        let table = Table::of("t", "a row", [(7usize, [0.1, 0.2])])
            .columns(["low", "high"], "px", |row| row.1)
            .column("count", "", |row| row.0);
        assert_eq!(Table::from(table).to_csv(), "low [px],high [px],count\n0.1,0.2,7\n");
        // As many cells as names, or the record says so when it is closed.
        let table = Table::of("t", "a row", [[0.1, 0.2]]).columns(["low"], "px", |row| *row);
        assert!(matches!(
            Table::from(table).validate(),
            Err(RecordError::RaggedTable { need: 1, got: 2, .. })
        ));
    }

    #[test]
    fn a_ragged_row_is_named() {
        let mut table = Table::new("t", "", &[("u", "px"), ("v", "px")]);
        table.push([1.0, 2.0]);
        table.push([1.0]);
        let error = table.validate().unwrap_err();
        assert_eq!(error, RecordError::RaggedTable { table: "t".into(), row: 1, need: 2, got: 1 });
    }
}
