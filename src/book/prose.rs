//! Was a result typed in by hand? Numbers of a result have a decimal point or a unit; in prose they must be
//! placeholders.

/// Units that make a number a quantity.
const UNITS: [&str; 20] = [
    "%",
    "px",
    "mm",
    "\u{b5}m",
    "deg",
    "\u{b0}",
    "ms",
    "s",
    "h",
    "K",
    "degrees",
    "degree",
    "pixels",
    "pixel",
    "millimetres",
    "percent",
    "months",
    "days",
    "hours",
    "weeks",
];

/// Quantities in a piece of prose: `4.678`, `20 px`, `33%`. A number behind a section sign is a place, not a
/// quantity, and one inside a word (`f32`, `k1`, `x86-64`) is part of a name.
pub(super) fn quantities(prose: &str) -> Vec<(usize, &str)> {
    let bytes = prose.as_bytes();
    let mut found = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        if !bytes[at].is_ascii_digit() {
            at += 1;
            continue;
        }
        let start = at;
        while at < bytes.len() && (bytes[at].is_ascii_digit() || decimal_point(bytes, at)) {
            at += 1;
        }
        let number = &prose[start..at];
        let before = prose[..start].chars().next_back();
        let in_word = before.is_some_and(|c| c.is_alphanumeric() || c == '_');
        let place = prose[..start].trim_end_matches(['\u{a0}', ' ']).ends_with('\u{a7}');
        let in_name = prose[at..].starts_with(|c: char| c.is_alphabetic() && c != '\u{b5}');
        let quantity = number.contains('.') || has_unit(&prose[at..]);
        if quantity && !in_word && !place && (!in_name || number.contains('.')) {
            found.push((start, number));
        }
    }
    found
}

/// A point between digits.
fn decimal_point(bytes: &[u8], at: usize) -> bool {
    bytes[at] == b'.' && bytes.get(at + 1).is_some_and(u8::is_ascii_digit)
}

fn has_unit(after: &str) -> bool {
    let after = after.trim_start_matches([' ', '\u{a0}', '\u{202f}', '-']);
    UNITS.iter().any(|unit| {
        after.strip_prefix(unit).is_some_and(|rest| !rest.starts_with(|c: char| c.is_alphanumeric()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(prose: &str) -> Vec<&str> {
        quantities(prose).into_iter().map(|(_, number)| number).collect()
    }

    #[test]
    fn results_are_found_and_names_are_not() {
        assert_eq!(found("bends by 4.678 px, RMS 2.249"), ["4.678", "2.249"]);
        assert_eq!(found("33% and 20 px and 5 mm, 56\u{b0}"), ["33", "20", "5", "56"]);
        assert!(
            found("section \u{a7}5.3, three steps, Zhang 2000, k1, x86-64, 4 poses, in 2 ways").is_empty()
        );
        assert!(found("640 x 480 at rest. 3 shifts").is_empty());
    }
}
