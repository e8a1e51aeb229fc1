//! How is a number written so that every reader gets the same bits? By its shortest digits, with a point and
//! a signed exponent.

use std::fmt::Write;

/// The shortest decimal that reads back as the same number. YAML 1.1, which PyYAML reads, takes `1e-9` for a
/// word: a number has a point, and its exponent a sign.
pub(super) fn decimal(number: f64) -> String {
    let text = format!("{number:?}");
    let Some((digits, exponent)) = text.split_once('e') else { return text };
    let point = if digits.contains('.') { "" } else { ".0" };
    let sign = if exponent.starts_with('-') { "" } else { "+" };
    format!("{digits}{point}e{sign}{exponent}")
}

/// Numbers with something between them.
pub(super) fn decimals(numbers: &[f64], between: &str) -> String {
    let mut text = String::new();
    for (i, number) in numbers.iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = write!(text, "{}{}", if i > 0 { between } else { "" }, decimal(*number));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_has_a_point_and_reads_back() {
        for (number, text) in [(1.0, "1.0"), (-1e-9, "-1.0e-9"), (2.5e30, "2.5e+30"), (0.1, "0.1")] {
            assert_eq!(decimal(number), text);
            assert_eq!(decimal(number).parse(), Ok(number));
        }
        assert_eq!(decimals(&[1.0, 2.0], ", "), "1.0, 2.0");
    }
}
