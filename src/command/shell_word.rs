//! How does a path stand in a command that is shown, to be copied into a shell?

/// A path as one word that a shell and the program take for it.
pub(super) fn shell_word(path: &str) -> String {
    // What begins with a dash is taken for an option.
    let path = if path.starts_with('-') { format!("./{path}") } else { path.to_string() };
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./,:@%+=".contains(c);
    match !path.is_empty() && path.chars().all(is_plain) {
        true => path,
        false => format!("'{}'", path.replace('\'', r"'\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_shell_would_part_or_expand_is_quoted() {
        for (path, word) in [
            ("out/studies/a-1.toml", "out/studies/a-1.toml"),
            ("my study", "'my study'"),
            ("it's", r"'it'\''s'"),
            ("-dash", "./-dash"),
            ("", "''"),
            ("a$b", "'a$b'"),
        ] {
            assert_eq!(shell_word(path), word);
        }
    }
}
