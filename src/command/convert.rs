//! `calibench convert IN OUT`: a camera, corners or a board from the file of one program to that of another.

use super::calibrate::parse_size;
use super::format::Format as Shown;
use super::said::{refuse_standard_output, written_by};
use super::source::unended;
use super::{Exit, print, warn};
use calibench::io::ShownPath;
use calibench::io::formats::{
    self, AprilTarget, CameraFile, ChessTarget, Format, KalibrTarget, VnlBoard, Wishes, format_names,
    format_of_name, read_camera_file,
};
use calibench::io::input::{read_regular, replaceable};
use calibench::io::shown::on_one_line;
use calibench::io::{parse_corners, significant, table, write_atomically};
use calibench::photos::{BoardSpec, MarkKind};
use clap::Args;
use serde_json::json;
use std::fmt::{Display, Write};
use std::path::{Path, PathBuf};

/// What can be converted.
const FORMATS: &str = "\
Cameras: calibench (.json), opencv-yaml, opencv-xml (.xml), opencv-json, ros, kalibr, mrcal (.cameramodel), colmap (.txt), matlab (JSON of \
toStruct), halcon (.dat). Corners: this program's .csv to mrcal's .vnl and back, with --board. Boards: chess:9x6:25mm or aprilgrid:6x6:88mm:0.3 to Kalibr's target.yaml \
and back. The format of IN is told by its contents, that of OUT by its ending. Every lens goes where the format has its equal; where it has none, the \
refusal says which lenses it has.";

#[derive(Debug, Args)]
#[command(after_help = FORMATS)]
pub(super) struct Arguments {
    /// The file to read; or a board, such as chess:9x6:25mm
    #[arg(value_name = "IN", required_unless_present = "schema")]
    from_file: Option<PathBuf>,
    /// The file to write
    #[arg(value_name = "OUT", required_unless_present = "schema")]
    to_file: Option<PathBuf>,
    /// Format of IN [default: told by its contents]
    #[arg(long, value_name = "FORMAT", value_parser = parse_format)]
    from: Option<&'static Format>,
    /// Format of OUT [default: told by its ending]
    #[arg(long, value_name = "FORMAT", value_parser = parse_format)]
    to: Option<&'static Format>,
    /// Which camera of several
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Size of the images, such as 640x480, where IN does not say it
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    image_size: Option<(usize, usize)>,
    /// Writes the camera of the same images scaled to this size, edge to edge
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    resize: Option<(usize, usize)>,
    /// Both coordinates of the centre of the first pixel in IN, such as 0 or 0.5 [default: what its format
    /// says]
    #[arg(long, value_name = "PX", value_parser = parse_finite)]
    first_pixel: Option<f64>,
    /// Fits the nearest lens where OUT has no equal one (from or to HALCON's polynomial), and says the
    /// largest error
    #[arg(long)]
    fit: bool,
    /// Height of a pixel in micrometres, for HALCON, which states focal lengths in metres
    #[arg(long, value_name = "UM", value_parser = parse_positive, default_value_t = 1.0)]
    pixel_um: f64,
    /// The board whose corners are converted, such as chess:9x6:25mm
    #[arg(long, value_name = "BOARD")]
    board: Option<BoardSpec>,
    /// Prints the JSON schema of this program's camera files, and converts nothing
    #[arg(long, conflicts_with_all = ["from_file", "to_file"])]
    schema: bool,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Shown::Text)]
    format: Shown,
}

fn parse_format(name: &str) -> Result<&'static Format, String> {
    format_of_name(name).ok_or_else(|| format!("the formats are {}", format_names().join(", ")))
}

fn parse_finite(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(|| format!("`{text}` is not a number"))
}

fn parse_positive(text: &str) -> Result<f64, String> {
    parse_finite(text).and_then(|x| if x > 0.0 { Ok(x) } else { Err("expected a number above 0".into()) })
}

pub(super) fn run(arguments: &Arguments) -> Exit {
    if arguments.schema {
        print(formats::SCHEMA);
        return Exit::Held;
    }
    let (Some(from), Some(to)) = (&arguments.from_file, &arguments.to_file) else { return Exit::Usage };
    let converted = match converted(arguments, from, to) {
        Ok(converted) => converted,
        Err(message) => {
            warn(&message);
            return Exit::Usage;
        }
    };
    if let Err(error) = write_atomically(to, converted.text.as_bytes()) {
        warn(&error.to_string());
        return Exit::Incomplete;
    }
    match arguments.format {
        Shown::Text => print(&converted.report(from, to)),
        Shown::Json => print(&converted.json(from, to)),
    }
    Exit::Held
}

/// What is written, and what is said of it.
#[derive(Debug, Default)]
struct Converted {
    text: String,
    from: String,
    to: String,
    noted: Vec<String>,
    converted: Vec<String>,
    lost: Vec<String>,
    read_back_px: Option<f64>,
}

