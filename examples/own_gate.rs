//! Is a solver of one's own to be trusted? The gate asks it problems with known answers; here one that
//! reports a focal length too large.
//!
//! `cargo run --release --example own_gate`
#![allow(clippy::print_stdout, reason = "an example shows what it finds")]

use calibench_gate::accept::Breakage;
use calibench_gate::protocol::{Answer, Problem};
use calibench_gate::{Builtin, Plan, Report, Solver, Terms, run as ask};
use std::error::Error;

/// Your solver: it takes a problem and gives an answer. This one changes the answer of another.
struct Mine {
    /// Factor on the focal length.
    factor: f64,
}

impl Solver for Mine {
    fn name(&self) -> String {
        format!("mine, fx times {}", self.factor)
    }

    fn ask(&self, problem: &Problem) -> Result<Answer, Breakage> {
        let mut answer = Builtin.ask(problem)?;
        if let Some(fx) = answer.parameters.get_mut("fx") {
            *fx *= self.factor;
        }
        Ok(answer)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    if run()? == (true, false) { Ok(()) } else { Err("the gate should tell them apart".into()) }
}

/// Whether the gate trusts the solver as it is, and with a focal length too large by a thousandth.
pub fn run() -> Result<(bool, bool), Box<dyn Error>> {
    // Seed, and samples of every scenario; a thorough run takes some thousand.
    let plan = Plan::new(1, 8)?;
    let judged = |factor: f64| {
        let mine = Mine { factor };
        let report = Report::new(&plan, &mine.name(), &ask(&plan, &mine, &|_| ()), &Terms::default(), 0.0);
        println!("{}", report.conclusion());
        report.held()
    };
    Ok((judged(1.0), judged(1.001)))
}
