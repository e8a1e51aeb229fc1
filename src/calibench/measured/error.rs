//! Why is there no camera from a measured target?

use super::TargetError;
use crate::calibrate::CalibrationError;

/// A calibration that is refused. Every variant carries its numbers and says what to do; views count from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeasuredError {
    /// The target is none.
    #[error(transparent)]
    Target(#[from] TargetError),
    /// The camera cannot be estimated, for a reason that every target may give.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// A mark that stands twice in a view.
    #[error("mark '{mark}' was seen twice in one view: keep the place where it is")]
    SeenTwice {
        /// Its name.
        mark: String,
    },
    /// A pixel that is none.
    #[error("mark '{mark}' was seen at ({u}, {v}), which is no pixel: leave it out")]
    PixelNotFinite {
        /// Its name.
        mark: String,
        /// As given.
        u: f64,
        /// As given.
        v: f64,
    },
    /// A weight that says nothing.
    #[error("mark '{mark}' has weight {weight}: a weight is positive; leave the mark out instead")]
    BadWeight {
        /// Its name.
        mark: String,
        /// As given.
        weight: f64,
    },
    /// No views.
    #[error("there are no views")]
    NoViews,
    /// A mark that the target does not have.
    #[error(
        "view {view} shows mark '{mark}', which the target does not have: is it the right target, and are the names the same in both?"
    )]
    UnknownMark {
        /// The view.
        view: usize,
        /// The name.
        mark: String,
    },
    /// A view with too few marks for its pose.
    #[error(
        "view {view} shows {got} marks, and its pose needs {need}, {}: leave it out", if *need > 4 { "six where they are not in one plane" } else { "four of them in one plane" }
    )]
    TooFewMarks {
        /// The view.
        view: usize,
        /// Least number.
        need: usize,
        /// Number given.
        got: usize,
    },
    /// Marks that tell no pose.
    #[error(
        "the marks of view {view} lie on one line, all or all but one, or at one place: its pose has no unique answer; leave it out"
    )]
    OnALine {
        /// The view.
        view: usize,
    },
    /// The same photograph twice.
    #[error(
        "view {view} is a copy of view {copy_of}: it says nothing new, and would make all standard deviations too small; leave it out"
    )]
    RepeatedView {
        /// The copy.
        view: usize,
        /// The first.
        copy_of: usize,
    },
    /// More unknown marks than the dense equations are made for.
    #[error(
        "{got} marks that were seen have a standard deviation, and at most {most} can be estimated together: leave some out, or give those that \
         are known much better than pixels tell a standard deviation of 0"
    )]
    TooManyUncertain {
        /// Number given.
        got: usize,
        /// Most there may be.
        most: usize,
    },
    /// A noise that is none.
    #[error("the noise of a coordinate cannot be {sigma_px} px: it is a positive number")]
    BadNoise {
        /// As given.
        sigma_px: f64,
    },
    /// Nothing is left over to tell the noise by.
    #[error(
        "{coordinates} pixel coordinates leave {freedom:.2} degrees of freedom to tell their noise by: say how large it is, or give more marks \
         or views"
    )]
    NoFreedom {
        /// Twice the number of marks over all views.
        coordinates: usize,
        /// What the unknowns leave of them.
        freedom: f64,
    },
    /// Something that is not known for measured targets.
    #[error("{what} is not known for measured targets: {instead}")]
    NotForTargets {
        /// What was asked.
        what: &'static str,
        /// What to do.
        instead: &'static str,
    },
    /// The measurements are too poor to hold the marks together.
    #[error(
        "the positions of the marks are not determined: the stated standard deviations, up to {largest}, are so large against what pixels tell that \
         place, size and turn of the target are lost in rounding; state them more narrowly"
    )]
    Loose {
        /// The largest standard deviation, in the target's unit.
        largest: f64,
    },
    /// No start was found.
    #[error(
        "no starting values: no lens and no poses were found from which every mark is seen; are the target's coordinates right-handed, do the names \
         of the marks agree with the pixels, and does v grow downwards? Beyond 90 degrees from the axis take a fisheye model (kannala-brandt, \
         division, double-sphere)"
    )]
    NoStart,
}
