//! How does a point in front of the camera become a pixel? Pinhole, Brown-Conrady distortion, their
//! derivatives and inverse.

mod brown_conrady;
mod correction;
mod intrinsics;
mod parameter;
mod projection;

pub use brown_conrady::{BrownConrady, UndistortError};
pub use intrinsics::Camera;
pub use parameter::{FreeParameters, Parameter, UnknownParameter};
pub(crate) use projection::intrinsics_columns;
pub use projection::{BehindCamera, ProjectionJacobian, project_with_jacobian};
