//! Answers in lines: a word on the left, what it says on the right, wrapped for a narrow terminal.

use serde_json::{Value, json};

/// Columns of the words on the left.
const LEFT: usize = 12;
/// Columns of a line.
const WIDTH: usize = 100;

/// An answer: parts with a heading each.
#[derive(Debug)]
pub(super) struct Answer(Vec<Part>);

#[derive(Debug)]
struct Part {
    heading: String,
    /// What each word says; several where it is a list.
    said: Vec<(String, Vec<String>)>,
}

impl Answer {
    /// Begins with a line of its own.
    pub fn headed(heading: &str) -> Answer {
        let mut answer = Answer(Vec::new());
        answer.part(heading);
        answer
    }

    /// A word and what it says.
    pub fn say(&mut self, word: &str, what: &str) {
        self.list(word, [what.to_string()]);
    }

    /// Several under one word; none is not said.
    pub fn list(&mut self, word: &str, each: impl IntoIterator<Item = String>) {
        let each: Vec<String> = each.into_iter().collect();
        if let Some(part) = self.0.last_mut().filter(|_| !each.is_empty()) {
            part.said.push((word.to_string(), each));
        }
    }

    /// An empty line and another heading.
    pub fn part(&mut self, heading: &str) {
        self.0.push(Part { heading: heading.to_string(), said: Vec::new() });
    }

    /// For people.
    pub fn text(&self) -> String {
        let part = |part: &Part| {
            let lines = part.said.iter().flat_map(|(word, each)| lines(word, each));
            format!("{}\n{}", part.heading, lines.collect::<String>())
        };
        self.0.iter().map(part).collect::<Vec<_>>().join("\n")
    }

    /// For programs: what each word says; a list where it says several things.
    pub fn json(&self) -> Value {
        let part = |part: &Part| {
            let mut json = json!({ "name": part.heading });
            for (word, each) in &part.said {
                let said = match each.as_slice() {
                    [one] => json!(one),
                    several => json!(several),
                };
                // A word that comes twice, as "computed" of a number and of the claim of its name, is a list.
                json[word.replace(' ', "_")] = match json.get(word.replace(' ', "_")) {
                    None => said,
                    Some(before) => json!([before, said]),
                };
            }
            json
        };
        json!(self.0.iter().map(part).collect::<Vec<_>>())
    }
}

/// Lines of one word.
fn lines(word: &str, each: &[String]) -> Vec<String> {
    let mut left = word.to_string();
    let mut lines = Vec::new();
    for what in each {
        for right in wrapped(what) {
            lines.push(format!("  {:<width$}{right}\n", std::mem::take(&mut left), width = LEFT - 2));
        }
    }
    lines
}

/// A text in lines as wide as there is room beside the words; an empty one is an empty line.
fn wrapped(what: &str) -> Vec<String> {
    let mut lines = vec![String::new()];
    for part in what.split_whitespace() {
        let last = lines.last_mut().expect("there is always a line");
        if !last.is_empty() && LEFT + last.chars().count() + 1 + part.chars().count() > WIDTH {
            lines.push(part.to_string());
        } else {
            if !last.is_empty() {
                last.push(' ');
            }
            last.push_str(part);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_long_goes_on_below_itself() {
        let mut answer = Answer::headed("name");
        answer.say("band", &"word ".repeat(30));
        answer.list("claims", ["one".to_string(), "two".to_string()]);
        let text = answer.text();
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines.iter().all(|line| line.chars().count() <= WIDTH));
        assert_eq!(&lines[2][..LEFT + 4], "            word");
        assert_eq!(lines[3..], ["  claims    one", "            two"]);
    }

    #[test]
    fn a_program_reads_what_people_read() {
        let mut answer = Answer::headed("e.n");
        answer.say("value", "1 px");
        answer.list("judged by", ["one".to_string(), "two".to_string()]);
        answer.say("computed", "a.rs:1");
        answer.say("computed", "a.rs:2");
        answer.part("more");
        let expected = json!([
            {"name": "e.n", "value": "1 px", "judged_by": ["one", "two"], "computed": ["a.rs:1", "a.rs:2"]},
            {"name": "more"},
        ]);
        assert_eq!(answer.json(), expected);
    }
}
