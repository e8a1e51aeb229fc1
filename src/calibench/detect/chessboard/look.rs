//! How do the squares about a corner look? Plain, as on a chessboard, or with a marker inside of the bright
//! ones, or of two sizes, as on a grid of tags.

/// What the search and the fit of corners must know of the squares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// How far beside an edge its two sides are compared, at most, in lengths of the edge.
    pub beside: f64,
    /// Where a square's level is sampled, in steps from its corner along both edges.
    pub samples: [(f64, f64); 4],
    /// Nearest candidates among which a corner looks for its first neighbours: noise, texture and a marker's
    /// cells may stand between.
    pub nearest: usize,
    /// How wide the squares are plain along their edges, in steps; `None`: all over.
    pub plain: Option<f64>,
    /// Distance of corners between two tags, as part of the distance of the corners of one; `None`: all
    /// squares are equal.
    pub between_tags: Option<f64>,
}

/// Places of a plain square's samples, in steps from the corner.
const NEAR: f64 = 0.16;
const FAR: f64 = 0.34;

impl Look {
    /// Of a chessboard.
    pub const PLAIN: Look = Look {
        beside: 0.3,
        samples: [(NEAR, NEAR), (NEAR, FAR), (FAR, NEAR), (FAR, FAR)],
        nearest: 20,
        plain: None,
        between_tags: None,
    };

    /// Of a chessboard with markers, whose sides are this part of a square's, in the middle of the bright
    /// squares.
    pub fn with_markers(marker: f64) -> Look {
        let plain = 0.5 * (1.0 - marker);
        let middle = 0.5 * plain;
        Look {
            beside: middle,
            samples: [(middle, 0.2), (0.2, middle), (middle, 0.38), (0.38, middle)],
            nearest: 40,
            plain: Some(plain),
            between_tags: None,
        }
    }

    /// Of a grid of tags `between` of their sides apart, with small squares at their corners.
    pub fn of_tags(between: f64) -> Look {
        Look { between_tags: Some(between), ..Look::PLAIN }
    }
}
