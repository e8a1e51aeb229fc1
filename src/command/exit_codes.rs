//! `calibench exit-codes`: what do they say, of every verb?

use super::{Exit, print};

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {}

pub(super) fn run(_: &Arguments) -> Exit {
    print(include_str!("exit_codes.md"));
    Exit::Held
}
