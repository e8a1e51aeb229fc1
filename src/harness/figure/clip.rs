//! Which part of a line lies inside the plot, and where do its dashes fall?

use super::canvas::Point;

/// The inside of a plot, px: left, top, right, bottom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frame {
    pub left: f64,
    pub top: f64,
    pub right: f64,
    pub bottom: f64,
}

impl Frame {
    pub(super) fn width(&self) -> f64 {
        self.right - self.left
    }

    pub(super) fn height(&self) -> f64 {
        self.bottom - self.top
    }

    /// Whether a point lies inside, edges included.
    pub(super) fn contains(&self, (x, y): Point) -> bool {
        (self.left..=self.right).contains(&x) && (self.top..=self.bottom).contains(&y)
    }

    /// The part of a segment inside the frame (Liang & Barsky 1984).
    fn clip_segment(&self, a: Point, b: Point) -> Option<(Point, Point)> {
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let edges =
            [(-dx, a.0 - self.left), (dx, self.right - a.0), (-dy, a.1 - self.top), (dy, self.bottom - a.1)];
        let (mut enter, mut leave) = (0.0f64, 1.0f64);
        for (towards, room) in edges {
            if towards == 0.0 {
                if room < 0.0 {
                    return None;
                }
            } else if towards < 0.0 {
                enter = enter.max(room / towards);
            } else {
                leave = leave.min(room / towards);
            }
        }
        let at = |t: f64| (a.0 + t * dx, a.1 + t * dy);
        (enter <= leave).then(|| (at(enter), at(leave)))
    }

    /// The connected parts of a line inside the frame. A point that is not finite interrupts the line.
    pub(super) fn clip_line(&self, points: &[Point]) -> Vec<Vec<Point>> {
        let finite = |p: Point| p.0.is_finite() && p.1.is_finite();
        let mut parts: Vec<Vec<Point>> = Vec::new();
        for pair in points.windows(2) {
            if !(finite(pair[0]) && finite(pair[1])) {
                continue;
            }
            let Some((a, b)) = self.clip_segment(pair[0], pair[1]) else { continue };
            match parts.last_mut() {
                Some(part) if part.last() == Some(&a) => part.push(b),
                _ => parts.push(vec![a, b]),
            }
        }
        parts
    }
}

/// Cuts a line into the strokes of a dash pattern (stroke, gap, stroke, gap, ... px); an empty pattern leaves
/// it whole.
pub(super) fn dashes(line: &[Point], pattern: &[f64]) -> Vec<Vec<Point>> {
    if pattern.is_empty() || line.len() < 2 {
        return vec![line.to_vec()];
    }
    let mut strokes = Vec::new();
    let mut stroke = vec![line[0]];
    let (mut index, mut left_px) = (0, pattern[0]);
    for pair in line.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        let length = libm::hypot(b.0 - a.0, b.1 - a.1);
        let at = |s: f64| (a.0 + s / length * (b.0 - a.0), a.1 + s / length * (b.1 - a.1));
        let mut done = 0.0;
        while length - done > left_px {
            done += left_px;
            if index % 2 == 0 {
                stroke.push(at(done));
                strokes.push(std::mem::take(&mut stroke));
            } else {
                stroke = vec![at(done)];
            }
            index = (index + 1) % pattern.len();
            left_px = pattern[index];
        }
        left_px -= length - done;
        if index % 2 == 0 {
            stroke.push(b);
        }
    }
    if stroke.len() > 1 {
        strokes.push(stroke);
    }
    strokes
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Frame = Frame { left: 0.0, top: 0.0, right: 10.0, bottom: 10.0 };

    #[test]
    fn a_line_is_cut_at_the_frame_and_at_holes() {
        let parts = FRAME.clip_line(&[(-5.0, 5.0), (15.0, 5.0)]);
        assert_eq!(parts, [[(0.0, 5.0), (10.0, 5.0)]]);
        let parts = FRAME.clip_line(&[(1.0, 1.0), (2.0, 1.0), (f64::NAN, 1.0), (4.0, 1.0), (5.0, 1.0)]);
        assert_eq!(parts.len(), 2);
        assert!(FRAME.clip_line(&[(-1.0, -1.0), (-1.0, 20.0)]).is_empty());
    }

    #[test]
    fn dashes_have_the_lengths_of_the_pattern_across_corners() {
        let strokes = dashes(&[(0.0, 0.0), (3.0, 0.0), (3.0, 7.0)], &[4.0, 2.0]);
        assert_eq!(strokes, [vec![(0.0, 0.0), (3.0, 0.0), (3.0, 1.0)], vec![(3.0, 3.0), (3.0, 7.0)]]);
        assert_eq!(dashes(&[(0.0, 0.0), (1.0, 0.0)], &[]).len(), 1);
    }
}
