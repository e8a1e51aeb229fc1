//! HALCON: the text of `write_cam_par`, up to HALCON 12, that describes itself: `Name:short: value;`, its
//! type and bounds, its meaning.
//!
//! With `(u, v)` in metres on the image plane and the focal length `Focus`, `u = Focus X / Z`, column `= u~ /
//! Sx + Cx`, row `= v~ / Sy + Cy`; the centre of the first pixel is (0, 0). The lens takes the seen point
//! `(u~, v~)` to the ideal one, the other way round than here:
//!
//! ```text
//! division:    u = u~ / (1 + Kappa r^2)
//! polynomial:  u = u~ (1 + K1 r^2 + K2 r^4 + K3 r^6) + P1 (r^2 + 2 u~^2) + 2 P2 u~ v~      r^2 = u~^2 + v~^2
//!              v = v~ (1 + K1 r^2 + K2 r^4 + K3 r^6) + 2 P1 u~ v~ + P2 (r^2 + 2 v~^2)
//! ```
//! Both are lenses here, which have the focal length for their unit: `division` with `k1 = Kappa Focus^2`,
//! and `halcon-polynomial` with `k1 = K1 Focus^2`, `k2 = K2 Focus^4`, `k3 = K3 Focus^6`, `p1 = P1 Focus`, `p2
//! = P2 Focus`. Any other lens is refused, or on request the nearest polynomial fitted over the frame, with
//! the largest error said. (MVTec HALCON operator reference, `read_cam_par`, "Calibration", "2D
//! Transformations".)

use super::camera_file::CameraFile;
use super::decimal::decimal;
use super::error::FormatError;
use super::node::{MOST_NAMES, Source, side};
use super::{Format, Found, Room, Size, Wishes, Written, fitted, lens};
use crate::camera::{BrownConrady, Camera, Lens, Model};
use crate::geometry::Vec2;

pub(super) const FORMAT: Format = Format {
    name: "halcon",
    of: "HALCON",
    endings: &["dat", "cal"],
    first_pixel: 0.0,
    coefficients: "Kappa, or K1 K2 K3 P1 P2, of its own lenses",
    room: Room {
        // All but its own two with --fit, which the writer asks for.
        lenses: &Model::ALL,
        behind: &[],
        skew: false,
        covariance: false,
        pose: false,
        name: false,
        size: Size::Needed,
    },
    looks_like: |text| text.contains("ParGroup:"),
    read,
    write,
};

const FIT: &str = "its lenses are division and halcon-polynomial here; --fit finds the nearest polynomial and says its largest error";

/// The parameters of a file: name, place of the value, value.
struct Entries<'a> {
    source: &'a Source<'a>,
    entries: Vec<(&'a str, usize, &'a str)>,
}

impl<'a> Entries<'a> {
    /// Statements end with a semicolon; those of types, bounds and meanings say nothing about the camera.
    fn of(source: &'a Source<'a>) -> Result<Entries<'a>, FormatError> {
        let text = source.text;
        let mut entries: Vec<(&str, usize, &str)> = Vec::new();
        let place = |part: &str| part.as_ptr() as usize - text.as_ptr() as usize;
        for line in text.lines().filter(|line| !line.trim_start().starts_with('#')) {
            for statement in line.split(';').map(str::trim) {
                let parts: Vec<&str> = statement.split(':').map(str::trim).collect();
                let [name, _, value] = parts[..] else { continue };
                if statement.starts_with('"') || matches!(name, "DOUBLE" | "INT" | "STRING") {
                    continue;
                }
                if entries.len() == MOST_NAMES {
                    return Err(source.syntax(place(name), format!("more than {MOST_NAMES} names")));
                }
                if entries.iter().any(|(known, ..)| *known == name) {
                    return Err(source.syntax(place(name), format!("`{name}` stands here a second time")));
                }
                entries.push((name, place(value), value));
            }
        }
        Ok(Entries { source, entries })
    }

    fn get(&self, name: &str) -> Option<(usize, &'a str)> {
        self.entries.iter().find(|(known, ..)| *known == name).map(|(_, offset, value)| (*offset, *value))
    }

    fn number(&self, name: &str) -> Result<f64, FormatError> {
        let Some((offset, value)) = self.get(name) else {
            return Err(FormatError::Missing { file: self.source.file.into(), line: 1, what: name.into() });
        };
        self.source.number(offset, name, value)
    }

    fn side(&self, name: &str) -> Result<usize, FormatError> {
        let number = self.number(name)?;
        let (offset, value) = self.get(name).unwrap_or_default();
        side(number).ok_or_else(|| self.source.value(offset, name, format!("{value} is no number of pixels")))
    }
}

