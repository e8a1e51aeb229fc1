//! What is kept of a solver's words? Little, on one line, and nothing that commands whoever reads it.

use calibench::io::shown;

/// Characters that are kept.
const MOST: usize = 400;

/// The beginning of a solver's text, on one line, with control characters as their numbers: for the terminal,
/// for reports, and for a memory that holds what a hundred thousand answers say.
pub fn quoted(text: &str) -> String {
    let head: String =
        text.chars().take(MOST).map(|c| if matches!(c, '\n' | '\r' | '\t') { ' ' } else { c }).collect();
    let cut = if head.len() < text.len() { "\u{2026}" } else { "" };
    format!("{}{cut}", shown(&head))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_text_is_cut_and_commands_are_numbers() {
        assert_eq!(quoted("no\nluck\u{1b}[2J\u{202e}"), "no luck\\u001b[2J\\u202e");
        let long = quoted(&"x".repeat(900_000));
        assert_eq!((long.chars().count(), long.ends_with('\u{2026}')), (MOST + 1, true));
    }
}
