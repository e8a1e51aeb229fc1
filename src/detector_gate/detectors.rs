//! Who is asked? This library's detectors in process, or a program that reads photographs from files.

use super::protocol::{Answer, Problem, Status, Wanted};
use super::scene::Scene;
use calibench::io::{Grey, write_png};
use calibench::raster::Raster;
use calibench_gate::Dialogue;
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::time::Duration;
use std::{fs, io};

/// A photograph with what is looked for in it.
#[derive(Debug, Clone)]
pub struct Asked {
    id: String,
    image: Raster<u8>,
    wanted: Wanted,
}

impl Asked {
    pub(super) fn new(scene: &Scene, trial: u64, suffix: &str, image: Raster<u8>) -> Asked {
        let id = format!("{}-{}-{trial}{suffix}", scene.kind.name(), scene.id);
        Asked { id, image, wanted: scene.wanted(trial) }
    }

    /// Its name.
    pub fn id(&self) -> &str {
        &self.id
    }

    /// The board that is looked for.
    pub fn wanted(&self) -> Wanted {
        self.wanted
    }

    /// The photograph.
    pub fn image(&self) -> &Raster<u8> {
        &self.image
    }
}

/// A detector as the gate sees it.
pub trait Detector {
    /// What it is called in reports.
    fn name(&self) -> String;

    /// Answers questions; an error within says how the protocol was broken.
    ///
    /// # Errors
    /// Photographs that cannot be handed over.
    fn answer_all(&mut self, asked: &[Asked]) -> io::Result<Vec<Result<Answer, String>>>;
}

/// This library's detectors.
#[derive(Debug, Clone, Copy, Default)]
pub struct Builtin;

impl Detector for Builtin {
    fn name(&self) -> String {
        "calibench".to_string()
    }

    fn answer_all(&mut self, asked: &[Asked]) -> io::Result<Vec<Result<Answer, String>>> {
        Ok(asked.par_iter().map(|asked| Ok(seen(asked))).collect())
    }
}

/// As [`calibench::photos`] looks for boards.
fn seen(asked: &Asked) -> Answer {
    let found = asked.wanted.spec().see(&Grey::U8(asked.image.clone()));
    let (status, marks, message) = match found {
        Ok(board) => {
            let marks = board.places_px().iter().map(|place| place.map(|p| [p.x, p.y])).collect();
            (Status::Ok, Some(marks), None)
        }
        Err(reason) => (Status::NotFound, None, Some(reason.to_string())),
    };
    Answer { id: asked.id.clone(), status, marks, message }
}

/// A program that reads questions and writes answers, one JSON object a line, and photographs from files of a
/// folder of its own.
#[derive(Debug)]
pub struct Program {
    dialogue: Dialogue,
    folder: Folder,
}

impl Program {
    /// A program started by the shell as `command`, given `timeout` for a photograph.
    ///
    /// # Errors
    /// A folder for photographs that cannot be made.
    pub fn new(command: &str, timeout: Duration) -> io::Result<Program> {
        Ok(Program { dialogue: Dialogue::new(command, timeout), folder: Folder::new()? })
    }

    /// Where photographs are put.
    pub fn folder(&self) -> &Path {
        &self.folder.path
    }
}

impl Detector for Program {
    fn name(&self) -> String {
        self.dialogue.command().to_string()
    }

    fn answer_all(&mut self, asked: &[Asked]) -> io::Result<Vec<Result<Answer, String>>> {
        let path = self.folder().join("photograph.png");
        let shown =
            path.to_str().ok_or_else(|| io::Error::other("the temporary folder's name is not UTF-8"))?;
        let mut answers = Vec::with_capacity(asked.len());
        for Asked { id, image, wanted } in asked {
            write_png(&path, image).map_err(io::Error::other)?;
            let problem = Problem { id: id.clone(), image: shown.to_string(), board: *wanted };
            answers.push(self.dialogue.ask(&problem));
        }
        Ok(answers)
    }
}

/// A folder that goes when its owner does.
#[derive(Debug)]
struct Folder {
    path: PathBuf,
}

impl Folder {
    fn new() -> io::Result<Folder> {
        let parent = std::env::temp_dir();
        let free = |number: u32| -> io::Result<PathBuf> {
            let path = parent.join(format!("calibench-photographs-{}-{number}", std::process::id()));
            fs::create_dir(&path)?;
            Ok(path)
        };
        let is_taken = |made: &io::Result<PathBuf>| {
            made.as_ref().is_err_and(|error| error.kind() == io::ErrorKind::AlreadyExists)
        };
        let made = (0..1000).map(free).find(|made| !is_taken(made));
        Ok(Folder { path: made.unwrap_or_else(|| Err(io::Error::other("no free name for a folder")))? })
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.path);
    }
}
