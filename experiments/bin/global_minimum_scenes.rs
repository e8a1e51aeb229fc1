//! Every scene of the experiment `global-minimum`, or those of a family: what is committed in
//! golden/global-minimum/.

use calibench_experiments::global_minimum::campaign;
use std::process::ExitCode;

fn main() -> ExitCode {
    campaign::main()
}
