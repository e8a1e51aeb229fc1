//! `calibench completions SHELL`: what a shell needs to complete verbs and options.

use super::{Exit, print};
use clap::Args;
use clap_complete::Shell;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The shell: its script goes to standard output, for `source` or the shell's folder of completions
    #[arg(value_enum)]
    shell: Shell,
}

pub(super) fn run(arguments: &Arguments) -> Exit {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut super::examples::command(), "calibench", &mut script);
    print(&String::from_utf8_lossy(&script));
    Exit::Held
}
