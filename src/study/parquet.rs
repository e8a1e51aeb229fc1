//! How do trials stand in a Parquet file? The columns of `trials.csv` with their types; a value that is not
//! there is null.
//!
//! Nothing is compressed: errors are noise, which no codec shortens, and the other columns are counters and
//! words, which the encodings of the format pack already.

use super::described;
use super::engine::Engine;
use super::folder_error::{FolderError, Located};
use super::manifest::Manifest;
use super::replay::Source;
use super::tables;
use super::trial::Trial;
use ::parquet::basic::{Encoding, LogicalType, Repetition, Type as Physical};
use ::parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use ::parquet::column::writer::ColumnWriter;
use ::parquet::data_type::{ByteArray, DataType};
use ::parquet::errors::{ParquetError, Result as ParquetResult};
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::{EnabledStatistics, WriterProperties};
use ::parquet::file::reader::{FileReader, RowGroupReader, SerializedFileReader};
use ::parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use ::parquet::schema::types::{Type, TypePtr};
use calibench::io::input::open_without_waiting;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Rows that are held in memory at a time, a few megabytes.
const GROUP: usize = 1 << 14;
/// Columns before the quantities: cell, trial, outcome, iterations.
const LEADING: usize = 4;

/// Writes all trials of `source` to `sink`.
pub(super) fn write(
    sink: impl Write + Send,
    path: &Path,
    engine: &Engine,
    manifest: &Manifest,
    source: &mut dyn Source,
) -> Result<(), FolderError> {
    let failed = |error: ParquetError| unwritten(path, error);
    let columns = tables::columns(&engine.quantities);
    let schema = schema(&columns).map_err(failed)?;
    let mut writer =
        SerializedFileWriter::new(sink, schema, Arc::new(properties(manifest))).map_err(failed)?;
    loop {
        let mut trials = Vec::with_capacity(GROUP);
        while trials.len() < GROUP
            && let Some(trial) = source.next()?
        {
            trials.push(trial);
        }
        if trials.is_empty() {
            break;
        }
        let mut group = writer.next_row_group().map_err(failed)?;
        write_group(&mut group, &trials, columns.len()).map_err(failed)?;
        group.close().map_err(failed)?;
    }
    writer.close().map(drop).map_err(failed)
}

fn schema(columns: &[String]) -> ParquetResult<TypePtr> {
    let field = |(i, name): (usize, &String)| {
        let (physical, logical, repetition) = match i {
            2 => (Physical::BYTE_ARRAY, Some(LogicalType::String), Repetition::REQUIRED),
            _ if i < LEADING => (Physical::INT64, None, Repetition::REQUIRED),
            _ => (Physical::DOUBLE, None, Repetition::OPTIONAL),
        };
        let field = Type::primitive_type_builder(name, physical);
        Ok(Arc::new(field.with_logical_type(logical).with_repetition(repetition).build()?))
    };
    let fields = columns.iter().enumerate().map(field).collect::<ParquetResult<Vec<TypePtr>>>()?;
    Ok(Arc::new(Type::group_type_builder("trial").with_fields(fields).build()?))
}

/// Counters by their differences, outcomes by a dictionary; a dictionary of errors would hold nearly all of
/// them. What made the trials stands in the head.
fn properties(manifest: &Manifest) -> WriterProperties {
    let head =
        described::in_head(manifest).into_iter().map(|(key, value)| KeyValue::new(key, value)).collect();
    let mut properties = WriterProperties::builder()
        .set_key_value_metadata(Some(head))
        .set_dictionary_enabled(false)
        .set_column_dictionary_enabled("outcome".into(), true)
        .set_statistics_enabled(EnabledStatistics::Chunk);
    for counter in ["cell", "trial", "iterations"] {
        properties = properties.set_column_encoding(counter.into(), Encoding::DELTA_BINARY_PACKED);
    }
    properties.build()
}

fn write_group<W: Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    trials: &[Trial],
    columns: usize,
) -> ParquetResult<()> {
    for column in 0..columns {
        let Some(mut writer) = group.next_column()? else { break };
        match writer.untyped() {
            ColumnWriter::Int64ColumnWriter(out) => {
                let counters: Vec<i64> = trials.iter().map(|t| counter(t, column)).collect();
                out.write_batch(&counters, None, None)?;
            }
            ColumnWriter::ByteArrayColumnWriter(out) => {
                let words: Vec<ByteArray> = trials.iter().map(|t| t.outcome.as_str().into()).collect();
                out.write_batch(&words, None, None)?;
            }
            ColumnWriter::DoubleColumnWriter(out) => {
                let all = || trials.iter().map(|t| t.values[column - LEADING]);
                let there: Vec<i16> = all().map(|v| i16::from(v.is_some())).collect();
                out.write_batch(&all().flatten().collect::<Vec<f64>>(), Some(&there), None)?;
            }
            _ => return Err(ParquetError::General("a column of a type that no trial has".to_string())),
        }
        writer.close()?;
    }
    Ok(())
}

fn counter(trial: &Trial, column: usize) -> i64 {
    match column {
        0 => trial.cell as i64,
        1 => trial.trial as i64,
        _ => trial.iterations as i64,
    }
}

/// Opens a file for reading; its columns must be those of the study.
pub(super) fn open(path: &Path, engine: &Engine) -> Result<Box<dyn Source>, FolderError> {
    let file = open_without_waiting(path).map_err(|cause| Located { path: path.to_path_buf(), cause })?;
    let reader = SerializedFileReader::new(file).map_err(|error| damaged(path, error.to_string()))?;
    let found = reader.metadata().file_metadata().schema_descr().columns();
    let found: Vec<&str> = found.iter().map(|c| c.name()).collect();
    if found != tables::columns(&engine.quantities) {
        return Err(damaged(path, "its columns are not those of this study".to_string()));
    }
    Ok(Box::new(Rows { reader, path: path.to_path_buf(), group: 0, trials: Vec::new().into_iter(), row: 0 }))
}

