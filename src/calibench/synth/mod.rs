//! What would a camera of known truth see? The virtual camera, its scenes, and the one place where noise
//! enters.

pub mod departure;
pub mod render;
pub mod scene;
pub mod stream;

pub use departure::Departure;
pub use scene::{Scene, SceneError, Truth};
pub use stream::{Stream, StreamKey, fnv1a};
