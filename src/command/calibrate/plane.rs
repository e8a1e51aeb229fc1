//! A map of a plane from a file of point pairs.

use super::super::Exit;
use super::super::report::table;
use super::super::said::{print_either, unless_unwritten};
use super::super::source::last_part;
use super::options::{Arguments, Mode};
use super::plane_page::PlaneReport;
use calibench::geometry::Vec2;
use calibench::io::{PointPairs, parse_point_pairs, significant, write_together};
use calibench::planar::{PlaneCalibration, calibrate_plane};
use std::path::{Path, PathBuf};

pub(super) fn run(arguments: &Arguments, file: &str, bytes: &[u8]) -> Result<Exit, String> {
    let PointPairs { names, pixels, world } =
        parse_point_pairs(file, bytes).map_err(|error| error.to_string())?;
    let mode = arguments.mode.unwrap_or(Mode::Planar);
    let result = calibrate_plane(mode.into(), &pixels, &world).map_err(|error| format!("{file}: {error}"))?;
    let json = plane_json(mode, &pixels, &world, &result);
    let title = last_part(Path::new(file));
    let report =
        PlaneReport { title, names: &names, pixels: &pixels, world: &world, plane: &result, overlay: None };
    let written =
        arguments.out.as_ref().map_or(Ok(()), |folder| write_together(&files(folder, &report, &json)));
    print_either(arguments.format, &plane_text(&result), &json);
    Ok(unless_unwritten(written, Exit::Held))
}

/// All or none, `result.json` last.
fn files(folder: &Path, report: &PlaneReport<'_>, json: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let files = report.files().into_iter().map(|(name, bytes)| (folder.join(name), bytes));
    files.chain([(folder.join("result.json"), json.as_bytes().to_vec())]).collect()
}

fn plane_json(mode: Mode, pixels: &[Vec2], world: &[Vec2], result: &PlaneCalibration) -> String {
    let m = result.map.matrix();
    let points = pixels.iter().zip(world);
    let value = serde_json::json!({
        "mode": mode.name(),
        "matrix": (0..3).map(|i| (0..3).map(|j| m[(i, j)]).collect::<Vec<f64>>()).collect::<Vec<_>>(),
        "scale_x": result.scale_x,
        "scale_y": result.scale_y,
        "rms_point": result.rms_point,
        "max_point": result.max_point,
        "degrees_of_freedom": result.degrees_of_freedom,
        "points": points.map(|(pixel, world)| serde_json::json!({
            "pixel": [pixel.x, pixel.y], "world": [world.x, world.y],
        })).collect::<Vec<_>>(),
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
