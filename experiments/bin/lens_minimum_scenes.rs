//! The scenes of the experiment `lens-minimum`, judged: what is committed in golden/lens-minimum/.

use calibench_experiments::lens_minimum::campaign;
use std::process::ExitCode;

fn main() -> ExitCode {
    campaign::main()
}
