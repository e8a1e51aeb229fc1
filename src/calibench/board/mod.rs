//! What is photographed? Boards of known geometry, and the correspondences a photograph of one gives.
//!
//! A [`Board`] is a lattice, which detectors find and the virtual camera photographs. A calibration needs
//! none: a [`View`] takes marks in any layout.

pub mod layout;
pub mod view;

pub use layout::{Arrangement, Board, BoardError, Pattern};
pub use view::{View, ViewError};
