//! What would ten thousand calibrations say? Monte Carlo studies described by data, resumable, sharded, with
//! intervals.
//!
//! ```text
//! Spec (TOML) --cells--> grid of designs --Engine--> trials.csv (in order, the one source of truth)
//!   --fold--> Tally a cell --summarise--> summary with intervals beside the Cramer-Rao bound --> figures, report
//! ```
//! Every number is a function of `trials.csv`: a resumed run replays it, a merge interleaves those of the
//! shards, and both end with the same bytes as an undivided run. A trial draws from streams of its own, so
//! neither the number of threads nor the split can move a bit of it.

mod accumulate;
mod alone;
mod calibrator;
mod cells;
pub mod compare;
mod described;
mod design;
mod engine;
#[cfg(test)]
mod example;
mod expected;
mod factor;
mod figures;
mod fingerprint;
mod finish;
mod folder;
mod folder_error;
mod frame;
mod grid;
mod inputs;
pub mod limits;
mod lists;
mod log;
mod manifest;
mod merge;
mod moments;
mod names;
mod panels;
#[cfg(feature = "parquet")]
mod parquet;
#[cfg(not(feature = "parquet"))]
#[path = "parquet_absent.rs"]
mod parquet;
pub mod plan;
mod poses;
mod prediction;
mod quantity;
mod reading;
mod replay;
mod report;
mod run_error;
mod shard;
mod sketch;
mod spec;
mod spec_error;
mod summary;
mod tables;
mod target;
mod trial;
mod trial_file;
mod whole_log;
mod within;

/// Whether trials can be read and written as Parquet.
pub const PARQUET: bool = cfg!(feature = "parquet");

pub use accumulate::Tally;
pub use alone::{MARKS, POSES};
pub use calibrator::{Calibrator, Estimate};
pub use cells::Cell;
pub use engine::{
    Engine, Interruption, Outcome, Pace, Worst, in_memory, in_memory_by, in_memory_seeing, in_memory_until,
};
pub use expected::Expected;
pub use fingerprint::Fingerprint;
pub use finish::{finish, single_panels};
pub use folder::Folder;
pub use folder_error::{FolderError, Located};
pub use frame::FrameQuantity;
pub use inputs::Inputs;
pub use log::Checkpoint;
pub use manifest::{Difference, Manifest};
pub use merge::{MergeError, merge, merge_on};
pub use moments::{Estimated, Moments};
pub use poses::{Poses, PosesError};
pub use prediction::Prediction;
pub use quantity::Quantity;
pub use run_error::RunError;
pub use shard::{Shard, ShardError};
pub use sketch::Sketch;
pub use spec::{Estimator, Length, LossChoice, Measure, Precision, SceneSpec, Spec, Trials};
pub use spec_error::SpecError;
pub use summary::{CellSummary, Statistic, Summary, summarise};
pub use tables::{columns, trial_of_line};
pub use target::TargetSpec;
pub use trial::{Trial, run_trial};
pub use trial_file::{NoParquet, TrialFile, TrialFileError};
pub use within::within;
