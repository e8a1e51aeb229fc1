//! How does a point in front of the camera become a pixel? Pinhole and lens models, their derivatives and
//! inverses.

mod any_lens;
mod brown_conrady;
mod correction;
mod imaging;
mod intrinsics;
mod lens;
mod parameter;
mod projection;

pub use any_lens::PixelDerivatives;
pub use brown_conrady::{BrownConrady, UndistortError};
pub use imaging::Imaging;
pub use intrinsics::Camera;
pub use lens::{Lens, Model, UnknownModel, WrongCoefficients};
pub(crate) use lens::{LensModel, LensVisitor, visit};
pub use parameter::{BadParameters, FreeParameters, Parameter, UnknownParameter};
pub(crate) use projection::intrinsics_columns;
pub use projection::{BehindCamera, ProjectionJacobian, project_with_jacobian};
