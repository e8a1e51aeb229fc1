//! `calibench study commands`: one line a shard, for whatever runs lines.

use super::{Failure, read_study};
use crate::shell_word::shell_word;
use crate::{Exit, print};
use calibench::io::ShownPath;
use calibench_study::{Engine, Shard};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The study
    spec: PathBuf,
    /// Parts of the study
    #[arg(long, value_name = "N", value_parser = crate::said::whole::<u64>)]
    shards: u64,
    /// Folder for the parts, and for the whole in `whole`
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Prints the command that joins the parts, and nothing else
    #[arg(long)]
    merge: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Failure> {
    let count = arguments.shards;
    if !(1..=Shard::MOST).contains(&count) {
        return Err(Failure::usage(format!("--shards must be from 1 to {}", Shard::MOST)));
    }
    // What cannot be run is said here, not once a shard.
    let (text, inputs) = read_study(&arguments.spec)?;
    Engine::with_inputs(&text, &inputs, Shard { index: 0, count })
        .map_err(|e| Failure::usage(format!("{}: {e}", arguments.spec.shown())))?;
    let part = |index: u64| word(&arguments.out.join(format!("part-{index}-of-{count}")));
    if arguments.merge {
        let parts: Vec<String> = (0..count).map(part).collect();
        let whole = word(&arguments.out.join("whole"));
        print(&format!("calibench study merge {} --out {whole}\n", parts.join(" ")));
        return Ok(Exit::Held);
    }
    let spec = word(&arguments.spec);
    for index in 0..count {
        print(&format!("calibench study run {spec} --shard {index}/{count} --out {}\n", part(index)));
    }
    Ok(Exit::Held)
}

fn word(path: &Path) -> String {
    shell_word(&path.to_string_lossy())
}
