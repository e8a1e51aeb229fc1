//! How much does a residual count? Least squares, or losses under which a mis-detected point cannot carry the
//! fit away.

/// The loss `rho(s)` of a point with squared residual `s = |r|^2` in px^2; the cost is its sum over points.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Loss {
    /// `rho = s`: maximum likelihood under Gaussian noise.
    #[default]
    Squares,
    /// `rho = s` up to `|r| = delta`, then `2 delta |r| - delta^2` (Huber 1964).
    Huber {
        /// Where the loss turns linear, px.
        delta_px: f64,
    },
    /// `rho = c^2 ln(1 + s / c^2)`: a far outlier hardly counts at all.
    Cauchy {
        /// Where the influence is greatest, px.
        scale_px: f64,
    },
}

impl Loss {
    /// `(rho(s), rho'(s))`: the loss, and the weight of the point in the reweighted normal equations.
    pub fn at(&self, s: f64) -> (f64, f64) {
        match *self {
            Loss::Squares => (s, 1.0),
            Loss::Huber { delta_px } => {
                if s <= delta_px * delta_px {
                    (s, 1.0)
                } else {
                    let r = s.sqrt();
                    (2.0 * delta_px * r - delta_px * delta_px, delta_px / r)
                }
            }
            Loss::Cauchy { scale_px } => {
                let square = scale_px * scale_px;
                (square * libm::log1p(s / square), 1.0 / (1.0 + s / square))
            }
        }
    }

    /// `rho'(s) + s rho''(s)`: the slope of the influence `rho'(|r|^2) r`, the mean of its slopes along and
    /// across the residual.
    pub fn slope(&self, s: f64) -> f64 {
        let weight = self.at(s).1;
        match *self {
            Loss::Squares => 1.0,
            // Beyond delta the influence keeps its size: it only turns.
            Loss::Huber { .. } if weight < 1.0 => 0.5 * weight,
            Loss::Huber { .. } => 1.0,
            Loss::Cauchy { .. } => weight * weight,
        }
    }

    /// Mean of the squares of those two slopes: across the residual the slope is the weight.
    pub fn squared_slope(&self, s: f64) -> f64 {
        let (across, mean) = (self.at(s).1, self.slope(s));
        let along = 2.0 * mean - across;
        0.5 * (along * along + across * across)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_the_slopes_of_the_losses() {
        for loss in [Loss::Squares, Loss::Huber { delta_px: 0.5 }, Loss::Cauchy { scale_px: 0.3 }] {
            for s in [0.01, 0.2, 0.24, 0.26, 1.0, 9.0] {
                let h = 1e-6 * s;
                let slope = (loss.at(s + h).0 - loss.at(s - h).0) / (2.0 * h);
                assert!((slope - loss.at(s).1).abs() < 1e-8, "{loss:?} at {s}");
                let curvature = (loss.at(s + h).1 - loss.at(s - h).1) / (2.0 * h);
                // The weight's rounding, 1e-16, over the step, 1e-6 s, times s.
                assert!((slope + s * curvature - loss.slope(s)).abs() < 1e-8, "{loss:?} at {s}");
                let (along, across) = (slope + 2.0 * s * curvature, slope);
                let squared = 0.5 * (along * along + across * across);
                assert!((squared - loss.squared_slope(s)).abs() < 2e-8, "{loss:?} at {s}");
            }
        }
    }
}
