//! `calibench claims`: which command shows which claim, and what does it cost? Every experiment is run in a
//! process of its own, so that time and memory are its own: what those ask who look at the artefacts of a
//! paper.

use super::format::Format;
use super::said::{print_either, unless_unwritten};
use super::{Exit, find, warn};
use calibench::io::write_atomically;
use calibench_harness::{Build, Experiment, ProgressDisplay};
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::PathBuf;
use std::process::Command;

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Names of experiments; without any, all of them
    ids: Vec<String>,
    /// File for the table, as Markdown
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// The table as Markdown for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

/// An experiment that was run: its claims, and what it took.
struct Shown {
    command: String,
    claims: Vec<Claim>,
    processor_seconds: Option<f64>,
    peak_memory_mib: Option<f64>,
}

struct Claim {
    name: String,
    statement: String,
    held: bool,
}

pub(super) fn run(experiments: &[Experiment], arguments: &Arguments, build: &Build) -> Exit {
    let chosen = arguments.ids.iter().map(|id| find(experiments, id));
    let chosen = match chosen.collect::<Result<Vec<_>, Exit>>() {
        Ok(chosen) if chosen.is_empty() => experiments.iter().collect(),
        Ok(chosen) => chosen,
        Err(exit) => return exit,
    };
    let progress = ProgressDisplay::stderr().start("experiments", chosen.len());
    let one = |experiment: &&Experiment| {
        let shown = shown(experiment);
        progress.advance(1);
        shown
    };
    let all = match chosen.iter().map(one).collect::<Result<Vec<Shown>, String>>() {
        Ok(all) => all,
        Err(message) => {
            warn(&message);
            return Exit::Incomplete;
        }
    };
    drop(progress);
    let text = as_markdown(&all, build);
    let written = arguments.out.as_ref().map_or(Ok(()), |path| write_atomically(path, text.as_bytes()));
    print_either(arguments.format, &text, &format!("{:#}\n", as_json(&all)));
    let held = all.iter().all(|shown| shown.claims.iter().all(|claim| claim.held));
    unless_unwritten(written, if held { Exit::Held } else { Exit::Deviates })
}

/// Runs an experiment as a user would, and reads what it says.
fn shown(experiment: &Experiment) -> Result<Shown, String> {
    let id = experiment.id;
    let failed = |why: String| format!("{id}: {why}");
    let program = std::env::current_exe().map_err(|error| failed(error.to_string()))?;
    // What it writes is not wanted here.
    let out = std::env::temp_dir().join(format!("calibench-claims-{}", std::process::id()));
    let output = Command::new(program).args(["run", id, "--format", "json", "--out"]).arg(&out).output();
    // Where nothing was written there is nothing to remove.
    let _ = std::fs::remove_dir_all(&out);
    let output = output.map_err(|error| failed(error.to_string()))?;
    let said: Value = serde_json::from_slice(&output.stdout)
        .map_err(|_| failed(String::from_utf8_lossy(&output.stderr).trim().to_string()))?;
    let text = |value: &Value| value.as_str().unwrap_or_default().to_string();
    let claim = |claim: &Value| Claim {
        name: format!("{id}.{}", text(&claim["id"])),
        statement: text(&claim["statement"]),
        held: claim["held"] == true,
    };
    Ok(Shown {
        command: format!("calibench run {id}"),
        claims: said["record"]["claims"].as_array().into_iter().flatten().map(claim).collect(),
        processor_seconds: said["cost"]["processor_seconds"].as_f64(),
        peak_memory_mib: said["cost"]["peak_memory_mib"].as_f64(),
    })
}

const HEAD: &str = "\
# Which command shows which claim, and what it costs

Processor time of all threads and the most memory, of a process of its own for every experiment. A claim is shown by a command; all
claims of an experiment by the same one, whose cost stands with the first.

| claim | statement | | command | s | MB |
|---|---|---|---|---|---|
";

fn as_markdown(all: &[Shown], build: &Build) -> String {
    let mut text = HEAD.to_string();
    for shown in all {
        let number =
            |value: Option<f64>, digits| value.map_or("unknown".to_string(), |x| format!("{x:.digits$}"));
        for (i, claim) in shown.claims.iter().enumerate() {
            let [command, seconds, memory] = match i {
                0 => [
                    format!("`{}`", shown.command),
                    number(shown.processor_seconds, 1),
                    // 2^20 bytes are 1.048576 MB.
                    number(shown.peak_memory_mib.map(|mib| mib * 1.048_576), 0),
                ],
                _ => [const { String::new() }; 3],
            };
            let held = if claim.held { "holds" } else { "FAILS" };
            // Writing to a string cannot fail, here and below.
            let _ = writeln!(
                text,
                "| `{}` | {} | {held} | {command} | {seconds} | {memory} |",
                claim.name,
                claim.statement.replace('|', "\\|")
            );
        }
    }
    let commit = build.commit.as_ref().map_or("unknown".to_string(), ToString::to_string);
    let _ = writeln!(text, "\nWritten by `calibench claims`, commit {commit}.");
    text
}

fn as_json(all: &[Shown]) -> Value {
    let experiment = |shown: &Shown| {
        let claims =
            shown.claims.iter().map(|c| json!({ "name": c.name, "statement": c.statement, "held": c.held }));
        json!({
            "command": shown.command,
            "processor_seconds": shown.processor_seconds,
            "peak_memory_mib": shown.peak_memory_mib,
            "claims": claims.collect::<Vec<_>>(),
        })
    };
    json!(all.iter().map(experiment).collect::<Vec<_>>())
}
