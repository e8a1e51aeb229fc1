//! How much does the camera see, and what is its focal length on the sensor?

use calibench::calibrate::LensCalibration;
use calibench::camera::{Camera, Lens, Parameter};
use calibench::geometry::{Vec2, Vec3};
use calibench::io::significant;
use serde::Serialize;
use std::fmt::Write;

/// What follows from the camera for people who choose lenses.
#[derive(Debug, Clone, Default, Serialize)]
pub(super) struct Optics {
    /// `None` where the image's size is not known.
    #[serde(rename = "field_of_view_deg", skip_serializing_if = "Option::is_none")]
    pub(super) field_of_view: Option<FieldOfView>,
    /// `None` where the pixel pitch is not known.
    #[serde(rename = "focal_length_mm", skip_serializing_if = "Option::is_none")]
    pub(super) focal_length: Option<FocalLength>,
}

/// Angles between the rays at opposite edges of the image, degrees; `None` where the lens model ends before
/// the edge.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct FieldOfView {
    /// In the row of the principal point.
    pub(super) horizontal: Option<f64>,
    /// In its column.
    pub(super) vertical: Option<f64>,
    /// Along the wider of both diagonals.
    pub(super) diagonal: Option<f64>,
}

/// The focal lengths on a sensor whose pixels are so far apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct FocalLength {
    /// `fx` times the pitch, mm.
    pub(super) x: f64,
    /// `fy` times the pitch, mm.
    pub(super) y: f64,
    /// Their standard deviations, mm, the pitch taken as exact; `None` for one that was held.
    pub(super) standard_deviations: [Option<f64>; 2],
    /// The distance of neighbouring pixels, micrometres.
    pub(super) pixel_pitch_um: f64,
}

/// A result with what follows from its camera.
#[derive(Debug, Serialize)]
struct WithOptics<'a, F: Serialize> {
    #[serde(flatten)]
    fields: &'a F,
    #[serde(flatten)]
    optics: &'a Optics,
}

impl Optics {
    /// Of a calibration of images of a size with pixels of `pitch_um`, what is known of both.
    pub(super) fn of(
        calibration: &LensCalibration,
        image_size: Option<(usize, usize)>,
        pitch_um: Option<f64>,
    ) -> Optics {
        let camera = &calibration.camera;
        let focal_length = pitch_um.map(|pixel_pitch_um| {
            let mm = 1e-3 * pixel_pitch_um;
            let deviation = |p: Parameter| calibration.standard_deviation(p).map(|sd| sd * mm);
            FocalLength {
                x: camera.fx * mm,
                y: camera.fy * mm,
                standard_deviations: [deviation(Parameter::Fx), deviation(Parameter::Fy)],
                pixel_pitch_um,
            }
        });
        Optics { field_of_view: image_size.map(|size| field_of_view(camera, size)), focal_length }
    }

    /// The text of a result with these fields at its end.
    pub(super) fn with(&self, fields: &impl Serialize) -> String {
        // Plain fields and string keys: nothing in them can fail to serialise.
        let text = serde_json::to_string_pretty(&WithOptics { fields, optics: self });
        text.expect("a calibration serialises") + "\n"
    }

    /// A line each for people.
    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        if let Some(view) = &self.field_of_view {
            let _ = writeln!(
                text,
                "field of view: horizontal {}, vertical {}, diagonal {} degrees",
                degrees(view.horizontal),
                degrees(view.vertical),
                degrees(view.diagonal)
            );
        }
        if let Some(focal) = &self.focal_length {
            let [x, y] = focal.standard_deviations.map(|sd| match sd {
                Some(sd) => format!(" \u{b1} {}", significant(sd, 2)),
                None => " (held)".to_string(),
            });
            let _ = writeln!(
                text,
                "focal length: {}{x} mm along u, {}{y} mm along v, with pixels of {} um",
                significant(focal.x, 6),
                significant(focal.y, 6),
                focal.pixel_pitch_um
            );
        }
        text
    }
}

/// An angle, or that the lens model has none there.
fn degrees(angle: Option<f64>) -> String {
    angle.map_or("unknown".to_string(), |angle| format!("{angle:.2}"))
}

/// Angles between the rays at opposite edges of the image, degrees: in the row and in the column of the
/// principal point, and along the wider of both diagonals. `None` where the lens model ends before the edge.
fn field_of_view(camera: &Camera<Lens>, (width, height): (usize, usize)) -> FieldOfView {
    let (right, bottom) = (width as f64 - 0.5, height as f64 - 0.5);
    let (cx, cy) = (camera.cx.clamp(-0.5, right), camera.cy.clamp(-0.5, bottom));
    let between = |a: (f64, f64), b: (f64, f64)| {
        let ray = |(u, v)| camera.ray(&Vec2::new(u, v)).ok();
        Some(opening(&ray(a)?, &ray(b)?).to_degrees())
    };
    let diagonals = [between((-0.5, -0.5), (right, bottom)), between((right, -0.5), (-0.5, bottom))];
    FieldOfView {
        horizontal: between((-0.5, cy), (right, cy)),
        vertical: between((cx, -0.5), (cx, bottom)),
        diagonal: match diagonals {
            [Some(a), Some(b)] => Some(a.max(b)),
            _ => None,
        },
    }
}

/// The angle from one ray over the optical axis to another: more than half a turn where they look backwards.
fn opening(a: &Vec3, b: &Vec3) -> f64 {
    let angle = libm::atan2(a.cross(b).norm(), a.dot(b));
    if a.z + b.z < 0.0 { std::f64::consts::TAU - angle } else { angle }
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench::camera::Model;

    #[test]
    fn a_pinholes_field_of_view_is_that_of_its_tangents() {
        // 400 px to each side at a focal length of 400 px: 45 degrees; 300 px up and down: atan(3/4).
        let camera = Camera::with_lens(400.0, 400.0, 399.5, 299.5, Lens::ideal(Model::BrownConrady));
        let view = field_of_view(&camera, (800, 600));
        assert!((view.horizontal.unwrap() - 90.0).abs() < 1e-9);
        assert!((view.vertical.unwrap() - 2.0 * libm::atan(0.75).to_degrees()).abs() < 1e-9);
        assert!((view.diagonal.unwrap() - 2.0 * libm::atan(1.25).to_degrees()).abs() < 1e-9);
    }

    #[test]
    fn a_fisheye_sees_more_than_half_a_turn() {
        // Equidistant: 100 px a radian, 175 px to each side.
        let camera = Camera::with_lens(100.0, 100.0, 174.5, 99.5, Lens::ideal(Model::KannalaBrandt));
        let view = field_of_view(&camera, (350, 200));
        assert!((view.horizontal.unwrap() - 3.5f64.to_degrees()).abs() < 1e-6, "{view:?}");
        assert!((view.vertical.unwrap() - 2.0f64.to_degrees()).abs() < 1e-6, "{view:?}");
    }
}
