//! A few bytes from the front of what is left of a file.

use std::io::{Read, Result};

/// So many bytes; `None` where there are fewer.
pub(super) fn bytes<const N: usize>(source: &mut impl Read) -> Result<Option<[u8; N]>> {
    let mut read = Vec::with_capacity(N);
    source.take(N as u64).read_to_end(&mut read)?;
    Ok(read.try_into().ok())
}