/// What belongs to cameras of another kind.
const OTHER_KINDS: [(&str, &str); 5] = [
    ("Magnification", "a telecentric lens"),
    ("Tilt", "a tilt lens"),
    ("Vx", "a line scan camera"),
    ("Vy", "a line scan camera"),
    ("Vz", "a line scan camera"),
];

fn read(source: &Source) -> Result<Vec<Found>, FormatError> {
    let entries = Entries::of(source)?;
    let other = OTHER_KINDS.iter().find(|(name, _)| entries.get(name).is_some());
    if let Some((_, kind)) = other {
        return Err(source.lens(*kind, "no camera here is one"));
    }
    let focus = entries.number("Focus")?;
    if focus <= 0.0 {
        // Older versions wrote a telecentric lens as one of focal length 0.
        return Err(source.lens(
            format!("a lens of focal length {focus} (0 is a telecentric one)"),
            "no camera here is one",
        ));
    }
    let (sx, sy) = (entries.number("Sx")?, entries.number("Sy")?);
    let linear = [focus / sx, focus / sy, entries.number("Cx")?, entries.number("Cy")?];
    let size = (entries.side("ImageWidth")?, entries.side("ImageHeight")?);
    let notes = vec![format!("a pixel measures {sx} x {sy} m, which is not kept")];
    let lens = match polynomial(&entries, focus)? {
        None => lens::division(entries.number("Kappa")? * focus * focus),
        Some(polynomial) => polynomial,
    };
    let camera = lens::camera(linear, lens::simplest(lens));
    Ok(vec![CameraFile { image_size: Some(size), notes, ..CameraFile::of(camera) }.into()])
}

/// The polynomial of a file, if it has one.
fn polynomial(entries: &Entries, focus: f64) -> Result<Option<Lens>, FormatError> {
    if entries.get("Poly1").is_none() {
        return Ok(None);
    }
    let f2 = focus * focus;
    let scaled = |name: &str, by: f64| entries.number(name).map(|value| value * by);
    let (k1, k2, k3) = (scaled("Poly1", f2)?, scaled("Poly2", f2 * f2)?, scaled("Poly3", f2 * f2 * f2)?);
    let (p1, p2) = (scaled("Poly4", focus)?, scaled("Poly5", focus)?);
    Ok(Some(lens::halcon_polynomial([k1, k2, p1, p2, k3])))
}

