//! Why does one view give no camera?

/// A view that is refused. Every variant carries its numbers and says what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TsaiError {
    /// A principal point that is none.
    #[error("the principal point must be given, and ({u}, {v}) is not finite")]
    PrincipalPoint {
        /// As given.
        u: f64,
        /// As given.
        v: f64,
    },
    /// Focal lengths in no ratio.
    #[error("fy cannot be {ratio} times fx: a ratio is a positive number")]
    BadRatio {
        /// fy over fx.
        ratio: f64,
    },
    /// One view of a plane does not tell the pixels' shape.
    #[error("one view of a plane does not tell fy over fx: give it, 1 for square pixels")]
    RatioOfPlane,
    /// Fewer points than stage 1 has unknowns.
    #[error("radial alignment of {} needs at least {need} points, got {got}", if *is_flat { "a plane" } else { "a target in three dimensions" })]
    TooFewPoints {
        /// Least number.
        need: usize,
        /// Number given.
        got: usize,
        /// Whether they lie in one plane.
        is_flat: bool,
    },
    /// All points at one place.
    #[error("all target points lie at one place, or on one line")]
    OnePlace,
    /// Radial alignment has more than one solution.
    #[error(
        "radial alignment does not determine the pose: its second-smallest singular value is {second:.1e} of the largest, the smallest {smallest:.1e}; \
         points whose images lie on one line through the principal point, on one line of the target or nearly in one plane say too little: add others"
    )]
    Singular {
        /// Smallest singular value over the largest.
        smallest: f64,
        /// Second-smallest over the largest.
        second: f64,
    },
    /// A plane that may as well face the camera.
    #[error(
        "focal length and distance (f, T_z) are inseparable: {}; tilt found: {tilt_deg:.2} degrees; tilt the target by 20 degrees or more",
        facing(*p_value)
    )]
    Facing {
        /// Tilt that noise or target have, degrees.
        tilt_deg: f64,
        /// Probability of as much perspective from a facing plane; `None` where no tilted plane before the
        /// camera has the view's perspective at all.
        p_value: Option<f64>,
    },
    /// A plane whose perspective is seen, but too little of its foreshortening.
    #[error(
        "focal length and distance (f, T_z) are nearly inseparable: a focal length of {other_px:.0} px explains the view within {standard_deviations:.1} \
         standard deviations as well (tilt found: {tilt_deg:.2} degrees); tilt the target by 20 degrees or more"
    )]
    WeakTilt {
        /// Tilt of the plane, degrees.
        tilt_deg: f64,
        /// A focal length three times as long or as short as the one found, px.
        other_px: f64,
        /// How much worse it is: root of the difference of cost over the variance of a coordinate.
        standard_deviations: f64,
    },
    /// The target is not before the camera.
    #[error(
        "the target comes to lie behind the camera (f = {focal_px:.1} px): are its axes right-handed, and does v grow downwards?"
    )]
    Behind {
        /// The focal length found, px.
        focal_px: f64,
    },
    /// No focal length was found at which stage 2 ends.
    #[error(
        "stage 2 does not settle on a focal length (last {focal_px:.1} px): tilt the target more, or check the principal point"
    )]
    NoDepth {
        /// The last one, px.
        focal_px: f64,
    },
}

fn facing(p_value: Option<f64>) -> String {
    match p_value {
        Some(p_value) => {
            format!("a plane that faces the camera explains the view as well (probability {p_value:.1e})")
        }
        None => "no tilted plane before the camera explains the view".to_string(),
    }
}
