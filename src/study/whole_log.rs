//! How do trials that are all done already come into a folder? All of them or none, with the files that vouch
//! for them.

use super::folder::{Folder, INPUTS};
use super::folder_error::FolderError;
use super::log::Checkpoint;
use super::manifest::Manifest;
use calibench::io::atomic::Beside;
use calibench::io::hash::hexadecimal;
use sha2::{Digest, Sha256};
use std::io;

/// `trials.csv` while it grows beside its place.
pub(super) struct WholeLog<'a> {
    folder: &'a Folder,
    trials: Beside<'a>,
    bytes: u64,
    hash: Sha256,
}

impl<'a> WholeLog<'a> {
    pub(super) fn begin(folder: &'a Folder, header: &str) -> Result<WholeLog<'a>, FolderError> {
        let trials = Beside::begin(folder.files.as_ref(), &folder.file("trials.csv"))
            .map_err(FolderError::Unwritten)?;
        let mut log = WholeLog { folder, trials, bytes: 0, hash: Sha256::new() };
        log.append(header.as_bytes())?;
        Ok(log)
    }

    pub(super) fn append(&mut self, bytes: &[u8]) -> Result<(), FolderError> {
        self.trials.append(bytes).map_err(FolderError::Unwritten)?;
        self.bytes += bytes.len() as u64;
        self.hash.update(bytes);
        Ok(())
    }

    /// Begins the run with its trials. Every file is on the disk before the first has its name, and the
    /// manifest has its name last: a folder without one holds no run.
    pub(super) fn place(self, spec_text: &str, manifest: &Manifest, batches: u64) -> Result<(), FolderError> {
        let sha256 = hexadecimal(&self.hash);
        let checkpoint = Checkpoint { run: manifest.identity(), batches, bytes: self.bytes, sha256 };
        let contents = &manifest.contents;
        let (spec, checkpoint, manifest) = (spec_text.to_string(), checkpoint.to_text(), manifest.to_text());
        let inputs = (!contents.is_empty()).then(|| (INPUTS, contents.to_text()));
        let mut files = vec![("spec.toml", spec)];
        files.extend(inputs);
        files.extend([("checkpoint.json", checkpoint), ("manifest.json", manifest)]);
        self.put(&files).map_err(FolderError::Unwritten)
    }

    fn put(self, files: &[(&str, String)]) -> io::Result<()> {
        self.trials.sync()?;
        let beside = files
            .iter()
            .map(|(name, text)| {
                Beside::write(self.folder.files.as_ref(), &self.folder.file(name), text.as_bytes())
            })
            .collect::<io::Result<Vec<Beside<'_>>>>()?;
        self.trials.place()?;
        beside.into_iter().try_for_each(Beside::place)
    }
}
