//! `calibench list`: which experiments are there, and what do they ask?

use super::format::Format;
use super::{Exit, print};
use calibench_harness::Experiment;
use serde_json::{Value, json};

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Prints names only, one a line
    #[arg(long)]
    names: bool,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text, conflicts_with = "names")]
    format: Format,
}

pub(super) fn run(experiments: &[Experiment], arguments: &Arguments) -> Exit {
    let entry = |e: &Experiment| {
        if arguments.names {
            format!("{}\n", e.id)
        } else {
            format!("{} (seed {})\n  {}\n{}\n\n", e.id, e.seed, e.title, wrapped(e.question, 96))
        }
    };
    match arguments.format {
        Format::Text => print(&experiments.iter().map(entry).collect::<String>()),
        Format::Json => {
            let all: Vec<Value> = experiments.iter().map(as_json).collect();
            print(&format!("{:#}\n", json!(all)));
        }
    }
    Exit::Held
}

fn as_json(experiment: &Experiment) -> Value {
    let Experiment { id, title, question, seed, takes_image, .. } = experiment;
    json!({ "id": id, "title": title, "question": question, "seed": seed, "takes_image": takes_image })
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
