//! Does the solver find the right minimum with every lens model, whatever people photograph?
//!
//! Expected: wherever the marks determine the camera (Cramer-Rao bound of sd(fx) below 2 % of fx) the solver ends at the cost that a search
//! from the truth reaches, or says that it does not know. Nothing certifies a minimum of these models: a number of starts is refined, and
//! this measures how often that suffices.
//!
//! What it cannot show: marks that break the model. Noise is Gaussian, the lens is of the model that is fitted, the board is flat and has
//! six marks or more in every view. The reference itself is a local minimum: where it is not the lowest one, a solver that ends lower counts
//! as right. Where numerator and denominator of a lens nearly cancel, it may have gone along a valley without end.
//!
//! The run judges the first scenes of every model; all of them take minutes, stand in golden/lens-minimum/, and are read here. They are
//! refused as stale when a line of the solver, of the scenes or of the reference has changed.

use crate::global_minimum::judged::Class;
use calibench_harness::fingerprint::Fingerprint;
use calibench_harness::{Band, Context, Experiment, ExperimentError, Record, Table};
use rayon::prelude::*;
use statrs::distribution::{Binomial, ChiSquared, ContinuousCDF, DiscreteCDF};

pub mod campaign;
pub mod families;
pub mod judged;
pub mod reference;
pub mod scenes;

use families::{FAMILIES, Family, SCENES};
use judged::{DETERMINED, HEADER, Line};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "lens-minimum",
    title: "The right minimum with every lens model",
    question: "Random scenes of six lens models: fields of 30 to 200 degrees, 640 to 4000 px wide, pixels up to twice as high as wide, 3 x 4 to \
               9 x 12 marks of which a part is seen, 4 to 20 views, tilts of up to 15 to 60 degrees, noise of 0.01 to 1 px. How often does \
               the solver accept a minimum of higher cost than the one next to the truth, not converge, or refuse? Expected: never where \
               the marks determine the camera.",
    seed: SEED,
    takes_image: false,
    run,
};

/// Seed of every scene; not chosen for its result.
const SEED: u64 = 21;
/// Scenes of each model that every run judges.
const SHARE: u64 = 4;
/// The command that judges all scenes and writes golden/lens-minimum/.
const COMMAND: &str = "cargo run --release --bin lens-minimum-scenes";

/// What was committed of each model.
const COMMITTED: [&str; FAMILIES.len()] = [
    include_str!("../golden/lens-minimum/rational.csv"),
    include_str!("../golden/lens-minimum/thin-prism.csv"),
    include_str!("../golden/lens-minimum/tilted.csv"),
    include_str!("../golden/lens-minimum/kannala-brandt.csv"),
    include_str!("../golden/lens-minimum/division.csv"),
    include_str!("../golden/lens-minimum/double-sphere.csv"),
];

/// A model with what was committed of it.
struct Measured {
    family: &'static Family,
    text: &'static str,
    lines: Vec<Line>,
}

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let measured = read()?;
    for m in &measured {
        record.input(format!("golden/lens-minimum/{}.csv", m.family.name()), m.text.as_bytes());
    }
    claim_current(&mut record, &measured);
    claim_share(&mut record, &measured, context);
    report_counts(&mut record, &measured);
    claim_minima(&mut record, &measured);
    claim_deviations(&mut record, &measured);
    record.table(families_table());
    record.table(models_table(&measured));
    record.table(wrong_table(&measured));
    Ok(record)
}

fn read() -> Result<Vec<Measured>, ExperimentError> {
    let one = |(family, text): (&'static Family, &'static str)| {
        let mut rows = text.lines().skip(1);
        let lines =
            (rows.next() == Some(HEADER)).then(|| rows.map(Line::read).collect::<Option<Vec<_>>>()).flatten();
        let broken = || format!("golden/lens-minimum/{}.csv is broken: run {COMMAND}", family.name());
        lines.map(|lines| Measured { family, text, lines }).ok_or_else(|| ExperimentError::Input(broken()))
    };
    FAMILIES.iter().zip(COMMITTED).map(one).collect()
}

/// The committed scenes are those of this code.
fn claim_current(record: &mut Record, measured: &[Measured]) {
    let present = Fingerprint::of_lens_minimum();
    let case = |m: &Measured| {
        let (what, held) = present.case(&format!("{}.csv", m.family.name()), m.text, COMMAND);
        (what, held && m.lines.len() as u64 == SCENES)
    };
    record
        .claim_that(
            "scenes-are-current",
            "every committed scene was judged by the present solver, drawn and referred by the present code",
        )
        .every("tables", measured.iter().map(case))
        .because("SHA-256 of the code lines of solver, scenes and reference, and the versions of the numeric crates");
}

/// The first scenes of every model are judged again in every run.
fn claim_share(record: &mut Record, measured: &[Measured], context: &Context) {
    if context.seed != SEED {
        record.note("Another seed draws other scenes than the committed ones: the share is not compared.");
        return;
    }
    let jobs: Vec<(&Measured, u64)> =
        measured.iter().flat_map(|m| (0..SHARE).map(move |index| (m, index))).collect();
    let progress = context.progress("scenes", jobs.len());
    let case = |(m, index): &(&Measured, u64)| {
        let now = judged::judged(m.family, SEED, *index).map(|line| line.text());
        progress.step();
        let then = m.text.lines().nth(2 + *index as usize);
        (format!("{} {index}: run {COMMAND}", m.family.name()), now.is_some() && now.as_deref() == then)
    };
    let cases: Vec<(String, bool)> = jobs.par_iter().map(case).collect();
    record.exact("").count("scenes-judged", cases.len(), "scenes judged in every run");
    record
        .claim_that(
            "share-has-the-same-bits",
            "the scenes judged in this run give the committed estimates, costs and references, bit for bit",
        )
        .every("scenes", cases)
        .because("the streams are keyed by seed, model and index, and every sum has its order");
}
fn report_counts(_: &mut Record, _: &[Measured]) {}
fn claim_minima(_: &mut Record, _: &[Measured]) {}
fn claim_deviations(_: &mut Record, _: &[Measured]) {}
fn families_table() -> Table {
    todo!()
}
fn models_table(_: &[Measured]) -> Table {
    todo!()
}
fn wrong_table(_: &[Measured]) -> Table {
    todo!()
}
