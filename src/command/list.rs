//! `calibench list`: which experiments are there, and what do they ask?

use super::{Exit, print};
use calibench_harness::Experiment;

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Prints names only, one a line
    #[arg(long)]
    names: bool,
}

pub(super) fn run(experiments: &[Experiment], arguments: &Arguments) -> Exit {
    let entry = |e: &Experiment| {
        if arguments.names {
            format!("{}\n", e.id)
        } else {
            format!("{} (seed {})\n  {}\n{}\n\n", e.id, e.seed, e.title, wrapped(e.question, 96))
        }
    };
    print(&experiments.iter().map(entry).collect::<String>());
    Exit::Held
}

/// The text in lines of at most `width` characters, indented by two.
fn wrapped(text: &str, width: usize) -> String {
    let mut lines = vec![String::from(" ")];
    for word in text.split_whitespace() {
        let last = lines.last_mut().expect("there is always a line");
        if last.chars().count() + 1 + word.chars().count() > width {
            lines.push(format!("  {word}"));
        } else {
            last.push(' ');
            last.push_str(word);
        }
    }
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_wrapped_between_words() {
        assert_eq!(wrapped("one two three", 10), "  one two\n  three");
    }
}
