//! Every scene of the experiment global-minimum, or those of a family.

#[path = "../global_minimum.rs"]
mod global_minimum;

fn main() -> std::process::ExitCode {
    global_minimum::campaign::main()
}
