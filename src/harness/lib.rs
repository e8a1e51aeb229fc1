//! How does a question become a locked, judged and readable result? Experiments, records, claims, figures,
//! golden values.
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
//! 1. `experiments/<name>.rs`: `pub const EXPERIMENT: Experiment`, and a `run(&Context) -> Result<Record,
//!    ExperimentError>` that reports numbers, claims, tables and figures.
//! 2. Three registrations: `mod` and table entry in `experiments/lib.rs`, and its own binary in
//!    `experiments/bin`.
//! 3. `calibench run <id>`, read and look; then `calibench bless <id>` and commit golden/ and figures/.
//!
//! The layout test names whatever was forgotten.

mod band;
pub mod campaign;
mod claim;
mod claim_draft;
mod data_package;
mod emit;
mod experiment;
pub mod figure;
pub mod fingerprint;
pub mod golden;
pub mod monte_carlo;
mod numbers;
mod predicted;
mod progress;
pub mod project;
mod provenance;
pub mod published;
mod reconcile;
mod record;
mod record_error;
pub mod resources;
mod run_crate;
mod simulated;
pub mod stats;
pub mod stopwatch;
mod table;
pub mod verdict;

pub use band::Band;
pub use claim::{Cases, Claim};
pub use claim_draft::ClaimDraft;
pub use data_package::{Field, Resource, data_package};
pub use emit::{emit, record_json};
pub use experiment::{Context, Experiment, ExperimentError};
pub use figure::{Align, Dash, Drawing, Figure, HeatMap, Look, Marker, Plot};
pub use monte_carlo::{MonteCarlo, Outcome};
pub use numbers::Numbers;
pub use predicted::Predicted;
pub use progress::{Progress, ProgressDisplay};
pub use provenance::Build;
pub use reconcile::{Expectation, Reconciliation};
pub use record::{Entered, Input, Number, Record};
pub use record_error::RecordError;
pub use run_crate::{PartFile, RunCrate};
pub use table::{Cell, Column, Rows, Table};
