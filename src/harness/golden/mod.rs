//! Is the result unchanged? A snapshot in plain text for each experiment, compared number by number within
//! stored bands.

mod compare;
mod snapshot;

pub use compare::{Comparison, compare};
pub use snapshot::{contents, file_text, snapshot};