impl Converted {
    fn report(&self, from: &Path, to: &Path) -> String {
        let mut text = format!("{} ({}) -> {} ({})\n", from.shown(), self.from, to.shown(), self.to);
        for (word, lines) in [("read", &self.noted), ("converted", &self.converted), ("lost", &self.lost)] {
            for line in lines {
                // Writing to a string cannot fail.
                let _ = writeln!(text, "{word}: {}", on_one_line(line));
            }
        }
        if self.read_back_px == Some(f64::INFINITY) {
            text.push_str("read back by this program: some rays of the frame have no pixel in the camera that was written\n");
        } else if let Some(px) = self.read_back_px {
            let _ = writeln!(
                text,
                "read back by this program: over the whole frame pixels differ by {} px at most",
                significant(px, 2)
            );
        }
        text
    }

    fn json(&self, from: &Path, to: &Path) -> String {
        let value = json!({
            "written_by": written_by(),
            "in": {"file": from.display().to_string(), "format": self.from},
            "out": {"file": to.display().to_string(), "format": self.to},
            "noted": self.noted,
            "converted": self.converted,
            "lost": self.lost,
            "read_back_px": self.read_back_px,
        });
        format!("{value:#}\n")
    }
}

impl Converted {
    /// With a note where the last line of a table has no end.
    fn with_end_of(mut self, name: &str, bytes: &[u8]) -> Converted {
        self.noted.extend(unended(name, bytes));
        self
    }
}

/// The kind of IN decides what OUT can be.
fn converted(arguments: &Arguments, from: &Path, to: &Path) -> Result<Converted, String> {
    refuse_standard_output(to)?;
    if let Some(Ok(board)) = from.to_str().map(str::parse::<BoardSpec>) {
        return board_to_target(&board);
    }
    let name = from.shown();
    replaceable(to).map_err(said)?;
    if let (Ok(a), Ok(b)) = (from.canonicalize(), to.canonicalize())
        && a == b
    {
        return Err(format!("{name} would be overwritten: choose another name"));
    }
    let bytes = read_regular(from, formats::MOST_BYTES).map_err(said)?;
    if arguments.from.is_none() && has_columns(&bytes) {
        return corners_to_vnl(arguments, &name, &bytes)
            .map(|converted| converted.with_end_of(&name, &bytes));
    }
    let text = std::str::from_utf8(&bytes).map_err(|error| {
        format!("{name}: byte {} is no UTF-8 text: no file of these formats", error.valid_up_to())
    })?;
    match arguments.from {
        None if formats::looks_like_vnl(text) => {
            vnl_to_corners(arguments, &name, text).map(|converted| converted.with_end_of(&name, &bytes))
        }
        None if text.lines().any(|line| line.starts_with("target_type")) => target_to_board(&name, text),
        _ => camera(arguments, &name, text, to),
    }
}

fn said(error: impl Display) -> String {
    error.to_string()
}

fn camera(arguments: &Arguments, name: &str, text: &str, to: &Path) -> Result<Converted, String> {
    let wishes = Wishes {
        fit: arguments.fit,
        pixel_height_m: 1e-6 * arguments.pixel_um,
        first_pixel: arguments.first_pixel,
    };
    let from = arguments.from.map_or_else(|| formats::detect(name, text), Ok).map_err(said)?;
    let out = to.shown();
    let to = arguments.to.map_or_else(|| formats::format_to_write(&out), Ok).map_err(said)?;
    let read = read_camera_file(from, name, text, arguments.camera.as_deref(), &wishes).map_err(said)?;
    let first_pixel = wishes.first_pixel.unwrap_or(from.first_pixel);
    read.assumed.iter().for_each(|assumed| warn(&format!("{name}: {assumed}")));
    let noted = read.notes.iter().chain(&read.assumed).cloned().collect();
    let (camera, scaled) = sized(arguments, name, read)?;
    let written = formats::write_camera_file(to, &camera, &wishes).map_err(said)?;
    let read_back_px = formats::read_back_px(to, &written, &camera).map_err(said)?;
    let mut converted = scaled;
    if first_pixel != to.first_pixel {
        converted.push(format!(
            "the principal point moves by {:+} px: the centre of the first pixel is ({first_pixel}, {first_pixel}) in IN and ({1}, {1}) in {2}",
            to.first_pixel - first_pixel,
            to.first_pixel,
            to.of
        ));
    }
    if from.coefficients != to.coefficients {
        converted.push(format!(
            "coefficients of the lens: {} in IN and {} in {}",
            from.coefficients, to.coefficients, to.of
        ));
    }
    converted.extend(written.converted);
    let (from, to) = (from.name.to_string(), to.name.to_string());
    Ok(Converted { text: written.text, from, to, noted, converted, lost: written.lost, read_back_px })
}

