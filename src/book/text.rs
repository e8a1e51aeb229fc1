//! Text inside HTML inside markdown: which characters must be escaped?

/// Escapes text for HTML.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Hides from the markdown reader what it would take for its own signs; for HTML that stands inside a paragraph or a cell.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_of_markdown_or_html_is_left() {
        assert_eq!(inline("a<b*c|d"), "a&lt;b&#42;c&#124;d");
        assert_eq!(attribute("one\n\"two\""), "one&#10;&quot;two&quot;");
    }
}
