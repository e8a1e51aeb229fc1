//! `calibench board BOARD`: a page to print, true to scale, with rulers to check the printer, and the file
//! for `calibench calibrate --board`.

mod named;
mod paper;
mod pdf;
mod sheet;
mod svg;

pub(super) use named::board_or_file;

use super::format::Format;
use super::said::say_written;
use super::shell_word::shell_word;
use super::{Exit, warn};
use calibench::io::input::MOST_SPEC_BYTES;
use calibench::io::{ShownPath, read_regular_text, write_together};
use calibench::photos::BoardSpec;
use clap::Args;
use paper::Paper;
use sheet::{Sheet, growth};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// chess:9x6:25mm (inner corners, side of a square), circles:9x7:20mm:8mm (spacing, diameter),
    /// asymmetric:4x9:19mm:14mm (distance of rows, half that of a row's discs; OpenCV's asymmetric grid),
    /// hexagonal:9x9:10mm:5mm, dots:3x3:40mm:10mm, charuco:7x5:35mm:26mm:DICT_4X4_50 (squares, their side,
    /// that of a marker) or aprilgrid:6x4:30mm:0.3 (tags, their side, space between them in sides)
    board: BoardSpec,
    /// Draws a PDF for this paper: A5 to A0, letter, legal, tabloid, or WIDTHxHEIGHT in mm [default: A4]
    #[arg(long, value_name = "PAPER")]
    pdf: Option<Paper>,
    /// Draws an SVG for this paper
    #[arg(long, value_name = "PAPER")]
    svg: Option<Paper>,
    /// Folder for board.pdf or board.svg, and board.toml
    #[arg(long, value_name = "DIR", default_value = ".")]
    out: PathBuf,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

pub(super) fn run(arguments: &Arguments) -> Exit {
    let drawn = paper(arguments).and_then(|paper| {
        let sheet = Sheet::of(&arguments.board, &paper).map_err(|error| error.to_string())?;
        Ok((paper, sheet))
    });
    let (paper, sheet) = match drawn {
        Ok(drawn) => drawn,
        Err(message) => {
            warn(&message);
            return Exit::Usage;
        }
    };
    let place = |name: &str| arguments.out.join(name);
    let mut files = Vec::new();
    if arguments.pdf.is_some() || arguments.svg.is_none() {
        files.push((place("board.pdf"), pdf::pdf(&sheet)));
    }
    if arguments.svg.is_some() {
        files.push((place("board.svg"), svg::svg(&sheet).into_bytes()));
    }
    let named = place("board.toml");
    if read_regular_text(&named, MOST_SPEC_BYTES).is_ok_and(|text| named::is_measured(&text)) {
        warn(&format!(
            "{}: somebody has measured the rulers of this page; draw the other into a folder of its own (--out DIR), or remove this file first",
            named.shown()
        ));
        return Exit::Usage;
    }
    files.push((named, named::file_text(&arguments.board, sheet.rulers).into_bytes()));
    if let Err(error) = write_together(&files) {
        warn(&error.to_string());
        return Exit::Incomplete;
    }
    let written: Vec<PathBuf> = files.into_iter().map(|(path, _)| path).collect();
    say_written(&written, arguments.format, || {
        let names: Vec<String> = written.iter().map(|path| path.shown()).collect();
        told(&arguments.board, &paper, &names)
    });
    Exit::Held
}

/// The one paper, whatever is drawn on it: one file tells the rulers of all. Without a wish A4.
fn paper(arguments: &Arguments) -> Result<Paper, String> {
    match (&arguments.pdf, &arguments.svg) {
        (Some(pdf), Some(svg)) if pdf != svg => Err(format!(
            "--pdf {pdf} and --svg {svg}: one board.toml tells the rulers of one page; draw them into two folders"
        )),
        (Some(paper), _) | (None, Some(paper)) => Ok(paper.clone()),
        (None, None) => "A4".parse(),
    }
}

/// What was drawn, and the way from here to a camera.
fn told(board: &BoardSpec, paper: &Paper, written: &[String]) -> String {
    let (file, pages) = written.split_last().expect("board.toml is always written");
    let mut text = format!("{board}, on {paper}: {} and {file}\n", pages.join(", "));
    if let Some(factor) = growth(board, paper).filter(|factor| *factor >= WORTH_TELLING) {
        text.push_str(&format!("the page has room for lengths {:.1} times as large\n", round_down(factor)));
    }
    text + &format!(
        "\nnext:\n  1. print it without scaling (\"actual size\", 100 %), and glue it to something flat\n  2. measure both rulers, and write \
         their lengths into {file}\n  3. take 10 to 20 photographs without zoom or autofocus: the board tilted by 20 to 45 degrees, each \
         time another way, in all parts of the frame\n  4. calibench calibrate --board {} --out result PHOTOS...\n",
        shell_word(file)
    )
}

/// A board that may grow by less fills its page.
const WORTH_TELLING: f64 = 1.2;

/// A factor to one decimal, not above it.
fn round_down(factor: f64) -> f64 {
    libm::floor(10.0 * factor) / 10.0
}
