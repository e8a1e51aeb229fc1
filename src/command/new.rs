//! `calibench new`: a file to start from, which runs as it is.

mod experiment;

use super::format::Format;
use super::said::say_written;
use super::{Exit, warn};
use calibench::io::{ShownPath, write_together};
use calibench_harness::project::Project;
use clap::{Args, Subcommand, ValueEnum};
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(subcommand)]
    what: What,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text, global = true)]
    format: Format,
}

#[derive(Debug, Subcommand)]
enum What {
    /// A Monte Carlo study: NAME.toml
    Study(Named),
    /// An experiment of this project, with its binary and its registrations
    Experiment(Named),
    /// A calibrator for the gate, to put your own in
    Adapter(Adapter),
    /// The file of a board that you have already: NAME.toml, for `calibench calibrate --board`
    Board(Named),
}

#[derive(Debug, Args)]
struct Named {
    /// Lower-case letters, digits and `-`
    #[arg(value_parser = parse_name)]
    name: String,
}

#[derive(Debug, Args)]
struct Adapter {
    #[command(flatten)]
    named: Named,
    /// The language of the calibrator
    #[arg(long, value_enum, default_value_t = Language::Python)]
    language: Language,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Language {
    /// Needs NumPy.
    Python,
    /// C++17, and nothing else.
    Cpp,
    /// Rust, without Cargo and without crates.
    Rust,
    /// Octave 7 without packages; MATLAB by files, which was not tried.
    Octave,
}

/// What is written, and what to do with it.
struct Started {
    files: Vec<(PathBuf, Vec<u8>)>,
    next: String,
}

const STUDY: &str = include_str!("new/study.toml");
const BOARD: &str = include_str!("new/board.toml");
const CPP: &str = include_str!("../../adapters/templates/solver.cpp");
const OCTAVE: &str = include_str!("../../adapters/templates/solver.m");
const RUST: &str = include_str!("../../adapters/templates/solver.rs");
const PYTHON: &str = include_str!("../../adapters/minimal_solver.py");

/// The name in the templates.
const PLACEHOLDER: &str = "my-name";

fn parse_name(text: &str) -> Result<String, String> {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    let begins = text.starts_with(|c: char| c.is_ascii_lowercase());
    if begins && text.chars().all(plain) && !text.ends_with('-') {
        return Ok(text.to_string());
    }
    Err("expected a name of lower-case letters, digits and `-` that begins with a letter, such as my-study"
        .to_string())
}

pub(super) fn run(arguments: &Arguments) -> Exit {
    let started = match &arguments.what {
        What::Study(Named { name }) => Ok(study(name)),
        What::Board(Named { name }) => Ok(board(name)),
        What::Adapter(Adapter { named, language }) => Ok(adapter(&named.name, *language)),
        What::Experiment(Named { name }) => Project::here()
            .map_err(|error| error.to_string())
            .and_then(|project| experiment::started(project.root(), name)),
    };
    let started = match started.and_then(refuse_what_is_there) {
        Ok(started) => started,
        Err(message) => {
            warn(&message);
            return Exit::Usage;
        }
    };
    if let Err(error) = write_together(&started.files) {
        warn(&error.to_string());
        return Exit::Incomplete;
    }
    let Started { files, next } = started;
    let written: Vec<PathBuf> = files.into_iter().map(|(path, _)| path).collect();
    say_written(&written, arguments.format, || {
        let names: Vec<String> = written.iter().map(|path| path.shown()).collect();
        format!("wrote {}\n\nnext:\n{next}\n", names.join(", "))
    });
    Exit::Held
}

/// What somebody wrote is not written over; files that are only added to may be there.
fn refuse_what_is_there(started: Started) -> Result<Started, String> {
    let mut own = started.files.iter().filter(|(path, _)| !experiment::is_added_to(path));
    match own.find(|(path, _)| path.symlink_metadata().is_ok()) {
        Some((path, _)) => {
            Err(format!("{} is there already: choose another name, or remove it", path.shown()))
        }
        None => Ok(started),
    }
}

fn study(name: &str) -> Started {
    let file = format!("{name}.toml");
    Started {
        next: format!(
            "  calibench study run {file} --out {name}     # some seconds; then open {name}/report.html"
        ),
        files: vec![(Path::new(&file).to_path_buf(), STUDY.replace(PLACEHOLDER, name).into_bytes())],
    }
}

fn board(name: &str) -> Started {
    let file = format!("{name}.toml");
    Started {
        next: format!(
            "  write your board's lengths into {file}\n  calibench calibrate --board {file} --out result PHOTOS..."
        ),
        files: vec![(Path::new(&file).to_path_buf(), BOARD.replace(PLACEHOLDER, name).into_bytes())],
    }
}

fn adapter(name: &str, language: Language) -> Started {
    let (file, text, needs, command) = match language {
        Language::Python => {
            let file = format!("{}.py", name.replace('-', "_"));
            let text = PYTHON.replace("adapters/minimal_solver.py", &file);
            let command = format!("python3 {file}");
            (file, text, "python3 -m pip install numpy".to_string(), command)
        }
        Language::Cpp => {
            let file = format!("{name}.cpp");
            let compiled = format!("c++ -std=c++17 -O2 -o {name} {file}");
            (file, CPP.replace(PLACEHOLDER, name), compiled, format!("./{name}"))
        }
        Language::Rust => {
            let file = format!("{name}.rs");
            let compiled = format!("rustc --edition 2021 -O -o {name} {file}");
            (file, RUST.replace(PLACEHOLDER, name), compiled, format!("./{name}"))
        }
        Language::Octave => {
            // Octave calls a file by its name, which is that of a function.
            let function = name.replace('-', "_");
            let text = OCTAVE.replace(PLACEHOLDER, name).replace("my_name", &function);
            let command = format!("octave-cli --quiet --eval {function}");
            (format!("{function}.m"), text, "octave-cli --version     # 7 or later".to_string(), command)
        }
    };
    Started {
        next: format!(
            "  {needs}\n  calibench gate --solver \"{command}\" --samples 1     # asks every kind of problem once\n  then put your own \
             calibrator in the place of its `solve`; adapters/PROTOCOL.md says what is asked and judged"
        ),
        files: vec![(Path::new(&file).to_path_buf(), text.into_bytes())],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench::photos::parse_board_file;

    #[test]
    fn names_are_those_of_files_and_of_the_project() {
        assert_eq!(parse_name("my-study2").unwrap(), "my-study2");
        for wrong in ["", "My", "2d", "a b", "a/b", "../a", "a-", "-a", "ä"] {
            assert!(parse_name(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn templates_take_the_name_everywhere() {
        let adapters = Language::value_variants().iter().map(|language| adapter("abc", *language));
        for started in [study("abc"), board("abc")].into_iter().chain(adapters) {
            let text = String::from_utf8(started.files[0].1.clone()).unwrap();
            assert!(
                !text.contains(PLACEHOLDER) && !text.contains("my_name") && !text.contains("minimal_solver"),
                "{text}"
            );
        }
    }

    #[test]
    fn the_file_of_a_board_is_one() {
        let text = String::from_utf8(board("abc").files[0].1.clone()).unwrap();
        assert_eq!(parse_board_file("abc.toml", &text).unwrap().words(), "chess:9x6:25mm");
    }
}
