//! Does a JPEG come to its end? Decoders paint what is missing of one that was cut off in grey, and say
//! nothing.
//!
//! A file is a row of segments, each `FF`, a kind, and mostly a length; after a scan's header (`FF DA`) its
//! data follow, in which a byte `FF` is always followed by `00` or the number of a restart. It ends with `FF
//! D9` (ITU-T T.81, 1992, annex B).

/// Whether the segments lead to the mark of the end. What follows it is nobody's business; bytes that are no
/// segment are left to the decoder.
pub(super) fn has_end(bytes: &[u8]) -> bool {
    let mut at = 2;
    loop {
        match (bytes.get(at), bytes.get(at + 1)) {
            (Some(0xff), Some(0xd9)) => return true,
            // Fill before a marker.
            (Some(0xff), Some(0xff)) => at += 1,
            // Markers that stand alone.
            (Some(0xff), Some(0x01 | 0xd0..=0xd8)) => at += 2,
            (Some(0xff), Some(kind)) => {
                let Some(length) = bytes.get(at + 2..at + 4) else { return false };
                at += 2 + usize::from(u16::from_be_bytes([length[0], length[1]]));
                if *kind == 0xda {
                    at = end_of_scan(bytes, at);
                }
            }
            (None, _) | (_, None) => return false,
            _ => return true,
        }
    }
}

/// Where the data of a scan that begins at `from` end: at the next marker, or with the file.
fn end_of_scan(bytes: &[u8], from: usize) -> usize {
    let data = bytes.get(from..).unwrap_or_default();
    let is_marker = |pair: &[u8]| pair[0] == 0xff && !matches!(pair[1], 0x00 | 0xd0..=0xd7 | 0xff);
    data.windows(2).position(is_marker).map_or(bytes.len(), |offset| from + offset)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A header of four bytes, a scan with data in which `FF` occurs, and the end.
    const WHOLE: [u8; 20] =
        [0xff, 0xd8, 0xff, 0xe0, 0, 4, 1, 2, 0xff, 0xda, 0, 3, 7, 0x12, 0xff, 0x00, 0x34, 0xff, 0xff, 0xd9];

    #[test]
    fn only_a_whole_file_has_an_end_whatever_follows_it() {
        assert!(has_end(&WHOLE));
        assert!(has_end(&[&WHOLE[..], &[0xff, 0xda, 0, 9]].concat()));
        for length in 2..WHOLE.len() {
            assert!(!has_end(&WHOLE[..length]), "{length}");
        }
    }
}
