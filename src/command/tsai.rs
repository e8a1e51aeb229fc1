//! `calibench tsai CORNERS.csv`: a camera from one view of a tilted plane or of a target in three dimensions,
//! by Tsai's two stages, and refined from there.

use super::calibrate::{parse_size, refuse_views_outside};
use super::format::Format;
use super::report::table;
use super::said::{Said, number_that, ratio, say, unless_unwritten, written_by};
use super::source::unended;
use super::{Exit, warn};
use calibench::board::{View, ViewError};
use calibench::calibrate::{Settings, calibrate};
use calibench::camera::{FreeParameters, Parameter};
use calibench::geometry::{Vec2, rotation};
use calibench::io::read_named_table;
use calibench::io::{
    CalibrationFields, ShownPath, SpatialFile, message, parse_spatial, significant, write_together,
};
use calibench::tsai::{Assumed, Refined, SpatialView, TwoStage, refine_view, two_stage};
use clap::Args;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Corner file with the columns view,point,X,Y,u,v, and Z for a target in three dimensions; or - for
    /// standard input
    corners: PathBuf,
    /// Image size, such as 640x480: the principal point is its centre
    #[arg(long, value_name = "WxH", value_parser = parse_size, required_unless_present = "principal_point")]
    image_size: Option<(usize, usize)>,
    /// The principal point, px, where it is known better
    #[arg(long, value_name = "U,V", value_parser = parse_point)]
    principal_point: Option<Vec2>,
    /// fy over fx, or free to estimate it from a target in three dimensions
    #[arg(long, value_name = "RATIO", value_parser = parse_aspect, default_value = "1")]
    aspect: Aspect,
    /// What is estimated of the camera when Tsai's answer is refined; fy follows fx unless it is named or
    /// --aspect is free
    #[arg(long, value_name = "LIST", default_value = "fx,k1")]
    free: FreeParameters,
    /// Folder for tsai.json, and result.json of the refined calibration from all views of a plane
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

/// fy over fx, if it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Aspect(Option<f64>);

fn parse_point(text: &str) -> Result<Vec2, String> {
    let wanted = || "expected U,V in pixels, such as 326,243".to_string();
    let (u, v) = text.split_once(',').ok_or_else(wanted)?;
    let number = |text: &str| number_that(text, |_| true, "a pixel");
    Ok(Vec2::new(number(u)?, number(v)?))
}

fn parse_aspect(text: &str) -> Result<Aspect, String> {
    match text {
        "free" => Ok(Aspect(None)),
        number => {
            ratio(number).map(|ratio| Aspect(Some(ratio))).map_err(|wanted| format!("{wanted}, or free"))
        }
    }
}

impl Arguments {
    fn assumed(&self) -> Assumed {
        let centre = Assumed::centre_of(self.image_size.unwrap_or_default()).principal_point_px;
        Assumed { principal_point_px: self.principal_point.unwrap_or(centre), fy_per_fx: self.aspect.0 }
    }

    /// fy over fx in the refinement, of a camera that was found.
    fn tie(&self, found: &TwoStage) -> Option<f64> {
        (!self.free.contains(Parameter::Fy)).then(|| found.camera.fy / found.camera.fx)
    }
}

pub(super) fn run(arguments: &Arguments) -> Exit {
    let found = match found(arguments) {
        Ok(found) => found,
        Err(message) => {
            warn(&message);
            return Exit::Usage;
        }
    };
    let said = Said { text: found.text(arguments), json: found.json(arguments) };
    let files = arguments.out.as_ref().map(|folder| found.files(folder, &said.json));
    let exit = say(Ok(said), None, "tsai.json", arguments.format);
    unless_unwritten(files.map_or(Ok(()), |files| write_together(&files)), exit)
}

/// What was found of every view, and of all.
struct Found {
    source: String,
    views: Vec<OfView>,
    /// Names of views that were refused, with the reason.
    refused: Vec<(String, String)>,
    /// The calibration from all views of a plane, started at Tsai's answer; `None` for targets in three
    /// dimensions.
    joint: Option<Result<CalibrationFields, String>>,
}

/// One view.
struct OfView {
    name: String,
    points: usize,
    tsai: TwoStage,
    refined: Result<Refined, String>,
}