fn write(file: &CameraFile, wishes: &Wishes) -> Result<Written, FormatError> {
    let camera = &file.camera;
    let (width, height) = file.image_size.unwrap_or_default();
    let (focus, sy) = (camera.fy * wishes.pixel_height_m, wishes.pixel_height_m);
    let sx = focus / camera.fx;
    let mut converted = vec![format!(
        "focal lengths are in metres there: a pixel is taken to be {} m high, which changes no ray",
        wishes.pixel_height_m
    )];
    let f2 = focus * focus;
    let lens = if let Some(k1) = division(&camera.distortion) {
        vec![("Kappa", "kappa", k1 / f2, "Radial distortion coefficient [1/(meter*meter)]")]
    } else {
        let [k1, k2, p1, p2, k3] = match halcon_polynomial(&camera.distortion) {
            Some(coefficients) => coefficients,
            None => {
                let (coefficients, error) = nearest(camera, (width, height), wishes)?;
                converted
                    .push(format!("the lens is fitted over the frame: the largest error is {error:.2e} px"));
                coefficients
            }
        };
        vec![
            ("Poly1", "poly1", k1 / f2, "Radial distortion coefficient K1 [1/m^2]"),
            ("Poly2", "poly2", k2 / (f2 * f2), "Radial distortion coefficient K2 [1/m^4]"),
            ("Poly3", "poly3", k3 / (f2 * f2 * f2), "Radial distortion coefficient K3 [1/m^6]"),
            ("Poly4", "poly4", p1 / focus, "Decentering distortion coefficient P1 [1/m]"),
            ("Poly5", "poly5", p2 / focus, "Decentering distortion coefficient P2 [1/m]"),
        ]
    };
    let mut text = "# INTERNAL CAMERA PARAMETERS\n\nParGroup: Camera: Parameter;\n    \"Internal camera parameters\";\n\n".to_string();
    let mut add = |name: &str, short: &str, value: String, bounds: &str, meaning: &str| {
        text += &format!("{name}:{short}: {value};\n    {bounds};\n    \"{meaning}\";\n\n");
    };
    add("Focus", "foc", decimal(focus), "DOUBLE:0.0:", "Focal length of the lens [meter]");
    for (name, short, value, meaning) in lens {
        add(name, short, decimal(value), "DOUBLE::", meaning);
    }
    add("Sx", "sx", decimal(sx), "DOUBLE:0.0:", "Width of a cell on the sensor [meter]");
    add("Sy", "sy", decimal(sy), "DOUBLE:0.0:", "Height of a cell on the sensor [meter]");
    add("Cx", "cx", decimal(camera.cx), "DOUBLE::", "X-coordinate of the image center [pixel]");
    add("Cy", "cy", decimal(camera.cy), "DOUBLE::", "Y-coordinate of the image center [pixel]");
    add("ImageWidth", "imgw", width.to_string(), "INT:1:", "Width of the images [pixel]");
    add("ImageHeight", "imgh", height.to_string(), "INT:1:", "Height of the images [pixel]");
    Ok(Written { text, converted, lost: Vec::new() })
}

/// k1 of a division, 0 of an ideal lens.
fn division(lens: &Lens) -> Option<f64> {
    match lens.model() {
        Model::Division => lens.coefficients().first().copied(),
        _ => lens::is_ideal(lens).then_some(0.0),
    }
}

/// k1, k2, p1, p2, k3 of a polynomial of its own.
fn halcon_polynomial(lens: &Lens) -> Option<[f64; 5]> {
    (lens.model() == Model::HalconPolynomial).then(|| lens.coefficients().try_into().ok()).flatten()
}

/// k1, k2, p1, p2, k3 of its polynomial that is nearest to a lens over the frame, and the largest error, px.
fn nearest(
    camera: &Camera<Lens>,
    size: (usize, usize),
    wishes: &Wishes,
) -> Result<([f64; 5], f64), FormatError> {
    let refuse = |help: String| {
        Err(FormatError::CannotHold { format: "HALCON", what: "this lens exactly".into(), help })
    };
    if !wishes.fit {
        return refuse(FIT.into());
    }
    let pairs = match fitted::seen_and_ideal(camera, size) {
        Ok(pairs) => pairs,
        Err(reason) => return refuse(reason),
    };
    let Some(fit) = fitted::polynomial(&pairs) else {
        return refuse(fitted::FAR.into());
    };
    let by_halcon: Vec<(Vec2, Vec2)> =
        pairs.iter().map(|(seen, _)| fit.distort(seen)).zip(fitted::frame(size)).collect();
    let BrownConrady { k1, k2, p1, p2, k3 } = fit;
    let error_px = fitted::largest_error_px(camera, &by_halcon);
    if !error_px.is_finite() {
        return refuse(fitted::FAR.into());
    }
    // Its p1 stands where p2 does in Brown and Conrady's polynomial, and the other way round.
    Ok(([k1, k2, p2, p1, k3], error_px))
}
