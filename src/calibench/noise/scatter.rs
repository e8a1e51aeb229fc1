//! How large is the scatter, how sure is that, and what do coordinates have in common?

use super::COVERAGE;
use super::frames::Deviations;
use super::motion::Motion;
use crate::distribution::{ChiSquare, normal_two_sided};
use crate::downstream::coverage_factor;
use crate::evaluate::Interval;
use crate::geometry::Vec2;

/// A standard deviation with its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Deviation {
    /// Of one coordinate, px.
    pub value_px: f64,
    /// Where the true one lies ([`COVERAGE`]).
    pub interval_px: Interval,
    /// Degrees of freedom: `(n - 1) M`.
    pub degrees_of_freedom: f64,
}

/// A correlation with its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Correlation {
    /// The estimate; white noise has 0 on average.
    pub value: f64,
    /// Where the true one lies ([`COVERAGE`]).
    pub interval: Interval,
}

/// The scatter of all marks together.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Scatter {
    /// Of a coordinate, u and v together.
    pub sigma_px: Deviation,
    /// Of u.
    pub sigma_u_px: Deviation,
    /// Of v.
    pub sigma_v_px: Deviation,
    /// Independent coordinates among all marks' `M`: as many as there are, if the noise is white.
    pub independent_coordinates: f64,
    /// Of u and v of a mark; `None` of two frames, as all correlations.
    pub correlation_uv: Option<Correlation>,
    /// Of a coordinate with the same of the marks beside it.
    pub correlation_neighbours: Option<Correlation>,
    /// Of a coordinate with itself in the next frame.
    pub correlation_next_frame: Option<Correlation>,
}

