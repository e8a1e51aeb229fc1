//! Where might four squares meet? Places around which a level is bright, dark, bright, dark, with the
//! directions of both edges.
//!
//! Eight samples `f_k` on a circle of 3 px around every pixel of the smoothed level, as the ChESS detector
//! (Bennett & Lasenby 2014) takes sixteen. Its second harmonic is large where two edges cross, at any angle
//! between edges and rows: `R = C^2 + S^2 - E - M` with `C = f_0 - f_2 + f_4 - f_6`, `S = f_1 - f_3 + f_5 -
//! f_7`. `E`, the squared differences of opposite samples, removes straight edges and the places where a
//! board ends; `M`, 8 times the squared difference of circle and centre, removes lines and spots. Noise
//! enters `C^2 + S^2` and `E` alike, so `R` has no bias from it.
//!
//! At a maximum of `R` a quadric fitted to 5 x 5 samples gives the saddle point, and a circle of 32 samples
//! the edges: opposite samples are averaged (a crossing looks the same after half a turn), and their mean
//! must pass half-way between bright and dark exactly twice in half a turn. Nothing here depends on the
//! contrast, only on its ratio to the noise.

use super::level::Smoothed;
use crate::geometry::Vec2;
use crate::geometry::lanes::{Kernel, Lanes, dispatch};
use crate::raster::Raster;

/// A place where two edges seem to cross.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// Place in the level, px.
    pub at: Vec2,
    /// Unit directions of the edges; turning from the first to the second as from u to v, it is dark.
    pub axes: [Vec2; 2],
    /// Bright minus dark.
    pub contrast: f64,
}

/// Radius of the circle of eight, px; the four between the axes lie at 2.83 px.
const CIRCLE_PX: usize = 3;

/// Least `sqrt(R)` in standard deviations of the noise of `C`: pure noise exceeds it at one pixel in 500 at
/// most.
const LEAST_IN_NOISE: f64 = 3.5;

/// Least `sqrt(R)` as a fraction of the level's range, for images without noise: a contrast of 1/200 gives
/// twice this.
const LEAST_IN_RANGE: f64 = 0.005;

/// Least `sqrt(R)` of a corner that stands out, as a fraction of the level's range: a contrast of a tenth has
/// 0.15.
const STRONG_IN_RANGE: f64 = 0.15;

/// Responses that are looked at together.
const AT_ONCE: usize = 16;

/// How much a corner must stand out to be a candidate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Strength {
    /// Contrast of a tenth of the image's range. Texture has few of them.
    Strong,
    /// As little as the noise allows.
    Any,
}

/// The candidates of a level, row by row.
pub fn candidates(level: &Smoothed, strength: Strength) -> Vec<Candidate> {
    let image = level.image();
    let (width, height) = (image.width(), image.height());
    let margin = CIRCLE_PX + 2;
    if width < 2 * margin + 2 || height < 2 * margin + 2 {
        return Vec::new();
    }
    let circle = Circle::new();
    let least = (LEAST_IN_NOISE * 2.0 * level.noise()).max(LEAST_IN_RANGE * level.range());
    let least = if strength == Strength::Strong { least.max(STRONG_IN_RANGE * level.range()) } else { least };
    let least = (least * least) as f32;
    let mut found = Vec::new();
    // Responses of five rows: a pixel is compared with those two rows above and below.
    let mut rows = vec![vec![0.0f32; width]; 5];
    for y in CIRCLE_PX..height - CIRCLE_PX {
        dispatch(Responses { image, y, out: &mut rows[y % 5] });
        if y < margin + CIRCLE_PX - 1 {
            continue;
        }
        let middle = y - 2;
        let around = [-2isize, -1, 0, 1, 2].map(|d| &rows[(middle as isize + d) as usize % 5][..]);
        for from in (margin..width - margin).step_by(AT_ONCE) {
            let part = &around[2][from..(from + AT_ONCE).min(width - margin)];
            // Hardly a place stands out: many at once are passed over sooner than one by one.
            if !part.iter().fold(false, |any, response| any | (*response > least)) {
                continue;
            }
            let peaks = (from..from + part.len()).filter(|&x| around[2][x] > least && is_peak(&around, x));
            found.extend(peaks.filter_map(|x| candidate(level, &circle, (x, middle))));
        }
    }
    found
}

/// `R` of a row. A kernel, so that it is compiled for wide registers too.
struct Responses<'a> {
    image: &'a Raster<f32>,
    y: usize,
    out: &'a mut [f32],
}

impl Kernel for Responses<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Responses { image, y, out } = self;
        let n = image.width() - 2 * CIRCLE_PX;
        let part = |row: usize, from: usize| &image.row(row)[from..from + n];
        let (here, east, west) = (part(y, 3), part(y, 6), part(y, 0));
        let (north, south) = (part(y - 3, 3), part(y + 3, 3));
        let (north_east, north_west) = (part(y - 2, 5), part(y - 2, 1));
        let (south_east, south_west) = (part(y + 2, 5), part(y + 2, 1));
        let out = &mut out[CIRCLE_PX..CIRCLE_PX + n];
        for x in 0..n {
            let (e, w, above, below) = (east[x], west[x], north[x], south[x]);
            let (ne, nw, se, sw) = (north_east[x], north_west[x], south_east[x], south_west[x]);
            let (c, d) = ((e + w) - (above + below), (se + nw) - (sw + ne));
            let (p, q, r, t) = (e - w, above - below, se - nw, sw - ne);
            let mean = 0.125 * (((e + w) + (above + below)) + ((se + nw) + (sw + ne)));
            let spot = mean - here[x];
            out[x] = ((c * c + d * d) - ((p * p + q * q) + (r * r + t * t))) - 8.0 * (spot * spot);
        }
    }
}

