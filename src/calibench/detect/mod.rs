//! Where are the marks in a photograph? Discs, ordered grids of discs, chessboard corners, boards with
//! markers.

mod beside;
mod beyond;
mod bias;
mod bilinear;
mod blob;
mod centre;
mod chessboard;
mod coded;
mod components;
mod corner;
mod discs;
mod edge;
mod ellipse;
mod grid;
mod grid_error;
mod larger;
mod lattice;
mod levels;
mod looks;
mod mean;
mod misplaced;
mod neighbours;
mod order;
mod orientation;
mod rectangle;
mod region;
mod saddle;
mod sectors;
mod seen;
mod smoothness;
mod staggered;
mod staggered_grid;
mod threshold;

pub use bias::{Imaging, disc_bias, disc_biases};
pub use blob::Blob;
pub use chessboard::{Chessboard, ChessboardError, chessboard, seen_chessboard};
pub use coded::{
    AprilGrid, Charuco, CodedError, Dictionary, LayoutError, UnknownDictionary, seen_april_grid, seen_charuco,
};
pub use components::Polarity;
pub use corner::{RefineError, refine_corner};
pub use discs::{BlobOptions, blobs};
pub use grid::{DotGrid, circle_grid, circle_grid_of, seen_circle_grid_of, sparse_dots, sparse_dots_of};
pub use grid_error::GridError;
pub use larger::refuse_larger;
pub use looks::searched_blobs;
pub use orientation::Orientation;
pub use seen::SeenBoard;
pub use staggered_grid::{seen_staggered_grid_of, staggered_grid, staggered_grid_of};
