//! How does a question become a locked, judged and readable result? Experiments, records, claims, figures, golden values.
//!
//! ```text
//! Experiment --run(Context)--> Record { numbers, tables, figures, claims, reconciliations }
//!   -> emit      out/<id>/, figures/<id>/
//!   -> golden    unchanged since it was blessed?
//!   -> claim     correct, by theory or an oracle?
//!   -> published reproduces the book?
//! ```
//!
//! # Adding an experiment
//! 1. `experiments/<name>.rs`: `pub const EXPERIMENT: Experiment`, `calibench::experiment_main!(EXPERIMENT);`, and a
//!    `run(&Context) -> Result<Record, ExperimentError>` that tells numbers, claims, tables and figures.
//! 2. Three registrations: a `[[bin]]` in Cargo.toml, `mod` and table entry in `experiments/table.rs`.
//! 3. `calibench run <id>`, read and look; then `calibench bless <id>` and commit golden/ and figures/.
//!
//! The layout test names whatever was forgotten.

mod band;
pub mod book;
mod claim;
pub mod cli;
mod emit;
mod experiment;
pub mod figure;
pub mod gate;
pub mod golden;
pub mod hash;
pub mod monte_carlo;
pub mod photos;
mod predicted;
mod progress;
pub mod project;
pub mod provenance;
pub mod published;
mod reconcile;
mod record;
pub mod resources;
mod simulated;
pub mod study;
mod table;
pub mod verdict;

pub use band::Band;
pub use claim::{Cases, Claim};
pub use emit::{EmitError, emit, write_atomically};
pub use experiment::{Context, Experiment, ExperimentError};
pub use figure::{Dash, Figure, HeatMap, Look, Marker, Plot};
pub use monte_carlo::{MonteCarlo, Outcome};
pub use predicted::{Predicted, significant};
pub use progress::{Progress, ProgressDisplay};
pub use reconcile::{Expectation, Reconciliation};
pub use record::{Input, Number, Record, RecordError};
pub use table::{Cell, Column, Table};
