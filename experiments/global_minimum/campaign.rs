//! The whole measurement: runs scenes of a family, or all of every family, and writes what is committed.

use super::committed::{HEADER, Line};
use super::families::{FAMILIES, Family};
use super::judged::{Judged, judge};
use super::listing;
use super::peers;
use super::scenes::Drawn;
use super::{COMMAND, SEED};
use calibench::io::write_atomically;
use calibench_harness::fingerprint::Fingerprint;
use calibench_harness::{ProgressDisplay, campaign};
use clap::Parser;
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Where the committed lines stand, from the root of the project.
pub const FOLDER: &str = "golden/global-minimum";

/// Runs scenes of the experiment global-minimum through the solver, and counts how they end.
#[derive(Debug, Parser)]
struct Arguments {
    /// A family, or `all`; none lists them
    family: Option<String>,
    /// First scene
    #[arg(default_value_t = 0)]
    from: u64,
    /// One beyond the last scene; all of the family without it
    to: Option<u64>,
    /// Judges every scene of every family and writes golden/global-minimum/
    #[arg(long, conflicts_with_all = ["family", "from", "to"])]
    write: bool,
    /// Judges every eighth scene again instead, and notes in golden/global-minimum/ that their rows are the
    /// same if they are: for a change of the code that should move nothing
    #[arg(long, conflicts_with_all = ["family", "from", "to", "write", "peer", "out", "list", "seed"])]
    confirm: bool,
    /// A CSV row a scene, with every number
    #[arg(long)]
    out: Option<PathBuf>,
    /// Prints the rows of scenes that ended so: right, wrong, not-converged, refused
    #[arg(long)]
    list: Option<String>,
    /// Asks another program, given with --solver, about the first scenes of every family, and writes how it
    /// ended to golden/global-minimum/<PEER>.csv, or where --out says
    #[arg(long, requires = "solver", conflicts_with_all = ["family", "from", "to", "write"])]
    peer: Option<String>,
    /// The program, as for `calibench gate`
    #[arg(long, requires = "peer")]
    solver: Option<String>,
    /// Copies of the program that run at once
    #[arg(long, default_value_t = 1)]
    jobs: usize,
    /// At most so many scenes of a family for another program
    #[arg(long, requires = "peer", default_value_t = u64::MAX, hide_default_value = true)]
    first: u64,
    /// Draws other scenes
    #[arg(long, default_value_t = SEED)]
    seed: u64,
}

/// One scene, drawn and judged. `None` if the family has no such scene.
pub fn judged(family: &Family, seed: u64, index: u64) -> Option<Judged> {
    judge(&Drawn::new(family, seed, index)?)
}

/// The command.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let outcome = match (&arguments.peer, &arguments.solver) {
        (Some(name), Some(command)) => {
            let file = || Path::new(FOLDER).join(format!("{name}.csv"));
            let path = arguments.out.clone().unwrap_or_else(file);
            peers::measure(command, name, arguments.jobs, arguments.first, &path)
        }
        _ if arguments.write => write(Path::new(FOLDER)),
        _ if arguments.confirm => confirm(Path::new(FOLDER)),
        _ => show(&arguments),
    };
    campaign::exit_code(outcome)
}

fn run(family: &Family, seed: u64, scenes: Vec<u64>) -> Vec<Judged> {
    let progress = ProgressDisplay::stderr().start(family.name, scenes.len());
    scenes
        .into_par_iter()
        .filter_map(|index| {
            let judged = judged(family, seed, index);
            progress.step();
            judged
        })
        .collect()
}

#[allow(clippy::print_stdout, reason = "the command's answer")]
fn show(arguments: &Arguments) -> Result<(), String> {
    let wanted = |family: &&Family| {
        arguments.family.as_deref().is_some_and(|name| name == "all" || name == family.name)
    };
    let families: Vec<&Family> = FAMILIES.iter().filter(wanted).collect();
    if families.is_empty() {
        let list: Vec<String> =
            FAMILIES.iter().map(|f| format!("  {:22} {:>6} scenes: {}", f.name, f.scenes, f.about)).collect();
        return Err(format!("name a family, or all:\n{}", list.join("\n")));
    }
    println!("{}", listing::SUMMARY_HEADER);
    let mut csv = listing::HEADER.to_string();
    for family in families {
        let to = arguments.to.unwrap_or(family.scenes);
        let rows = run(family, arguments.seed, (arguments.from..to).collect());
        println!("{}", listing::summary(family, &rows));
        for row in &rows {
            let line = listing::line(family, row);
            if arguments.list.as_deref() == Some(row.class.name()) {
                println!("{line}");
            }
            csv += &line;
            csv.push('\n');
        }
    }
    let Some(path) = &arguments.out else { return Ok(()) };
    write_atomically(path, csv.as_bytes()).map_err(|e| e.to_string())
}

/// Judges everything and writes a file a family.
#[allow(clippy::print_stdout, reason = "the command's answer")]
fn write(folder: &Path) -> Result<(), String> {
    println!("{}", listing::SUMMARY_HEADER);
    for family in FAMILIES {
        let rows = run(family, SEED, (0..family.scenes).collect());
        println!("{}", listing::summary(family, &rows));
        let table = campaign::table(HEADER, rows.iter().map(|row| Line::of(row).text()));
        let head = Fingerprint::of_global_minimum().head(&format!("{COMMAND}; seed {SEED}"));
        let text = format!("{head}\n{table}");
        write_atomically(&table_of(family, folder), text.as_bytes()).map_err(|e| e.to_string())?;
    }
    Ok(())
}

fn table_of(family: &Family, folder: &Path) -> PathBuf {
    folder.join(format!("{}.csv", family.name))
}

fn confirm(folder: &Path) -> Result<(), String> {
    let present = Fingerprint::of_global_minimum();
    let first = present.pick(campaign::EVERY);
    FAMILIES.iter().try_for_each(|family| {
        let every = (0..family.scenes).skip(first).step_by(campaign::EVERY);
        let again: Vec<String> =
            run(family, SEED, every.collect()).iter().map(|judged| Line::of(judged).text()).collect();
        campaign::confirm(&table_of(family, folder), &present, &again)
    })
}