fn found(arguments: &Arguments) -> Result<Found, String> {
    let bytes = read_named_table(&arguments.corners).map_err(|error| error.to_string())?;
    let source = arguments.corners.shown();
    unended(&source, &bytes).iter().for_each(|said| warn(&format!("warning: {said}")));
    let SpatialFile { view_names, views } =
        parse_spatial(&source, &bytes).map_err(|error| error.to_string())?;
    let pixels = views.iter().map(SpatialView::pixels);
    refuse_views_outside(&source, arguments.image_size, view_names.iter().zip(pixels))?;
    let mut found = Found { source, views: Vec::new(), refused: Vec::new(), joint: None };
    for (name, view) in view_names.iter().zip(&views) {
        match two_stage(view, &arguments.assumed()) {
            Ok(tsai) => found.views.push(OfView {
                name: name.clone(),
                points: view.len(),
                refined: refined(arguments, view, &tsai),
                tsai,
            }),
            Err(error) => found.refused.push((name.clone(), error.to_string())),
        }
    }
    let Some(first) = found.views.first() else {
        let reasons = found.refused.iter().map(|(name, reason)| format!("view {name}: {reason}"));
        return Err(format!(
            "{}: no view gives a camera: {}",
            found.source,
            reasons.collect::<Vec<_>>().join("; ")
        ));
    };
    found.joint = joint(arguments, &view_names, &views, &first.tsai);
    Ok(found)
}

/// The most likely camera of one view near Tsai's.
fn refined(arguments: &Arguments, view: &SpatialView, tsai: &TwoStage) -> Result<Refined, String> {
    let start = starting_camera(arguments, tsai);
    let refined = refine_view(view, (&start, &tsai.cam_from_target), arguments.free, arguments.tie(tsai));
    refined.map_err(|error| error.to_string())
}

/// Tsai's camera, coefficients that are not estimated at 0: Tsai's one is spread over three.
fn starting_camera(arguments: &Arguments, tsai: &TwoStage) -> calibench::camera::Camera {
    let is_held = |p: &Parameter| !arguments.free.contains(*p) && !Parameter::LINEAR.contains(p);
    Parameter::ALL.into_iter().filter(is_held).fold(tsai.camera, |camera, p| camera.with(p, 0.0))
}

/// The calibration from all views of a plane, with Tsai's camera of the first as its start.
fn joint(
    arguments: &Arguments,
    names: &[String],
    views: &[SpatialView],
    tsai: &TwoStage,
) -> Option<Result<CalibrationFields, String>> {
    let views = views.iter().map(flat).collect::<Option<Result<Vec<View>, ViewError>>>()?;
    let start = starting_camera(arguments, tsai);
    let mut settings = Parameter::ALL
        .into_iter()
        .filter(|p| !arguments.free.contains(*p))
        .fold(Settings::new(arguments.free), |settings, p| settings.hold(p, start.get(p)))
        .starting_at(start);
    settings.image_size = arguments.image_size;
    let settings = arguments.tie(tsai).map_or(settings.clone(), |ratio| settings.tie_focal_lengths(ratio));
    let result = views
        .map_err(|error| error.to_string())
        .and_then(|views| calibrate(&views, &settings).map_err(|error| message(&error)));
    Some(result.map(|result| CalibrationFields::of(&result.into(), names, arguments.image_size)))
}

/// A view of a target in its plane Z = 0; `None` for one in three dimensions.
fn flat(view: &SpatialView) -> Option<Result<View, ViewError>> {
    view.points()
        .iter()
        .all(|p| p.z == 0.0)
        .then(|| View::new(view.points().iter().map(|p| p.xy()).collect(), view.pixels().to_vec()))
}

/// A value with its standard deviation, if it has one.
fn with_deviation(value: f64, deviation: Option<f64>) -> String {
    match deviation {
        Some(sd) => format!("{} \u{b1} {}", significant(value, 6), significant(sd, 2)),
        None => significant(value, 6),
    }
}

impl Found {
    /// The calibration from all views, if there is one, and what was found, which vouches for it.
    fn files(&self, folder: &Path, json: &Value) -> Vec<(PathBuf, Vec<u8>)> {
        let joint = self
            .joint
            .iter()
            .flatten()
            .map(|joint| (folder.join("result.json"), joint.to_json().into_bytes()));
        let own = (folder.join("tsai.json"), format!("{json:#}\n").into_bytes());
        joint.chain([own]).collect()
    }

    fn text(&self, arguments: &Arguments) -> String {
        let Assumed { principal_point_px: centre, .. } = arguments.assumed();
        let mut rows =
            table(&["view", "method", "fx (px)", "fy (px)", "k1", "distance", "tilt (deg)", "RMSE (px)"]);
        for OfView { name, tsai, refined, .. } in &self.views {
            let tilt = tsai.tilt_rad.map_or("-".to_string(), |tilt| significant(tilt.to_degrees(), 4));
            let camera = &tsai.camera;
            rows.add_row([
                name.clone(),
                "Tsai".into(),
                significant(camera.fx, 7),
                significant(camera.fy, 7),
                significant(camera.distortion.k1, 4),
                significant(tsai.cam_from_target.translation.z, 6),
                tilt,
                significant(tsai.rmse_px, 4),
            ]);
            let Ok(refined) = refined else { continue };
            let of = |p: Parameter| with_deviation(refined.camera.get(p), refined.standard_deviation(p));
            let depth = refined.pose_standard_deviations()[5];
            rows.add_row([
                String::new(),
                "refined".into(),
                of(Parameter::Fx),
                of(Parameter::Fy),
                of(Parameter::K1),
                with_deviation(refined.cam_from_target.translation.z, Some(depth)),
                String::new(),
                significant(refined.rmse_px, 4),
            ]);
        }
        let (u, v) = (significant(centre.x, 7), significant(centre.y, 7));
        let mut text =
            format!("{}: principal point taken to be ({u}, {v})\n\n{}\n\n", self.source, rows.trim_fmt());
        // Writing to a string cannot fail, here and below.
        for OfView { name, refined, .. } in &self.views {
            if let Err(why) = refined {
                let _ = writeln!(text, "not refined: view {name}: {why}");
            }
        }
        for (name, reason) in &self.refused {
            let _ = writeln!(text, "refused: view {name}: {reason}");
        }
        text += &self.joint_text();
        if !arguments.free.contains(Parameter::Cx) {
            text += "standard deviations take the principal point for exact: where it is not, focal length and distance are off by more\n";
        }
        text
    }

