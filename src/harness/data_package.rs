//! How do others read the tables? `datapackage.json`, a Data Package (version 2 of the standard, 2024) with
//! the schema of each CSV file: the name of every column as its header has it, type, unit, and what the rows
//! are.

use super::table::{Cell, Table};
use calibench::io::hash::sha256_hex;
use serde_json::{Value, json};

const PACKAGE_PROFILE: &str = "https://datapackage.org/profiles/2.0/datapackage.json";
const RESOURCE_PROFILE: &str = "https://datapackage.org/profiles/2.0/dataresource.json";
/// Numbers that are none, as the tables write them: the standard reads them as values that are missing.
const NOT_FINITE: [&str; 4] = ["", "NaN", "inf", "-inf"];

/// A column of a file: its header, the type of its values in the words of the standard, and its unit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    /// The header, as it stands in the file.
    pub header: String,
    /// `number`, `integer` or `string`.
    pub kind: &'static str,
    /// Unit, empty for a pure number or a word.
    pub unit: String,
}

/// A file of a package: `<name>.csv`.
#[derive(Debug, Clone, PartialEq)]
pub struct Resource {
    /// File name without extension.
    pub name: String,
    /// What the rows are.
    pub description: String,
    /// Its columns.
    pub fields: Vec<Field>,
    /// SHA-256 of its bytes, hexadecimal.
    pub sha256: String,
    /// Number of its bytes; `None` where it was not counted.
    pub bytes: Option<usize>,
}

impl Resource {
    /// A table, as [`Table::to_csv`] writes it.
    pub fn of(table: &Table) -> Resource {
        let csv = table.to_csv();
        let field = |(i, column): (usize, &super::table::Column)| Field {
            header: column.header(),
            kind: kind(table.rows().iter().map(|row| &row[i])),
            unit: column.unit.clone(),
        };
        Resource {
            name: table.name.clone(),
            description: table.caption.clone(),
            fields: table.columns().iter().enumerate().map(field).collect(),
            sha256: sha256_hex(csv.as_bytes()),
            bytes: Some(csv.len()),
        }
    }

    fn json(&self) -> Value {
        let fields = self.fields.iter().map(|field| {
            let mut json = json!({ "name": field.header, "type": field.kind });
            if !field.unit.is_empty() {
                json["unit"] = json!(field.unit);
            }
            json["description"] = json!(field.in_words());
            json
        });
        let mut json = json!({
            "$schema": RESOURCE_PROFILE,
            "name": self.name,
            "path": format!("{}.csv", self.name),
            "type": "table",
            "description": self.description,
            "format": "csv",
            "mediatype": "text/csv",
            "encoding": "utf-8",
            "hash": format!("sha256:{}", self.sha256),
            "schema": { "fields": fields.collect::<Vec<_>>(), "missingValues": NOT_FINITE },
        });
        if let Some(bytes) = self.bytes {
            json["bytes"] = json!(bytes);
        }
        json
    }
}

impl Field {
    /// The header as words: `fx_bias [px]` is `fx bias, in px`.
    fn in_words(&self) -> String {
        let name = self.header.split(" [").next().unwrap_or_default().replace('_', " ");
        if self.unit.is_empty() { name } else { format!("{name}, in {}", self.unit) }
    }
}

/// The type that all cells have: words among numbers make words of all. A cell without text is a value that
/// is missing, of whatever type.
fn kind<'a>(cells: impl Iterator<Item = &'a Cell>) -> &'static str {
    let of = |cell: &Cell| match cell {
        Cell::Integer(_) => Some(0),
        Cell::Number(_) => Some(1),
        Cell::Text(text) => (!text.is_empty()).then_some(2),
    };
    ["integer", "number", "string"][cells.filter_map(of).max().unwrap_or(2)]
}

/// The package of a folder.
pub fn data_package(name: &str, title: &str, description: &str, resources: &[Resource]) -> Value {
    json!({
        "$schema": PACKAGE_PROFILE,
        "name": name,
        "title": title,
        "description": description,
        "resources": resources.iter().map(Resource::json).collect::<Vec<_>>(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_has_the_header_type_and_unit_of_its_file() {
        let mut table = Table::new("t", "rows", &[("k1_bias", "px"), ("views", ""), ("way", "")]);
        table.push([Cell::Number(0.5), Cell::Integer(4), Cell::Text("flat".into())]);
        table.push([Cell::Integer(1), Cell::Integer(8), Cell::Integer(9)]);
        let package = data_package("e", "An experiment", "?", &[Resource::of(&table)]);
        let fields = &package["resources"][0]["schema"]["fields"];
        let header = table.to_csv().lines().next().unwrap_or_default().to_string();
        let of = |key: &str| -> Vec<&str> {
            fields.as_array().unwrap().iter().map(|f| f[key].as_str().unwrap_or_default()).collect()
        };
        assert_eq!(of("name").join(","), header);
        assert_eq!(of("type"), ["number", "integer", "string"]);
        assert_eq!(of("unit"), ["px", "", ""]);
        assert_eq!(of("description")[0], "k1 bias, in px");
        // What is missing has no type: it is a number that nobody knows.
        table.push([Cell::Text(String::new()), Cell::Text(String::new()), Cell::Text("steep".into())]);
        let fields = &data_package("e", "An experiment", "?", &[Resource::of(&table)])["resources"][0]["schema"]
            ["fields"];
        assert_eq!(
            [0, 1, 2].map(|i| fields[i]["type"].as_str().unwrap_or_default()),
            ["number", "integer", "string"]
        );
    }
}