/// Whether a response is the greatest of 5 x 5; of equal ones the last.
fn is_peak(around: &[&[f32]; 5], x: usize) -> bool {
    let here = around[2][x];
    let before = |row: &[f32]| row[x - 2..=x + 2].iter().all(|&r| r <= here);
    let after = |row: &[f32]| row[x - 2..=x + 2].iter().all(|&r| r < here);
    before(around[0])
        && before(around[1])
        && around[2][x - 2..x].iter().all(|&r| r <= here)
        && around[2][x + 1..=x + 2].iter().all(|&r| r < here)
        && after(around[3])
        && after(around[4])
}

/// Directions on half a circle.
const HALF: usize = 16;

/// Radius of the circle that shows the edges, px.
const EDGE_CIRCLE_PX: f64 = 3.5;

/// How far a saddle point may lie from its pixel, px.
const LARGEST_MOVE_PX: f64 = 1.5;

/// Largest part of the differences around the circle that may change sign over half a turn.
const LARGEST_ASYMMETRY: f64 = 0.5;

/// Least angle between the edges: 38 degrees is a board turned by 45 and tilted by 70 degrees.
const LEAST_SINE: f64 = 0.3;

/// Half a circle of unit directions.
struct Circle([Vec2; HALF]);

impl Circle {
    fn new() -> Circle {
        Circle(std::array::from_fn(|k| direction(k as f64)))
    }
}

/// The direction of a place on the half circle, in parts of it.
fn direction(k: f64) -> Vec2 {
    let (sine, cosine) = libm::sincos(std::f64::consts::PI * k / HALF as f64);
    Vec2::new(cosine, sine)
}

fn candidate(level: &Smoothed, circle: &Circle, (x, y): (usize, usize)) -> Option<Candidate> {
    let at = Vec2::new(x as f64, y as f64) + saddle_offset(level, (x, y))?;
    let (axes, contrast) = edges(level, circle, &at)?;
    Some(Candidate { at, axes, contrast })
}

/// The saddle point of the quadric through 5 x 5 samples by least squares, from their middle.
pub fn saddle_offset(level: &Smoothed, (x, y): (usize, usize)) -> Option<Vec2> {
    let (mut fx, mut fy, mut fxx, mut fxy, mut fyy, mut sum) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for dy in 0..5 {
        let row = &level.image().row(y + dy - 2)[x - 2..=x + 2];
        let v = dy as f64 - 2.0;
        for (dx, &sample) in row.iter().enumerate() {
            let (u, f) = (dx as f64 - 2.0, f64::from(sample));
            sum += f;
            fx += u * f;
            fy += v * f;
            fxx += u * u * f;
            fxy += u * v * f;
            fyy += v * v * f;
        }
    }
    // Sums over the 5 x 5 raster: u^2 50, u^2 v^2 100, u^4 - (u^2)^2 / 25 = 70.
    let gradient = Vec2::new(fx / 50.0, fy / 50.0);
    let (a, b, c) = ((fxx - 2.0 * sum) / 35.0, fxy / 100.0, (fyy - 2.0 * sum) / 35.0);
    let determinant = a * c - b * b;
    if determinant.is_nan() || determinant >= 0.0 {
        return None;
    }
    let offset = Vec2::new(b * gradient.y - c * gradient.x, b * gradient.x - a * gradient.y) / determinant;
    (offset.amax() <= LARGEST_MOVE_PX).then_some(offset)
}

/// The directions of both edges and the contrast.
fn edges(level: &Smoothed, circle: &Circle, at: &Vec2) -> Option<([Vec2; 2], f64)> {
    if !level.holds(at, EDGE_CIRCLE_PX + 0.5) {
        return None;
    }
    let mut even = [0.0; HALF];
    let (mut odd_square, mut mean) = (0.0, 0.0);
    for (even, direction) in even.iter_mut().zip(&circle.0) {
        let (a, b) =
            (level.at(&(at + direction * EDGE_CIRCLE_PX)), level.at(&(at - direction * EDGE_CIRCLE_PX)));
        *even = 0.5 * (a + b);
        odd_square += 0.25 * (a - b) * (a - b);
        mean += *even / HALF as f64;
    }
    let even_square: f64 = even.iter().map(|f| (f - mean) * (f - mean)).sum();
    if odd_square > LARGEST_ASYMMETRY * even_square {
        return None;
    }
    let smooth: [f64; HALF] = std::array::from_fn(|k| {
        0.25 * even[(k + HALF - 1) % HALF] + 0.5 * even[k] + 0.25 * even[(k + 1) % HALF]
    });
    let low = smooth.iter().copied().fold(f64::INFINITY, f64::min);
    let high = smooth.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let middle = 0.5 * (low + high);
    let (mut darker, mut brighter) = (None, None);
    for k in 0..HALF {
        let (here, next) = (smooth[k] - middle, smooth[(k + 1) % HALF] - middle);
        if (here >= 0.0) == (next >= 0.0) {
            continue;
        }
        let crossing = direction(k as f64 + here / (here - next));
        let side = if here >= 0.0 { &mut darker } else { &mut brighter };
        if side.replace(crossing).is_some() {
            return None;
        }
    }
    let (first, mut second) = (darker?, brighter?);
    if first.perp(&second) < 0.0 {
        second = -second;
    }
    (first.perp(&second) >= LEAST_SINE).then_some(([first, second], high - low))
}
