//! Photographs of a board: each is read, its marks found and drawn in; one that fails is named and the rest goes on.

use super::camera::{self, Observed};
use super::{Arguments, Exit, warn};
use calibench::board::{View, ViewError};
use calibench::geometry::Vec2;
use calibench::io::{Grey, ImageError, LeftOut, Overlay, read_image};
use calibench::photos::{BoardSpec, MarkKind, NotFound};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Photographs wider than this are not enlarged in their overlays: a mark then has pixels enough.
const ENLARGED_BELOW_PX: usize = 1200;

/// Colour of a mark that fits no board.
const CANDIDATE: [u8; 3] = [230, 40, 40];

/// Why a photograph is left out.
#[derive(Debug, thiserror::Error)]
enum PhotoError {
    /// No image. Its message names the file.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The board was not found.
    #[error(transparent)]
    NotFound(#[from] NotFound),
    /// Another camera, or another setting of it.
    #[error("{} x {} px, but {} has {} x {} px: one camera's photographs have one size", got.0, got.1, of, size.0, size.1)]
    Size {
        /// Width and height, px.
        got: (usize, usize),
        /// Expected width and height, px.
        size: (usize, usize),
        /// Who has that size.
        of: String,
    },
    /// A mark without a place.
    #[error(transparent)]
    View(#[from] ViewError),
}

/// A photograph that was read.
struct Seen {
    size: (usize, usize),
    marks: Result<Vec<Vec2>, NotFound>,
    /// The overlay's path in the output folder, or why it could not be written.
    overlay: Option<Result<String, String>>,
}

pub(super) fn run(arguments: &Arguments, board: &BoardSpec, photos: &[PathBuf]) -> Result<Exit, String> {
    board.check_detector().map_err(|error| error.to_string())?;
    let seen: Vec<Result<Seen, ImageError>> = photos
        .par_iter()
        .enumerate()
        .map(|(index, path)| see(path, index, board, arguments.out.as_deref()))
        .collect();
    let observed = observed(arguments, board, photos, seen)?;
    for LeftOut { name, reason } in &observed.left_out {
        warn(&format!("left out: {name}: {reason}"));
    }
    if observed.views.is_empty() {
        return Err(format!("none of {} photographs shows the {board}", photos.len()));
    }
    camera::run(arguments, observed)
}

/// Reads a photograph, finds the marks, draws them in.
fn see(path: &Path, index: usize, board: &BoardSpec, out: Option<&Path>) -> Result<Seen, ImageError> {
    let photo = read_image(path)?;
    let marks = board.detect(&photo);
    let overlay = out.map(|out| {
        let stem = plain(&path.file_stem().map(|stem| stem.to_string_lossy()).unwrap_or_default());
        // Photographs of two folders may share a name; their place in the list they do not.
        let name = format!("overlay/{:03}-{stem}.png", index + 1);
        let written = draw(&photo, &marks, board.board().columns()).write_png(&out.join(&name));
        written.map(|()| name).map_err(|error| error.to_string())
    });
    Ok(Seen { size: photo.size(), marks, overlay })
}

/// A name that needs no escape in a link.
fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect()
}

/// The board's marks in their order; where it was not found, a red cross on each disc that might be one of them.
fn draw(photo: &Grey, marks: &Result<Vec<Vec2>, NotFound>, columns: usize) -> Overlay {
    let scale = if photo.width() < ENLARGED_BELOW_PX { 2 } else { 1 };
    let mut overlay = Overlay::new(&photo.to_u8(), scale);
    match marks {
        Ok(marks) => overlay.grid(marks, columns),
        Err(missing) => missing.candidates_px.iter().for_each(|&at| overlay.cross(at, 4.0, CANDIDATE)),
    }
    overlay
}

fn observed(
    arguments: &Arguments,
    board: &BoardSpec,
    photos: &[PathBuf],
    seen: Vec<Result<Seen, ImageError>>,
) -> Result<Observed, String> {
    let first = photos.iter().zip(&seen).find_map(|(path, seen)| Some((path, seen.as_ref().ok()?.size)));
    let expected = match (arguments.image_size, first) {
        (Some(size), _) => Some((size, "--image-size".to_string())),
        (None, Some((path, size))) => Some((size, path.display().to_string())),
        (None, None) => None,
    };
    let points = board.board().points();
    let mut observed = Observed {
        source: format!("{} photographs of a {board}", photos.len()),
        image_size: expected.as_ref().map(|(size, _)| *size),
        discs: board.diameter_known.then(|| *board.board()),
        ..Observed::default()
    };
    if board.kind != MarkKind::Chess && !board.diameter_known {
        observed.notes.push(
            "the centres of the imaged discs are not corrected for their bias, because the discs' diameter is not known: add \
             it to --board, as in circles:9x7:10mm:3mm"
                .to_string(),
        );
    }
    for (path, seen) in photos.iter().zip(seen) {
        let name = path.display().to_string();
        if let Some(overlay) = seen.as_ref().ok().and_then(|seen| seen.overlay.clone()) {
            observed.overlays.insert(name.clone(), overlay?);
        }
        match view(seen, expected.as_ref(), &points) {
            Ok(view) => {
                observed.names.push(name);
                observed.views.push(view);
            }
            Err(error) => observed.left_out.push(LeftOut { reason: reason(&error, &name), name }),
        }
    }
    Ok(observed)
}

fn view(
    seen: Result<Seen, ImageError>,
    expected: Option<&((usize, usize), String)>,
    points: &[Vec2],
) -> Result<View, PhotoError> {
    let seen = seen?;
    match expected {
        Some((size, of)) if *size != seen.size => {
            Err(PhotoError::Size { got: seen.size, size: *size, of: of.clone() })
        }
        _ => Ok(View::new(points.to_vec(), seen.marks?)?),
    }
}

/// The reason without the file's name, which stands beside it.
fn reason(error: &PhotoError, name: &str) -> String {
    let text = error.to_string();
    text.strip_prefix(&format!("{name}: ")).map(str::to_string).unwrap_or(text)
}
