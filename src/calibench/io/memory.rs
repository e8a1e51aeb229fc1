//! How much memory may photographs take together? It is asked for before a photograph is decoded, and given
//! back when it is done with.

use super::input::InputError;
use super::shown::ShownPath;
use std::path::Path;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// What photographs may take if nothing else is said: one of 100 megapixels in colour at a time, or several
/// small ones.
pub const DEFAULT_MEMORY: u64 = 2 << 30;

/// Bytes that several threads share.
#[derive(Debug)]
pub struct Memory {
    most: u64,
    free: Mutex<u64>,
    given_back: Condvar,
}

/// A part of them. Dropping it gives it back.
#[derive(Debug)]
pub struct Taken<'a> {
    memory: &'a Memory,
    bytes: u64,
}

impl Memory {
    /// So many bytes in all.
    pub fn new(most: u64) -> Memory {
        Memory { most, free: Mutex::new(most), given_back: Condvar::new() }
    }

    /// Takes what a file needs, and waits for it while others have it: photographs that fill the memory come
    /// one at a time. Whoever holds a part must not wait for another.
    ///
    /// # Errors
    /// More is needed than there is in all.
    pub fn take(&self, path: &Path, bytes: u64) -> Result<Taken<'_>, InputError> {
        if bytes > self.most {
            let path = path.shown();
            return Err(InputError::NeedsMemory { path, needed: bytes, most: self.most });
        }
        let mut free = self.free();
        while *free < bytes {
            free = self.given_back.wait(free).unwrap_or_else(PoisonError::into_inner);
        }
        *free -= bytes;
        Ok(Taken { memory: self, bytes })
    }

    fn free(&self) -> MutexGuard<'_, u64> {
        self.free.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Taken<'_> {
    fn drop(&mut self) {
        *self.memory.free() += self.bytes;
        self.memory.given_back.notify_all();
    }
}

/// Units of bytes by their names.
const UNITS: [(&str, u64); 8] = [
    ("GiB", 1 << 30),
    ("MiB", 1 << 20),
    ("KiB", 1 << 10),
    ("kiB", 1 << 10),
    ("GB", 1_000_000_000),
    ("MB", 1_000_000),
    ("KB", 1000),
    ("kB", 1000),
];

/// A number of bytes as a user writes it: `2GiB`, `500MB`.
///
/// # Errors
/// What was expected.
pub fn parse_bytes(text: &str) -> Result<u64, String> {
    let (number, unit) =
        UNITS.iter().find_map(|(name, bytes)| Some((text.strip_suffix(name)?, *bytes))).unwrap_or((text, 1));
    let bytes = number.trim().parse::<u64>().ok().and_then(|number| number.checked_mul(unit));
    bytes.filter(|bytes| *bytes > 0).ok_or_else(|| {
        "expected a whole number of bytes, or of kB, MB, GB, kiB, MiB or GiB, such as 500MB or 2GiB"
            .to_string()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU64, Ordering};

    #[test]
    fn no_more_is_out_at_a_time_than_there_is() {
        let (memory, out, most) = (Memory::new(10), AtomicU64::new(0), AtomicU64::new(0));
        std::thread::scope(|scope| {
            for need in [3, 4, 10, 6, 5, 10, 1] {
                let (memory, out, most) = (&memory, &out, &most);
                scope.spawn(move || {
                    for _ in 0..50 {
                        let taken = memory.take(Path::new("x"), need).unwrap();
                        most.fetch_max(out.fetch_add(need, Ordering::SeqCst) + need, Ordering::SeqCst);
                        std::thread::yield_now();
                        out.fetch_sub(need, Ordering::SeqCst);
                        drop(taken);
                    }
                });
            }
        });
        assert!(most.into_inner() <= 10);
        let error = memory.take(Path::new("x"), 11).unwrap_err();
        assert!(matches!(error, InputError::NeedsMemory { needed: 11, most: 10, .. }), "{error}");
    }

    #[test]
    fn bytes_are_read_with_their_units() {
        assert_eq!(parse_bytes("2GiB"), Ok(2 << 30));
        assert_eq!(parse_bytes("500 MB"), Ok(500_000_000));
        assert_eq!(parse_bytes("100KB"), Ok(100_000));
        assert_eq!(parse_bytes("7"), Ok(7));
        for wrong in ["", "0", "-1", "2TB", "99999999999999GiB", "1.5GiB"] {
            assert!(parse_bytes(wrong).is_err(), "{wrong}");
        }
    }
}
