//! Where are the measurements of others? A folder beside the project, or wherever the user says. The build
//! script asks the same lines, so they need the standard library alone.

use std::fmt;
use std::path::PathBuf;

/// The environment variable that names the folder.
pub const VARIABLE: &str = "CALIBENCH_DATA";

/// The user named a folder that is not there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MissingDataFolder {
    /// The folder named.
    pub path: String,
}

impl fmt::Display for MissingDataFolder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let path = &self.path;
        write!(
            f,
            "{VARIABLE} names {path}, which is not a folder: correct it, or unset it to use ../shared/data"
        )
    }
}

impl std::error::Error for MissingDataFolder {}

/// The folder of real data: `CALIBENCH_DATA` if set, else `../shared/data` seen from the package (from the
/// working directory outside of Cargo). `None` if the variable is `none`, or unset and the default is absent:
/// a reason to skip, not to fail.
///
/// # Errors
/// The variable is set, but not to a folder.
pub fn data_folder() -> Result<Option<PathBuf>, MissingDataFolder> {
    if let Some(named) = std::env::var_os(VARIABLE) {
        if named == "none" {
            return Ok(None);
        }
        let path = PathBuf::from(named);
        return if path.is_dir() {
            Ok(Some(path))
        } else {
            Err(MissingDataFolder { path: path.display().to_string() })
        };
    }
    // Asked at run time, so that no path of the building machine stands in the binary.
    let package = std::env::var_os("CARGO_MANIFEST_DIR").map_or_else(|| PathBuf::from("."), PathBuf::from);
    let default = package.join("../shared/data");
    Ok(default.is_dir().then_some(default))
}
