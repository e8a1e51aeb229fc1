//! `calibench undistort --camera RESULT.json PHOTOS...`: what an ideal lens would have shown.

use super::format::Format;
use super::said::{say_written, written_by};
use super::{Exit, print, warn};
use calibench::camera::{Camera, Lens};
use calibench::io::ShownPath;
use calibench::io::memory::{DEFAULT_MEMORY, parse_bytes};
use calibench::io::result::LensFields;
use calibench::io::result_camera::read_lens_camera;
use calibench::io::{Channels, Memory, image_extent, read_channels, write_atomically, write_png};
use calibench::raster::Raster;
use calibench::rectify::{Interpolated, OutputView, Projection, RectifyError, RectifyMap, output_camera};
use clap::{Args, ValueEnum};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// result.json of `calibench calibrate`, or any JSON with {"camera": {"fx": ..., "fy": ..., "cx": ...,
    /// "cy": ...}}
    #[arg(long, value_name = "RESULT.json")]
    camera: PathBuf,
    /// Photographs: PNG, JPEG, BMP, PGM or TIFF, grey or colour, with or without alpha, 8 or 16 bit; all is
    /// kept
    #[arg(required = true, value_name = "PHOTOS")]
    photos: Vec<PathBuf>,
    /// Folder for the corrected photographs, as PNG of the same name, and camera-<W>x<H>.json
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// What the output shows; all and valid are for brown-conrady lenses and a pinhole
    #[arg(long, value_enum, default_value_t = View::Same)]
    view: View,
    /// How the output shows it
    #[arg(long, value_enum, default_value_t = To::Pinhole)]
    projection: To,
    /// Grey level, black 0 to white 1, of output pixels without data; where the photograph has alpha, they
    /// are transparent too
    #[arg(long, value_name = "LEVEL", default_value_t = 0.0, value_parser = parse_level)]
    border: f32,
    /// Memory that a photograph may take, such as 500MB or 2GiB [default: 2GiB]
    #[arg(long, value_name = "BYTES", value_parser = parse_bytes, default_value_t = DEFAULT_MEMORY, hide_default_value = true)]
    memory: u64,
    /// Also writes mask-<W>x<H>.png: white where the output has data
    #[arg(long)]
    mask: bool,
    /// Text for people, a line as each photograph is finished, or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum View {
    /// The same focal lengths and principal point: pixels keep their meaning, parts may be lost or empty
    Same,
    /// Every pixel of the photograph; parts are empty
    All,
    /// No empty pixel
    Valid,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum To {
    /// Straight lines are straight; less than 180 degrees are seen
    Pinhole,
    /// A fisheye: distance from the principal point is angle times focal length
    Equidistant,
    /// Longitude along u, latitude along v
    Equirectangular,
}

impl From<To> for Projection {
    fn from(to: To) -> Projection {
        match to {
            To::Pinhole => Projection::Pinhole,
            To::Equidistant => Projection::Equidistant,
            To::Equirectangular => Projection::Equirectangular,
        }
    }
}

impl From<View> for OutputView {
    fn from(view: View) -> OutputView {
        match view {
            View::Same => OutputView::SameK,
            View::All => OutputView::AllPixels,
            View::Valid => OutputView::OnlyValid,
        }
    }
}

fn parse_level(text: &str) -> Result<f32, String> {
    let wanted = || format!("`{text}` is not a level from 0 (black) to 1 (white)");
    let level: f32 = text.parse().map_err(|_| wanted())?;
    if (0.0..=1.0).contains(&level) { Ok(level) } else { Err(wanted()) }
}

