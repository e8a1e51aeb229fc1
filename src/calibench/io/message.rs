//! What does a person read of an error? What it says, and what its causes say.
//!
//! An error of this project hands a cause on in one way only: its own message states it, or
//! [`source`](std::error::Error::source) gives it.

use std::error::Error;

/// The message of an error and those of its sources, with `: ` between them: everything that is known, once.
///
/// ```
/// use calibench::{calibrate::CalibrationError, geometry::HomographyError, io::message};
///
/// let few = HomographyError::TooFewPoints { need: 4, got: 3 };
/// let error = CalibrationError::View { view: 2, source: few };
/// assert_eq!(message(&error), "view 2 has no homography: a homography needs at least 4 point pairs, got 3");
/// ```
pub fn message(error: &(dyn Error + 'static)) -> String {
    let messages = std::iter::successors(Some(error), |&error| error.source()).map(|error| error.to_string());
    messages.collect::<Vec<_>>().join(": ")
}
