//! How do numbers come in and results go out? Files, with errors that name file, line and column.

pub mod atomic;
#[cfg(feature = "photo")]
mod bytes;
#[cfg(feature = "photo")]
pub mod channels;
pub mod checks;
pub mod corners;
pub mod data;
pub mod digits;
mod doubts;
pub mod ends;
#[cfg(feature = "photo")]
pub mod extent;
pub mod files;
pub mod formats;
pub mod hash;
#[cfg(feature = "photo")]
pub mod image;
pub mod input;
#[cfg(feature = "photo")]
mod jpeg;
mod kept;
pub mod known;
mod lines;
pub mod lock;
mod loss;
pub mod marks;
pub mod measured;
pub mod memory;
pub mod message;
pub mod misplaced;
#[cfg(feature = "photo")]
pub mod overlay;
pub mod pairs;
mod plausible;
#[cfg(feature = "photo")]
mod png;
#[cfg(feature = "photo")]
mod pnm;
pub mod provenance;
pub mod result;
pub mod result_camera;
pub mod robot;
pub mod scene_tables;
pub mod shown;
pub mod spatial;
pub mod table;
#[cfg(feature = "photo")]
mod tiff;

pub use atomic::{write_atomically, write_together};
#[cfg(feature = "photo")]
pub use channels::{Channels, read_channels};
pub use checks::{Check, parse_checks};
pub use corners::{CornerFile, parse_corners, read_corners};
pub use data::{MissingDataFolder, data_folder};
pub use digits::significant;
pub use doubts::doubts;
pub use ends::{PixelEnds, parse_pixel_ends, read_pixel_ends};
#[cfg(feature = "photo")]
pub use extent::{Extent, image_extent, parse_extent};
pub use hash::sha256_hex;
#[cfg(feature = "photo")]
pub use image::{Grey, ImageError, read_image, write_png, write_png_16};
pub use input::{InputError, MOST_SIDE_PX, read_regular, read_regular_text};
pub use kept::{is_kept, keep_files};
pub use known::{Known, KnownCalibration, KnownError, parse_known, read_known};
pub use lines::read_named_table;
pub use loss::{loss_from_text, loss_to_text};
pub use marks::{MarkFile, parse_marks, read_marks};
pub use measured::{MeasuredFields, SeenFile, TargetFileError, parse_seen, parse_target, refusal_by_names};
pub use memory::Memory;
pub use message::message;
pub use misplaced::misplaced_marks;
#[cfg(feature = "photo")]
pub use overlay::{Colour, Overlay};
pub use pairs::{PointPairs, parse_point_pairs, read_point_pairs};
pub use plausible::implausible_value;
pub use provenance::Commit;
pub use result::{CalibrationFields, LeftOut};
pub use result_camera::{ResultError, read_camera, read_lens_camera};
pub use shown::{ShownPath, shown};
pub use spatial::{SpatialFile, parse_spatial};
pub use table::TableError;
