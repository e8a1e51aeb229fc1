//! How many instructions does a kernel take? Repeats one row's work, for `valgrind` to count: `instructions
//! ROW TIMES`.
//!
//! `.ci/instructions` runs it with two counts; the difference is that of the repetitions, without making the
//! input.

mod common;
mod works;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [row, times] = &arguments[..] else { return Err("usage: instructions ROW TIMES".into()) };
    works::named(row).ok_or_else(|| format!("no row {row}"))?.repeat(times.parse()?);
    Ok(())
}
