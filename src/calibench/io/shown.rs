//! How is text from elsewhere shown? Without what would command the terminal.

use std::borrow::Cow;
use std::path::Path;

/// Text as it is shown: what would command a terminal, or reorder what is read, stands as its number. Names
/// of files, fields of a study and whatever a solver says come from elsewhere. The form is that of JSON, so
/// that JSON stays JSON.
pub fn shown(text: &str) -> Cow<'_, str> {
    numbered(text, |c| commands(c) && c != '\n' && c != '\t')
}

/// The same on one line: a line break in a name or a field would begin a line that looks like the program's
/// own.
pub fn on_one_line(text: &str) -> Cow<'_, str> {
    numbered(text, commands)
}

/// Characters of an [`excerpt`].
const MOST: usize = 200;

/// The beginning of a text [`on_one_line`]: enough to know what it is, however long a file without line ends.
///
/// ```
/// use calibench::io::shown::excerpt;
///
/// assert_eq!(excerpt("px,py"), "px,py");
/// assert_eq!(excerpt(&"\0".repeat(40_000_000)).len(), 200 * "\\u0000".len() + "\u{2026}".len());
/// ```
pub fn excerpt(text: &str) -> String {
    let end = text.char_indices().nth(MOST).map_or(text.len(), |(at, _)| at);
    let cut = if end < text.len() { "\u{2026}" } else { "" };
    format!("{}{cut}", on_one_line(&text[..end]))
}

/// A file's name as messages and results show it.
pub trait ShownPath {
    /// The name, [`on_one_line`].
    fn shown(&self) -> String;
}

impl ShownPath for Path {
    fn shown(&self) -> String {
        on_one_line(&self.display().to_string()).into_owned()
    }
}

/// Whether a character ends a line, commands a terminal, or reorders what is read.
fn commands(c: char) -> bool {
    c.is_control() || matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Text with the characters that `hidden` names as their numbers.
fn numbered(text: &str, hidden: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(&hidden) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if hidden(c) {
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

    #[test]
    fn a_file_whose_name_has_line_breaks_is_named_on_one_line() {
        assert_eq!(
            Path::new("a\nall held\r\t\u{1b}.csv").shown(),
            "a\\u000aall held\\u000d\\u0009\\u001b.csv"
        );
        assert_eq!(Path::new("fotos/gr\u{fc}n 1.png").shown(), "fotos/gr\u{fc}n 1.png");
    }
}
