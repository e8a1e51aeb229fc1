//! Which files was a verb given to read? All that its arguments name, but those that say what to write. No
//! verb may replace them by what it finds.

use clap::ArgMatches;
use std::path::Path;

/// Arguments that name files to be written. A history is both: the verb that adds to it keeps it itself.
const WRITTEN: [&str; 8] = ["out", "json", "junit", "html", "methods", "digits", "to_file", "history"];

/// Keeps the files of a command line from being replaced.
pub(super) fn keep(matches: &ArgMatches) {
    for id in matches.ids().map(|id| id.as_str()).filter(|id| !WRITTEN.contains(id)) {
        let values = matches.try_get_raw(id).ok().flatten();
        calibench::io::keep_files(values.into_iter().flatten().map(Path::new));
    }
    if let Some((_, of_verb)) = matches.subcommand() {
        keep(of_verb);
    }
}
