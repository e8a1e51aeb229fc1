//! What is to be known better? A parameter, where the image of a direction falls, or a length; each is a
//! quadratic form of the camera's covariance.

use super::information::Estimated;
use crate::camera::{Camera, Lens, Parameter};
use crate::evaluate::difference::frame_nodes;
use crate::geometry::{Vec2, Vec3, rotation};
use nalgebra::{DMatrix, DVector, Matrix2, Matrix2xX, Matrix3, Matrix3xX};

/// What is to be known better.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wanted {
    /// A parameter of the camera.
    Parameter(Parameter),
    /// The pixel on which a direction falls, over an image of this width and height, px: the root of the mean
    /// square of its error over the nodes of the frame, the rotation taken out that fits best over all of
    /// them, since no calibration tells where its camera looks (Kogan 2021, as
    /// [`crate::evaluate::frame_difference`]).
    Pixel((usize, usize)),
    /// A length seen between two fixed pixels, in a plane parallel to the image whose distance is known.
    Length {
        /// Its middle in the camera's frame.
        centre: Vec3,
        /// Its length along X, in the same unit.
        length: f64,
    },
}

impl Wanted {
    /// Its name: that of the parameter, `pixel` or `length`.
    pub fn name(&self) -> &'static str {
        match self {
            Wanted::Parameter(parameter) => parameter.name(),
            Wanted::Pixel(_) => "pixel",
            Wanted::Length { .. } => "length",
        }
    }

    /// The unit of its standard deviation: empty for a pure number, and for a length, which has that of the
    /// target.
    pub fn unit(&self) -> &'static str {
        match self {
            Wanted::Parameter(parameter) => parameter.unit(),
            Wanted::Pixel(_) => "px",
            Wanted::Length { .. } => "",
        }
    }
}

/// Why something cannot be wanted of a calibration.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WantedError {
    /// It was not estimated.
    #[error("{parameter} was not estimated, so that no view tells more of it; estimated were: {estimated}")]
    NotEstimated {
        /// The parameter.
        parameter: Parameter,
        /// Those that were.
        estimated: String,
    },
    /// Too little of the frame is seen by the lens.
    #[error(
        "the lens is one-to-one at {got} of the frame's nodes only, and {need} are needed: is the image size right?"
    )]
    TooFewNodes {
        /// Nodes needed.
        need: usize,
        /// Nodes seen.
        got: usize,
    },
    /// A length that the camera does not see.
    #[error("the camera does not see a length of {length} with its middle at ({x}, {y}, {z}): {why}")]
    Unseen {
        /// The length.
        length: f64,
        /// X of its middle.
        x: f64,
        /// Y of its middle.
        y: f64,
        /// Z of its middle.
        z: f64,
        /// Why.
        why: &'static str,
    },
    /// The estimated parameters leave it as it is.
    #[error("{0} does not depend on what was estimated")]
    Certain(&'static str),
}

/// Several nodes for each of some twenty parameters and three numbers of a rotation.
const LEAST_NODES: usize = 50;

/// A wanted quantity of one camera: its variance is `trace(W P)`, with `P` the covariance of the estimated
/// parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Wish {
    /// What.
    pub wanted: Wanted,
    form: DMatrix<f64>,
}

impl Wish {
    /// The quadratic form of what is wanted, at this camera.
    ///
    /// # Errors
    /// [`WantedError`].
    pub fn of(wanted: Wanted, camera: &Camera<Lens>, estimated: &Estimated) -> Result<Wish, WantedError> {
        let form = match wanted {
            Wanted::Parameter(parameter) => of_parameter(parameter, estimated)?,
            Wanted::Pixel(size) => frame_form(size, camera, estimated, true)?,
            Wanted::Length { centre, length } => {
                let gradient = length_gradient(&centre, length, camera, estimated)?;
                &gradient * gradient.transpose()
            }
        };
        match form.iter().any(|x| *x != 0.0) {
            true => Ok(Wish { wanted, form }),
            false => Err(WantedError::Certain(wanted.name())),
        }
    }

    /// The standard deviation, `sqrt(trace(W P))`: of the pixel the root mean square over the frame of the
    /// distance by which it is wrong.
    pub fn standard_deviation(&self, covariance: &DMatrix<f64>) -> f64 {
        self.form.dot(covariance).max(0.0).sqrt()
    }
}

