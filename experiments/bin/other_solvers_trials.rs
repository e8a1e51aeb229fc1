//! The trials of the experiment `other-solvers`, asked of one program: what is committed in
//! golden/other-solvers/.

use calibench_experiments::other_solvers::campaign;
use std::process::ExitCode;

fn main() -> ExitCode {
    campaign::main()
}
