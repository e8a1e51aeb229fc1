//! From photographs of a board to a camera: what the board is, where its marks are, which views count, and
//! the fit.
//!
//! ```text
//! BoardSpec --detect(photograph)--> marks --fit--> calibrate, subtract the discs' bias, leave out stray views
//! ```

mod board;
mod board_file;
mod coded;
mod discs;
mod fit;

pub use board::{BoardSpec, BoardSpecError, DetectError, MarkKind};
pub use board_file::{BoardFileError, parse_board_file};
pub use discs::{NotFound, ordered_discs};
pub use fit::{BiasCorrection, Fit, Fitter, Rejected, without_disc_bias};
