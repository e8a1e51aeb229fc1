//! Where do golden/, figures/ and out/ stand? In the nearest folder above that has golden/published.toml;
//! elsewhere golden values and the book's text come from the program itself, and what is written goes to the
//! current folder.

use calibench::io::input::{MOST_TABLE_BYTES, read_regular};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Files by their path in the source tree.
pub type Files = &'static [(&'static str, &'static [u8])];

/// What the program carries with it.
static CARRIED: OnceLock<Files> = OnceLock::new();

/// Says what the program carries with it for the time when it runs outside the source tree. The first call
/// counts.
pub fn carry(files: Files) {
    CARRIED.get_or_init(|| files);
}

/// The source tree of calibench, or a folder elsewhere with the files that the program carries.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Project {
    root: PathBuf,
    /// What is read before the folder is asked; empty in the source tree.
    carried: Files,
}

/// The command was started outside the source tree.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "no golden/published.toml in {start} or a folder above it: run this inside the source tree of calibench",
    start = start.display()
)]
pub struct NotInProject {
    /// Where the search began.
    pub start: PathBuf,
}

impl Project {
    /// The source tree around the current folder; without one, the current folder with what the program
    /// carries.
    ///
    /// # Errors
    /// There is no source tree, and the program carries nothing.
    pub fn find() -> Result<Project, NotInProject> {
        match (Project::here(), CARRIED.get()) {
            (Err(NotInProject { start }), Some(&carried)) => Ok(Project { root: start, carried }),
            (found, _) => found,
        }
    }

    /// The source tree around the current folder.
    ///
    /// # Errors
    /// There is none.
    pub fn here() -> Result<Project, NotInProject> {
        Project::above(&std::env::current_dir().unwrap_or_default())
    }

    /// Searches `start` and the folders above it.
    ///
    /// # Errors
    /// None of them is the source tree.
    pub fn above(start: &Path) -> Result<Project, NotInProject> {
        start
            .ancestors()
            .find(|folder| folder.join("golden/published.toml").is_file())
            .map(|root| Project { root: root.to_path_buf(), carried: &[] })
            .ok_or_else(|| NotInProject { start: start.to_path_buf() })
    }

    /// Whether this is the source tree, where golden values can be accepted and committed figures compared.
    pub fn is_source_tree(&self) -> bool {
        self.carried.is_empty()
    }

    /// The folder itself.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// A file by its path in the source tree.
    ///
    /// # Errors
    /// It is neither carried nor in the folder.
    pub fn read(&self, path: &str) -> io::Result<Vec<u8>> {
        match self.carried.iter().find(|(name, _)| *name == path) {
            Some((_, bytes)) => Ok(bytes.to_vec()),
            None => Ok(read_regular(&self.root.join(path), MOST_TABLE_BYTES)?),
        }
    }

    /// Files of the source tree that are others than the program carries, or are gone, below a path such as
    /// `golden/`: the program was built with other ones. None elsewhere.
    pub fn others_than_carried(&self, below: &str) -> Vec<&'static str> {
        let carried = CARRIED.get().copied().unwrap_or_default().iter();
        let below = carried.filter(|(name, _)| self.is_source_tree() && name.starts_with(below));
        below
            .filter(|(name, bytes)| self.read(name).ok().as_deref() != Some(*bytes))
            .map(|(name, _)| *name)
            .collect()
    }

    /// A text by its path in the source tree.
    ///
    /// # Errors
    /// As [`Project::read`], and it is not UTF-8.
    pub fn read_text(&self, path: &str) -> io::Result<String> {
        String::from_utf8(self.read(path)?).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))
    }

    /// The committed snapshot of an experiment, if there is one.
    pub fn snapshot_text(&self, experiment: &str) -> Option<String> {
        self.read_text(&format!("golden/{experiment}.snap")).ok()
    }

    /// The file of an experiment's snapshot.
    pub fn snapshot(&self, experiment: &str) -> PathBuf {
        self.root.join("golden").join(format!("{experiment}.snap"))
    }

    /// The folder of an experiment's figures, in the source tree the committed ones.
    pub fn figures(&self, experiment: &str) -> PathBuf {
        self.root.join("figures").join(experiment)
    }

    /// The folder of the last run's results.
    pub fn out(&self) -> PathBuf {
        self.root.join("out")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tree_is_found_from_a_folder_inside_it_and_only_there() {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        assert_eq!(Some(Project::above(here).unwrap().root()), here.ancestors().nth(2));
        assert!(Project::above(Path::new("/")).is_err());
    }

    #[test]
    fn what_is_carried_is_read_before_the_folder_is_asked() {
        let project = Project {
            root: PathBuf::from(env!("CARGO_MANIFEST_DIR")),
            carried: &[("golden/x.snap", b"carried")],
        };
        assert_eq!(project.snapshot_text("x").as_deref(), Some("carried"));
        assert!(project.read_text("project.rs").unwrap().contains("what is carried"));
        assert!(project.read("no/such/file").is_err());
    }
}
