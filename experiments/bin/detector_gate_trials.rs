//! The photographs of the experiment `detector-gate`, shown to one program: what is committed in
//! golden/detector-gate/.

use calibench_experiments::detector_gate::campaign;
use std::process::ExitCode;

fn main() -> ExitCode {
    campaign::main()
}
