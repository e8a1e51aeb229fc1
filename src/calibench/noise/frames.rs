//! Which marks do all frames have, where are they on average, and how far is each frame from there?

use super::{FEWEST_MARKS, NoiseError};
use crate::board::View;
use crate::geometry::Vec2;
use std::collections::BTreeMap;

/// How far a mark may lie from where the first frame has it, as part of the distance to its nearest
/// neighbour. Beyond half it may be the neighbour.
const LARGEST_MOVE: f64 = 0.25;

/// Marks whose distance on the target exceeds the least by no more than this are neighbours too.
const EQUAL_DISTANCES: f64 = 1.01;

/// The marks that all frames have.
pub struct Frames {
    /// Their places on the target.
    pub points: Vec<Vec2>,
    /// Their mean places, px.
    pub mean_px: Vec<Vec2>,
    /// Marks that some frame lacks.
    pub left_out: usize,
    pixels: Vec<Vec<Vec2>>,
}

/// Distances of marks from their means, frame by frame, px.
pub struct Deviations {
    pub frames: Vec<Vec<Vec2>>,
}

impl Frames {
    pub fn of(views: &[View]) -> Result<Frames, NoiseError> {
        if views.len() < 2 {
            return Err(NoiseError::TooFewFrames { need: 2, got: views.len() });
        }
        // A point of the target is told from others by its bits.
        let key = |p: &Vec2| (p.x.to_bits(), p.y.to_bits());
        let seen: Vec<BTreeMap<(u64, u64), Vec2>> = views
            .iter()
            .map(|view| view.pairs().map(|(point, pixel)| (key(point), *pixel)).collect())
            .collect();
        let everywhere = |point: &&Vec2| seen.iter().all(|frame| frame.contains_key(&key(point)));
        let points: Vec<Vec2> = views[0].points().iter().filter(everywhere).copied().collect();
        if points.len() < FEWEST_MARKS {
            return Err(NoiseError::TooFewMarks { need: FEWEST_MARKS, common: points.len() });
        }
        let most = seen.iter().map(BTreeMap::len).max().unwrap_or_default();
        let left_out = most.saturating_sub(points.len());
        let pixels: Vec<Vec<Vec2>> =
            seen.iter().map(|frame| points.iter().map(|point| frame[&key(point)]).collect()).collect();
        let mean =
            |mark: usize| pixels.iter().map(|f: &Vec<Vec2>| f[mark]).sum::<Vec2>() / pixels.len() as f64;
        let mean_px = (0..points.len()).map(mean).collect();
        let frames = Frames { points, mean_px, left_out, pixels };
        frames.refuse_copies()?;
        frames.refuse_moved()?;
        Ok(frames)
    }

    pub fn count(&self) -> usize {
        self.pixels.len()
    }

    fn refuse_copies(&self) -> Result<(), NoiseError> {
        let mut first = BTreeMap::new();
        for (second, pixels) in self.pixels.iter().enumerate() {
            let bits: Vec<u64> = pixels.iter().flat_map(|p| [p.x.to_bits(), p.y.to_bits()]).collect();
            if let Some(first) = first.insert(bits, second) {
                return Err(NoiseError::Copies { first, second });
            }
        }
        Ok(())
    }

    fn refuse_moved(&self) -> Result<(), NoiseError> {
        let first = &self.pixels[0];
        let nearest = self.neighbours().into_iter().map(|[a, b]| (first[a] - first[b]).norm());
        let limit = LARGEST_MOVE * nearest.fold(f64::INFINITY, f64::min);
        for (frame, pixels) in self.pixels.iter().enumerate() {
            for ((pixel, there), point) in pixels.iter().zip(first).zip(&self.points) {
                let moved_px = (pixel - there).norm();
                if moved_px > limit {
                    return Err(NoiseError::Moved { frame, x: point.x, y: point.y, moved_px });
                }
            }
        }
        Ok(())
    }

    pub fn deviations(&self) -> Deviations {
        let from_mean =
            |frame: &Vec<Vec2>| frame.iter().zip(&self.mean_px).map(|(p, mean)| p - mean).collect();
        Deviations { frames: self.pixels.iter().map(from_mean).collect() }
    }

