//! A page as SVG, one unit a millimetre.

use super::sheet::{Ink, Sheet};
use std::fmt::Write;

/// The file. A white ground, since some programs show pages on dark.
pub(super) fn svg(sheet: &Sheet) -> String {
    let (width, height) = (sheet.size.x, sheet.size.y);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height}mm\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"Helvetica, Arial, sans-serif\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n"
    );
    for ink in &sheet.ink {
        // Writing to a string cannot fail.
        let _ = match ink {
            Ink::Disc { centre, diameter } => {
                writeln!(
                    text,
                    "<circle cx=\"{}\" cy=\"{}\" r=\"{}\"/>",
                    mm(centre.x),
                    mm(centre.y),
                    mm(0.5 * diameter)
                )
            }
            Ink::Rectangle { corner, size } => writeln!(
                text,
                "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>",
                mm(corner.x),
                mm(corner.y),
                mm(size.x),
                mm(size.y)
            ),
            Ink::Cells(cells) => {
                text.push_str("<path d=\"");
                for [low, high] in cells {
                    let (left, top, right, bottom) = (mm(low.x), mm(low.y), mm(high.x), mm(high.y));
                    let _ = write!(text, "M{left} {top}H{right}V{bottom}H{left}Z");
                }
                writeln!(text, "\"/>")
            }
            Ink::Words { at, height, text: words } => {
                writeln!(
                    text,
                    "<text x=\"{}\" y=\"{}\" font-size=\"{height}\">{words}</text>",
                    mm(at.x),
                    mm(at.y)
                )
            }
        };
    }
    text + "</svg>\n"
}

/// A length to a tenth of a micrometre, far below what paper keeps.
pub(super) fn mm(length: f64) -> f64 {
    libm::round(1e4 * length) / 1e4
}
