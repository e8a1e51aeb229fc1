//! What is the root of a covariance that may be singular?

use nalgebra::DMatrix;

/// `L` with `L L^T` the matrix, by its eigenvalues: what priors settle leaves next to nothing of some. `None`
/// where a number is not finite.
pub(super) fn root(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    if matrix.iter().any(|x| !x.is_finite()) {
        return None;
    }
    if matrix.is_empty() {
        return Some(DMatrix::zeros(0, 0));
    }
    // Parameters differ in size by orders of magnitude.
    let size = matrix.diagonal().map(|d| d.max(0.0).sqrt().max(f64::MIN_POSITIVE));
    let n = matrix.nrows();
    let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] / (size[i] * size[j]));
    let eigen = scaled.symmetric_eigen();
    let root =
        |i: usize, k: usize| size[i] * eigen.eigenvectors[(i, k)] * eigen.eigenvalues[k].max(0.0).sqrt();
    Some(DMatrix::from_fn(n, n, root))
}