pub(super) fn run(arguments: &Arguments) -> Exit {
    let (camera, image_size) = match read_lens_camera(&arguments.camera) {
        Ok(read) => read,
        Err(error) => {
            warn(&error.to_string());
            return Exit::Usage;
        }
    };
    if let Err(message) = distinct_outputs(arguments) {
        warn(&message);
        return Exit::Usage;
    }
    let mut work =
        Work { arguments, camera, image_size, map: None, described: BTreeSet::new(), written: Vec::new() };
    let mut exit = Exit::Held;
    // A photograph that cannot be corrected does not keep the others from it.
    for photo in &arguments.photos {
        if let Err((failed, message)) = work.undistort(photo) {
            warn(&message);
            exit = exit.max(failed);
        }
    }
    // What is finished stands.
    if exit == Exit::Usage && !work.written.is_empty() {
        exit = Exit::Incomplete;
    }
    // People saw each as it was finished.
    say_written(&work.written, arguments.format, String::new);
    exit
}

/// Two photographs must not be written to one file, nor one over itself.
fn distinct_outputs(arguments: &Arguments) -> Result<(), String> {
    let mut outputs = BTreeSet::new();
    let is_output = |path: &Path| {
        path.file_name().is_some_and(|n| n.to_string_lossy().to_lowercase().starts_with("camera-"))
    };
    let folder = |path: &Path| path.parent().map(Path::to_path_buf).unwrap_or_default();
    let same = |a: &Path, b: &Path| matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b);
    let of_camera = folder(&arguments.camera.canonicalize().unwrap_or_default());
    if is_output(&arguments.camera) && same(&of_camera, &arguments.out) {
        let camera = arguments.camera.shown();
        return Err(format!(
            "{camera} could be overwritten by the camera of the output: choose another folder"
        ));
    }
    for photo in &arguments.photos {
        let output = output_path(&arguments.out, photo);
        if let (Ok(from), Ok(to)) = (photo.canonicalize(), output.canonicalize())
            && from == to
        {
            return Err(format!("{} would be overwritten: choose another folder", photo.shown()));
        }
        if arguments.mask && is_mask_name(&output) {
            return Err(format!(
                "{} would be written to {}, which is the name of a mask: rename it, or leave --mask out",
                photo.shown(),
                output.shown()
            ));
        }
        if !outputs.insert(output.clone()) {
            return Err(format!("two photographs would be written to {}: rename one", output.shown()));
        }
    }
    Ok(())
}

/// Whether the name is `mask-<W>x<H>.png`, in letters of either size, since some file systems do not tell
/// them apart.
fn is_mask_name(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    let size = name.strip_prefix("mask-").and_then(|rest| rest.strip_suffix(".png"));
    let number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    size.and_then(|size| size.split_once('x')).is_some_and(|(w, h)| number(w) && number(h))
}

fn output_path(folder: &Path, photo: &Path) -> PathBuf {
    // Not `with_extension`: a name may hold further dots.
    let mut name = photo.file_stem().unwrap_or_default().to_os_string();
    name.push(".png");
    folder.join(name)
}

/// Floating-point levels are written with 16 bits, black 0 to white 1: what lies elsewhere would be lost.
fn refuse_other_levels(photo: &Path, image: &Channels) -> Result<(), String> {
    let Channels::F32(channels) = image else { return Ok(()) };
    let levels = || channels.iter().flat_map(|channel| channel.samples());
    match levels().filter(|level| !(0.0..=1.0).contains(*level)).count() {
        0 => Ok(()),
        beyond => Err(format!(
            "{}: {beyond} of {} floating-point levels are not from 0 (black) to 1 (white), between which they are written with 16 bits: scale them first",
            photo.shown(),
            levels().count()
        )),
    }
}

type Size = (usize, usize);

struct Work<'a> {
    arguments: &'a Arguments,
    camera: Camera<Lens>,
    image_size: Option<Size>,
    /// The look-up table of the size that came last: a table of each would take memory that nobody counted.
    map: Option<(Size, RectifyMap)>,
    /// Sizes whose output is described.
    described: BTreeSet<Size>,
    /// Files written so far.
    written: Vec<PathBuf>,
}

/// How to end, and what to say.
type Failure = (Exit, String);

