//! Runs scenes of a family through the solver: `global-minimum-scenes FAMILY|all [FROM TO] [--out FILE.csv] [--seed N] [--list CLASS]`.

mod families;
mod judged;
mod oracle;
mod scenes;

use families::{FAMILIES, Family};
use judged::{Class, Judged, judge};
use rayon::prelude::*;
use scenes::Drawn;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::process::ExitCode;

/// Seed of the experiment; not chosen for its result.
const SEED: u64 = 11;

struct Options {
    family: String,
    range: Option<(u64, u64)>,
    out: Option<String>,
    seed: u64,
    list: Option<String>,
}

fn options() -> Option<Options> {
    let mut options = Options { family: String::new(), range: None, out: None, seed: SEED, list: None };
    let mut plain = Vec::new();
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--out" => options.out = Some(words.next()?),
            "--seed" => options.seed = words.next()?.parse().ok()?,
            "--list" => options.list = Some(words.next()?),
            _ => plain.push(word),
        }
    }
    options.family = plain.first()?.clone();
    if let [_, from, to] = plain.as_slice() {
        options.range = Some((from.parse().ok()?, to.parse().ok()?));
    }
    Some(options)
}

#[allow(clippy::print_stdout)]
fn main() -> ExitCode {
    let Some(options) = options() else {
        eprintln!("global-minimum-scenes FAMILY|all [FROM TO] [--out FILE.csv] [--seed N] [--list CLASS]");
        for family in FAMILIES {
            eprintln!("  {:24} {} scenes: {}", family.name, family.scenes, family.about);
        }
        return ExitCode::from(2);
    };
    let mut csv = judged::header() + "\n";
    println!(
        "{:24} {:>6} {:>6} {:>6} {:>8} {:>8} | bound < 2 %: {:>5} {:>6} {:>8} {:>8} | {:>9} worst accepted",
        "family",
        "scenes",
        "right",
        "wrong",
        "not-conv",
        "refused",
        "right",
        "wrong",
        "not-conv",
        "refused",
        "us/scene"
    );
    for family in FAMILIES.iter().filter(|f| options.family == "all" || f.name == options.family) {
        let (from, to) = options.range.unwrap_or((0, family.scenes));
        let rows = run(family, options.seed, from, to);
        println!("{}", summary(family, &rows));
        println!("{}", endings(&rows));
        for row in &rows {
            let _ = writeln!(csv, "{}", row.line(family.name));
            if options.list.as_deref() == Some(row.class.name()) {
                println!("{}", row.line(family.name));
            }
        }
    }
    if let Some(path) = options.out
        && let Err(error) = std::fs::write(&path, csv)
    {
        eprintln!("{path}: {error}");
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}

fn run(family: &Family, seed: u64, from: u64, to: u64) -> Vec<Judged> {
    (from..to).into_par_iter().filter_map(|index| judge(&Drawn::new(family, seed, index)?)).collect()
}

fn summary(family: &Family, rows: &[Judged]) -> String {
    let count =
        |class, known: bool| rows.iter().filter(|r| r.class == class && (!known || r.bound < 0.02)).count();
    let all = Class::ALL.map(|class| count(class, false));
    let known = Class::ALL.map(|class| count(class, true));
    let time = rows.iter().map(|r| r.time_us).sum::<f64>() / rows.len() as f64;
    let off =
        |row: &Judged| row.found.as_ref().map_or(0.0, |f| (f.fx - row.reference_fx).abs() / row.fx_true);
    let worst = rows.iter().filter(|r| r.class == Class::Wrong).max_by(|a, b| off(a).total_cmp(&off(b)));
    let worst = worst.and_then(|r| r.found.as_ref().map(|f| (r, f))).map_or(String::new(), |(r, f)| {
        format!(
            "#{} fx {:.1} +- {:.1} for {:.1}, excess {:.3e}",
            r.index, f.fx, f.fx_sd, r.reference_fx, f.excess
        )
    });
    format!(
        "{:24} {:>6} {:>6} {:>6} {:>8} {:>8} |              {:>5} {:>6} {:>8} {:>8} | {time:>9.0} {worst}",
        family.name,
        rows.len(),
        all[0],
        all[1],
        all[2],
        all[3],
        known[0],
        known[1],
        known[2],
        known[3]
    )
}

/// Counts of every ending, and of references that did not converge.
fn endings(rows: &[Judged]) -> String {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for row in rows {
        *counts.entry(format!("{} ({})", row.ending, row.class)).or_default() += 1;
    }
    let list: Vec<String> = counts.iter().map(|(ending, count)| format!("{count} {ending}")).collect();
    let open = rows.iter().filter(|r| !r.reference_converged).count();
    let below = rows
        .iter()
        .filter(|r| r.found.as_ref().is_some_and(|f| f.excess < -1e-3 - 1e-6 * r.reference))
        .count();
    format!("    {}; reference not converged {open}; solver below the reference {below}", list.join(", "))
}