    /// Pairs of marks that lie side by side on the target: those at the least distance that there is.
    pub fn neighbours(&self) -> Vec<[usize; 2]> {
        let extent = |axis: usize| {
            let of =
                |pick: fn(f64, f64) -> f64, start: f64| self.points.iter().map(|p| p[axis]).fold(start, pick);
            of(f64::max, f64::NEG_INFINITY) - of(f64::min, f64::INFINITY)
        };
        // Along the longer side few marks stand at the same place.
        let axis = if extent(1) > extent(0) { 1 } else { 0 };
        let mut order: Vec<usize> = (0..self.points.len()).collect();
        let place = |mark: usize| self.points[mark];
        order.sort_by(|&a, &b| {
            place(a)[axis].total_cmp(&place(b)[axis]).then(place(a)[1 - axis].total_cmp(&place(b)[1 - axis]))
        });
        let mut least = f64::INFINITY;
        self.each_pair(&order, axis, |_, distance, reach| {
            least = least.min(distance);
            *reach = least;
        });
        let mut pairs = Vec::new();
        self.each_pair(&order, axis, |pair, distance, reach| {
            *reach = EQUAL_DISTANCES * least;
            if distance <= *reach {
                pairs.push(pair);
            }
        });
        pairs
    }

    /// Hands on pairs no farther apart along an axis than the reach, which the receiver may set.
    fn each_pair(&self, order: &[usize], axis: usize, mut take: impl FnMut([usize; 2], f64, &mut f64)) {
        let mut reach = f64::INFINITY;
        for (place, &a) in order.iter().enumerate() {
            for &b in &order[place + 1..] {
                if self.points[b][axis] - self.points[a][axis] > reach {
                    break;
                }
                take([a, b], (self.points[a] - self.points[b]).norm(), &mut reach);
            }
        }
    }
}

impl Deviations {
    pub fn marks(&self) -> usize {
        self.frames[0].len()
    }

    /// Frames less the one that the mean takes.
    pub fn freedom(&self) -> usize {
        self.frames.len() - 1
    }

    /// `n - 1` contrasts of the frames, `z_k = (e_1 + ... + e_k - k e_(k + 1)) / sqrt(k (k + 1))` (Helmert):
    /// independent where the frames are, with the frames' sums of squares and products.
    pub fn contrasts(&self) -> Vec<Vec<Vec2>> {
        let mut sum = vec![Vec2::zeros(); self.marks()];
        let mut contrasts = Vec::new();
        for (k, pair) in self.frames.windows(2).enumerate() {
            let k = k as f64 + 1.0;
            sum.iter_mut().zip(&pair[0]).for_each(|(sum, e)| *sum += e);
            let scale = (k * (k + 1.0)).sqrt();
            contrasts.push(sum.iter().zip(&pair[1]).map(|(sum, next)| (sum - next * k) / scale).collect());
        }
        contrasts
    }

    /// Sums of a mark's squares, of u and of v.
    pub fn squares(&self, mark: usize) -> Vec2 {
        self.frames.iter().map(|frame| frame[mark].component_mul(&frame[mark])).sum()
    }

    /// Sum of all squares.
    pub fn square(&self) -> f64 {
        self.frames.iter().flatten().map(Vec2::norm_squared).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::Board;

    #[test]
    fn neighbours_are_those_along_rows_and_columns() {
        let points = Board::chessboard(9, 6, 25.0).unwrap().points();
        let frames = Frames {
            mean_px: points.clone(),
            pixels: vec![points.clone()],
            points: points.clone(),
            left_out: 0,
        };
        let pairs = frames.neighbours();
        assert_eq!(pairs.len(), 8 * 6 + 9 * 5);
        assert!(pairs.iter().all(|&[a, b]| ((points[a] - points[b]).norm() - 25.0).abs() < 1e-9));
    }

    #[test]
    fn marks_are_matched_by_their_place_on_the_target() {
        let points = Board::chessboard(4, 3, 1.0).unwrap().points();
        let pixels = |shift: f64| points.iter().map(|p| 30.0 * p + Vec2::new(shift, 0.0)).collect::<Vec<_>>();
        let first = View::new(points.clone(), pixels(0.0)).unwrap();
        let (mut turned, mut their) = (points.clone(), pixels(0.5));
        turned.reverse();
        their.reverse();
        let second = View::new(turned[2..].to_vec(), their[2..].to_vec()).unwrap();
        let frames = Frames::of(&[first.clone(), second]).unwrap();
        assert_eq!((frames.points.len(), frames.left_out), (10, 2));
        assert!(frames.deviations().frames[1].iter().all(|e| (e - Vec2::new(0.25, 0.0)).norm() < 1e-12));
        // Numbered from the other end, and the same frame again.
        let reversed = View::new(turned, pixels(0.1)).unwrap();
        assert!(matches!(Frames::of(&[first.clone(), reversed]), Err(NoiseError::Moved { frame: 1, .. })));
        let copies = NoiseError::Copies { first: 0, second: 1 };
        assert_eq!(Frames::of(&[first.clone(), first]).err(), Some(copies));
    }
}
