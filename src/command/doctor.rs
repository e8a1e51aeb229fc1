//! `calibench doctor`: is this program what one thinks it is? Its build, what it can do here, and whether it
//! belongs to the golden values beside it.

use super::format::Format;
use super::report::table;
use super::{Exit, print};
use calibench::io::data::data_folder;
use calibench_harness::project::Project;
use calibench_harness::{Build, Experiment};
use serde_json::json;

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

/// What was looked at: its name, what was found, and whether that is well.
struct Look {
    name: &'static str,
    found: String,
    well: bool,
}

impl Look {
    fn well(name: &'static str, found: impl Into<String>) -> Look {
        Look { name, found: found.into(), well: true }
    }
}

pub(super) fn run(experiments: &[Experiment], arguments: &Arguments, build: &Build) -> Exit {
    let mut looks = vec![program(build), arithmetic(build), features(), threads(), data()];
    match Project::find() {
        Ok(project) => looks.extend(belonging(experiments, &project)),
        Err(error) => looks.push(Look { name: "golden", found: error.to_string(), well: false }),
    }
    print(&match arguments.format {
        Format::Text => as_text(&looks),
        Format::Json => as_json(&looks),
    });
    if looks.iter().all(|look| look.well) { Exit::Held } else { Exit::Deviates }
}

fn as_text(looks: &[Look]) -> String {
    let mut rows = table(&["what", "found", ""]);
    for look in looks {
        rows.add_row([look.name, &look.found, if look.well { "ok" } else { "LOOK" }]);
    }
    format!("{}\n", rows.trim_fmt())
}

fn as_json(looks: &[Look]) -> String {
    let look = |look: &Look| json!({ "what": look.name, "found": look.found, "well": look.well });
    format!("{:#}\n", json!(looks.iter().map(look).collect::<Vec<_>>()))
}

fn program(build: &Build) -> Look {
    let commit =
        build.commit.as_ref().map_or("no commit known".to_string(), |commit| format!("commit {commit}"));
    Look::well("program", format!("calibench {}, {commit}", env!("CARGO_PKG_VERSION")))
}

/// Results do not depend on it; speed does.
fn arithmetic(build: &Build) -> Look {
    let lanes = if wide_registers() { "four numbers at once (AVX2 and FMA)" } else { "pairs of numbers" };
    let crates: Vec<String> =
        build.crates.iter().map(|(name, version)| format!("{name} {version}")).collect();
    let crates = if crates.is_empty() { "versions not known".to_string() } else { crates.join(", ") };
    Look::well("arithmetic", format!("{lanes}; {crates}"))
}

fn wide_registers() -> bool {
    #[cfg(all(target_arch = "x86_64", not(calibench_portable)))]
    {
        std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma")
    }
    #[cfg(not(all(target_arch = "x86_64", not(calibench_portable))))]
    {
        false
    }
}

fn features() -> Look {
    let parquet = if calibench_study::PARQUET { "with" } else { "without" };
    Look::well("features", format!("trials of a study as Parquet: {parquet} (cargo feature parquet)"))
}

fn threads() -> Look {
    let machine =
        std::thread::available_parallelism().map_or("an unknown number of".to_string(), |n| n.to_string());
    Look::well(
        "threads",
        format!("{} of {machine} cores; no result depends on them", rayon::current_num_threads()),
    )
}

fn data() -> Look {
    match data_folder() {
        Ok(Some(folder)) => Look::well("data", format!("measurements of others in {}", folder.display())),
        Ok(None) => Look::well("data", "no measurements of others: tests on them are ignored"),
        Err(error) => Look { name: "data", found: error.to_string(), well: false },
    }
}

/// Whether program and golden values belong together: the same files, and a snapshot for every experiment.
fn belonging(experiments: &[Experiment], project: &Project) -> Vec<Look> {
    let place = if project.is_source_tree() {
        format!("the source tree {}", project.root().display())
    } else {
        format!(
            "no source tree: golden values are the program's own, results go to {}",
            project.out().display()
        )
    };
    let missing: Vec<&str> =
        experiments.iter().map(|e| e.id).filter(|id| project.snapshot_text(id).is_none()).collect();
    let other = project.others_than_carried("golden/");
    let golden = if !missing.is_empty() {
        Look {
            name: "golden",
            found: format!(
                "no snapshot of {0}: run `calibench bless {0}` in the source tree",
                missing.join(" ")
            ),
            well: false,
        }
    } else if !other.is_empty() {
        let found =
            format!("{} are others than the program was built with: build it again", other.join(", "));
        Look { name: "golden", found, well: false }
    } else {
        Look::well(
            "golden",
            format!("{} snapshots, those that the program was built with", experiments.len()),
        )
    };
    vec![Look::well("folder", place), golden]
}
