//! The numbers and tables of the three modes.

use super::*;

pub fn report_geometry(record: &mut Record, image: &Raster<f32>, centres: &[Vec2], band: Band) {
    let (along, between) = spacings(centres);
    record
        .exact("px")
        .count("image-width", image.width(), "width of the image")
        .count("image-height", image.height(), "height of the image")
        .band(band)
        .number("spacing", 0.5 * (along + between), "mean spacing of the dots")
        .number("spacing-rows", between, "mean spacing from row to row")
        .number("spacing-columns", along, "mean spacing from column to column")
        .number("centre-u", mean(centres).x, "mean of the nine centres, u")
        .number("centre-v", mean(centres).y, "mean of the nine centres, v");
}

/// Mean distance of neighbours along the rows, and from row to row.
pub fn spacings(centres: &[Vec2]) -> (f64, f64) {
    let mean = |pairs: [(usize, usize); 6]| {
        pairs.iter().map(|&(i, j)| (centres[j] - centres[i]).norm()).sum::<f64>() / 6.0
    };
    let along_rows = mean([(0, 1), (1, 2), (3, 4), (4, 5), (6, 7), (7, 8)]);
    let row_to_row = mean([(0, 3), (3, 6), (1, 4), (4, 7), (2, 5), (5, 8)]);
    (along_rows, row_to_row)
}

pub fn report_planar(record: &mut Record, fit: &PlaneCalibration, band: Band) {
    let m = fit.map.matrix();
    let per_px = 0.5 * (fit.scale_x + fit.scale_y);
    record
        .group("1/px", band)
        .number("m11", m[(0, 0)], "matrix, row 1, column 1")
        .number("m22", m[(1, 1)], "matrix, row 2, column 2")
        .unit("")
        .number("tx", m[(0, 2)], "matrix, translation along x")
        .number("ty", m[(1, 2)], "matrix, translation along y")
        .unit("1/px")
        .number("sx", fit.scale_x, "scale along u")
        .number("sy", fit.scale_y, "scale along v")
        .group("", Band::absolute(1e-8, "centres repeat to 1e-6 px, 4e-9 units"))
        .number("rms", fit.rms_point, "residual RMS per point, target units")
        .number("max", fit.max_point, "largest residual, target units")
        .unit("1/px")
        .number("m12", m[(0, 1)], "matrix, row 1, column 2")
        .number("m21", m[(1, 0)], "matrix, row 2, column 1")
        .group("px", Band::absolute(3e-6, "centres repeat to 1e-6 px"))
        .number("fit-rms-px", fit.rms_point / per_px, "residual RMS in pixels")
        .number("fit-max-px", fit.max_point / per_px, "largest residual in pixels");
}

pub fn modes_table(fits: &[PlaneCalibration]) -> Result<Table, ExperimentError> {
    let names = [
        "source", "m11", "m12", "tx", "m21", "m22", "ty", "m31", "m32", "m33", "sx", "sy", "rms", "max",
        "rms_px", "max_px",
    ];
    let columns: Vec<(&str, &str)> =
        names.iter().map(|&name| (name, if name.ends_with("_px") { "px" } else { "" })).collect();
    let mut table =
        Table::new("modes", "the three modes, and what the chapter and the vendor's GUI print", &columns);
    for ((name, _), fit) in MODES.iter().zip(fits) {
        let m = fit.map.matrix();
        let entries = (0..9).map(|i| Cell::from(m[(i / 3, i % 3)]));
        let per_px = 0.5 * (fit.scale_x + fit.scale_y);
        let rest = [
            fit.scale_x,
            fit.scale_y,
            fit.rms_point,
            fit.max_point,
            fit.rms_point / per_px,
            fit.max_point / per_px,
        ];
        table.push(std::iter::once(Cell::from(*name)).chain(entries).chain(rest.map(Cell::from)));
    }
    let printed = |id: &str| entry(id).map(|entry| Cell::from(entry.printed.as_str()));
    let text = |text: &str| Cell::from(text);
    // The chapter gives no digits for "~0" entries; the GUI does not show the cells left empty.
    let mut book = vec![text("book, planar"), printed("m11")?, text("~0"), printed("tx")?, text("~0")];
    book.extend([printed("m22")?, printed("ty")?, text("0"), text("0"), text("1")]);
    for id in ["sx", "sy", "rms", "max", "rms-px", "max-px"] {
        book.push(printed(id)?);
    }
    let mut gui = vec![text("vendor GUI"), printed("gui-a11")?, text(""), printed("gui-tx")?, text("")];
    gui.extend([printed("gui-a22")?, printed("gui-ty")?, text(""), text(""), text("")]);
    gui.extend([printed("gui-sx")?, printed("gui-sy")?, text(""), text(""), text(""), text("")]);
    table.push(book);
    table.push(gui);
    Ok(table)
}

pub fn residual_table(centres: &[Vec2], fits: &[PlaneCalibration]) -> Table {
    let caption = "predicted minus given target point, for the three modes";
    let mut table = Table::of("residuals", caption, unit_grid().into_iter().zip(centres).zip(0..))
        .column("x", "", |((point, _), _)| point.x)
        .column("y", "", |((point, _), _)| point.y)
        .column("u", "px", |((_, pixel), _)| pixel.x)
        .column("v", "px", |((_, pixel), _)| pixel.y);
    for ((mode, _), fit) in MODES.iter().zip(fits) {
        table = table.column(&format!("{mode}_x"), "", |(_, i)| fit.residuals[*i].x).column(
            &format!("{mode}_y"),
            "",
            |(_, i)| fit.residuals[*i].y,
        );
    }
    table.into()
}
