//! Do neighbouring marks err alike? Noise does not; a lens or a board that the model leaves out does.
//!
//! Marks are given row by row, so that one and the next are mostly neighbours. Of independent noise the sum
//! over such pairs
//!
//! ```text
//! z = sum r_i . r_(i+1) / (s^2 sqrt(2 n)),   s^2 = sum |r_i|^2 / (2 N)
//! ```
//! for `n` pairs and `N` marks has mean 0 and variance 1 (Moran 1950, for neighbours on a line); what a fit
//! takes out of the residuals lowers it a little. Marks in another order make the test blind, not wrong.

use super::{Loss, Warning, strays};
use crate::geometry::Vec2;

/// A normal number exceeds this with a probability of one in a million.
const CHANCE: f64 = 4.75;
/// And this once in seven hundred times: enough to look again, not to warn.
const SUSPECT: f64 = 3.0;
/// Weaker correlations, which large sets of real photographs show all the time, widen no standard deviation
/// by more than a fifth.
const MATERIAL: f64 = 0.2;

/// What neighbours' residuals have in common.
pub(super) struct Neighbours {
    /// Correlation coefficient of a mark's residual with the next one's.
    pub correlation: f64,
    /// The sum in its standard deviations.
    z: f64,
}

impl Neighbours {
    /// Whether they agree so much that the residuals may be more than noise.
    pub fn may_agree(&self) -> bool {
        self.z > SUSPECT
    }
}

/// Of residuals of one size, strays under a robust loss left aside; a set without neighbours has none.
pub(super) fn neighbours(residuals: &[Vec<Vec2>], loss: Loss) -> Neighbours {
    let residuals = strays::at_zero(residuals, loss);
    let residuals = residuals.as_ref();
    let marks: usize = residuals.iter().map(Vec::len).sum();
    let square: f64 = residuals.iter().flatten().map(Vec2::norm_squared).sum();
    with_variance(residuals, 0.5 * square / marks as f64)
}

fn with_variance(residuals: &[Vec<Vec2>], variance: f64) -> Neighbours {
    let (mut pairs, mut products) = (0.0, 0.0);
    for view in residuals {
        products += view.windows(2).map(|pair| pair[0].x * pair[1].x + pair[0].y * pair[1].y).sum::<f64>();
        pairs += view.len().saturating_sub(1) as f64;
    }
    Neighbours {
        correlation: products / pairs / (2.0 * variance),
        z: products / (variance * (2.0 * pairs).sqrt()),
    }
}

/// The warning, where neighbours' residuals agree; `variance` is `s^2` under least squares.
pub(super) fn structure(residuals: &[Vec<Vec2>], variance: f64, loss: Loss) -> Option<Warning> {
    let Neighbours { correlation, z } = match loss {
        Loss::Squares => with_variance(residuals, variance),
        _ => neighbours(residuals, loss),
    };
    (z > CHANCE && correlation > MATERIAL).then_some(Warning::Structured { correlation })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn correlations_are_those_of_marks_next_to_each_other_in_a_view() {
        let view = |list: &[(f64, f64)]| list.iter().map(|&(x, y)| Vec2::new(x, y)).collect::<Vec<_>>();
        // s^2 = 4 * 25 / 8, three pairs of product 25: correlation 1, z = 75 / (12.5 sqrt(6)).
        let neighbours = |residuals: &[Vec<Vec2>]| neighbours(residuals, Loss::Squares);
        let alike = neighbours(&[view(&[(3.0, 4.0); 4])]);
        assert_eq!(alike.correlation, 1.0);
        assert!((alike.z - 2.449_489_742_783_178).abs() < 1e-14);
        assert_eq!(neighbours(&[view(&[(0.0, 1.0), (0.0, -1.0), (0.0, 1.0)])]).correlation, -1.0);
        // At a right angle; and the last of a view is no neighbour of the next one's first.
        let square = view(&[(1.0, 0.0), (0.0, 1.0)]);
        assert_eq!(neighbours(&[square.clone(), view(&[(0.0, 1.0), (1.0, 0.0)])]).correlation, 0.0);
    }

    #[test]
    fn neighbours_may_agree_beyond_three_deviations() {
        let may_agree = |z: f64| Neighbours { correlation: 0.1, z }.may_agree();
        assert!(may_agree(3.1) && !may_agree(2.9) && !may_agree(-3.1));
    }
}
