//! Which code does a section show? An item of a source file by its name, so that the text cannot drift from
//! it.

/// The item `name` of a file: function, structure, constant, trait or implementation, with its documentation;
/// first line from 1. `Type::name` looks inside `impl Type`.
pub(super) fn item(source: &str, name: &str) -> Option<(usize, String)> {
    let lines: Vec<&str> = source.lines().collect();
    let (from, to, name) = match name.split_once("::") {
        None => (0, lines.len(), name),
        Some((scope, name)) => {
            let start = (0..lines.len()).find(|&i| defines(lines[i], "impl", scope))?;
            (start + 1, end_of(&lines, start), name)
        }
    };
    let keywords = ["fn", "struct", "enum", "const", "trait", "impl", "macro_rules!", "type", "static"];
    let start = (from..to).find(|&i| keywords.iter().any(|k| defines(lines[i], k, name)))?;
    let end = end_of(&lines, start);
    let attached = |line: &str| line.trim_start().starts_with("///") || line.trim_start().starts_with("#[");
    let mut first = start;
    while first > from && attached(lines[first - 1]) {
        first -= 1;
    }
    let margin = lines[start].len() - lines[start].trim_start().len();
    let text: Vec<&str> = lines[first..=end].iter().map(|l| l.get(margin..).unwrap_or("")).collect();
    Some((first + 1, text.join("\n")))
}

/// The fenced block whose first line is `$ command` or begins so.
pub(super) fn shell<'a>(source: &'a str, command: &str) -> Option<&'a str> {
    let first = format!("$ {command}");
    let blocks = source.split("\n```").skip(1).step_by(2);
    let mut bodies = blocks.filter_map(|block| block.split_once('\n')).map(|(_, body)| body);
    bodies.find(|body| body.starts_with(&first))
}

/// Whether a line begins the definition of `name` by `keyword`.
fn defines(line: &str, keyword: &str, name: &str) -> bool {
    let line = line.trim_start();
    let line = line.strip_prefix("pub ").unwrap_or(line);
    let line = line.strip_prefix("pub(super) ").or_else(|| line.strip_prefix("pub(crate) ")).unwrap_or(line);
    let line = if keyword == "fn" { line.strip_prefix("const ").unwrap_or(line) } else { line };
    let Some(rest) = line.strip_prefix(keyword).and_then(|rest| rest.strip_prefix(' ')) else { return false };
    rest.strip_prefix(name).is_some_and(|after| !after.starts_with(|c: char| c.is_alphanumeric() || c == '_'))
}

/// The last line of the item that begins at `start`: where its brackets are closed and a `}` or `;` ends the
/// line. Code that rustfmt has seen closes an item at its own indentation; a raw string ends where it is
/// closed.
fn end_of(lines: &[&str], start: usize) -> usize {
    let margin = lines[start].len() - lines[start].trim_start().len();
    if lines[start].trim_end().ends_with([';', '}']) {
        return start;
    }
    if lines[start].trim_end().ends_with("r#\"") {
        return (start + 1..lines.len()).find(|&i| lines[i].ends_with("\"#;")).unwrap_or(lines.len() - 1);
    }
    let closes = |line: &str| {
        line.len() - line.trim_start().len() == margin
            && line.trim_start().starts_with(['}', ']', ')'])
            && !line.trim_end().ends_with('{')
    };
    (start + 1..lines.len()).find(|&i| closes(lines[i])).unwrap_or(lines.len() - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOURCE: &str = "const A: [i32; 2] = [\n    1,\n];\n\n/// Doubles.\npub fn f(\n    x: i32,\n) -> i32 {\n    if x > 0 {\n        2 * x\n    } else {\n        0\n    }\n}\n\nimpl B {\n    /// Inner.\n    fn f(&self) -> i32 {\n        3\n    }\n}\n";

    #[test]
    fn a_command_is_quoted_with_what_it_prints() {
        let source = "text\n```sh\n$ other\n```\n\nmore\n```text\n$ do this --now\ndone\n```\nend";
        assert_eq!(shell(source, "do this"), Some("$ do this --now\ndone"));
        assert_eq!(shell(source, "more"), None);
    }

    #[test]
    fn an_item_is_quoted_whole_with_its_documentation() {
        let (line, text) = item(SOURCE, "f").unwrap();
        assert_eq!(line, 5);
        assert!(text.starts_with("/// Doubles.\npub fn f(") && text.ends_with("    }\n}"), "{text}");
        assert_eq!(item(SOURCE, "A").unwrap(), (1, "const A: [i32; 2] = [\n    1,\n];".to_string()));
        assert_eq!(
            item(SOURCE, "B::f").unwrap(),
            (17, "/// Inner.\nfn f(&self) -> i32 {\n    3\n}".to_string())
        );
        assert_eq!(item(SOURCE, "g"), None);
        let study = "const STUDY: &str = r#\"\n[[factor]]\nlevels = [\n1\n]\n\"#;\n\nfn f() {\n}\n";
        let quoted = "const STUDY: &str = r#\"\n[[factor]]\nlevels = [\n1\n]\n\"#;";
        assert_eq!(item(study, "STUDY").unwrap(), (1, quoted.to_string()));
    }
}
