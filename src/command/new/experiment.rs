//! A new experiment: its file, its binary, and its registrations in experiments/lib.rs and Cargo.toml.

use super::Started;
use calibench::io::input::MOST_SPEC_BYTES;
use calibench::io::read_regular_text;
use std::path::{Path, PathBuf};

const TEMPLATE: &str = include_str!("experiment_template.rs");

/// What the registrations are put before.
const BEFORE_MODULE: &str = "mod sweep;\n";
const BEFORE_ENTRY: &str = "];\n";
const BEFORE_BINARY: &str = "# Every scene of that experiment,";

/// The files of a new experiment in the source tree at `root`.
pub(super) fn started(root: &Path, name: &str) -> Result<Started, String> {
    let module = name.replace('-', "_");
    let file = format!("experiments/{module}.rs");
    let binary = format!("experiments/bin/{module}.rs");
    let read = |path: &str| read_regular_text(&root.join(path), MOST_SPEC_BYTES).map_err(|e| e.to_string());
    let list = put_before(&read("experiments/lib.rs")?, BEFORE_MODULE, &format!("pub mod {module};\n"))
        .and_then(|list| put_before(&list, BEFORE_ENTRY, &format!("    {module}::EXPERIMENT,\n")))
        .ok_or("experiments/lib.rs has no list of experiments as this program knows it")?;
    let entry = format!("[[bin]]\nname = \"{name}\"\npath = \"{binary}\"\ntest = false\n\n");
    let manifest = put_before(&read("Cargo.toml")?, BEFORE_BINARY, &entry)
        .ok_or("Cargo.toml has no list of experiments as this program knows it")?;
    let files = [
        (file.as_str(), TEMPLATE.replace(super::PLACEHOLDER, name)),
        (binary.as_str(), binary_text(name, &module)),
        ("experiments/lib.rs", list),
        ("Cargo.toml", manifest),
    ];
    Ok(Started {
        files: files.into_iter().map(|(path, text)| (root.join(path), text.into_bytes())).collect(),
        next: format!(
            "  cargo run --release --bin {name}     # ends with 1: no golden values yet\n  look at every number and figure; change {file} \
             until it answers your question\n  cargo run --release -- bless {name}, and commit golden/ and figures/"
        ),
    })
}

/// Whether a file is one that every experiment stands in.
pub(super) fn is_added_to(path: &Path) -> bool {
    let ends: [PathBuf; 2] = ["experiments/lib.rs".into(), "Cargo.toml".into()];
    ends.iter().any(|end| path.ends_with(end))
}

/// The text with `added` before the first `mark`, if there is one.
fn put_before(text: &str, mark: &str, added: &str) -> Option<String> {
    let (before, behind) = text.split_once(mark)?;
    Some(format!("{before}{added}{mark}{behind}"))
}

fn binary_text(name: &str, module: &str) -> String {
    format!(
        "//! The experiment `{name}` alone, as `calibench run {name}`.\n\nuse calibench_experiments::{module}::EXPERIMENT;\n\
         use std::process::ExitCode;\n\nfn main() -> ExitCode {{\n    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())\n}}\n"
    )
}
