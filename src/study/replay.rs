//! How are the trials of a run read back? Batch by batch, in the order in which the engine does them, from
//! either kind of file.

use super::engine::Engine;
use super::folder_error::{FolderError, Located};
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
    /// Batches of the file, where a checkpoint counts them.
    counted: Option<u64>,
}

impl Replay {
    pub(super) fn new(source: Box<dyn Source>, path: PathBuf) -> Replay {
        Replay { source, path, counted: None }
    }

    /// The same of a file whose checkpoint counts so many batches.
    pub(super) fn counting(self, batches: u64) -> Replay {
        Replay { counted: Some(batches), ..self }
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
                None => self.ended(engine),
                Some(_) => Err(self.damaged("more trials than the study has")),
            };
        };
        let mut trials = Vec::new();
        for index in engine.trials_of(batch) {
            match self.source.next()? {
                None if trials.is_empty() => return self.ended(engine),
                None => return Err(self.damaged("it ends within a batch")),
                Some(trial) if trial.cell == cell && trial.trial == index => trials.push(trial),
                Some(_) => return Err(self.damaged(&format!("not trial {index} of cell {cell}"))),
            }
        }
        Ok(Some(trials))
    }

    /// The end of the file, which must be where the checkpoint has it.
    fn ended(&self, engine: &Engine) -> Result<Option<Vec<Trial>>, FolderError> {
        let Some(counted) = self.counted.filter(|counted| *counted != engine.batches) else {
            return Ok(None);
        };
        let path = self.path.with_file_name("checkpoint.json");
        let what = format!("it counts {counted} batches, and trials.csv holds {}", engine.batches);
        Err(FolderError::Damaged { path, what })
    }

    fn damaged(&self, what: &str) -> FolderError {
        FolderError::Damaged { path: self.path.clone(), what: format!("{}: {what}", self.source.place()) }
    }
}

/// Bytes of a line of trials: a thousand times what a study with every quantity has. A file without line ends
/// would be read whole.
const MOST_LINE_BYTES: u64 = 1 << 20;

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
        let read = self.reader.by_ref().take(MOST_LINE_BYTES).read_line(&mut self.line);
        let count = read.map_err(|cause| Located { path: self.path.clone(), cause })?;
        self.number += 1;
        if count as u64 == MOST_LINE_BYTES {
            return Err(self.damaged("it is longer than any line of trials"));
        }
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
        match tables::trial_of_line(line, quantities) {
            Some(trial) => Ok(Some(trial)),
            None => Err(self.damaged("it is not a trial of this study")),
        }
    }

    fn place(&self) -> String {
        format!("line {}", self.number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Shard;
    use crate::example::STUDY;
    use std::path::Path;

    /// The order in which they are done: a batch of each cell, round by round.
    const ORDER: [(usize, u64); 6] = [(0, 0), (0, 1), (1, 0), (1, 1), (0, 2), (1, 2)];

    struct Given {
        trials: std::vec::IntoIter<Trial>,
        taken: usize,
    }

    impl Source for Given {
        fn next(&mut self) -> Result<Option<Trial>, FolderError> {
            self.taken += 1;
            Ok(self.trials.next())
        }

        fn place(&self) -> String {
            format!("trial {}", self.taken)
        }
    }

    fn engine() -> Engine {
        Engine::new(STUDY, Shard::WHOLE).unwrap()
    }

    /// Takes in trials of these cells and numbers; how many batches, or why not.
    fn replayed(order: &[(usize, u64)]) -> Result<u64, String> {
        let mut engine = engine();
        let values = vec![None; engine.quantities.len()];
        let outcome = "refused".to_string();
        let trial = |&(cell, trial): &(usize, u64)| Trial {
            cell,
            trial,
            outcome: outcome.clone(),
            iterations: 0,
            values: values.clone(),
        };
        let trials = order.iter().map(trial).collect::<Vec<_>>().into_iter();
        let mut replay = Replay::new(Box::new(Given { trials, taken: 0 }), "trials.csv".into());
        while replay.batch(&mut engine).map_err(|error| error.to_string())? {}
        Ok(engine.batches)
    }

    #[test]
    fn trials_in_their_order_are_taken_in_as_far_as_they_go() {
        assert_eq!(replayed(&[]), Ok(0));
        assert_eq!(replayed(&ORDER[..4]), Ok(2));
        assert_eq!(replayed(&ORDER), Ok(4));
    }

    #[test]
    fn trials_of_another_cell_or_number_are_refused_with_their_place() {
        let refused = |order: &[(usize, u64)], place: &str, what: &str| {
            let said = replayed(order).unwrap_err();
            assert!(said.contains(&format!("trials.csv is damaged: {place}: {what}")), "{said}");
        };
        refused(&[(1, 0)], "trial 1", "not trial 0 of cell 0");
        refused(&[(0, 0), (1, 1)], "trial 2", "not trial 1 of cell 0");
        refused(&[(0, 0), (0, 0)], "trial 2", "not trial 1 of cell 0");
        refused(&[(0, 0), (0, 1), (1, 0), (1, 1), (0, 3)], "trial 5", "not trial 2 of cell 0");
        refused(&ORDER[..3], "trial 4", "it ends within a batch");
        refused(&[&ORDER[..], &[(1, 3)]].concat(), "trial 7", "more trials than the study has");
    }

    #[test]
    fn a_line_that_does_not_end_is_not_read_to_the_end_of_the_file() {
        let header = tables::header(&engine().quantities);
        let long = |bytes: usize| {
            let mut lines = lines(&(header.clone() + &"1".repeat(bytes)), "long").unwrap();
            let said = lines.next().unwrap_err().to_string();
            (said, lines.line.len() as u64)
        };
        let (said, kept) = long(3 << 20);
        assert!(said.contains("line 2: it is longer than any line of trials"), "{said}");
        assert_eq!(kept, MOST_LINE_BYTES);
        assert!(long(9).0.contains("line 2: it is not a trial of this study"));
    }

    /// The lines of a file that its checkpoint vouches for.
    fn lines(text: &str, name: &str) -> Result<Lines, FolderError> {
        let path = std::env::temp_dir().join(format!("calibench-replay-{}-{name}", std::process::id()));
        std::fs::write(&path, text).unwrap();
        let file = File::open(&path).unwrap();
        std::fs::remove_file(path).unwrap();
        let engine = engine();
        let header = tables::header(&engine.quantities);
        Lines::open(file, text.len() as u64, Path::new("trials.csv").into(), &header, engine.quantities.len())
    }

    #[test]
    fn rows_that_are_none_of_the_study_are_refused_with_their_line() {
        let engine = engine();
        let header = tables::header(&engine.quantities);
        let row = format!("0,0,refused,0{}\n", ",".repeat(engine.quantities.len()));
        let mut good = lines(&format!("{header}{row}"), "good").unwrap();
        assert!(good.next().unwrap().is_some() && good.next().unwrap().is_none());
        let other = lines(&format!("cell,trial\n{row}"), "header").err().unwrap().to_string();
        assert!(other.contains("line 1: it is not the header of this study"), "{other}");
        for broken in
            [format!(",{row}"), row.replacen("0,0", "0,-1", 1), row.replacen(",\n", ",x\n", 1), "\n".into()]
        {
            let mut lines = lines(&format!("{header}{row}{broken}"), "broken").unwrap();
            assert!(lines.next().unwrap().is_some());
            let said = lines.next().unwrap_err().to_string();
            assert!(said.contains("line 3: it is not a trial of this study"), "{broken}: {said}");
        }
    }
}
