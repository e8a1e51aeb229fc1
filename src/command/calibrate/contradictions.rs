//! Do the options say one thing? What they say twice, or say to a kind of input that has no use for it, is refused and not decided.

use super::Arguments;
use calibench::camera::Parameter;

/// What a file or the files hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Input {
    /// Photographs of a board.
    Photographs,
    /// A corner file.
    Corners,
    /// Point pairs of a plane.
    PointPairs,
}

/// Refuses options that contradict each other or the input.
pub(super) fn refuse(arguments: &Arguments, input: Input) -> Result<(), String> {
    parameters(arguments)?;
    let without_use: &[(&str, bool)] = match input {
        Input::Photographs | Input::Corners => &[("--mode", arguments.mode.is_some())],
        Input::PointPairs => &[
            ("--free", arguments.free.is_some()),
            ("--fix", !arguments.fix.is_empty()),
            ("--image-size", arguments.image_size.is_some()),
            ("--loss", arguments.loss.is_some()),
            ("--intervals", arguments.intervals.is_some()),
            ("--reject-views", arguments.reject_views.is_some()),
        ],
    };
    let (holds, is_for) = match input {
        Input::Photographs => ("--board was given", "point pairs (point,px,py,X,Y)"),
        Input::Corners => ("the file holds corners (view,point,X,Y,u,v)", "point pairs (point,px,py,X,Y)"),
        Input::PointPairs => ("the file holds point pairs (point,px,py,X,Y)", "a camera's calibration"),
    };
    match without_use.iter().find(|(_, given)| *given) {
        Some((option, _)) => Err(format!("{option} is for {is_for}, but {holds}: leave it out")),
        None => Ok(()),
    }
}

/// A parameter has one value, or is estimated.
fn parameters(arguments: &Arguments) -> Result<(), String> {
    let fixed: Vec<Parameter> = arguments.fix.iter().map(|fix| fix.0).collect();
    if let Some(twice) = fixed.iter().enumerate().find(|(i, p)| fixed[..*i].contains(p)) {
        return Err(format!("--fix gives {} more than once: give it one value", twice.1));
    }
    // The parameters that are free by default give way to --fix; those that were named do not.
    let both = arguments.free.and_then(|free| fixed.iter().find(|p| free.contains(**p)));
    match both {
        Some(p) => Err(format!("{p} is in --free and in --fix: it is estimated or held, not both")),
        None => Ok(()),
    }
}
