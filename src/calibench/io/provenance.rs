//! From which sources does a result come? Their commit, and whether files differ from it.

use std::path::Path;
use std::process::Command;

/// The state of the source tree.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Commit {
    /// Full hash.
    pub hash: String,
    /// Whether files differ from that commit.
    pub dirty: bool,
}

/// The commit of the source tree, asked of git at run time; `None` where there is no git or no repository.
pub fn commit(root: &Path) -> Option<Commit> {
    let git = |args: &[&str]| {
        let output = Command::new("git").arg("-C").arg(root).args(args).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_string())
    };
    let hash = git(&["rev-parse", "HEAD"])?;
    let dirty = !git(&["status", "--porcelain", "--untracked-files=no"])?.is_empty();
    Some(Commit { hash, dirty })
}
