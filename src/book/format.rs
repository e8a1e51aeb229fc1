//! How does a number look in the text? By a format of the placeholder: `.4`, `s3`, `e1`, `%1`.

/// Formats a value; `None` for a format that is not known. A minus is typographic, a power of ten is written
/// as one.
pub(super) fn format(value: f64, how: &str) -> Option<String> {
    let (kind, digits) = (how.get(..1)?, how.get(1..)?.parse::<usize>().ok()?);
    let plain = match kind {
        "." => format!("{value:.digits$}"),
        "s" => significant(value, digits.max(1)),
        "e" => return Some(power_of_ten(value, digits)),
        "%" => format!("{:.digits$}", 100.0 * value),
        _ => return None,
    };
    Some(typeset(&plain))
}

/// A plain number with a true minus sign; no sign for a zero.
pub(super) fn typeset(plain: &str) -> String {
    let zero = plain.trim_start_matches('-').bytes().all(|b| b == b'0' || b == b'.');
    match plain.strip_prefix('-') {
        Some(rest) if zero => rest.to_string(),
        Some(rest) => format!("\u{2212}{rest}"),
        None => plain.to_string(),
    }
}

/// Significant digits; far from one as a power of ten.
pub(super) fn significant(value: f64, digits: usize) -> String {
    let text = calibench::io::significant(value, digits);
    if text.contains('e') { power_of_ten(value, digits.saturating_sub(1)) } else { typeset(&text) }
}

fn power_of_ten(value: f64, decimals: usize) -> String {
    if !value.is_finite() || value == 0.0 {
        return typeset(&format!("{value}"));
    }
    let text = format!("{value:.decimals$e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let exponent = typeset(exponent);
    let mantissa = typeset(mantissa);
    format!("{mantissa}\u{a0}\u{d7}\u{a0}10<sup>{exponent}</sup>")
}

/// A unit as it stands behind a number.
pub(super) fn unit(unit: &str) -> String {
    match unit {
        "" => String::new(),
        "%" => "\u{a0}%".to_string(),
        "deg" => "\u{b0}".to_string(),
        _ => format!("\u{a0}{}", super::text::inline(unit)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_look_as_they_are_asked_to() {
        let is = |value, how, text: &str| assert_eq!(format(value, how).as_deref(), Some(text), "{how}");
        is(4.677_747, ".3", "4.678");
        is(-1.4293, ".2", "\u{2212}1.43");
        is(-0.000_01, ".3", "0.000");
        is(0.003_21, "s2", "0.0032");
        is(1.171e-13, "e1", "1.2\u{a0}\u{d7}\u{a0}10<sup>\u{2212}13</sup>");
        is(0.3267, "%1", "32.7");
        assert_eq!(format(1.0, "x4"), None);
        assert_eq!(format(1.0, ""), None);
    }
}