impl Scatter {
    /// Of deviations from which the fields of a motion were taken; `pairs` are the marks side by side.
    pub(super) fn of(deviations: &Deviations, taken: &Motion, pairs: &[[usize; 2]]) -> Scatter {
        let of = |pick: fn(&Vec2) -> f64| -> Vec<Vec<f64>> {
            deviations.frames.iter().map(|frame| frame.iter().map(pick).collect()).collect()
        };
        let (u, v) = (of(|e| e.x), of(|e| e.y));
        let both: Vec<Vec<f64>> = u.iter().zip(&v).map(|(u, v)| [&u[..], &v[..]].concat()).collect();
        let left = taken.left();
        let independent = independent(&both, left.sum());
        let contrasts = deviations.contrasts();
        Scatter {
            sigma_px: deviation(&both, left.sum()),
            sigma_u_px: deviation(&u, left.x),
            sigma_v_px: deviation(&v, left.y),
            independent_coordinates: independent,
            correlation_uv: correlation_uv(&contrasts, taken),
            correlation_neighbours: neighbours(&contrasts, taken, pairs),
            correlation_next_frame: next_frame(&both, independent),
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn square(frames: &[Vec<f64>]) -> f64 {
    frames.iter().map(|frame| dot(frame, frame)).sum()
}

/// `s^2 = sum e^2 / ((n - 1) d)` of `d` coordinates, chi-squared with `(n - 1) M` degrees of freedom.
fn deviation(frames: &[Vec<f64>], coordinates: f64) -> Deviation {
    let repetitions = (frames.len() - 1) as f64;
    let value_px = (square(frames) / (repetitions * coordinates)).sqrt();
    let degrees_of_freedom = repetitions * independent(frames, coordinates);
    let (low, high) = factors(degrees_of_freedom);
    Deviation {
        value_px,
        interval_px: Interval { low: low * value_px, high: high * value_px },
        degrees_of_freedom,
    }
}

/// The true standard deviation over the estimated one, from and to, by `sqrt(freedom / chi-squared)`.
pub fn factors(freedom: f64) -> (f64, f64) {
    let Some(chi) = ChiSquare::with_freedom(freedom) else { return (0.0, f64::INFINITY) };
    let at = |p: f64| (freedom / chi.quantile(p)).sqrt();
    (at(0.5 * (1.0 + COVERAGE)), at(0.5 * (1.0 - COVERAGE)))
}

/// How many independent coordinates have the variance of the sum of squares that these have: `M = (tr S)^2 /
/// tr S^2` (Satterthwaite 1946), `S` the covariance of the coordinates, both parts estimated without bias
/// from its sample (Srivastava 2005): `tr S^2 = v^2 / ((v - 1)(v + 2)) (tr C^2 - (tr C)^2 / v)` of `v = n -
/// 1` degrees of freedom. Two frames cannot tell, and are taken for white.
fn independent(frames: &[Vec<f64>], coordinates: f64) -> f64 {
    let v = (frames.len() - 1) as f64;
    if v < 2.0 {
        return coordinates;
    }
    let trace = square(frames) / v;
    let trace_of_square =
        v * v / ((v - 1.0) * (v + 2.0)) * (square_of_gram(frames) / (v * v) - trace * trace / v);
    let square_of_trace = trace * trace - 2.0 / v * trace_of_square;
    let estimate = square_of_trace / trace_of_square;
    if trace_of_square > 0.0 { estimate.clamp(1.0, coordinates) } else { coordinates }
}

/// Sum of the squared products of all frames with each other, or, where there are more frames than
/// coordinates, of all coordinates: it is the same.
fn square_of_gram(frames: &[Vec<f64>]) -> f64 {
    let coordinates = frames[0].len();
    if frames.len() > coordinates {
        let turned: Vec<Vec<f64>> =
            (0..coordinates).map(|i| frames.iter().map(|frame| frame[i]).collect()).collect();
        return products(&turned);
    }
    products(frames)
}

fn products(rows: &[Vec<f64>]) -> f64 {
    let mut sum = 0.0;
    for (i, row) in rows.iter().enumerate() {
        sum += dot(row, row) * dot(row, row);
        sum += 2.0 * rows[i + 1..].iter().map(|other| dot(row, other) * dot(row, other)).sum::<f64>();
    }
    sum
}

/// A ratio of sums over independent contrasts of the frames: `r = sum a / sum b`, of variance `k / (k - 1)
/// sum (a - r b)^2 / (sum b)^2` of `k` contrasts (Cochran 1977, section 2.11), Student's with `k - 1` degrees
/// of freedom. `white` is what white noise has, and is taken off.
fn ratio(a: &[f64], b: &[f64], white: f64) -> Option<Correlation> {
    let (k, sum) = (a.len() as f64, b.iter().sum::<f64>());
    if k < 2.0 {
        return None;
    }
    let raw = a.iter().sum::<f64>() / sum;
    let scatter: f64 = a.iter().zip(b).map(|(a, b)| (a - raw * b) * (a - raw * b)).sum();
    let half = coverage_factor(COVERAGE, Some(k - 1.0)) * (k / (k - 1.0) * scatter).sqrt() / sum;
    let value = raw - white;
    Some(Correlation {
        value,
        interval: Interval { low: (value - half).max(-1.0), high: (value + half).min(1.0) },
    })
}

/// Sums over all marks, contrast by contrast.
fn sums(contrasts: &[Vec<Vec2>], of: impl Fn(&Vec2) -> f64) -> Vec<f64> {
    contrasts.iter().map(|contrast| contrast.iter().map(&of).sum()).collect()
}

fn correlation_uv(contrasts: &[Vec<Vec2>], taken: &Motion) -> Option<Correlation> {
    let (uu, vv) = (sums(contrasts, |z| z.x * z.x), sums(contrasts, |z| z.y * z.y));
    let (su, sv) = (uu.iter().sum::<f64>(), vv.iter().sum::<f64>());
    let product: Vec<f64> = sums(contrasts, |z| z.x * z.y).iter().map(|uv| uv / (su * sv).sqrt()).collect();
    let size: Vec<f64> = uu.iter().zip(&vv).map(|(uu, vv)| 0.5 * (uu / su + vv / sv)).collect();
    let left = taken.left();
    ratio(&product, &size, taken.covariance_uv() / (left.x * left.y).sqrt())
}

fn neighbours(contrasts: &[Vec<Vec2>], taken: &Motion, pairs: &[[usize; 2]]) -> Option<Correlation> {
    let of = |pair: fn(&Vec2, &Vec2) -> f64| -> Vec<f64> {
        let sum = |contrast: &Vec<Vec2>| pairs.iter().map(|&[a, b]| pair(&contrast[a], &contrast[b])).sum();
        contrasts.iter().map(sum).collect()
    };
    let product = of(|a, b| a.dot(b));
    let size = of(|a, b| 0.5 * (a.norm_squared() + b.norm_squared()));
    let covariance: f64 = pairs.iter().map(|&pair| taken.covariance(pair)).sum();
    let variance: f64 =
        pairs.iter().map(|&[a, b]| 0.5 * (taken.left_of(a).sum() + taken.left_of(b).sum())).sum();
    ratio(&product, &size, covariance / variance)
}

/// Correlation with the next frame by squared differences, which the mean does not enter:
/// `C = 1 - sum (e_t+1 - e_t)^2 / (2 sum e_t^2)`, 0 for white noise, of variance `(n - 2) / ((n - 1)(n + 1))` a
/// coordinate (von Neumann 1941, Young 1941).
fn next_frame(frames: &[Vec<f64>], independent: f64) -> Option<Correlation> {
    let n = frames.len() as f64;
    if n < 3.0 {
        return None;
    }
    let difference = |pair: &[Vec<f64>]| -> f64 {
        pair[1].iter().zip(&pair[0]).map(|(next, here)| (next - here) * (next - here)).sum()
    };
    let differences: f64 = frames.windows(2).map(difference).sum();
    let apparent = 1.0 - differences / (2.0 * square(frames));
    let deviation = ((n - 2.0) / ((n - 1.0) * (n + 1.0) * independent)).sqrt();
    let half = normal_two_sided(1.0 - COVERAGE) * deviation;
    let of = |apparent: f64| fading(apparent, frames.len());
    Some(Correlation {
        value: of(apparent),
        interval: Interval { low: of(apparent - half), high: of(apparent + half) },
    })
}

/// The correlation with the next frame that shows as `apparent` where it falls by the same factor `r` with
/// every frame: squares about a mean of `n` are then `1 - 2 / (n - 1) sum (1 - k / n) r^k` of what they
/// should be.
fn fading(apparent: f64, n: usize) -> f64 {
    let shows = |r: f64| {
        let (mut power, mut sum) = (1.0, 0.0);
        for k in 1..n {
            power *= r;
            sum += (1.0 - k as f64 / n as f64) * power;
        }
        1.0 - (1.0 - r) / (1.0 - 2.0 / (n as f64 - 1.0) * sum)
    };
    // It grows with r.
    let (mut low, mut high) = (-1.0, 1.0 - 1e-9);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if shows(middle) < apparent {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Most frames that are counted on: more than anybody takes.
const MOST_FRAMES: usize = 1 << 30;

/// Frames after which the interval of a standard deviation lies within `precision` of the estimate on both
/// sides, of so many independent coordinates a frame; `2^30` where no number of frames that anybody takes is
/// enough.
///
/// ```
/// // One coordinate alone to 10 %: 234 frames; 118 of them together: 3.
/// use calibench::noise::frames_for;
///
/// assert!(frames_for(0.1, 1.0) > 200 && frames_for(0.1, 118.0) <= 4);
/// ```
pub fn frames_for(precision: f64, independent: f64) -> usize {
    let enough = |frames: usize| {
        let (low, high) = factors((frames - 1) as f64 * independent);
        high - 1.0 <= precision && 1.0 - low <= precision
    };
    let mut most = 2;
    while !enough(most) && most < MOST_FRAMES {
        most *= 2;
    }
    let mut least = 1.max(most / 2);
    while most - least > 1 {
        let middle = least + (most - least) / 2;
        if enough(middle) { most = middle } else { least = middle }
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fading_correlation_is_found_behind_what_shows() {
        // By hand, n = 3, r = 1/2: squares about the mean are 1 - (2/3 r + 1/3 r^2) = 7/12 of what they
        // should be, so that 1 - (1/2) / (7/12) = 1/7 shows.
        assert!((fading(1.0 / 7.0, 3) - 0.5).abs() < 1e-9);
        assert!(fading(0.0, 12).abs() < 1e-9);
    }

    #[test]
    fn equal_and_single_coordinates_count_as_what_they_are() {
        // Hadamard's columns are orthogonal: frames of three coordinates that have nothing in common, and of
        // one thrice.
        let signs = [[1.0, 1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0]];
        let white: Vec<Vec<f64>> = signs.iter().map(|s| s.to_vec()).collect();
        let equal: Vec<Vec<f64>> = signs.iter().map(|s| vec![s[0]; 3]).collect();
        assert_eq!(independent(&white, 3.0), 3.0);
        // (tr)^2 / tr S^2 of one coordinate is 1, or less by the correction for small samples.
        assert_eq!(independent(&equal, 3.0), 1.0);
        // The sum of squared products is the same by frames and by coordinates.
        let turned: Vec<Vec<f64>> = (0..3).map(|i| signs.iter().map(|s| s[i]).collect()).collect();
        assert_eq!(products(&white), products(&turned));
    }

    #[test]
    fn more_frames_or_coordinates_are_needed_for_more_precision() {
        for precision in [0.3, 0.1, 0.03] {
            let frames = frames_for(precision, 10.0);
            let (low, high) = factors(10.0 * (frames - 1) as f64);
            assert!(high - 1.0 <= precision && 1.0 - low <= precision);
            let (_, high) = factors(10.0 * (frames - 2) as f64);
            assert!(high - 1.0 > precision);
            // The normal approximation: a relative standard deviation of 1 / sqrt(2 v).
            let normal = 1.96 * 1.96 / (2.0 * precision * precision) / 10.0;
            assert!((frames as f64 / normal) < 2.0 + 4.0 / normal, "{frames} {normal}");
        }
        // A mark alone.
        assert!(frames_for(0.1, 1.0) > 200 && frames_for(0.1, 1.0) < 300);
    }
}
