//! What do the pages of the book compute while they are read? The library's own solver, behind questions that
//! are numbers and answers that are numbers.
//!
//! ```text
//! knobs (numbers) -> question -> answer (numbers) | refusal (words)
//! ```
//!
//! `exports` puts them before a page as WebAssembly; [`answer`] asks the same natively, so that the bits of
//! both can be compared. Nothing is drawn or kept here: a page draws, and the same numbers always get the
//! same answer.

mod calibration;
mod exports;
mod lens;
mod picture;
mod plane;
mod questions;
mod scene;
mod trials;
mod uncertainty;

pub use questions::{answer, questions};
pub use scene::CHAPTER;

/// Of the sources, in a section of the WebAssembly that has its own name: `tests/laboratory.rs` compares it
/// with theirs.
#[cfg(target_arch = "wasm32")]
#[used]
#[unsafe(link_section = "calibench-fingerprint")]
static FINGERPRINT: [u8; 16] = *env!("LABORATORY_FINGERPRINT").as_bytes().first_chunk().unwrap();
