//! What do many trials say together? Mean, spread and correlation in one pass, independent of how the trials
//! were split.

/// Sums of a multivariate sample about a fixed origin: trials can be added in any grouping as long as the
/// order is kept.
///
/// The origin should lie near the values (the truth does), so that nothing cancels.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    origin: Vec<f64>,
    count: usize,
    sum: Vec<f64>,
    /// Upper triangle, row by row.
    product: Vec<f64>,
}

impl Sample {
    /// An empty sample of vectors measured from `origin`.
    pub fn about(origin: &[f64]) -> Sample {
        let n = origin.len();
        Sample { origin: origin.to_vec(), count: 0, sum: vec![0.0; n], product: vec![0.0; n * (n + 1) / 2] }
    }

    /// Adds a trial. Panics if its length is not that of the origin.
    pub fn add(&mut self, values: &[f64]) {
        assert_eq!(values.len(), self.origin.len(), "a trial has one value per dimension");
        self.count += 1;
        let offset: Vec<f64> = values.iter().zip(&self.origin).map(|(v, o)| v - o).collect();
        let mut at = 0;
        for (i, a) in offset.iter().enumerate() {
            self.sum[i] += a;
            for b in &offset[i..] {
                self.product[at] += a * b;
                at += 1;
            }
        }
    }

    /// Number of trials.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Mean - origin: the bias where the origin is the truth.
    pub fn bias(&self, i: usize) -> f64 {
        self.sum[i] / self.count as f64
    }

    /// Mean.
    pub fn mean(&self, i: usize) -> f64 {
        self.origin[i] + self.bias(i)
    }

    /// Unbiased covariance of two dimensions; NaN below two trials.
    pub fn covariance(&self, i: usize, j: usize) -> f64 {
        let (i, j) = (i.min(j), i.max(j));
        let n = self.origin.len();
        let at = i * n - i * (i + 1) / 2 + j;
        let count = self.count as f64;
        (self.product[at] - self.sum[i] * self.sum[j] / count) / (count - 1.0)
    }

    /// Sample standard deviation.
    pub fn standard_deviation(&self, i: usize) -> f64 {
        self.covariance(i, i).sqrt()
    }

    /// Root mean square distance from the origin: bias and spread together.
    pub fn root_mean_square(&self, i: usize) -> f64 {
        let n = self.origin.len();
        (self.product[i * n - i * (i + 1) / 2 + i] / self.count as f64).sqrt()
    }

    /// Sample correlation coefficient.
    pub fn correlation(&self, i: usize, j: usize) -> f64 {
        self.covariance(i, j) / (self.standard_deviation(i) * self.standard_deviation(j))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_those_of_the_definition() {
        let data = [[1.0, 2.0, 0.0], [2.0, 1.0, 1.0], [4.0, 3.0, -2.0], [5.0, 7.0, 0.5]];
        let origin = [3.0, 3.0, 0.0];
        let mut sample = Sample::about(&origin);
        data.iter().for_each(|row| sample.add(row));
        let mean = |i: usize| data.iter().map(|r| r[i]).sum::<f64>() / 4.0;
        let covariance =
            |i: usize, j: usize| data.iter().map(|r| (r[i] - mean(i)) * (r[j] - mean(j))).sum::<f64>() / 3.0;
        for i in 0..3 {
            assert!((sample.mean(i) - mean(i)).abs() < 1e-14);
            assert!((sample.standard_deviation(i) - covariance(i, i).sqrt()).abs() < 1e-14, "{i}");
            let square = data.iter().map(|r| (r[i] - origin[i]) * (r[i] - origin[i])).sum::<f64>() / 4.0;
            assert!((sample.root_mean_square(i) - square.sqrt()).abs() < 1e-14);
            for j in 0..3 {
                assert!((sample.covariance(i, j) - covariance(i, j)).abs() < 1e-14, "{i} {j}");
                let correlation = covariance(i, j) / (covariance(i, i) * covariance(j, j)).sqrt();
                assert!((sample.correlation(i, j) - correlation).abs() < 1e-14, "{i} {j}");
            }
        }
    }
}
