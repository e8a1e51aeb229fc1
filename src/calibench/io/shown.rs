//! How is text from elsewhere shown? Without what would command the terminal.

use std::borrow::Cow;

/// Text as it is shown: what would command a terminal, or reorder what is read, stands as its number. Names
/// of files, fields of a study and whatever a solver says come from elsewhere. The form is that of JSON, so
/// that JSON stays JSON.
pub fn shown(text: &str) -> Cow<'_, str> {
    let commands = |c: char| {
        (c.is_control() && c != '\n' && c != '\t')
            || matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    if !text.contains(commands) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if commands(c) {
            shown.push_str(&format!("\\u{:04x}", u32::from(c)));
        } else {
            shown.push(c);
        }
    }
    Cow::Owned(shown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_would_command_the_terminal_is_shown_as_its_number_and_json_stays_json() {
        assert_eq!(shown("a\u{1b}[31mb\r\nc\t\u{9b}2J\u{202e}"), "a\\u001b[31mb\\u000d\nc\t\\u009b2J\\u202e");
        assert!(matches!(shown("\u{b1}8 %, fx \u{2026}\n"), Cow::Borrowed(_)));
        let json = serde_json::json!({"name": "x\u{9b}2J\u{7f}"});
        let back: serde_json::Value = serde_json::from_str(&shown(&json.to_string())).unwrap();
        assert_eq!(back, json);
    }
}
