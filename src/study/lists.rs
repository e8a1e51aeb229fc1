//! How many numbers stand in a list? As many as its field has: one too many is a slip, and not left out.

use serde::de::{Deserialize, Deserializer, Error};

/// A list of exactly `N` values.
pub(super) fn exactly<'de, D, T, const N: usize>(deserializer: D) -> Result<[T; N], D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    let values = Vec::deserialize(deserializer)?;
    let got = values.len();
    values.try_into().map_err(|_| D::Error::custom(format!("{got} values in a list that has {N}")))
}

/// Width and height.
pub(super) fn pair<'de, D: Deserializer<'de>>(deserializer: D) -> Result<(usize, usize), D::Error> {
    exactly(deserializer).map(|[width, height]| (width, height))
}
