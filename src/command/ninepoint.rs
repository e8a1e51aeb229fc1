//! `calibench ninepoint IMAGE`: the dots of a photograph, and the map from its pixels to the unit grid.

use super::calibrate::{Mode, PlaneReport, plane_text};
use super::format::Format;
use super::said::{print_either, unless_unwritten, written_by};
use super::source::last_part;
use super::{Exit, warn};
use calibench::board::Board;
use calibench::detect::{DotGrid, sparse_dots_of};
use calibench::geometry::Vec2;
use calibench::io::ShownPath;
use calibench::io::memory::{DEFAULT_MEMORY, parse_bytes};
use calibench::io::{Memory, Overlay, image_extent, read_image, write_together};
use calibench::photos::ordered_discs;
use calibench::planar::{PlaneCalibration, calibrate_plane};
use clap::Args;
use serde_json::{Value, json};
use std::io;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Photograph of dark dots on bright ground: PNG, JPEG, BMP, PGM or TIFF
    image: PathBuf,
    /// Map from pixels to the grid: planar (mode 0), tilted (1) or similarity (2)
    #[arg(long, value_enum, default_value_t = Mode::Planar)]
    mode: Mode,
    /// Dots along a row
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = super::said::whole::<usize>)]
    columns: usize,
    /// Rows
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = super::said::whole::<usize>)]
    rows: usize,
    /// Memory that the photograph may take, such as 500MB or 2GiB [default: 2GiB]
    #[arg(long, value_name = "BYTES", value_parser = parse_bytes, default_value_t = DEFAULT_MEMORY, hide_default_value = true)]
    memory: u64,
    /// Folder for result.json, overlay.png with the dots drawn in, and the page report.html with its plots
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

/// What was found in the photograph.
struct Found {
    centres_px: Vec<Vec2>,
    world: Vec<Vec2>,
    plane: PlaneCalibration,
}

pub(super) fn run(arguments: &Arguments) -> Exit {
    ninepoint(arguments).unwrap_or_else(|message| {
        warn(&message);
        Exit::Usage
    })
}

fn ninepoint(arguments: &Arguments) -> Result<Exit, String> {
    // The limits of a board, before any work.
    Board::chessboard(arguments.columns, arguments.rows, 1.0).map_err(|error| error.to_string())?;
    let extent = image_extent(&arguments.image).map_err(|error| error.to_string())?;
    let memory = Memory::new(arguments.memory);
    let _taken =
        memory.take(&arguments.image, extent.memory_to_detect()).map_err(|error| error.to_string())?;
    for what in extent.left_out() {
        warn(&format!("{} {what}", arguments.image.shown()));
    }
    let image = read_image(&arguments.image).map_err(|error| error.to_string())?;
    let at_file = |error: &dyn std::fmt::Display| format!("{}: {error}", arguments.image.shown());
    let grid = ordered_discs(&image, |discs| sparse_dots_of(discs, arguments.columns, arguments.rows))
        .map_err(|error| at_file(&error))?;
    let (centres_px, world) = (grid.centres_px(), unit_grid(arguments.columns, arguments.rows));
    let plane =
        calibrate_plane(arguments.mode.into(), &centres_px, &world).map_err(|error| at_file(&error))?;
    let found = Found { centres_px, world, plane };
    let json = format!("{:#}\n", result_json(arguments, &found));
    let overlay = || overlay(&image.to_u8(), &grid);
    let written =
        arguments.out.as_ref().map_or(Ok(()), |folder| write(folder, arguments, &found, &json, &overlay()));
    print_either(arguments.format, &text(&found), &json);
    Ok(unless_unwritten(written, Exit::Held))
}

/// The dots' world coordinates, row by row from the top left: one unit apart, the origin in the middle, y up.
fn unit_grid(columns: usize, rows: usize) -> Vec<Vec2> {
    let place = |index: usize, count: usize| index as f64 - 0.5 * (count as f64 - 1.0);
    (0..rows)
        .flat_map(|row| (0..columns).map(move |column| (column, row)))
        .map(|(column, row)| Vec2::new(place(column, columns), -place(row, rows)))
        .collect()
}

fn result_json(arguments: &Arguments, found: &Found) -> Value {
    let plane = &found.plane;
    let m = plane.map.matrix();
    let per_px = 0.5 * (plane.scale_x + plane.scale_y);
    let points = found.centres_px.iter().zip(&found.world).zip(&plane.residuals);
    json!({
        "written_by": written_by(),
        "mode": arguments.mode.name(),
        "columns": arguments.columns,
        "rows": arguments.rows,
        "matrix": (0..3).map(|i| (0..3).map(|j| m[(i, j)]).collect::<Vec<f64>>()).collect::<Vec<_>>(),
        "scale_x": plane.scale_x,
        "scale_y": plane.scale_y,
        "rms_point": plane.rms_point,
        "max_point": plane.max_point,
        "rms_px": plane.rms_point / per_px,
        "max_px": plane.max_point / per_px,
        "degrees_of_freedom": plane.degrees_of_freedom,
        "points": points.map(|((pixel, world), residual)| json!({
            "pixel": [pixel.x, pixel.y], "world": [world.x, world.y], "residual": [residual.x, residual.y],
        })).collect::<Vec<_>>(),
    })
}

fn text(found: &Found) -> String {
    let first = found.centres_px[0];
    let per_px = 0.5 * (found.plane.scale_x + found.plane.scale_y);
    format!(
        "{} dots, the first at ({:.3}, {:.3}) px; world: the unit grid about its middle, y up\n\n{}residual RMS {:.4} px, largest \
         {:.4} px\n",
        found.centres_px.len(),
        first.x,
        first.y,
        plane_text(&found.plane),
        found.plane.rms_point / per_px,
        found.plane.max_point / per_px,
    )
}

/// The photograph with the dots and their order drawn in.
fn overlay(image: &calibench::raster::Raster<u8>, grid: &DotGrid) -> Overlay {
    let mut overlay = Overlay::new(image, 1);
    overlay.grid(&grid.centres_px(), grid.columns());
    for blob in grid.blobs() {
        // A cross as long as the dot is seen at any size.
        overlay.cross(blob.centre_px, 0.5 * blob.semi_axes_px().0, [255, 60, 60]);
    }
    overlay
}

/// All files or none, `result.json` last.
fn write(
    folder: &Path,
    arguments: &Arguments,
    found: &Found,
    json: &str,
    overlay: &Overlay,
) -> io::Result<()> {
    const OVERLAY: &str = "overlay.png";
    let names: Vec<String> = (1..=found.centres_px.len()).map(|dot| dot.to_string()).collect();
    let report = PlaneReport {
        title: format!("the dots of {}", last_part(&arguments.image)),
        names: &names,
        pixels: &found.centres_px,
        world: &found.world,
        plane: &found.plane,
        overlay: Some(OVERLAY),
    };
    let mut files: Vec<(PathBuf, Vec<u8>)> =
        vec![(folder.join(OVERLAY), overlay.png().map_err(io::Error::other)?)];
    files.extend(report.files().into_iter().map(|(name, bytes)| (folder.join(name), bytes)));
    files.push((folder.join("result.json"), json.as_bytes().to_vec()));
    write_together(&files)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unit_grid_of_nine_dots_runs_from_the_top_left_with_y_up() {
        let grid = unit_grid(3, 3);
        assert_eq!((grid[0], grid[4], grid[8]), (Vec2::new(-1.0, 1.0), Vec2::zeros(), Vec2::new(1.0, -1.0)));
        assert_eq!(unit_grid(4, 2)[0], Vec2::new(-1.5, 0.5));
    }
}