fn of_parameter(parameter: Parameter, estimated: &Estimated) -> Result<DMatrix<f64>, WantedError> {
    let (row, factor) = match estimated.fy_per_fx {
        Some(ratio) if parameter == Parameter::Fy => (estimated.free.position(Parameter::Fx), ratio),
        _ => (estimated.free.position(parameter), 1.0),
    };
    let row = row.ok_or(WantedError::NotEstimated { parameter, estimated: estimated.free.to_string() })?;
    let n = estimated.len();
    Ok(DMatrix::from_fn(n, n, |i, j| if (i, j) == (row, row) { factor * factor } else { 0.0 }))
}

/// The mean square over the nodes of a frame of `size` px by which an error `e` of the estimated parameters
/// moves a pixel is `e^T W e`, px^2: the matrix `W`.
///
/// `W = sum G^T G / N`, with `G = D - R (sum R^T R)^-1 (sum R^T D)` where the best rotation of the camera is
/// taken out, else `G = D`: `D` the derivatives of the pixel by the parameters, `R` those by a rotation of
/// the camera.
///
/// # Errors
/// [`WantedError::TooFewNodes`].
pub fn frame_form(
    size: (usize, usize),
    camera: &Camera<Lens>,
    estimated: &Estimated,
    is_rotation_taken_out: bool,
) -> Result<DMatrix<f64>, WantedError> {
    let slopes = |pixel: &Vec2| -> Option<(Matrix2xX<f64>, nalgebra::Matrix2x3<f64>)> {
        let ray = camera.ray(pixel).ok()?;
        let at = camera.pixel_with_derivatives(&ray)?;
        Some((estimated.columns(&at.by_parameters), -at.by_point * rotation::skew(&ray)))
    };
    let nodes: Vec<_> = frame_nodes(size).0.iter().filter_map(slopes).collect();
    let too_few = || WantedError::TooFewNodes { need: LEAST_NODES, got: nodes.len() };
    if nodes.len() < LEAST_NODES {
        return Err(too_few());
    }
    let n = estimated.len();
    let (mut own, mut with) = (Matrix3::zeros(), Matrix3xX::zeros(n));
    for (by_camera, by_rotation) in &nodes {
        own += by_rotation.transpose() * by_rotation;
        with += by_rotation.transpose() * by_camera;
    }
    let best = match is_rotation_taken_out {
        true => own.cholesky().ok_or_else(too_few)?.solve(&with),
        false => Matrix3xX::zeros(n),
    };
    let mut form = DMatrix::zeros(n, n);
    for (by_camera, by_rotation) in &nodes {
        let left = by_camera - by_rotation * &best;
        form += left.transpose() * &left;
    }
    Ok(form / nodes.len() as f64)
}

/// How the measured length changes with each parameter, the pixels of its ends fixed.
fn length_gradient(
    centre: &Vec3,
    length: f64,
    camera: &Camera<Lens>,
    estimated: &Estimated,
) -> Result<DVector<f64>, WantedError> {
    let unseen = |why| WantedError::Unseen { length, x: centre.x, y: centre.y, z: centre.z, why };
    if !(length > 0.0 && length.is_finite() && centre.iter().all(|x| x.is_finite())) {
        return Err(unseen("a length above 0 and three finite numbers are needed"));
    }
    if centre.z <= 0.0 {
        return Err(unseen("it does not lie in front of the camera"));
    }
    let limit = camera.distortion.monotone_angle();
    // With the pixel fixed, `d X = -(d pixel / d X)^-1 (d pixel / d parameters)` in the plane.
    let end = |half: f64| -> Option<Matrix2xX<f64>> {
        let point = centre + Vec3::new(half, 0.0, 0.0);
        let at = camera
            .pixel_with_derivatives(&point)
            .filter(|_| libm::atan2(point.xy().norm(), point.z) < limit)?;
        let by_point: Matrix2<f64> = at.by_point.fixed_columns::<2>(0).into_owned();
        Some(by_point.try_inverse()? * estimated.columns(&at.by_parameters))
    };
    let (Some(a), Some(b)) = (end(-0.5 * length), end(0.5 * length)) else {
        return Err(unseen("the lens shows none of it, or not all of it"));
    };
    Ok((a.row(0) - b.row(0)).transpose())
}
