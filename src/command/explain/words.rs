//! Answers in lines: a word on the left, what it says on the right, wrapped for a narrow terminal.

use std::fmt::Write;

/// Columns of the words on the left.
const LEFT: usize = 12;
/// Columns of a line.
const WIDTH: usize = 100;

/// An answer.
#[derive(Debug, Default)]
pub(super) struct Answer(String);

impl Answer {
    /// Begins with a line of its own.
    pub fn headed(heading: &str) -> Answer {
        Answer(format!("{heading}\n"))
    }

    /// A line, or as many as it takes. Empty words continue what stands above.
    pub fn say(&mut self, word: &str, what: &str) {
        let mut left = word.to_string();
        let mut line = String::new();
        for part in what.split_whitespace() {
            if !line.is_empty() && LEFT + line.chars().count() + 1 + part.chars().count() > WIDTH {
                self.line(&std::mem::take(&mut left), &std::mem::take(&mut line));
            }
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(part);
        }
        self.line(&left, &line);
    }

    /// Several under one word.
    pub fn list(&mut self, word: &str, each: impl IntoIterator<Item = String>) {
        let mut word = word;
        for one in each {
            self.say(std::mem::take(&mut word), &one);
        }
    }

    /// An empty line and another heading.
    pub fn part(&mut self, heading: &str) {
        self.0.push_str(&format!("\n{heading}\n"));
    }

    fn line(&mut self, left: &str, right: &str) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.0, "  {left:<width$}{right}", width = LEFT - 2);
    }

    pub fn text(self) -> String {
        self.0
    }
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
}
