//! Matrices of any size as data of serde: their rows, or none where there is no matrix.

use nalgebra::DMatrix;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

type Rows = Vec<Vec<f64>>;

fn of(matrix: &DMatrix<f64>) -> Rows {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}

/// `None` where rows differ in length.
fn matrix(rows: &Rows) -> Option<DMatrix<f64>> {
    let columns = rows.first().map_or(0, Vec::len);
    let is_whole = rows.iter().all(|row| row.len() == columns);
    is_whole.then(|| DMatrix::from_fn(rows.len(), columns, |i, j| rows[i][j]))
}

const RAGGED: &str = "a matrix has rows of different lengths";

pub(crate) fn serialize<S: Serializer>(matrix: &DMatrix<f64>, to: S) -> Result<S::Ok, S::Error> {
    of(matrix).serialize(to)
}

pub(crate) fn deserialize<'a, D: Deserializer<'a>>(from: D) -> Result<DMatrix<f64>, D::Error> {
    matrix(&Rows::deserialize(from)?).ok_or_else(|| D::Error::custom(RAGGED))
}

/// A matrix that may be missing.
pub(crate) mod if_any {
    use super::{DMatrix, Deserialize, Deserializer, Error, RAGGED, Rows, Serialize, Serializer, matrix, of};

    pub(crate) fn serialize<S: Serializer>(matrix: &Option<DMatrix<f64>>, to: S) -> Result<S::Ok, S::Error> {
        matrix.as_ref().map(of).serialize(to)
    }

    pub(crate) fn deserialize<'a, D: Deserializer<'a>>(from: D) -> Result<Option<DMatrix<f64>>, D::Error> {
        let rows = Option::<Rows>::deserialize(from)?;
        rows.map(|rows| matrix(&rows).ok_or_else(|| D::Error::custom(RAGGED))).transpose()
    }
}
