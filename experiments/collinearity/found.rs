//! One single-plane calibration, the correction of its points, and what the chapter measures of both.

use super::*;

/// What is assumed of the distortion centre.
#[derive(Clone, Copy, PartialEq)]
pub enum Centre {
    /// Held at the middle of the image, (320, 240).
    Image,
    /// Held at the true principal point, (326, 243).
    Truth,
    /// Estimated.
    Free,
    /// Held at the middle of the image, and p1, p2 estimated beside k1, k2: the chapter's program has slots
    /// for them.
    ImageTangential,
}

pub const CENTRES: [Centre; 4] = [Centre::Image, Centre::Truth, Centre::Free, Centre::ImageTangential];

/// The treatment that the published numbers are reconciled with: a free centre. The five numbers together
/// exclude a radial lens whose centre is held; a centre held at the image's with tangential terms they do not
/// exclude (table `joint`), and its distributions are the same to the line's width.
pub const MAIN: usize = 2;

impl Centre {
    /// The treatment in words, as a statement ends with it.
    pub fn in_words(self) -> &'static str {
        match self {
            Centre::Image => "centre held at the image's",
            Centre::Truth => "centre held at its true place",
            Centre::Free => "centre free",
            Centre::ImageTangential => "centre held at the image's, p1 and p2 free",
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Centre::Image => "image-centre",
            Centre::Truth => "true-centre",
            Centre::Free => "free-centre",
            Centre::ImageTangential => "image-centre-tangential",
        }
    }

    /// What the fit estimates beside the homography.
    pub fn estimated(self) -> &'static str {
        match self {
            Centre::Image | Centre::Truth => "k1, k2",
            Centre::Free => "k1, k2, centre",
            Centre::ImageTangential => "k1, k2, p1, p2",
        }
    }

    /// Whether the model holds the truth: without noise nothing is left.
    pub fn is_exact(self) -> bool {
        matches!(self, Centre::Truth | Centre::Free)
    }

    pub fn options(self) -> SinglePlaneOptions {
        let truth = Truth::example_camera();
        let (width, height) = Truth::EXAMPLE_IMAGE;
        let image = Vec2::new(0.5 * width as f64, 0.5 * height as f64);
        let centre_px = if self == Centre::Truth { Vec2::new(truth.cx, truth.cy) } else { image };
        SinglePlaneOptions { focal_px: truth.fx, centre_px, centre_free: self == Centre::Free }
    }

    /// Homography, k1, k2, and the centre or p1, p2.
    pub fn parameters(self) -> usize {
        match self {
            Centre::Image | Centre::Truth => 10,
            Centre::Free | Centre::ImageTangential => 12,
        }
    }
}

/// The five published quantities: name, unit, what.
pub const QUANTITIES: [(&str, &str, &str); 5] = [
    ("plane-rms", "px", "RMS of the single-plane calibration"),
    (
        "top-row-before",
        "px",
        "largest distance of the top row's points from their regression line, as photographed",
    ),
    ("top-row-after", "px", "largest distance of the top row's points from their regression line, corrected"),
    ("affine-rms", "mm", "RMS of the affine fit of the corrected points to the target"),
    ("affine-max", "mm", "largest residual of the affine fit"),
];

/// The chapter's values of [`QUANTITIES`].
pub type Book = [&'static Entry; 5];

pub fn book() -> Result<Book, ExperimentError> {
    let entries: Result<Vec<_>, _> =
        QUANTITIES.iter().map(|(id, _, _)| published::entry(EXPERIMENT.id, id)).collect();
    let entries = entries.map_err(ExperimentError::at("published values"))?;
    Ok(std::array::from_fn(|q| entries[q]))
}

/// One calibration and what follows from it.
pub struct Found {
    pub plane: SinglePlane,
    pub corrected: Vec<Vec2>,
    pub row_before: LineFit,
    pub row_after: LineFit,
    /// Affine image of the corrected point minus the target point, mm.
    pub affine_residuals: Vec<Vec2>,
}

impl Found {
    pub fn new(view: &View, centre: Centre) -> Result<Found, ExperimentError> {
        let plane = calibrate_single_plane(view, &centre.options())
            .map_err(ExperimentError::at("single-plane calibration"))?;
        let plane = if centre == Centre::ImageTangential { with_tangential(view, plane)? } else { plane };
        let corrected = corrected(&plane.lens_camera(), view.pixels())?;
        let affine = Affine::fit(&corrected, view.points()).map_err(ExperimentError::at("affine fit"))?;
        let affine_residuals =
            corrected.iter().zip(view.points()).map(|(pixel, point)| affine.apply(pixel) - point).collect();
        Ok(Found {
            row_before: line(&view.pixels()[TOP_ROW])?,
            row_after: line(&corrected[TOP_ROW])?,
            plane,
            corrected,
            affine_residuals,
        })
    }

    /// In the order of [`QUANTITIES`].
    pub fn quantities(&self) -> [f64; 5] {
        [
            self.plane.rms_px,
            self.row_before.max_deviation(),
            self.row_after.max_deviation(),
            rms(&self.affine_residuals),
            self.affine_residuals.iter().map(Vec2::norm).fold(0.0, f64::max),
        ]
    }
}

pub fn line(points: &[Vec2]) -> Result<LineFit, ExperimentError> {
    LineFit::new(points).map_err(ExperimentError::at("line fit"))
}

pub fn rms(vectors: &[Vec2]) -> f64 {
    (vectors.iter().map(Vec2::norm_squared).sum::<f64>() / vectors.len() as f64).sqrt()
}

/// The chapter's point correction: pixels of the same `K` without distortion.
pub fn corrected(camera: &Camera, pixels: &[Vec2]) -> Result<Vec<Vec2>, ExperimentError> {
    let ideal = camera.with_distortion(Default::default());
    rectify_points(camera, &ideal, pixels)
        .into_iter()
        .collect::<Result<_, _>>()
        .map_err(ExperimentError::at("correction of points"))
}
