//! How large is a figure? A browser that knows leaves room for it before it has come.

/// Width and height in CSS pixels: of an SVG of ours from its first tag, of a PNG from its header.
pub(super) fn size(bytes: &[u8]) -> Option<(f64, f64)> {
    svg_size(bytes).or_else(|| png_size(bytes))
}

fn svg_size(bytes: &[u8]) -> Option<(f64, f64)> {
    let tag = std::str::from_utf8(bytes).ok()?.strip_prefix("<svg ")?.split_once('>')?.0;
    let attribute = |name: &str| tag.split_once(name)?.1.split_once('"')?.0.parse().ok();
    Some((attribute(" width=\"")?, attribute(" height=\"")?))
}

/// The header's first chunk holds both, as four bytes each, at bytes 16 and 20.
fn png_size(bytes: &[u8]) -> Option<(f64, f64)> {
    bytes.strip_prefix(b"\x89PNG\r\n\x1a\n")?;
    let at = |from: usize| {
        let four = bytes.get(from..from + 4)?.try_into().ok()?;
        Some(f64::from(u32::from_be_bytes(four)))
    };
    Some((at(16)?, at(20)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drawing_and_a_photograph_tell_their_size() {
        let svg = b"<svg xmlns=\"x\" width=\"880\" height=\"340.5\"><rect width=\"1\" height=\"2\"/>";
        assert_eq!(size(svg), Some((880.0, 340.5)));
        let png = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x02\x80\0\0\x01\xe0";
        assert_eq!(size(png), Some((640.0, 480.0)));
        assert_eq!(size(&png[..20]), None);
        assert_eq!(size(b"\x89PNG width=\"880\""), None);
    }
}