impl Work<'_> {
    fn undistort(&mut self, photo: &Path) -> Result<(), Failure> {
        let wrong = |message: String| (Exit::Usage, message);
        // All that a header can tell is asked of it, before anything is decoded.
        let extent = image_extent(photo).map_err(|error| wrong(error.to_string()))?;
        self.refuse_other_size(photo, extent.size).map_err(wrong)?;
        let memory = Memory::new(self.arguments.memory);
        let _taken = memory.take(photo, extent.memory_to_correct()).map_err(|e| wrong(e.to_string()))?;
        let image = read_channels(photo).map_err(|error| wrong(error.to_string()))?;
        refuse_other_levels(photo, &image).map_err(wrong)?;
        for what in extent.left_out() {
            warn(&format!("{} {what}", photo.shown()));
        }
        let arguments = self.arguments;
        let map = self.map_of(image.size())?;
        let output = output_path(&arguments.out, photo);
        // A map is made for the size of the image.
        let same_size = |error: RectifyError| wrong(error.to_string());
        let border = arguments.border;
        let corrected = match &image {
            Channels::U8(channels) => all(map, channels, (255.0 * border).round() as u8, 0).map(Channels::U8),
            Channels::U16(channels) => {
                all(map, channels, (65535.0 * border).round() as u16, 0).map(Channels::U16)
            }
            Channels::F32(channels) => all(map, channels, border, 0.0).map(Channels::F32),
        };
        let written = corrected.map_err(same_size)?.write_png(&output);
        written.map_err(|error| (Exit::Incomplete, error.to_string()))?;
        if arguments.format == Format::Text {
            print(&format!("{}\n", output.shown()));
        }
        self.written.push(output);
        Ok(())
    }

    /// A camera is one of images of its size.
    fn refuse_other_size(&self, photo: &Path, (width, height): Size) -> Result<(), String> {
        match self.image_size {
            Some((w, h)) if (w, h) != (width, height) => {
                let camera = self.arguments.camera.shown();
                Err(format!(
                    "{}: {width} x {height} px, but {camera} is of {w} x {h} px images",
                    photo.shown()
                ))
            }
            _ => Ok(()),
        }
    }

    /// The table for a size.
    fn map_of(&mut self, size: Size) -> Result<&RectifyMap, Failure> {
        let map = match self.map.take() {
            Some((of, map)) if of == size => map,
            // The table of another size is dropped before this one is made.
            _ => self.made(size)?,
        };
        let (_, map) = self.map.insert((size, map));
        Ok(map)
    }

    /// Makes the table for a size. Of one that is new the camera of its output is written.
    fn made(&mut self, size: Size) -> Result<RectifyMap, Failure> {
        let wrong = |error: &dyn std::fmt::Display| (Exit::Usage, error.to_string());
        let (output, map) = match (self.camera.brown_conrady(), self.arguments.projection) {
            (Some(camera), To::Pinhole) => {
                let view = self.arguments.view.into();
                let output = output_camera(&camera, size, view).map_err(|error| wrong(&error))?;
                let map = RectifyMap::between(&camera, size, &output, size).map_err(|error| wrong(&error))?;
                (Some(output.into()), map)
            }
            (_, projection) if self.arguments.view == View::Same => {
                let projection = Projection::from(projection);
                let map = RectifyMap::through_lens(&self.camera, size, projection);
                (projection.camera(&self.camera), map.map_err(|error| wrong(&error))?)
            }
            _ => {
                let message = "--view all and --view valid are for brown-conrady lenses and a pinhole: leave --view out";
                return Err((Exit::Usage, message.to_string()));
            }
        };
        if !self.described.contains(&size) {
            let written = self.describe(size, output, &map).map_err(|message| (Exit::Incomplete, message))?;
            self.written.extend(written);
            self.described.insert(size);
        }
        Ok(map)
    }

    /// Writes the camera of an output, and where it has data; the files' paths.
    fn describe(
        &self,
        size: Size,
        output: Option<Camera<Lens>>,
        map: &RectifyMap,
    ) -> Result<Vec<PathBuf>, String> {
        let (width, height) = size;
        let mask = map.mask();
        let empty = mask.samples().iter().filter(|&&has_data| !has_data).count();
        if let Some(told) = nearly_empty(empty, size, self.arguments.projection) {
            warn(&format!("{}: {told}", self.arguments.camera.shown()));
        }
        let camera = match output {
            Some(camera) => serde_json::json!(LensFields(camera)),
            None => {
                let Camera { fx, fy, cx, cy, .. } = self.camera;
                serde_json::json!({"projection": "equirectangular", "fx": fx, "fy": fy, "cx": cx, "cy": cy})
            }
        };
        let result = serde_json::json!({
            "written_by": written_by(),
            "camera": camera,
            "image_size": [width, height],
            "pixels_without_data": empty,
        });
        let file = self.arguments.out.join(format!("camera-{width}x{height}.json"));
        write_atomically(&file, format!("{result:#}\n").as_bytes()).map_err(|error| error.to_string())?;
        let mut written = vec![file];
        if self.arguments.mask {
            let file = self.arguments.out.join(format!("mask-{width}x{height}.png"));
            let white: Raster<u8> = mask.map(|&has_data| if has_data { 255 } else { 0 });
            write_png(&file, &white).map_err(|error| error.to_string())?;
            written.push(file);
        }
        Ok(written)
    }
}

