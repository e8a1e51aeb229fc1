//! What would an ideal lens have shown? Rectification: every pixel of the output asks where in the photograph
//! it was seen.
//!
//! ```text
//! output pixel -> ray of the output camera -> distort -> photograph's pixel -> bilinear sample
//! ```
//! The inverse mapping needs only the forward distortion, leaves no holes, and its look-up table serves every
//! image of a size.

mod any_lens;
mod direct;
mod eight_bit;
mod fraction;
mod map;
mod output;
mod points;
mod sample;
mod source_row;
mod window;

pub use any_lens::Projection;
pub use direct::rectify_image;
pub use map::{RectifyError, RectifyMap};
pub use output::{OutputCameraError, OutputView, output_camera};
pub use points::{rectify_points, source_pixel};
pub use sample::Interpolated;
