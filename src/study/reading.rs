//! What did a run do, batch by batch? Its trials beside the engine that knows their order.

use super::engine::Engine;
use super::folder::Folder;
use super::folder_error::FolderError;
use super::replay::Replay;
use super::run_error::RunError;
use super::trial::Trial;
use std::path::Path;

/// A batch with its cell.
pub(super) type Batch = ((usize, u64), Vec<Trial>);

/// A run that is read from its first trial.
pub(super) struct Reading {
    pub engine: Engine,
    pub folder: Folder,
    replay: Replay,
}

impl Reading {
    /// The run in a folder, whatever its state.
    pub fn open(path: &Path) -> Result<Reading, RunError> {
        let folder = Folder::open_to_read(path)?;
        let engine = folder.engine(folder.shard()?)?;
        Ok(Reading::begin(folder, engine)?)
    }

    /// The same, with an engine that is at its beginning.
    pub fn begin(folder: Folder, engine: Engine) -> Result<Reading, FolderError> {
        let replay = folder.trials(&engine)?;
        Ok(Reading { engine, folder, replay })
    }

    /// The next batch; `None` after the last.
    pub fn next(&mut self) -> Result<Option<Batch>, FolderError> {
        let Some(trials) = self.replay.trials(&self.engine)? else { return Ok(None) };
        let unit = self.engine.next().expect("trials were read for the batch that comes next");
        self.engine.absorb(unit, &trials);
        Ok(Some((unit, trials)))
    }
}
