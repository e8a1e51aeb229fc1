//! How much do the marks of a board scatter that nobody touches? The noise of extraction, measured from
//! repeated photographs, with no camera in it.
//!
//! ```text
//! e_ti = p_ti - mean over t of p_ti        mark i of m, frame t of n
//! ```
//! Whatever lens and target are, `e` is noise, and what moved between the frames. What moved as a whole is
//! one of eight fields, those by which the image of a plane can change (`motion.rs`); a calibration's poses
//! take it up. So everything is stated twice: as it was seen, and within the frames, the eight fields taken
//! off. The second is the noise that a calibration meets.
//!
//! A variance has its interval from chi-squared with as many degrees of freedom as there are independent
//! numbers: `(n - 1) M`, with `M` between 1 and the number of coordinates estimated from the data too
//! (`scatter.rs`). The correlations take the frames for independent repetitions, and the correlation of a
//! frame with the next asks whether they are. `still.rs` tests for motion, drift and marks that follow the
//! light.

mod frames;
mod motion;
mod scatter;
mod still;

pub use scatter::{Correlation, Deviation, Scatter, frames_for};
pub use still::{Stillness, Test};

use crate::board::View;
use crate::distribution::fisher_tail;
use crate::geometry::Vec2;
use frames::{Deviations, Frames};
use motion::Motion;

/// Probability that an interval contains the true value.
pub const COVERAGE: f64 = 0.95;

/// Fewest marks: twelve coordinates, of which eight fields leave four.
const FEWEST_MARKS: usize = 6;

/// Why frames tell no noise.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoiseError {
    /// One photograph has no scatter.
    #[error(
        "{got} frames of a still board: noise is what changes from frame to frame, which takes {need} at least"
    )]
    TooFewFrames {
        /// Fewest.
        need: usize,
        /// Frames given.
        got: usize,
    },
    /// Too few marks that all frames have.
    #[error(
        "{common} marks are seen in every frame: {need} at least are needed, of which motion takes eight coordinates"
    )]
    TooFewMarks {
        /// Fewest.
        need: usize,
        /// Marks in all frames.
        common: usize,
    },
    /// Frames that are one.
    #[error(
        "frames {first} and {second} have the same marks to the last bit: a copy says nothing of the noise"
    )]
    Copies {
        /// Index of the first of them.
        first: usize,
        /// Index of the other.
        second: usize,
    },
    /// The board was not still.
    #[error(
        "mark ({x}, {y}) lies {moved_px:.1} px from where the first frame has it in frame {frame}, more than a quarter of the way to \
         its neighbour: the board or the camera was moved, or the marks are numbered from another end"
    )]
    Moved {
        /// Index of the frame.
        frame: usize,
        /// The mark on the target.
        x: f64,
        /// See `x`.
        y: f64,
        /// How far it moved.
        moved_px: f64,
    },
    /// A measure of the light for some of the frames only, or one that is no number.
    #[error("{frames} frames, but {light} finite levels of their light")]
    Light {
        /// Frames.
        frames: usize,
        /// Finite levels.
        light: usize,
    },
}

/// What one mark does, within the frames.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct MarkNoise {
    /// Its place on the target.
    pub point: Vec2,
    /// Its mean place in the frames, px.
    pub mean_px: Vec2,
    /// Standard deviation of u and of v, px.
    pub sigma_px: Vec2,
    /// Correlation of u and v.
    pub correlation_uv: f64,
    /// Chance that one of all marks scatters so much more than the others, if all have the same noise
    /// (Bonferroni).
    pub p_value: f64,
}

/// How a frame lies against the mean of all.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct FrameMotion {
    /// Mean shift of the marks, px.
    pub shift_px: Vec2,
    /// Root mean square of what the marks moved as a whole, px.
    pub rms_px: f64,
}

/// The noise of extraction.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ExtractionNoise {
    /// Scatter with all that moved.
    pub as_seen: Scatter,
    /// Scatter within the frames: what a calibration meets.
    pub within: Scatter,
    /// Whether anything but noise changed.
    pub still: Stillness,
    /// Mark by mark, in the first frame's order.
    pub marks: Vec<MarkNoise>,
    /// Frame by frame.
    pub frames: Vec<FrameMotion>,
    /// Marks that some frame lacks, left out.
    pub marks_left_out: usize,
}

