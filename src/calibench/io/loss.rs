//! How is a loss written on a command line and in a file? `squares`, `huber:SCALE` or `cauchy:SCALE`.

use crate::calibrate::Loss;

/// The loss that a text names; `None` where it names none that can be.
///
/// ```
/// use calibench::calibrate::Loss;
/// use calibench::io::{loss_from_text, loss_to_text};
///
/// let loss = Loss::Huber { delta_px: 0.5 };
/// assert_eq!(loss_from_text(&loss_to_text(loss)), Some(loss));
/// assert_eq!(loss_from_text("huber:-1"), None);
/// ```
pub fn loss_from_text(text: &str) -> Option<Loss> {
    let scaled = |scale: &str| scale.parse().ok();
    let loss = match text.split_once(':') {
        None if text == "squares" => Some(Loss::Squares),
        Some(("huber", scale)) => scaled(scale).map(|delta_px| Loss::Huber { delta_px }),
        Some(("cauchy", scale)) => scaled(scale).map(|scale_px| Loss::Cauchy { scale_px }),
        _ => None,
    };
    loss.filter(Loss::is_valid)
}

/// A loss as [`loss_from_text`] reads it.
pub fn loss_to_text(loss: Loss) -> String {
    match loss {
        Loss::Squares => "squares".to_string(),
        Loss::Huber { delta_px } => format!("huber:{delta_px}"),
        Loss::Cauchy { scale_px } => format!("cauchy:{scale_px}"),
    }
}
