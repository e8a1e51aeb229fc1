//! Where do golden/, figures/ and out/ stand? In the nearest folder above that has golden/published.toml.

use std::path::{Path, PathBuf};

/// The source tree of calibench: the folder that holds golden/ and figures/.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Project {
    root: PathBuf,
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
    /// Searches the current folder and those above it.
    pub fn find() -> Result<Project, NotInProject> {
        Project::above(&std::env::current_dir().unwrap_or_default())
    }

    /// Searches `start` and the folders above it.
    pub fn above(start: &Path) -> Result<Project, NotInProject> {
        start
            .ancestors()
            .find(|folder| folder.join("golden/published.toml").is_file())
            .map(|root| Project { root: root.to_path_buf() })
            .ok_or_else(|| NotInProject { start: start.to_path_buf() })
    }

    /// The folder itself.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The snapshot of an experiment.
    pub fn snapshot(&self, experiment: &str) -> PathBuf {
        self.root.join("golden").join(format!("{experiment}.snap"))
    }

    /// The folder of an experiment's committed figures.
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
}
