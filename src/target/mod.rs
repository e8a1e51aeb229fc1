//! What is photographed? Boards of known geometry, and the correspondences a photograph of one gives.

pub mod board;
pub mod view;

pub use board::{Board, BoardError, Pattern};
pub use view::{View, ViewError};