/// An output of which less than this part has data is told.
const FEW_WITH_DATA: f64 = 0.25;

/// What to say of an output that shows little.
fn nearly_empty(empty: usize, (width, height): Size, projection: To) -> Option<String> {
    let shown = 1.0 - empty as f64 / (width * height) as f64;
    let advice = match projection {
        To::Pinhole => {
            "the camera folds there, or sees so far to the side that --projection equidistant shows more"
        }
        To::Equidistant | To::Equirectangular => "the camera folds beyond it, or sees no more",
    };
    (shown < FEW_WITH_DATA).then(|| {
        format!(
            "only {:.1} % of the {width} x {height} output shows the photograph, the rest has no data: {advice}",
            100.0 * shown
        )
    })
}

/// Every channel corrected. Pixels without data get the level `border` in colours and `clear` in alpha, the
/// second or fourth channel.
fn all<T: Interpolated>(
    map: &RectifyMap,
    channels: &[Raster<T>],
    border: T,
    clear: T,
) -> Result<Vec<Raster<T>>, RectifyError> {
    let has_alpha = channels.len().is_multiple_of(2);
    let level = |c: usize| if has_alpha && c + 1 == channels.len() { clear } else { border };
    channels.iter().enumerate().map(|(c, channel)| map.apply(channel, level(c))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_output_has_the_photographs_name_as_png() {
        assert_eq!(output_path(Path::new("o"), Path::new("a/b.c.jpg")), Path::new("o/b.c.png"));
    }

    #[test]
    fn an_output_that_shows_little_is_told() {
        let told = nearly_empty(990, (50, 20), To::Pinhole).unwrap();
        assert!(told.starts_with("only 1.0 % of the 50 x 20 output"), "{told}");
        assert_eq!(nearly_empty(700, (50, 20), To::Pinhole), None);
    }

    #[test]
    fn names_of_masks_are_known_in_any_letters() {
        for name in ["mask-640x480.png", "Mask-1x2.PNG"] {
            assert!(is_mask_name(Path::new(name)), "{name}");
        }
        for name in ["mask-640x480b.png", "mask-x480.png", "mask.png", "unmask-1x2.png"] {
            assert!(!is_mask_name(Path::new(name)), "{name}");
        }
    }

    #[test]
    fn a_border_level_is_a_fraction_of_white() {
        assert_eq!(parse_level("0.5"), Ok(0.5));
        assert!(parse_level("128").is_err() && parse_level("NaN").is_err() && parse_level("x").is_err());
    }
}