    fn joint_text(&self) -> String {
        match &self.joint {
            Some(Ok(joint)) => {
                let values = joint.standard_deviations.iter().map(|(name, sd)| {
                    let value =
                        joint.camera.0.values().find(|(p, _)| p.name() == *name).map_or(f64::NAN, |(_, v)| v);
                    format!("{name} = {}", with_deviation(value, Some(*sd)))
                });
                format!(
                    "all {} views from Tsai's start: {}; RMSE {} px, {}\n",
                    joint.views.len(),
                    values.collect::<Vec<_>>().join(", "),
                    significant(joint.rmse_px, 4),
                    joint.termination,
                )
            }
            Some(Err(why)) => format!("all views from Tsai's start: refused: {why}\n"),
            None => String::new(),
        }
    }

    fn json(&self, arguments: &Arguments) -> Value {
        let Assumed { principal_point_px: centre, fy_per_fx } = arguments.assumed();
        json!({
            "written_by": written_by(),
            "source": self.source,
            "image_size": arguments.image_size.map(|(width, height)| [width, height]),
            "principal_point_px": [centre.x, centre.y],
            "fy_per_fx": fy_per_fx,
            "views": self.views.iter().map(OfView::json).collect::<Vec<_>>(),
            "refused": self.refused.iter().map(|(view, reason)| json!({ "view": view, "reason": reason })).collect::<Vec<_>>(),
            "all_views": self.joint.as_ref().and_then(|joint| joint.as_ref().ok()),
            "all_views_refused": self.joint.as_ref().and_then(|joint| joint.as_ref().err()),
        })
    }
}

fn camera_json(camera: &calibench::camera::Camera) -> Value {
    Parameter::ALL.into_iter().map(|p| (p.name().to_string(), json!(camera.get(p)))).collect()
}

fn pose_json(pose: &calibench::geometry::Pose) -> Value {
    let turn = rotation::log(&pose.rotation);
    json!({
        "rotation_vector_rad": [turn.x, turn.y, turn.z],
        "translation": [pose.translation.x, pose.translation.y, pose.translation.z],
    })
}

impl OfView {
    fn json(&self) -> Value {
        let OfView { name, points, tsai, refined } = self;
        let of_refined = refined.as_ref().ok().map(|refined| {
            let deviations = Parameter::ALL
                .into_iter()
                .filter_map(|p| Some((p.name().to_string(), json!(refined.standard_deviation(p)?))));
            json!({
                "camera": camera_json(&refined.camera),
                "cam_from_target": pose_json(&refined.cam_from_target),
                "free": refined.free.iter().map(Parameter::name).collect::<Vec<_>>(),
                "standard_deviations": deviations.collect::<Value>(),
                "pose_standard_deviations": refined.pose_standard_deviations(),
                "sigma_px": refined.sigma_px,
                "rmse_px": refined.rmse_px,
                "degrees_of_freedom": refined.degrees_of_freedom,
            })
        });
        json!({
            "view": name,
            "points": points,
            "is_flat": tsai.is_flat,
            "camera": camera_json(&tsai.camera),
            "cam_from_target": pose_json(&tsai.cam_from_target),
            "kappa": tsai.kappa,
            "linear_focal_px": tsai.linear_focal_px,
            "conversion_px": tsai.conversion_px,
            "tilt_deg": tsai.tilt_rad.map(f64::to_degrees),
            "rmse_px": tsai.rmse_px,
            "refined": of_refined,
            "not_refined": refined.as_ref().err(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_and_ratios_are_read() {
        assert_eq!(parse_point("326,-3.5"), Ok(Vec2::new(326.0, -3.5)));
        assert!(parse_point("326").is_err() && parse_point("a,b").is_err() && parse_point("nan,1").is_err());
        assert_eq!((parse_aspect("free"), parse_aspect("1.02")), (Ok(Aspect(None)), Ok(Aspect(Some(1.02)))));
        assert!(parse_aspect("0").is_err());
    }
}
