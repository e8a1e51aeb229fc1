//! What is a page made of? Prose, code, mathematics, placeholders, HTML and link targets, each with its line.

/// A piece of a page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Piece<'a> {
    /// Line on which it begins, from 1.
    pub line: usize,
    pub kind: Kind<'a>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Kind<'a> {
    Prose(&'a str),
    /// Fenced or inline code, delimiters included.
    Code(&'a str),
    /// TeX in a line.
    Math(&'a str),
    /// TeX on lines of its own, with its name.
    Equation {
        tex: &'a str,
        label: Option<&'a str>,
    },
    /// What stands between double braces.
    Placeholder(&'a str),
    /// A tag or a comment.
    Html(&'a str),
    /// The target of a link, without its brackets.
    Target(&'a str),
    /// `{#name}` behind a heading, name only.
    Place(&'a str),
    /// Something opened and not closed; what.
    Unclosed(&'static str),
}

/// Splits a page into pieces; together they are the page.
pub(super) fn scan(text: &str) -> Vec<Piece<'_>> {
    let mut scanner = Scanner { text, at: 0, prose_from: 0, pieces: Vec::new() };
    while scanner.at < text.len() {
        if !scanner.special() {
            scanner.at += text[scanner.at..].chars().next().map_or(1, char::len_utf8);
        }
    }
    scanner.flush(text.len());
    scanner.pieces
}

struct Scanner<'a> {
    text: &'a str,
    at: usize,
    prose_from: usize,
    pieces: Vec<Piece<'a>>,
}

impl<'a> Scanner<'a> {
    /// Takes one special piece at the present place, if one begins here.
    fn special(&mut self) -> bool {
        let rest = &self.text[self.at..];
        let line_start = self.at == 0 || self.text.as_bytes()[self.at - 1] == b'\n';
        if line_start && rest.starts_with("```") {
            return self.until(3, "\n```", "code", Kind::Code, true);
        }
        match rest.as_bytes() {
            [b'\\', _, ..] => {
                self.at += 1 + rest[1..].chars().next().map_or(1, char::len_utf8);
                true
            }
            [b'`', ..] => self.until(1, "`", "code", Kind::Code, true),
            [b'{', b'{', ..] => self.until(2, "}}", "placeholder", Kind::Placeholder, false),
            [b'{', b'#', ..] => self.until(2, "}", "name", Kind::Place, false),
            [b'$', b'$', ..] => self.equation(),
            [b'$', ..] => self.until(1, "$", "formula", Kind::Math, false),
            [b'<', b'!', ..] => self.until(4, "-->", "comment", Kind::Html, true),
            [b'<', next, ..] if next.is_ascii_alphabetic() || *next == b'/' => {
                self.until(1, ">", "HTML tag", Kind::Html, true)
            }
            [b']', b'(', ..] => {
                self.at += 2;
                self.flush(self.at);
                self.until(0, ")", "link", Kind::Target, false);
                // The bracket goes back to the prose, if there is one.
                if matches!(self.pieces.last(), Some(Piece { kind: Kind::Target(_), .. })) {
                    self.at -= 1;
                    self.prose_from = self.at;
                }
                true
            }
            _ => false,
        }
    }

    /// Takes the text up to `close`; with `whole`, the delimiters belong to the piece.
    fn until(
        &mut self,
        open: usize,
        close: &str,
        what: &'static str,
        kind: impl Fn(&'a str) -> Kind<'a>,
        whole: bool,
    ) -> bool {
        let start = self.at;
        self.flush(start);
        let Some(length) = self.text.get(start + open..).and_then(|rest| rest.find(close)) else {
            self.push(start, Kind::Unclosed(what));
            self.at = self.text.len();
            self.prose_from = self.at;
            return true;
        };
        let inner_end = start + open + length;
        let end = inner_end + close.len();
        let piece = if whole { &self.text[start..end] } else { self.text[start + open..inner_end].trim() };
        self.push(start, kind(piece));
        self.at = end;
        self.prose_from = end;
        true
    }

    fn equation(&mut self) -> bool {
        let start = self.at;
        self.until(2, "$$", "equation", Kind::Math, false);
        let Some(Piece { kind: Kind::Math(tex), .. }) = self.pieces.last() else { return true };
        let tex = *tex;
        self.pieces.pop();
        let rest = &self.text[self.at..];
        let label = rest.strip_prefix(" {#").and_then(|rest| rest.split_once('}')).map(|(label, _)| label);
        if let Some(label) = label {
            self.at += label.len() + 4;
            self.prose_from = self.at;
        }
        self.push(start, Kind::Equation { tex, label });
        true
    }

    fn flush(&mut self, end: usize) {
        if self.prose_from < end {
            let text = &self.text[self.prose_from..end];
            self.push(self.prose_from, Kind::Prose(text));
        }
        self.prose_from = end;
    }

    fn push(&mut self, start: usize, kind: Kind<'a>) {
        let line = 1 + self.text[..start].bytes().filter(|&b| b == b'\n').count();
        self.pieces.push(Piece { line, kind });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinds(text: &str) -> Vec<Kind<'_>> {
        scan(text).into_iter().map(|p| p.kind).collect()
    }

    #[test]
    fn a_page_falls_into_its_pieces() {
        use Kind::*;
        assert_eq!(
            kinds("a $x$ b {{num e.n .4}} `c $`"),
            [Prose("a "), Math("x"), Prose(" b "), Placeholder("num e.n .4"), Prose(" "), Code("`c $`")]
        );
        assert_eq!(
            kinds("[t](x.md#a) <b>z"),
            [Prose("[t]("), Target("x.md#a"), Prose(") "), Html("<b>"), Prose("z")]
        );
        assert_eq!(kinds("$$\ny\n$$ {#eq:y}\n"), [Equation { tex: "y", label: Some("eq:y") }, Prose("\n")]);
        assert_eq!(kinds("# H {#h}"), [Prose("# H "), Place("h")]);
    }

    #[test]
    fn lines_are_counted_and_what_is_not_closed_is_told() {
        let pieces = scan("a\n\n{{num");
        assert_eq!(pieces[1], Piece { line: 3, kind: Kind::Unclosed("placeholder") });
        // The last letter takes two bytes: there is no bracket to put back.
        let open = [Kind::Prose("[t]("), Kind::Unclosed("link")];
        assert_eq!(kinds("[t](caf\u{e9}"), open);
        assert_eq!(kinds("[t](x"), open);
        let pieces = scan("a\n```rust\n{{x}}\n```\nb {{y}}");
        assert_eq!(pieces[1].line, 2);
        assert_eq!(pieces[3], Piece { line: 5, kind: Kind::Placeholder("y") });
    }
}
