//! What is calibrated: the stand-in, or an image given.

use super::*;

/// What is calibrated: the stand-in or a file.
pub struct Shown {
    pub image: Raster<f32>,
    /// Truth of the stand-in.
    pub centres_true: Option<Vec<Vec2>>,
}

impl Shown {
    pub fn new(context: &Context, record: &mut Record) -> Result<Shown, ExperimentError> {
        let Some(path) = &context.image else {
            record.note(
                "The published image is not available: this is a STAND-IN, rendered from the published size \
                 and spacings and the centre that follows from the published matrix, without distortion and \
                 noise (dot diameter: a quarter of the spacing, not published). That its matrix agrees with \
                 the book's shows that the chapter's numbers agree with each other and with our detector, \
                 not what the real image holds.",
            );
            let photograph = nine_dot_stand_in();
            // A camera's file has 8 bits.
            let image = photograph.image.to_u8().to_f32();
            return Ok(Shown { image, centres_true: Some(photograph.centres_true) });
        };
        let bytes = read_regular(path, MOST_IMAGE_BYTES)
            .map_err(|error| ExperimentError::Input(error.to_string()))?;
        let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
        let wrong = |error: ImageError| ExperimentError::Input(error.to_string());
        let needed = parse_extent(&bytes, &name).map_err(wrong)?.memory_to_detect();
        if needed > DEFAULT_MEMORY {
            return Err(ExperimentError::Input(format!(
                "{name}: needs some {needed} bytes of memory, and the limit is {DEFAULT_MEMORY}: give an image with fewer pixels"
            )));
        }
        let image = parse_image(&bytes, &name).map_err(wrong)?;
        record.input(name, &bytes);
        Ok(Shown { image: image.to_f32(), centres_true: None })
    }

    pub fn name(&self) -> &'static str {
        if self.centres_true.is_some() { "stand-in" } else { "image given" }
    }

    /// The stand-in, or an image of the published one's size: only then are the published values about it.
    pub fn is_published(&self) -> bool {
        (self.image.width(), self.image.height()) == PUBLISHED_SIZE
    }

    pub fn stand_in_text(&self) -> &'static str {
        if self.centres_true.is_some() {
            "image rendered from the published geometry"
        } else {
            "image given, of the published size"
        }
    }

    pub fn band(&self) -> Band {
        Band::relative(1e-9, "the centres' last refinement step, below 1e-7 px of 236 px")
    }
}
