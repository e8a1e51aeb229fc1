//! How do numbers come in and results go out? Files, with errors that name file, line and column.

pub mod atomic;
pub mod corners;
pub mod data;
pub mod pairs;
mod table;

pub use atomic::write_atomically;
pub use corners::{CornerFile, parse_corners, read_corners};
pub use data::{MissingDataFolder, data_folder};
pub use pairs::{PointPairs, parse_point_pairs, read_point_pairs};
pub use table::TableError;