/// The rows of a file, one group after the other.
struct Rows {
    reader: SerializedFileReader<File>,
    path: PathBuf,
    group: usize,
    trials: std::vec::IntoIter<Trial>,
    row: u64,
}

impl Source for Rows {
    fn next(&mut self) -> Result<Option<Trial>, FolderError> {
        while self.trials.len() == 0 && self.group < self.reader.num_row_groups() {
            let trials = self.reader.get_row_group(self.group).and_then(|group| read_group(group.as_ref()));
            self.trials = trials.map_err(|error| damaged(&self.path, error.to_string()))?.into_iter();
            self.group += 1;
        }
        self.row += 1;
        Ok(self.trials.next())
    }

    fn place(&self) -> String {
        format!("row {}", self.row)
    }
}

fn read_group(group: &dyn RowGroupReader) -> ParquetResult<Vec<Trial>> {
    let rows = group.metadata().num_rows() as usize;
    let quantities = group.metadata().num_columns().saturating_sub(LEADING);
    let blank = || Trial {
        cell: 0,
        trial: 0,
        outcome: String::new(),
        iterations: 0,
        values: Vec::with_capacity(quantities),
    };
    let mut trials: Vec<Trial> = (0..rows).map(|_| blank()).collect();
    for column in 0..group.metadata().num_columns() {
        match group.get_column_reader(column)? {
            ColumnReader::Int64ColumnReader(reader) => {
                let counters = read_column(reader, rows)?;
                trials.iter_mut().zip(counters).for_each(|(trial, n)| set_counter(trial, column, n));
            }
            ColumnReader::ByteArrayColumnReader(reader) => {
                for (trial, word) in trials.iter_mut().zip(read_column(reader, rows)?) {
                    trial.outcome =
                        word.map(|w| w.as_utf8().map(str::to_string)).transpose()?.unwrap_or_default();
                }
            }
            ColumnReader::DoubleColumnReader(reader) => {
                let values = read_column(reader, rows)?;
                trials.iter_mut().zip(values).for_each(|(trial, value)| trial.values.push(value));
            }
            _ => return Err(ParquetError::General(format!("column {column} is of another type"))),
        }
    }
    Ok(trials)
}

fn set_counter(trial: &mut Trial, column: usize, value: Option<i64>) {
    let value = value.unwrap_or_default();
    match column {
        0 => trial.cell = value as usize,
        1 => trial.trial = value as u64,
        _ => trial.iterations = value as usize,
    }
}

/// The values of a column; `None` for null.
fn read_column<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    rows: usize,
) -> ParquetResult<Vec<Option<T::T>>> {
    let (mut levels, mut values, mut read) = (Vec::new(), Vec::new(), 0);
    while read < rows {
        let (records, _, _) = reader.read_records(rows - read, Some(&mut levels), None, &mut values)?;
        if records == 0 {
            return Err(ParquetError::General(format!("{read} rows, but the footer counts {rows}")));
        }
        read += records;
    }
    // A column that has no nulls has no levels.
    if levels.is_empty() {
        return Ok(values.into_iter().map(Some).collect());
    }
    let mut values = values.into_iter();
    Ok(levels.iter().map(|&there| if there > 0 { values.next() } else { None }).collect())
}

fn damaged(path: &Path, what: String) -> FolderError {
    FolderError::Damaged { path: path.to_path_buf(), what }
}

/// Only the disk can fail here.
fn unwritten(path: &Path, error: ParquetError) -> FolderError {
    Located { path: path.to_path_buf(), cause: std::io::Error::other(error) }.into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example::STUDY;
    use crate::{Shard, Spec};
    use calibench_harness::Build;

    struct Given(std::vec::IntoIter<Trial>);

    impl Source for Given {
        fn next(&mut self) -> Result<Option<Trial>, FolderError> {
            Ok(self.0.next())
        }

        fn place(&self) -> String {
            String::new()
        }
    }

    #[test]
    fn trials_are_read_as_they_were_written() {
        let engine = Engine::new(STUDY, Shard::WHOLE).unwrap();
        let manifest = Manifest::new(&Spec::parse(STUDY).unwrap(), Shard::WHOLE, &Build::default());
        // More than a group holds, every third value missing, and a quantity that no trial has.
        let value =
            |i: usize, q: usize| (q > 1 && !(i + q).is_multiple_of(3)).then(|| (i as f64).sqrt() - q as f64);
        let trials = (0..GROUP + 5).map(|i| Trial {
            cell: i % 2,
            trial: i as u64 / 2,
            outcome: ["converged", "refused-few"][i % 2].into(),
            iterations: i % 7,
            values: (0..engine.quantities.len()).map(|q| value(i, q)).collect(),
        });
        let trials: Vec<Trial> = trials.collect();
        let path = std::env::temp_dir().join(format!("calibench-parquet-{}", std::process::id()));
        let file = File::create(&path).unwrap();
        write(file, &path, &engine, &manifest, &mut Given(trials.clone().into_iter())).unwrap();
        let mut rows = open(&path, &engine).unwrap();
        let read: Vec<Trial> = std::iter::from_fn(|| rows.next().unwrap()).collect();
        assert!(read == trials);
        std::fs::remove_file(path).unwrap();
    }
}
