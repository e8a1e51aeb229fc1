//! Where does a polynomial first become 0? That is where a radial map folds back.

/// Smallest positive root of `c[0] + c[1] s + c[2] s^2 + ...` with `c[0] > 0`, or `None` if it stays
/// positive.
///
/// Between the positive roots of its derivative a polynomial is monotone: the first piece that ends at or
/// below 0 is bisected to neighbouring numbers.
pub(super) fn smallest_positive_root(c: &[f64]) -> Option<f64> {
    positive_roots(c).into_iter().next()
}

/// All positive roots at which the sign changes, ascending.
fn positive_roots(c: &[f64]) -> Vec<f64> {
    let degree = c.iter().rposition(|&x| x != 0.0).unwrap_or(0);
    if degree == 0 {
        return Vec::new();
    }
    let value = |s: f64| c[..=degree].iter().rev().fold(0.0, |sum, x| sum * s + x);
    let derivative: Vec<f64> = (1..=degree).map(|k| k as f64 * c[k]).collect();
    let mut ends = positive_roots(&derivative);
    ends.push(beyond(&c[..=degree]).max(ends.last().map_or(0.0, |last| 2.0 * last)));
    let mut roots = Vec::new();
    let mut low = 0.0;
    for high in ends {
        if (value(low) > 0.0) != (value(high) > 0.0) {
            roots.push(bisect(value, low, high));
        }
        low = high;
    }
    roots
}

/// A bound of the size of all roots (Cauchy 1829).
fn beyond(c: &[f64]) -> f64 {
    let leading = c[c.len() - 1].abs();
    1.0 + c.iter().map(|x| x.abs() / leading).fold(0.0, f64::max)
}

/// The sign change of `value` between `low` and `high`, on the side of `low`.
fn bisect(value: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let positive = value(low) > 0.0;
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return low;
        }
        if (value(middle) > 0.0) == positive {
            low = middle;
        } else {
            high = middle;
        }
    }
}

/// The `x` in `[0, limit]` with `value(x) = wanted`, for a map that grows there from 0; `limit` may be
/// infinite. `None` beyond the image of `limit`. `value` gives the slope too.
pub(super) fn inverse_of_growing(
    value: impl Fn(f64) -> (f64, f64),
    wanted: f64,
    start: f64,
    limit: f64,
) -> Option<f64> {
    if limit.is_finite() && wanted > value(limit).0 {
        return None;
    }
    let (mut low, mut high) = (0.0, limit);
    let mut x = start.min(limit);
    // 200 bisections of any finite bracket end at neighbouring numbers; Newton's method needs about five.
    for _ in 0..200 {
        let (at, slope) = value(x);
        let excess = at - wanted;
        if excess == 0.0 {
            return Some(x);
        }
        if excess > 0.0 {
            high = x;
        } else {
            low = x;
        }
        let newton = x - excess / slope;
        let next = if newton > low && newton < high {
            newton
        } else if high.is_finite() {
            0.5 * (low + high)
        } else {
            2.0 * x.max(wanted)
        };
        if (next - x).abs() <= f64::EPSILON * 0.5 * x {
            return Some(next);
        }
        if !next.is_finite() {
            return None;
        }
        x = next;
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_root_is_found_among_many() {
        // (1 - s)(2 - s)(3 - s)
        let found = smallest_positive_root(&[6.0, -11.0, 6.0, -1.0]).unwrap();
        assert!((found - 1.0).abs() < 1e-12, "{found}");
        assert_eq!(smallest_positive_root(&[1.0, 0.3, 0.0, 2.0]), None);
        assert_eq!(smallest_positive_root(&[1.0, 0.0, 0.0]), None);
        let far = smallest_positive_root(&[1.0, 0.0, 0.0, -1e-12]).unwrap();
        assert!((far - 1e4).abs() < 1e-8);
    }

    #[test]
    fn a_growing_map_is_inverted_to_the_last_digit() {
        let cube = |x: f64| (x + x * x * x, 1.0 + 3.0 * x * x);
        for wanted in [0.0, 1e-9, 0.5, 10.0, 1e9] {
            let x = inverse_of_growing(cube, wanted, wanted, f64::INFINITY).unwrap();
            assert!((cube(x).0 - wanted).abs() <= 4.0 * f64::EPSILON * wanted);
        }
        assert_eq!(inverse_of_growing(cube, 3.0, 3.0, 1.0), None);
    }
}
