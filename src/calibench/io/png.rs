//! Does a PNG hold more images than the first? Told from its chunks, before anything is decoded: a decoder
//! reads the first frame of an animation and says nothing of the others.
//!
//! Eight bytes of signature, then chunks: four bytes of length, four of name, the data, four of check sum. An
//! animation has `acTL` in front of `IDAT`; its data begin with the number of frames (PNG, third edition
//! 2025, section 11.3.6).

use super::bytes::bytes;
use std::io::{Read, Result, Seek, SeekFrom};

const SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";
/// Chunks that are looked through: a file of more in front of its image has notes without end.
const MOST_CHUNKS: usize = 1000;
/// Bytes of a chunk's check sum.
const CHECK_SUM: i64 = 4;

/// Whether an animation of more than one frame; not so of what is no PNG, or was cut off.
pub(super) fn has_more(source: &mut (impl Read + Seek)) -> Result<bool> {
    source.rewind()?;
    if !matches!(bytes::<8>(source)?, Some(SIGNATURE)) {
        return Ok(false);
    }
    for _ in 0..MOST_CHUNKS {
        let (Some(length), Some(name)) = (bytes(source)?, bytes::<4>(source)?) else { break };
        match &name {
            b"acTL" => return Ok(bytes(source)?.map_or(0, u32::from_be_bytes) > 1),
            b"IDAT" | b"IEND" => break,
            _ => source.seek(SeekFrom::Current(i64::from(u32::from_be_bytes(length)) + CHECK_SUM))?,
        };
    }
    Ok(false)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn chunk(name: &[u8; 4], data: &[u8]) -> Vec<u8> {
        let length = (data.len() as u32).to_be_bytes();
        [&length[..], name, data, &[0; 4]].concat()
    }

    #[test]
    fn an_animation_is_told_by_its_frames() {
        let file = |chunks: &[Vec<u8>]| [&SIGNATURE[..], &chunks.concat()].concat();
        let more = |file: &[u8]| has_more(&mut Cursor::new(file)).unwrap();
        let (head, image) = (chunk(b"IHDR", &[0; 13]), chunk(b"IDAT", &[1, 2, 3]));
        let frames = |count: u32| chunk(b"acTL", &[count.to_be_bytes(), [0; 4]].concat());
        assert!(more(&file(&[head.clone(), chunk(b"tEXt", b"a\0b"), frames(3), image.clone()])));
        assert!(!more(&file(&[head.clone(), frames(1), image.clone()])));
        assert!(!more(&file(&[head.clone(), image.clone(), frames(3)])));
        // A chunk that is longer than the file, one that is cut off, and what is no PNG.
        let animated = file(&[head, frames(2)]);
        assert!(more(&animated) && !more(&animated[..animated.len() - 14]) && !more(&animated[1..]));
        let far = file(&[[&u32::MAX.to_be_bytes()[..], b"tEXt"].concat()]);
        assert!(!more(&far) && !more(&[]));
    }
}
