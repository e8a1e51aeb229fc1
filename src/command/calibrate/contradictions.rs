//! Do the options say one thing? What they say twice, or say to a kind of input that has no use for it, is
//! refused and not decided.

use super::options::{Arguments, ModelChoice};
use calibench::camera::Parameter;

/// What a file or the files hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Input {
    /// Photographs of a board.
    Photographs,
    /// A corner file.
    Corners,
    /// A corner file with the measured places of its marks.
    Measured,
    /// Point pairs of a plane.
    PointPairs,
}

/// Refuses options that contradict each other or the input.
pub(super) fn refuse(arguments: &Arguments, input: Input) -> Result<(), String> {
    target(arguments, input)?;
    parameters(arguments)?;
    if arguments.memory.is_some() && input != Input::Photographs {
        return Err("--memory bounds what photographs take, and there are none: leave it out".to_string());
    }
    let without_use: &[(&str, bool)] = match input {
        Input::Photographs | Input::Corners | Input::Measured => &[("--mode", arguments.mode.is_some())],
        Input::PointPairs => &[
            ("--model", arguments.model.is_some()),
            ("--board-shape", arguments.bow.is_some()),
            ("--free", arguments.free.is_some()),
            ("--fix", !arguments.fix.is_empty()),
            ("--tie", arguments.tie.is_some()),
            ("--prior", !arguments.prior.is_empty()),
            ("--image-size", arguments.image_size.is_some()),
            ("--pixel-pitch", arguments.pixel_pitch.is_some()),
            ("--loss", arguments.loss.is_some()),
            ("--intervals", arguments.intervals.is_some()),
            ("--reject-views", arguments.reject_views.is_some()),
        ],
    };
    let (holds, is_for) = match input {
        Input::Photographs => ("--board was given", "point pairs (point,px,py,X,Y)"),
        Input::Corners => ("the file holds corners (view,point,X,Y,u,v)", "point pairs (point,px,py,X,Y)"),
        Input::Measured => ("--target was given", "point pairs (point,px,py,X,Y)"),
        Input::PointPairs => ("the file holds point pairs (point,px,py,X,Y)", "a camera's calibration"),
    };
    match without_use.iter().find(|(_, given)| *given) {
        Some((option, _)) => Err(format!("{option} is for {is_for}, but {holds}: leave it out")),
        None => Ok(()),
    }
}

/// What goes with a measured target, and what does not.
fn target(arguments: &Arguments, input: Input) -> Result<(), String> {
    if arguments.sigma.is_some() && arguments.target.is_none() {
        return Err(
            "--sigma goes with --target: without one the noise is estimated; leave it out".to_string()
        );
    }
    if arguments.target.is_none() {
        return Ok(());
    }
    let is_dash = |path: &std::path::Path| path.as_os_str() == "-";
    let instead = match input {
        Input::Photographs => {
            "--target takes marks from a corner file and not from photographs: calibrate with --board and --out DIR first, and then \
             DIR/corners.csv with --target, its names being the board's"
        }
        Input::PointPairs => {
            "--target is for a camera's calibration, but the file holds point pairs (point,px,py,X,Y): leave it out"
        }
        _ if arguments.files.first().is_some_and(|f| is_dash(f))
            && arguments.target.as_deref().is_some_and(is_dash) =>
        {
            "standard input cannot be both files: give one of them by its name"
        }
        _ if arguments.model == Some(ModelChoice::Auto) => {
            "--model auto takes marks of a board, flat or bent: with --target name a lens"
        }
        _ if arguments.bow.is_some() => {
            "--board-shape estimates how a flat board is bent, and --target says where its marks are: leave one of them out"
        }
        _ if arguments.loss.is_some_and(|loss| loss != calibench::calibrate::Loss::Squares) => {
            "--loss resists strays, which --target names instead: leave it out, and mend or remove those that are named"
        }
        _ if arguments.intervals.is_some() => "--intervals is not known with --target: leave it out",
        _ if arguments.reject_views.is_some() => {
            "--reject-views is not known with --target: leave the views out of the file"
        }
        _ => return Ok(()),
    };
    Err(instead.to_string())
}

/// A parameter has one value, or is estimated, or follows another.
fn parameters(arguments: &Arguments) -> Result<(), String> {
    let fixed: Vec<Parameter> = arguments.fix.iter().map(|fix| fix.0).collect();
    let known: Vec<Parameter> = arguments.prior.iter().map(|prior| prior.parameter).collect();
    for (option, list) in [("--fix", &fixed), ("--prior", &known)] {
        if let Some((_, twice)) = list.iter().enumerate().find(|(i, p)| list[..*i].contains(p)) {
            return Err(format!("{option} gives {twice} more than once: give it one value"));
        }
    }
    if arguments.model == Some(ModelChoice::Auto) {
        let named = arguments.free.into_iter().flat_map(|free| free.iter());
        let mut told = named.chain(fixed.iter().copied()).chain(known.iter().copied());
        if let Some(p) = told.find(|p| !Parameter::LINEAR.contains(p)) {
            return Err(format!(
                "--model auto chooses what is estimated of a lens, and {p} is told already: leave it out"
            ));
        }
    }
    let in_both = |list: &[Parameter]| fixed.iter().copied().find(|p| list.contains(p));
    // The parameters that are free by default give way to --fix; those that were named do not.
    let named: Vec<Parameter> = arguments.free.into_iter().flat_map(|free| free.iter()).collect();
    if let Some(p) = in_both(&named) {
        return Err(format!("{p} is in --free and in --fix: it is estimated or held, not both"));
    }
    if let Some(p) = in_both(&known) {
        return Err(format!("{p} is in --prior and in --fix: it is estimated or held, not both"));
    }
    let says_of_fy = [("--free", &named), ("--fix", &fixed), ("--prior", &known)];
    let twice = says_of_fy.into_iter().find(|(_, list)| list.contains(&Parameter::Fy));
    match (arguments.tie, twice) {
        (Some(_), Some((option, _))) => {
            Err(format!("fy is in {option} and in --tie: it follows fx or goes its own way, not both"))
        }
        _ => Ok(()),
    }
}
