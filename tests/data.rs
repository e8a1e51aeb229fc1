//! Where are the measurements of others?

use std::path::PathBuf;

/// The folder that was there when the tests were built; without one, the tests that ask for it are ignored,
/// and counted so.
pub fn folder() -> PathBuf {
    let folder = calibench::io::data_folder().expect("CALIBENCH_DATA names a folder");
    folder.expect("the measurements of others: set CALIBENCH_DATA, or build the tests with CALIBENCH_DATA=none to leave them out")
}
