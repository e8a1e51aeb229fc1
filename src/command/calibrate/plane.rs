//! A map of a plane from a file of point pairs.

use super::{Arguments, Exit, Format, print, table};
use calibench::io::{PointPairs, read_point_pairs, significant, write_atomically};
use calibench::planar::{PlaneCalibration, calibrate_plane};
use std::path::Path;

pub(super) fn run(arguments: &Arguments, file: &Path) -> Result<Exit, String> {
    let PointPairs { pixels, world, .. } = read_point_pairs(file).map_err(|error| error.to_string())?;
    let result = calibrate_plane(arguments.mode.into(), &pixels, &world)
        .map_err(|error| format!("{}: {error}", file.display()))?;
    let json = plane_json(&result);
    if let Some(folder) = &arguments.out {
        write_atomically(&folder.join("result.json"), json.as_bytes()).map_err(|error| error.to_string())?;
    }
    match arguments.format {
        Format::Json => print(&json),
        Format::Text => print(&plane_text(&result)),
    }
    Ok(Exit::Held)
}

fn plane_json(result: &PlaneCalibration) -> String {
    let m = result.map.matrix();
    let value = serde_json::json!({
        "matrix": (0..3).map(|i| (0..3).map(|j| m[(i, j)]).collect::<Vec<f64>>()).collect::<Vec<_>>(),
        "scale_x": result.scale_x,
        "scale_y": result.scale_y,
        "rms_point": result.rms_point,
        "max_point": result.max_point,
        "degrees_of_freedom": result.degrees_of_freedom,
        "residuals": result.residuals.iter().map(|r| [r.x, r.y]).collect::<Vec<_>>(),
    });
    format!("{value:#}\n")
}

/// The map, its scales and its residuals for people.
pub(crate) fn plane_text(result: &PlaneCalibration) -> String {
    let m = result.map.matrix();
    let mut rows = table(&["world from pixel", "", ""]);
    for i in 0..3 {
        rows.add_row([0, 1, 2].map(|j| significant(m[(i, j)], 15)));
    }
    format!(
        "{}\n\nscales {} and {} world units per px; residual RMS {} per point, largest {}, {} degrees of freedom\n",
        rows.trim_fmt(),
        significant(result.scale_x, 8),
        significant(result.scale_y, 8),
        significant(result.rms_point, 9),
        significant(result.max_point, 9),
        result.degrees_of_freedom,
    )
}