impl ExtractionNoise {
    /// Factors of a mark's standard deviations between which the true one lies ([`COVERAGE`]).
    pub fn factors_of_a_mark(&self) -> (f64, f64) {
        scatter::factors((self.frames.len() - 1) as f64)
    }
}

/// The noise of extraction from photographs of a board that nobody touched, in the order in which they were
/// taken.
///
/// `light` has a measure of each frame's light in any unit, for a test whether marks follow it; `false_alarm`
/// is the rate of each test.
///
/// # Errors
/// See [`NoiseError`].
///
/// ```
/// use calibench::noise::extraction_noise;
/// use calibench::synth::{Scene, Stream, StreamKey};
///
/// // The same view twelve times, with noise of 0.05 px.
/// let mut noise = Stream::open(StreamKey { seed: 1, scenario: "still", trial: 0, purpose: "noise" });
/// let frames: Vec<_> = (0..12).map(|_| Scene::example().observe(0.05, &mut noise)[0].clone()).collect();
/// let measured = extraction_noise(&frames, None, 0.01)?;
/// assert!(measured.still.holds());
/// assert!(measured.within.sigma_px.interval_px.contains(0.05));
/// // One photograph has no scatter.
/// assert!(extraction_noise(&frames[..1], None, 0.01).is_err());
/// # Ok::<(), calibench::noise::NoiseError>(())
/// ```
pub fn extraction_noise(
    frames: &[View],
    light: Option<&[f64]>,
    false_alarm: f64,
) -> Result<ExtractionNoise, NoiseError> {
    let frames = Frames::of(frames)?;
    let light = centred_light(light, frames.count())?;
    let seen = frames.deviations();
    let motion = Motion::of(&frames.mean_px);
    let (moved, rest) = motion.split(&seen);
    let pairs = frames.neighbours();
    Ok(ExtractionNoise {
        as_seen: Scatter::of(&seen, &Motion::none(frames.mean_px.len()), &pairs),
        within: Scatter::of(&rest, &motion, &pairs),
        still: Stillness::of(&moved, &rest, &motion, light.as_deref(), false_alarm),
        marks: marks(&frames, &rest, &motion),
        frames: moved.frames.iter().map(|frame| FrameMotion::of(frame)).collect(),
        marks_left_out: frames.left_out,
    })
}

/// The light of each frame less the mean; `None` where it never changed.
fn centred_light(light: Option<&[f64]>, frames: usize) -> Result<Option<Vec<f64>>, NoiseError> {
    let Some(light) = light else { return Ok(None) };
    let finite = light.iter().filter(|level| level.is_finite()).count();
    if finite != frames || light.len() != frames {
        return Err(NoiseError::Light { frames, light: finite });
    }
    let mean = light.iter().sum::<f64>() / frames as f64;
    let centred: Vec<f64> = light.iter().map(|level| level - mean).collect();
    Ok(centred.iter().any(|level| *level != 0.0).then_some(centred))
}

impl FrameMotion {
    fn of(moved: &[Vec2]) -> FrameMotion {
        let count = moved.len() as f64;
        let square = moved.iter().map(Vec2::norm_squared).sum::<f64>() / count;
        FrameMotion { shift_px: moved.iter().sum::<Vec2>() / count, rms_px: square.sqrt() }
    }
}

fn marks(frames: &Frames, rest: &Deviations, motion: &Motion) -> Vec<MarkNoise> {
    let freedom = rest.freedom();
    let squares: Vec<Vec2> = (0..rest.marks()).map(|mark| rest.squares(mark)).collect();
    let left: Vec<Vec2> = (0..rest.marks()).map(|mark| motion.left_of(mark)).collect();
    let (all, all_left) = (squares.iter().sum::<Vec2>().sum(), left.iter().sum::<Vec2>().sum());
    let mark = |mark: usize| {
        let (square, left) = (squares[mark], left[mark]);
        let products: f64 = rest.frames.iter().map(|frame| frame[mark].x * frame[mark].y).sum();
        let own = square.sum() / left.sum();
        let others = (all - square.sum()) / (all_left - left.sum());
        let more = fisher_tail(own / others, 2 * freedom, 2 * freedom * (rest.marks() - 1));
        MarkNoise {
            point: frames.points[mark],
            mean_px: frames.mean_px[mark],
            sigma_px: (square.component_div(&left) / freedom as f64).map(f64::sqrt),
            correlation_uv: products / (square.x * square.y).sqrt(),
            p_value: (more * rest.marks() as f64).min(1.0),
        }
    };
    (0..rest.marks()).map(mark).collect()
}
