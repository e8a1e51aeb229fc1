//! Photographs of a board: each is read, its marks found and drawn in; one that fails is named and the rest
//! goes on.

use super::super::{Exit, warn};
use super::camera;
use super::observed::Observed;
use super::options::Arguments;
use calibench::board::{View, ViewError};
use calibench::detect::SeenBoard;
use calibench::geometry::Vec2;
use calibench::io::ShownPath;
use calibench::io::{Grey, ImageError, LeftOut, Memory, Overlay, image_extent, read_image};
use calibench::photos::{BoardSpec, NotFound};
use calibench::raster::{Level, Raster};
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
    marks: Result<SeenBoard, NotFound>,
    /// Mean level between the outermost marks; 0 without marks.
    light: f64,
    /// The overlay's path in the output folder, or why it could not be written.
    overlay: Option<Result<String, String>>,
    /// What of its file is not read.
    not_read: Vec<&'static str>,
}

pub(super) fn run(arguments: &Arguments, board: &BoardSpec, photos: &[PathBuf]) -> Result<Exit, String> {
    let reading = Reading {
        image_size: arguments.image_size,
        memory: arguments.memory(),
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
    ) -> Result<Observed, String> {
        let memory = Memory::new(self.memory);
        let seen = each(photos, |index, path| {
            let extent = image_extent(path)?;
            let _taken = memory.take(path, extent.memory_to_detect()).map_err(ImageError::Input)?;
            let seen = see(path, index, board, self.overlays)?;
            Ok(Seen { not_read: extent.left_out().collect(), ..seen })
        });
        let notes = not_read(photos, &seen);
        let mut observed = observed(self.image_size, board, photos, seen)?;
        observed.notes.extend(notes);
        for LeftOut { name, reason } in &observed.left_out {
            warn(&format!("left out: {name}: {reason}"));
        }
        if observed.views.is_empty() {
            return Err(format!("none of {} photographs shows the {board}", photos.len()));
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
    let marks = board.see(&photo);
    let overlay = out.map(|out| {
        let stem = plain(&path.file_stem().map(|stem| stem.to_string_lossy()).unwrap_or_default());
        // Photographs of two folders may share a name; their place in the list they do not.
        let name = format!("overlay/{:03}-{stem}.png", index + 1);
        let written = draw(&photo, &marks).write_png(&out.join(&name));
        written.map(|()| name).map_err(|error| error.to_string())
    });
    let light = marks.as_ref().map_or(0.0, |marks| light(&photo, marks));
    Ok(Seen { size: photo.size(), marks, light, overlay, not_read: Vec::new() })
}

/// What of the files is not read: a sentence for each such thing, which names the first photograph.
fn not_read(photos: &[PathBuf], seen: &[Result<Seen, ImageError>]) -> Vec<String> {
    let mut by_what: BTreeMap<&str, Vec<&PathBuf>> = BTreeMap::new();
    for (path, seen) in photos.iter().zip(seen.iter()) {
        for what in seen.iter().flat_map(|seen| &seen.not_read) {
            by_what.entry(what).or_default().push(path);
        }
    }
    let sentence = |(what, paths): (&str, Vec<&PathBuf>)| match paths[..] {
        [path] => format!("{} {what}", path.shown()),
        _ => format!("{} photographs, {} the first of them: each {what}", paths.len(), paths[0].shown()),
    };
    by_what.into_iter().map(sentence).collect()
}

/// Mean level of the upright rectangle that holds all marks.
fn light(photo: &Grey, seen: &SeenBoard) -> f64 {
    let low = seen.seen().fold(Vec2::repeat(f64::INFINITY), |low, (_, mark)| low.inf(&mark));
    let high = seen.seen().fold(Vec2::zeros(), |high, (_, mark)| high.sup(&mark));
    match photo {
        Grey::U8(image) => mean_level(image, low, high),
        Grey::U16(image) => mean_level(image, low, high),
        Grey::F32(image) => mean_level(image, low, high),
    }
}

fn mean_level<T: Level>(image: &Raster<T>, low: Vec2, high: Vec2) -> f64 {
    // Casts saturate: marks may lie a little outside.
    let rows = low.y as usize..image.height().min(high.y as usize + 1);
    let right = image.width().min(high.x as usize + 1);
    let columns = right.min(low.x as usize)..right;
    let count = (rows.len() * columns.len()) as f64;
    let sum: f64 = rows.flat_map(|y| &image.row(y)[columns.clone()]).map(|level| level.to_f64()).sum();
    sum / count
}

/// A name that needs no escape in a link.
fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect()
}

/// The board's marks that are seen, in their order; where it was not found, a red cross on each disc that
/// might be one of them.
fn draw(photo: &Grey, marks: &Result<SeenBoard, NotFound>) -> Overlay {
    let scale = if photo.width() < ENLARGED_BELOW_PX { 2 } else { 1 };
    let mut overlay = Overlay::new(&photo.to_u8(), scale);
    match marks {
        Ok(seen) => overlay.seen_grid(seen.places_px(), seen.columns()),
        Err(missing) => missing.candidates_px.iter().for_each(|&at| overlay.cross(at, 4.0, CANDIDATE)),
    }
    overlay
}

fn observed(
    image_size: Option<Size>,
    board: &BoardSpec,
    photos: &[PathBuf],
    seen: Vec<Result<Seen, ImageError>>,
) -> Result<Observed, String> {
    let expected = match image_size {
        Some(size) => Some((size, "--image-size has".to_string())),
        None => ruling_size(&seen)?,
    };
    let points = board.points();
    let mut observed = Observed {
        source: format!("{} photographs of a {board}", photos.len()),
        title: format!("photographs of a {board}"),
        unit: if board.unit.is_empty() { "board units".to_string() } else { board.unit.clone() },
        given: photos.iter().map(|path| path.shown()).collect(),
        photos: photos.to_vec(),
        image_size: expected.as_ref().map(|(size, _)| *size),
        discs: board.diameter_known.then(|| *board.board()),
        ..Observed::default()
    };
    if board.lacks_diameter() {
        observed.notes.push(
            "the centres of the imaged discs are not corrected for their bias, because the discs' diameter is not known: add \
             it to --board, as in circles:9x7:10mm:3mm"
                .to_string(),
        );
    }
    let mut parts = Vec::new();
    for (place, (path, seen)) in photos.iter().zip(seen).enumerate() {
        let name = path.shown();
        if let Some(overlay) = seen.as_ref().ok().and_then(|seen| seen.overlay.clone()) {
            match overlay {
                Ok(file) => _ = observed.overlays.insert(place, file),
                Err(error) => _ = observed.unwritten.get_or_insert(error),
            }
        }
        let light = seen.as_ref().map_or(0.0, |seen| seen.light);
        let board = seen.as_ref().ok().and_then(|seen| seen.marks.as_ref().ok());
        let (orientation, missing) = (board.map(SeenBoard::orientation), board.map_or(0, SeenBoard::missing));
        match view(seen, expected.as_ref(), &points) {
            Ok(view) => {
                observed.light.push(light);
                observed.orientation = orientation;
                if missing > 0 {
                    parts.push(format!("{name} ({missing})"));
                }
                observed.names.push(name);
                observed.places.push(place);
                observed.views.push(view);
            }
            Err(error) => {
                observed.left_out.push(LeftOut { reason: reason(&error, &name), name });
                observed.left_out_places.push(place);
            }
        }
    }
    if !parts.is_empty() {
        observed.notes.push(format!(
            "not all of the {} marks are seen, because something covers them, they lie outside or in glare; the others count: {}",
            points.len(),
            parts.join(", ")
        ));
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
        _ => {
            let (points, pixels) = seen.marks?.seen().map(|(mark, place)| (points[mark], place)).unzip();
            Ok(View::new(points, pixels)?)
        }
    }
}

/// The reason without the file's name, which stands beside it.
fn reason(error: &PhotoError, name: &str) -> String {
    let text = error.to_string();
    text.strip_prefix(&format!("{name}: ")).map(str::to_string).unwrap_or(text)
}
