//! Photographs of a board: each is read, its marks found and drawn in; one that fails is named and the rest
//! goes on.

use super::camera::{self, Observed};
use super::{Arguments, Exit, Failure, warn};
use calibench::board::{View, ViewError};
use calibench::geometry::Vec2;
use calibench::io::ShownPath;
use calibench::io::{Grey, ImageError, LeftOut, Memory, Overlay, image_extent, read_image};
use calibench::photos::{BoardSpec, MarkKind, NotFound};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

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
    #[error("{} x {} px, but {} {} x {} px: one camera's photographs have one size", got.0, got.1, of, size.0, size.1)]
    Size {
        /// Width and height, px.
        got: (usize, usize),
        /// Expected width and height, px.
        size: (usize, usize),
        /// Who has that size, with the verb.
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

pub(super) fn run(arguments: &Arguments, board: &BoardSpec, photos: &[PathBuf]) -> Result<Exit, Failure> {
    let reading = Reading {
        image_size: arguments.image_size,
        memory: arguments.memory,
        overlays: arguments.out.as_deref(),
    };
    camera::run(arguments, reading.observe(board, photos)?)
}

/// How photographs are read.
#[derive(Debug, Clone, Copy)]
pub(in crate::calibrate) struct Reading<'a> {
    /// The size they must have; else that of most.
    pub(in crate::calibrate) image_size: Option<Size>,
    /// Bytes that they may take together.
    pub(in crate::calibrate) memory: u64,
    /// Folder for pictures with the marks drawn in.
    pub(in crate::calibrate) overlays: Option<&'a Path>,
}

impl Reading<'_> {
    /// The marks of a board in photographs; those that fail are named and left out.
    pub(in crate::calibrate) fn observe(
        &self,
        board: &BoardSpec,
        photos: &[PathBuf],
    ) -> Result<Observed, Failure> {
        let memory = Memory::new(self.memory);
        let seen = each(photos, |index, path| {
            let needed = image_extent(path)?.memory_to_detect();
            let _taken = memory.take(path, needed).map_err(ImageError::Input)?;
            see(path, index, board, self.overlays)
        });
        let observed = observed(self.image_size, board, photos, seen)?;
        for LeftOut { name, reason } in &observed.left_out {
            warn(&format!("left out: {name}: {reason}"));
        }
        if observed.views.is_empty() {
            return Err(format!("none of {} photographs shows the {board}", photos.len()).into());
        }
        Ok(observed)
    }
}

/// What `work` gives for each photograph, in their order. Threads of its own: one of a pool that waits for
/// memory may be given the work of another by whoever it waits for, and then both wait.
fn each<T: Send>(photos: &[PathBuf], work: impl Fn(usize, &Path) -> T + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let results: Vec<Mutex<Option<T>>> = photos.iter().map(|_| Mutex::new(None)).collect();
    std::thread::scope(|scope| {
        for _ in 0..rayon::current_num_threads().min(photos.len()) {
            scope.spawn(|| {
                while let Some((index, path)) =
                    photos.iter().enumerate().nth(next.fetch_add(1, Ordering::Relaxed))
                {
                    *results[index].lock().unwrap_or_else(PoisonError::into_inner) = Some(work(index, path));
                }
            });
        }
    });
    let done = |slot: Mutex<Option<T>>| slot.into_inner().unwrap_or_else(PoisonError::into_inner);
    results.into_iter().map(|slot| done(slot).expect("every photograph was taken by a thread")).collect()
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

/// The board's marks in their order; where it was not found, a red cross on each disc that might be one of
/// them.
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
    image_size: Option<Size>,
    board: &BoardSpec,
    photos: &[PathBuf],
    seen: Vec<Result<Seen, ImageError>>,
) -> Result<Observed, Failure> {
    let expected = match image_size {
        Some(size) => Some((size, "--image-size has".to_string())),
        None => ruling_size(&seen)?,
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
        let name = path.shown();
        if let Some(overlay) = seen.as_ref().ok().and_then(|seen| seen.overlay.clone()) {
            observed.overlays.insert(name.clone(), overlay.map_err(Failure::unwritten)?);
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

type Size = (usize, usize);

/// The size that most photographs with the board have, and who has it. A photograph that does not show the
/// board may be anything.
///
/// # Errors
/// Two sizes that equally many have: nothing says which camera is meant.
fn ruling_size(seen: &[Result<Seen, ImageError>]) -> Result<Option<(Size, String)>, String> {
    let mut groups: BTreeMap<Size, usize> = BTreeMap::new();
    for seen in seen.iter().flatten().filter(|seen| seen.marks.is_ok()) {
        *groups.entry(seen.size).or_default() += 1;
    }
    let Some(most) = groups.values().copied().max() else { return Ok(None) };
    let largest: Vec<Size> =
        groups.iter().filter(|(_, count)| **count == most).map(|(size, _)| *size).collect();
    if let [size] = largest[..] {
        let with_board: usize = groups.values().sum();
        return Ok(Some((size, format!("{most} of the {with_board} photographs with the board have"))));
    }
    let named: Vec<String> = largest.iter().map(|(width, height)| format!("{width}x{height}")).collect();
    Err(format!(
        "the board is seen in {most} photographs of each of the sizes {}: choose one with --image-size, or name those of one camera",
        named.join(", ")
    ))
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
