//! How does a reader see the result? Plots as SVG, photographs as PNG, the same bytes on every machine.

mod axis;
mod bins;
mod canvas;
mod clip;
mod colour;
mod drawing;
mod heat;
mod legend;
mod mark;
mod plot;
mod render;

pub use bins::density;
pub use colour::{Dash, Look, Marker};
pub use drawing::{Align, At, Drawing};
pub use heat::HeatMap;
pub use plot::Plot;

use calibench::raster::Raster;

/// The format of a figure's file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Scalable, with selectable text.
    Svg,
    /// Pixels.
    Png,
}

impl Format {
    /// File name extension.
    pub fn extension(self) -> &'static str {
        match self {
            Format::Svg => "svg",
            Format::Png => "png",
        }
    }
}

/// A figure of an experiment, written to `figures/<experiment>/<name>.<svg|png>`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Figure {
    /// File name without extension, in kebab-case.
    pub name: String,
    /// Seed, trials, units, and what to notice.
    pub caption: String,
    /// Format of the bytes.
    pub format: Format,
    /// The file.
    pub bytes: Vec<u8>,
    /// Whether every machine gives the same bytes; false where a third party's code stands in the path.
    pub reproducible: bool,
}

impl Figure {
    /// One plot.
    pub fn plot(name: impl Into<String>, plot: &Plot, caption: impl Into<String>) -> Figure {
        Figure::panels(name, std::slice::from_ref(plot), 1, caption)
    }

    /// Several plots side by side, row by row, `columns` in a row.
    pub fn panels(
        name: impl Into<String>,
        plots: &[Plot],
        columns: usize,
        caption: impl Into<String>,
    ) -> Figure {
        let caption = caption.into();
        let bytes = render::svg(plots, columns, &caption).into_bytes();
        Figure { name: name.into(), caption, format: Format::Svg, bytes, reproducible: true }
    }

    /// A drawing without axes. With debug assertions, words that run over its edge are a panic.
    pub fn drawing(name: impl Into<String>, drawing: &Drawing, caption: impl Into<String>) -> Figure {
        debug_assert_eq!(drawing.words_beyond_the_sheet(), Vec::<&str>::new());
        let caption = caption.into();
        let bytes = drawing.svg(&caption).into_bytes();
        Figure { name: name.into(), caption, format: Format::Svg, bytes, reproducible: true }
    }

    /// A photograph, sample for sample.
    pub fn photo(name: impl Into<String>, photo: &Raster<u8>, caption: impl Into<String>) -> Figure {
        Figure {
            name: name.into(),
            caption: caption.into(),
            format: Format::Png,
            bytes: png(photo),
            reproducible: true,
        }
    }

    /// The same figure, declared to depend on a third party's arithmetic.
    pub fn not_reproducible(self) -> Figure {
        Figure { reproducible: false, ..self }
    }

    /// `<name>.<extension>`.
    pub fn file_name(&self) -> String {
        format!("{}.{}", self.name, self.format.extension())
    }
}

/// Grey PNG, 8 bits, best compression; no time stamp and no other metadata.
fn png(photo: &Raster<u8>) -> Vec<u8> {
    use image::codecs::png::{CompressionType, FilterType, PngEncoder};
    use image::{ExtendedColorType, ImageEncoder};
    let mut bytes = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::Adaptive);
    encoder
        .write_image(photo.samples(), photo.width() as u32, photo.height() as u32, ExtendedColorType::L8)
        .expect("a raster has as many samples as its size says, and memory takes them all");
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_photo_is_read_back_sample_for_sample() {
        let photo = Raster::from_fn(7, 5, |x, y| (31 * x + 3 * y) as u8);
        let figure = Figure::photo("photo", &photo, "a ramp");
        let back = image::load_from_memory(&figure.bytes).unwrap().into_luma8();
        assert_eq!(back.as_raw(), photo.samples());
        assert_eq!(figure.file_name(), "photo.png");
    }

    #[test]
    fn a_plot_is_svg_with_selectable_text_and_without_traces_of_the_machine() {
        let plot = Plot::new("Title & more", "x (px)", "y (px)").line("curve", [(0.0, 0.0), (1.0, 2.0)]);
        let figure = Figure::plot("curve", &plot, "what to <notice>");
        let text = String::from_utf8(figure.bytes.clone()).unwrap();
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"));
        assert!(text.contains("Title &amp; more") && text.contains("what to &lt;notice&gt;"));
        assert!(!text.contains(env!("CARGO_MANIFEST_DIR")));
        assert_eq!(Figure::plot("curve", &plot, "what to <notice>"), figure);
    }
}
