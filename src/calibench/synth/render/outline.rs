//! Where does the edge of a mark run in the image? Smooth pieces of outline, cut into arcs that are nearly
//! straight.

use super::window::{Side, Window};
use crate::geometry::Vec2;

/// A smooth piece of a mark's outline on the board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Piece {
    /// A whole circle.
    Circle {
        /// Centre.
        centre: Vec2,
        /// Radius.
        radius: f64,
    },
    /// A straight edge.
    Edge {
        /// Start.
        from: Vec2,
        /// End.
        to: Vec2,
    },
}

impl Piece {
    /// The point at parameter `t` in 0 ... 1.
    pub fn at(&self, t: f64) -> Vec2 {
        match *self {
            Piece::Circle { centre, radius } => {
                let angle = std::f64::consts::TAU * t;
                centre + Vec2::new(libm::cos(angle), libm::sin(angle)) * radius
            }
            Piece::Edge { from, to } => from + (to - from) * t,
        }
    }

    /// Parts into which the piece is cut before its curvature is looked at, so that no turn hides between
    /// samples.
    pub fn start_parts(&self) -> usize {
        match self {
            Piece::Circle { .. } => 16,
            Piece::Edge { .. } => 4,
        }
    }
}

/// The closed outline of a region.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    /// Its pieces, end to start.
    pub pieces: Vec<Piece>,
}

impl Outline {
    /// A disc.
    pub fn disc(centre: Vec2, radius: f64) -> Outline {
        Outline { pieces: vec![Piece::Circle { centre, radius }] }
    }

    /// An upright rectangle.
    pub fn rectangle(low: Vec2, high: Vec2) -> Outline {
        let corners = [low, Vec2::new(high.x, low.y), high, Vec2::new(low.x, high.y)];
        let pieces = (0..4).map(|i| Piece::Edge { from: corners[i], to: corners[(i + 1) % 4] }).collect();
        Outline { pieces }
    }
}

/// A short arc of the projected outline, given by its ends and the point in its middle: the parabola
/// `p(t) = from + (4 middle - 3 from - to) t + (2 from - 4 middle + 2 to) t^2`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    /// Start, px.
    pub from: Vec2,
    /// The point at half the parameter, px.
    pub middle: Vec2,
    /// End, px.
    pub to: Vec2,
}

impl Arc {
    /// Signed area between the arc and its chord, `2/3 (middle - from) x (to - from)`, exact for a parabola
    /// (Archimedes): what the chord lacks of `1/2 oint (x dy - y dx)`.
    pub fn sliver(&self) -> f64 {
        let (a, b) = (self.middle - self.from, self.to - self.from);
        (a.x * b.y - a.y * b.x) * (2.0 / 3.0)
    }
}

/// When is an arc short enough?
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steps {
    /// Largest sliver, px^2.
    pub sliver: f64,
    /// Longest chord, px.
    pub chord_px: f64,
}

impl Steps {
    /// An arc enters the sharp image as two chords plus the two slivers between chord and arc, each an eighth
    /// of the arc's own. A sliver that straddles pixels is credited to one of them; 8e-7 / 8 = 1e-7 bounds
    /// that error, and an outline passes a pixel's border only a few times.
    pub const SHARP: Steps = Steps { sliver: 8e-7, chord_px: f64::INFINITY };
}

/// Halvings of a part of a piece: the parameter's double precision has no more.
const MAX_HALVINGS: u32 = 48;

/// Cuts a curve over t in 0 ... 1 into arcs and hands them on in order. What the image does not see is left
/// out, and what lies far to its left becomes a straight line, however long it is: the cost is bounded by the
/// image.
pub fn trace<E>(
    curve: &impl Fn(f64) -> Result<Vec2, E>,
    parts: usize,
    steps: &Steps,
    window: &Window,
    emit: &mut impl FnMut(&Arc),
) -> Result<(), E> {
    let mut from = curve(0.0)?;
    for part in 0..parts {
        let span = (part as f64 / parts as f64, (part + 1) as f64 / parts as f64);
        let to = curve(span.1)?;
        halve(curve, span, (from, to), MAX_HALVINGS, &Cut { steps, window }, emit)?;
        from = to;
    }
    Ok(())
}

/// Where an arc ends, and where it need not be followed.
struct Cut<'a> {
    steps: &'a Steps,
    window: &'a Window,
}

fn halve<E>(
    curve: &impl Fn(f64) -> Result<Vec2, E>,
    (start, end): (f64, f64),
    (from, to): (Vec2, Vec2),
    halvings: u32,
    cut: &Cut<'_>,
    emit: &mut impl FnMut(&Arc),
) -> Result<(), E> {
    let half = 0.5 * (start + end);
    let arc = Arc { from, middle: curve(half)?, to };
    match cut.window.side(&arc) {
        Side::Unseen => return Ok(()),
        Side::FarLeft => {
            cut.window.down_the_left(&arc, cut.steps.chord_px).for_each(|arc| emit(&arc));
            return Ok(());
        }
        Side::Seen => {}
    }
    let Cut { steps, .. } = cut;
    let short = arc.sliver().abs() <= steps.sliver && (to - from).norm() <= steps.chord_px;
    if short || halvings == 0 {
        emit(&arc);
        return Ok(());
    }
    halve(curve, (start, half), (from, arc.middle), halvings - 1, cut, emit)?;
    halve(curve, (half, end), (arc.middle, to), halvings - 1, cut, emit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    #[test]
    fn the_slivers_of_a_circle_complete_its_polygon() {
        let circle = Piece::Circle { centre: Vec2::new(3.0, -2.0), radius: 7.5 };
        let curve = |t: f64| Ok::<_, Infallible>(circle.at(t));
        let (mut polygon, mut slivers) = (0.0, 0.0);
        trace(&curve, circle.start_parts(), &Steps::SHARP, &Window::ALL, &mut |arc| {
            polygon += 0.5 * (arc.from.x * arc.to.y - arc.from.y * arc.to.x);
            slivers += arc.sliver();
        })
        .unwrap();
        let area = std::f64::consts::PI * 7.5 * 7.5;
        // The parabola's error is of order (arc / radius)^2 = 1e-5 of the slivers' 1e-3 px^2 or less.
        assert!((polygon + slivers - area).abs() < 1e-8, "{:e}", polygon + slivers - area);
        assert!((polygon - area).abs() > 1e-5, "the chords alone are not enough");
    }
}
