//! What is wrong with a study's file, where, and what helps?

use super::poses::PosesError;
use calibench::camera::{Model, Parameter};

/// A study that cannot be run as written.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SpecError {
    /// Not TOML, an unknown or missing field, or a value of the wrong type.
    #[error("line {line}, column {column}: {message}; the fields are explained in studies/README.md")]
    Toml {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What the reader says.
        message: String,
    },
    /// The name is used for files.
    #[error("name `{0}`: use lower-case letters, digits and `-`")]
    Name(String),
    /// A number outside its domain.
    #[error("{field} is {value}: it must be {need}")]
    Value {
        /// Path of the field.
        field: &'static str,
        /// Its value.
        value: f64,
        /// Its domain.
        need: &'static str,
    },
    /// Numbers with which nothing can be calculated.
    #[error("scene.camera: {0}")]
    Camera(String),
    /// A count with which nothing is done, nor kept.
    #[error("a whole number of the scene or the estimator is beyond {max}, the largest of TOML", max = i64::MAX)]
    NumberTooLarge,
    /// A text that would stand in tables, figures and pages.
    #[error("the text {0} holds a control character: take it out")]
    ControlCharacter(String),
    /// A study that would not end, or not fit into memory.
    #[error("the study needs {needed} {what}, and the limit is {limit}: {advice}")]
    TooMuch {
        /// What it would need.
        needed: u128,
        /// The most there may be.
        limit: u64,
        /// Of what.
        what: &'static str,
        /// What helps.
        advice: &'static str,
    },
    /// A parameter that the estimator's lens model does not have.
    #[error(
        "estimator: the {model} model has no {parameter}; its coefficients are {}",
        model.coefficients().iter().map(|p| p.name()).collect::<Vec<_>>().join(" ")
    )]
    NotOfModel {
        /// Which.
        parameter: Parameter,
        /// The model.
        model: Model,
    },
    /// No such board.
    #[error("scene.target: {0}")]
    Target(String),
    /// A file that the study names and that cannot be read.
    #[error("file `{name}`: {cause}")]
    Input {
        /// As the study names it.
        name: String,
        /// What is wrong with it.
        cause: String,
    },
    /// A file that is read, and whose marks or poses cannot be used.
    #[error("{0}")]
    Table(String),
    /// A factor that cannot be applied.
    #[error("line {line}, column {column}: factor `{factor}`: {message}")]
    Factor {
        /// Line of the level, from 1; 0 where the text is not at hand.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// Name of the factor.
        factor: String,
        /// What is wrong, and what to do.
        message: String,
    },
    /// The same name for two factors.
    #[error("two factors are named `{0}`: give each a name of its own")]
    DuplicateFactor(String),
    /// A level that another level overwrites.
    #[error(
        "`{field}`, which factor `{before}` sets, is set again by factor `{by}`: its levels would be lost; set each field once"
    )]
    SetTwice {
        /// Path of the field.
        field: String,
        /// Factor that sets it first.
        before: String,
        /// Factor that sets it again, or the table around it.
        by: String,
    },
    /// A factor whose levels are files and have no names of their own.
    #[error("factor `{0}` sets files: give it `labels`, so that no path becomes the name of a cell")]
    Unlabelled(String),
    /// Noise that neighbours share, on marks that have none.
    #[error(
        "scene.noise_correlation needs a target with columns and rows: marks of a file have no neighbours; set it to 0"
    )]
    NoNeighbours,
    /// A cell whose poses do not exist.
    #[error("cell {cell}: {cause}")]
    Poses {
        /// The cell's levels.
        cell: String,
        /// What is wrong.
        cause: PosesError,
    },
    /// The precision is wanted of a quantity that is not estimated in every cell.
    #[error("trials.precision.quantity `{quantity}` is not measured in cell {cell}; there are: {known}")]
    Precision {
        /// As given.
        quantity: String,
        /// The cell's levels.
        cell: String,
        /// Quantities of that cell.
        known: String,
    },
}

impl SpecError {
    pub(super) fn toml(text: &str, error: &toml::de::Error) -> SpecError {
        let (line, column) = place(text, error.span().map_or(0, |span| span.start));
        SpecError::Toml { line, column, message: in_words(error.message().trim()) }
    }
}

/// What the reader expects, in words instead of names of Rust's types.
fn in_words(message: &str) -> String {
    let words = [
        ("expected u64", "expected a whole number from 0"),
        ("expected usize", "expected a whole number from 0"),
        ("expected f64", "expected a number"),
        ("floating point", "number"),
        ("integer", "number"),
    ];
    words.iter().fold(message.to_string(), |text, (typed, said)| text.replace(typed, said))
}

/// Line and column, both from 1, of a byte; the column counts characters.
pub(super) fn place(text: &str, byte: usize) -> (usize, usize) {
    let before = &text.as_bytes()[..byte.min(text.len())];
    let line = before.iter().filter(|&&b| b == b'\n').count() + 1;
    let start = before.iter().rposition(|&b| b == b'\n').map_or(0, |at| at + 1);
    // Every character has one byte that does not continue another.
    let column = before[start..].iter().filter(|&&b| b & 0xc0 != 0x80).count() + 1;
    (line, column)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_columns_are_counted_from_one_and_columns_in_characters() {
        let text = "ab\nc\u{e9}\u{4e2d}d\n";
        let at = |what: &str| place(text, text.find(what).unwrap());
        assert_eq!((at("a"), at("b"), at("c")), ((1, 1), (1, 2), (2, 1)));
        // Two bytes and three bytes are a character each.
        assert_eq!((at("\u{4e2d}"), at("d")), ((2, 3), (2, 4)));
        assert_eq!(place(text, 1000), (3, 1));
    }

    #[test]
    fn what_a_field_takes_is_told_in_words() {
        assert_eq!(
            in_words("invalid type: string, expected u64"),
            "invalid type: string, expected a whole number from 0"
        );
        assert_eq!(
            in_words("floating point `1.5`, expected usize"),
            "number `1.5`, expected a whole number from 0"
        );
    }
}
