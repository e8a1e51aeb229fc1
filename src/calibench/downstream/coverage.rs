//! How far does an interval reach whose standard uncertainty is itself estimated?

use crate::distribution::student_two_sided;

/// The factor `k` by which a standard uncertainty is multiplied for an interval that contains the value with
/// probability `coverage`, 0 < coverage < 1: the two-sided quantile of Student's distribution, of the normal
/// distribution without `degrees_of_freedom` (JCGM 100:2008, G.3).
///
/// ```
/// use calibench::downstream::coverage_factor;
///
/// // JCGM 100:2008, table G.2.
/// assert!((coverage_factor(0.95, Some(10.0)) - 2.23).abs() < 0.005);
/// assert!((coverage_factor(0.9545, None) - 2.00).abs() < 0.005);
/// ```
pub fn coverage_factor(coverage: f64, degrees_of_freedom: Option<f64>) -> f64 {
    student_two_sided(1.0 - coverage, degrees_of_freedom.unwrap_or(f64::INFINITY))
}

/// Effective degrees of freedom of a sum of independent contributions, each a variance with the degrees of
/// freedom of its estimate: `(sum u^2)^2 / sum (u^4 / nu)` (Welch 1947, Satterthwaite 1946; JCGM 100:2008,
/// G.2b). A variance that is known has none and adds nothing below; `None` where all are known.
pub fn effective_freedom(contributions: &[(f64, Option<f64>)]) -> Option<f64> {
    let total: f64 = contributions.iter().map(|(variance, _)| variance).sum();
    let below: f64 = contributions
        .iter()
        .map(|(variance, freedom)| freedom.map_or(0.0, |nu| variance * variance / nu))
        .sum();
    (below > 0.0).then(|| total * total / below)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_those_of_the_table() {
        // JCGM 100:2008, table G.2, fraction 95 %.
        for (freedom, factor) in [(1.0, 12.71), (5.0, 2.57), (20.0, 2.09), (100.0, 1.984)] {
            assert!((coverage_factor(0.95, Some(freedom)) - factor).abs() < 0.005, "{freedom}");
        }
        assert!((coverage_factor(0.95, None) - 1.960).abs() < 0.0005);
    }

    #[test]
    fn with_many_degrees_of_freedom_the_factor_comes_and_is_students() {
        // By `scipy.stats.t.ppf`, of 95 % and 99 %.
        for (freedom, factors) in [
            (300.0, [1.967_903_011_261, 2.592_316_410_848]),
            (1e3, [1.962_339_080_826, 2.580_754_698_066]),
            (1e5, [1.959_987_707_535, 2.575_878_469_908]),
            (1e7, [1.959_964_221_767, 2.575_829_795_204]),
            (1e12, [1.959_963_984_54, 2.575_829_303_55]),
        ] {
            for (coverage, factor) in [0.95, 0.99].into_iter().zip(factors) {
                let ours = coverage_factor(coverage, Some(freedom));
                assert!((ours / factor - 1.0).abs() < 1e-9, "{freedom}: {ours}");
            }
        }
        assert_eq!(coverage_factor(0.95, Some(f64::INFINITY)), coverage_factor(0.95, None));
    }

    #[test]
    fn one_estimate_keeps_its_freedom_and_two_equal_ones_add_theirs() {
        assert_eq!(effective_freedom(&[(4.0, Some(7.0))]), Some(7.0));
        assert_eq!(effective_freedom(&[(1.0, Some(7.0)), (1.0, Some(7.0))]), Some(14.0));
        // Half the variance known: four times the degrees of freedom.
        assert_eq!(effective_freedom(&[(1.0, Some(7.0)), (1.0, None)]), Some(28.0));
        assert_eq!(effective_freedom(&[(1.0, None)]), None);
    }
}
