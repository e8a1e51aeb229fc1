//! Text inside HTML inside markdown: which characters must be escaped?

/// Escapes text for HTML.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Hides from the markdown reader what it would take for its own signs; for HTML that stands inside a
/// paragraph or a cell.
pub(super) fn shield(html: &str) -> String {
    let mut shielded = String::with_capacity(html.len());
    for c in html.chars() {
        match c {
            '*' | '_' | '|' | '[' | ']' | '`' | '\\' | '~' | '$' | '{' | '}' => {
                shielded.push_str(&format!("&#{};", u32::from(c)));
            }
            '\n' => shielded.push(' '),
            _ => shielded.push(c),
        }
    }
    shielded
}

/// Text for an attribute: escaped, shielded, lines kept apart.
pub(super) fn attribute(text: &str) -> String {
    let lines: Vec<String> = text.lines().map(|line| shield(&escape(line))).collect();
    lines.join("&#10;")
}

/// A plain sentence that stands inside HTML.
pub(super) fn inline(text: &str) -> String {
    shield(&escape(text))
}

/// A caption begins as a sentence does, unless its first word is a symbol such as `k2`.
pub(super) fn sentence(caption: &str) -> String {
    let word = caption.split(|c: char| !c.is_alphanumeric()).next().unwrap_or_default();
    let is_word = word.chars().all(|c| c.is_ascii_lowercase()) && !["fx", "fy", "cx", "cy"].contains(&word);
    let Some(first) = caption.chars().next().filter(|_| is_word) else { return caption.to_string() };
    first.to_uppercase().chain(caption.chars().skip(1)).collect()
}

/// A section with its sign; `case study` has no number.
pub(super) fn section(name: &str) -> String {
    let sign = if name.starts_with(|c: char| c.is_ascii_digit()) { "\u{a7}" } else { "" };
    format!("{sign}{}", inline(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sentence_begins_with_a_capital_and_a_symbol_stays_itself() {
        assert_eq!(sentence("median day of the alarm"), "Median day of the alarm");
        assert_eq!(sentence("k2 against coverage"), "k2 against coverage");
        assert_eq!(sentence("fx, fy and cx"), "fx, fy and cx");
        assert_eq!(sentence("equation\u{a0}(3.2)"), "Equation\u{a0}(3.2)");
        assert_eq!(sentence(""), "");
    }

    #[test]
    fn nothing_of_markdown_or_html_is_left() {
        assert_eq!(inline("a<b*c|d"), "a&lt;b&#42;c&#124;d");
        assert_eq!(attribute("one\n\"two\""), "one&#10;&quot;two&quot;");
    }
}