/// The camera with the size that the user states, and scaled as the user asks.
fn sized(
    arguments: &Arguments,
    name: &str,
    mut read: CameraFile,
) -> Result<(CameraFile, Vec<String>), String> {
    if let (Some((w, h)), Some((width, height))) = (arguments.image_size, read.image_size)
        && (w, h) != (width, height)
    {
        return Err(format!(
            "{name} is of {width} x {height} px, not of {w} x {h}: to scale it, use --resize {w}x{h}"
        ));
    }
    read.image_size = read.image_size.or(arguments.image_size);
    let Some(to) = arguments.resize else { return Ok((read, Vec::new())) };
    let from = read.image_size;
    let resized = read
        .resized(to)
        .ok_or_else(|| format!("{name}: --resize needs the size of IN: give --image-size WxH"))?;
    let (width, height) = from.unwrap_or_default();
    let said = format!("scaled from {width} x {height} px to {} x {} px, edge to edge", to.0, to.1);
    Ok((resized, vec![said]))
}

/// Whether these are corners of this program.
fn has_columns(bytes: &[u8]) -> bool {
    let columns = table::columns(bytes);
    ["view", "X", "Y", "u", "v"].iter().all(|name| columns.iter().any(|column| column == name))
}

fn board_of(arguments: &Arguments) -> Result<VnlBoard, String> {
    let board = arguments
        .board
        .as_ref()
        .ok_or("corners.vnl has no board in it: give --board, such as chess:9x6:25mm")?;
    if board.kind.arrangement().is_staggered() {
        return Err(format!(
            "corners.vnl numbers marks by row and column of rows in line, and the rows of {} are staggered",
            board.words()
        ));
    }
    let board = board.board();
    Ok(VnlBoard { columns: board.columns(), rows: board.rows(), spacing: board.spacing() })
}

fn corners_to_vnl(arguments: &Arguments, name: &str, bytes: &[u8]) -> Result<Converted, String> {
    let corners = parse_corners(name, bytes).map_err(said)?;
    let text = formats::vnl_text(&corners, &board_of(arguments)?).map_err(said)?;
    let mut lost = vec!["the board: corners.vnl has no place for it".to_string()];
    if corners.views.iter().any(|view| view.weights().is_some()) {
        lost.push(
            "how well each mark was seen (weight or sigma_px): every corner is written with level 0"
                .to_string(),
        );
    }
    Ok(Converted { text, from: "corners".into(), to: "vnl".into(), lost, ..Converted::default() })
}

fn vnl_to_corners(arguments: &Arguments, name: &str, text: &str) -> Result<Converted, String> {
    let (corners, noted) = formats::parse_vnl(name, text, &board_of(arguments)?).map_err(said)?;
    let text = formats::corner_text(&corners);
    Ok(Converted { text, from: "vnl".into(), to: "corners".into(), noted, ..Converted::default() })
}

fn target_to_board(name: &str, text: &str) -> Result<Converted, String> {
    let text = match formats::parse_target(name, text).map_err(said)? {
        KalibrTarget::Chess(ChessTarget { columns, rows, square_m }) => {
            format!("chess:{columns}x{rows}:{square_m}m")
        }
        KalibrTarget::AprilGrid(AprilTarget { columns, rows, tag_m, spacing }) => {
            format!("aprilgrid:{columns}x{rows}:{tag_m}m:{spacing}")
        }
    };
    // What is written must be a board here.
    text.parse::<BoardSpec>().map_err(said)?;
    let converted = vec![format!("the target is --board {text}")];
    Ok(Converted {
        text: text + "\n",
        from: "kalibr-target".into(),
        to: "board".into(),
        converted,
        ..Converted::default()
    })
}

fn board_to_target(spec: &BoardSpec) -> Result<Converted, String> {
    let per_metre = match spec.unit.as_str() {
        "mm" => 1000.0,
        "cm" => 100.0,
        "m" => 1.0,
        _ => {
            return Err(
                "Kalibr's squares are in metres: give the board's unit, such as chess:9x6:25mm".into()
            );
        }
    };
    let board = spec.board();
    let target = match (spec.kind, spec.april_grid()) {
        (MarkKind::Chess, _) => KalibrTarget::Chess(ChessTarget {
            columns: board.columns(),
            rows: board.rows(),
            square_m: board.spacing() / per_metre,
        }),
        (_, Some((grid, tag))) => KalibrTarget::AprilGrid(AprilTarget {
            columns: grid.columns(),
            rows: grid.rows(),
            tag_m: tag / per_metre,
            spacing: grid.spacing(),
        }),
        _ => {
            return Err(
                "of this program's boards only chess and aprilgrid have an equal among Kalibr's targets"
                    .into(),
            );
        }
    };
    let text = formats::target_text(&target);
    Ok(Converted { text, from: "board".into(), to: "kalibr-target".into(), ..Converted::default() })
}
