//! Does a solver deserve trust? A statistical gate for this library's solver and for anyone's calibrator.
//!
//! ```text
//! Plan (scenes of known truth, noise, variants, bad input)
//!   -> Problem --Solver (in process, or a program behind two pipes)--> Answer
//!   -> Trial (distance from the truth in units of the Cramer-Rao bound)
//!   -> Check (one a property and scenario) --decide (Holm, one overall false-alarm rate)--> Report
//! ```
//!
//! The gate's own power is measured by planted faults ([`faults`], [`power`]), its false alarms by clean
//! runs.

pub mod accept;
pub mod allowances;
pub mod bad_input;
pub mod bound;
pub mod certified;
pub mod covariance_form;
mod descendants;
pub mod dialogue;
pub mod faults;
pub mod files;
pub mod greeting;
pub mod judge;
mod lines;
pub mod paired;
pub mod plan;
pub mod power;
pub mod principal;
pub mod process;
pub mod program;
pub mod protocol;
pub mod quoted;
pub mod recorder;
pub mod report;
pub mod residual_tests;
pub mod run;
mod running;
pub mod setup;
pub mod solver;
mod strict;
pub mod suite;
pub mod textbook;
pub mod trial;
pub mod variant;
pub mod violation;

pub use allowances::{AllowError, Allowance, Allowed};
pub use dialogue::{Dialogue, Question, Reply};
pub use judge::{Check, EXPECTED_FALSE_ALARMS, Property, Terms, Verdict};
pub use plan::{Asked, Plan, PlanError};
pub use process::Process;
pub use program::ProgramEnd;
pub use recorder::Recorder;
pub use report::Report;
pub use run::run;
pub use solver::{Builtin, Solver};

/// Samples a scenario in a quick run: under 30 s for this library's solver, and enough for every gross fault.
pub const QUICK: usize = 128;
/// Samples a scenario in a thorough run: enough for a bias of a tenth of a standard deviation and a variance
/// 5 % too large.
pub const THOROUGH: usize = 8192;
