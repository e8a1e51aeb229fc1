//! How are the trials of a run read back? Batch by batch, in the order in which the engine does them, from
//! either kind of file.

use super::engine::Engine;
use super::folder::{FolderError, Located};
use super::tables;
use super::trial::Trial;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Take};
use std::path::PathBuf;

/// A file of trials, read from the beginning.
pub(super) trait Source {
    /// The next trial; `None` after the last.
    fn next(&mut self) -> Result<Option<Trial>, FolderError>;

    /// Where the trial stands that was read last: `line 7`.
    fn place(&self) -> String;
}

/// Reads trials batch by batch.
pub(super) struct Replay {
    source: Box<dyn Source>,
    path: PathBuf,
}

impl Replay {
    pub(super) fn new(source: Box<dyn Source>, path: PathBuf) -> Replay {
        Replay { source, path }
    }

    /// Takes in the batch that the engine expects next; whether there was one.
    pub(super) fn batch(&mut self, engine: &mut Engine) -> Result<bool, FolderError> {
        let Some(trials) = self.trials(engine)? else { return Ok(false) };
        let unit = engine.next().expect("trials were read for the batch that comes next");
        engine.absorb(unit, &trials);
        Ok(true)
    }

    /// The trials of the batch that the engine expects next; `None` at the end of the file.
    pub(super) fn trials(&mut self, engine: &Engine) -> Result<Option<Vec<Trial>>, FolderError> {
        let Some((cell, batch)) = engine.next() else {
            return match self.source.next()? {
                None => Ok(None),
                Some(_) => Err(self.damaged("more trials than the study has")),
            };
        };
        let mut trials = Vec::new();
        for index in engine.trials_of(batch) {
            match self.source.next()? {
                None if trials.is_empty() => return Ok(None),
                None => return Err(self.damaged("it ends within a batch")),
                Some(trial) if trial.cell == cell && trial.trial == index => trials.push(trial),
                Some(_) => return Err(self.damaged(&format!("not trial {index} of cell {cell}"))),
            }
        }
        Ok(Some(trials))
    }

    fn damaged(&self, what: &str) -> FolderError {
        FolderError::Damaged { path: self.path.clone(), what: format!("{}: {what}", self.source.place()) }
    }
}

/// `trials.csv`, as far as the checkpoint counts it.
pub(super) struct Lines {
    reader: BufReader<Take<File>>,
    path: PathBuf,
    line: String,
    number: usize,
    quantities: usize,
}

impl Lines {
    /// Reads `bytes` bytes of `file`, of which the first line must be `header`.
    pub(super) fn open(
        file: File,
        bytes: u64,
        path: PathBuf,
        header: &str,
        quantities: usize,
    ) -> Result<Lines, FolderError> {
        let reader = BufReader::new(file.take(bytes));
        let mut lines = Lines { reader, path, line: String::new(), number: 0, quantities };
        if lines.next_line()? != Some(header.trim_end()) {
            return Err(lines.damaged("it is not the header of this study"));
        }
        Ok(lines)
    }

    /// The next line, without its end; `None` after the last.
    fn next_line(&mut self) -> Result<Option<&str>, FolderError> {
        self.line.clear();
        let read = self.reader.read_line(&mut self.line);
        let count = read.map_err(|cause| Located { path: self.path.clone(), cause })?;
        self.number += 1;
        Ok((count > 0).then(|| self.line.trim_end()))
    }

    fn damaged(&self, what: &str) -> FolderError {
        FolderError::Damaged { path: self.path.clone(), what: format!("{}: {what}", self.place()) }
    }
}

impl Source for Lines {
    fn next(&mut self) -> Result<Option<Trial>, FolderError> {
        let quantities = self.quantities;
        let Some(line) = self.next_line()? else { return Ok(None) };
        match tables::parse_row(line, quantities) {
            Some(trial) => Ok(Some(trial)),
            None => Err(self.damaged("it is not a trial of this study")),
        }
    }

    fn place(&self) -> String {
        format!("line {}", self.number)
    }
}
