//! Where are the marks in a photograph? Discs, ordered grids of discs, chessboard corners.

mod bias;
mod blob;
mod centre;
mod components;
mod edge;
mod grid;
mod lattice;
mod neighbours;
mod threshold;

pub use bias::{disc_bias, disc_biases};
pub use blob::{Blob, BlobOptions, blobs};
pub use components::Polarity;
pub use grid::{DotGrid, GridError, circle_grid, circle_grid_of, sparse_dots, sparse_dots_of};
