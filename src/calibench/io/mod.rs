//! How do numbers come in and results go out? Files, with errors that name file, line and column.

pub mod atomic;
pub mod corners;
pub mod data;
pub mod digits;
pub mod hash;
#[cfg(feature = "photo")]
pub mod image;
#[cfg(feature = "photo")]
pub mod overlay;
pub mod pairs;
pub mod provenance;
pub mod result;
mod table;

pub use atomic::write_atomically;
pub use corners::{CornerFile, parse_corners, read_corners};
pub use data::{MissingDataFolder, data_folder};
pub use digits::significant;
pub use hash::sha256_hex;
#[cfg(feature = "photo")]
pub use image::{Grey, ImageError, read_image, write_png, write_png_16};
#[cfg(feature = "photo")]
pub use overlay::{Colour, Overlay};
pub use pairs::{PointPairs, parse_point_pairs, read_point_pairs};
pub use provenance::Commit;
pub use result::{CalibrationFields, LeftOut, ResultError, read_camera};
pub use table::TableError;
