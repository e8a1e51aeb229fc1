//! What is photographed? Boards of known geometry, and the correspondences a photograph of one gives.

pub mod layout;
pub mod view;

pub use layout::{Arrangement, Board, BoardError, Pattern};
pub use view::{View, ViewError};
