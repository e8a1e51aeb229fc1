//! The trials of the experiment `model-choice`, every candidate fitted: what is committed in
//! golden/model-choice/.

use calibench_experiments::model_choice::campaign;
use std::process::ExitCode;

fn main() -> ExitCode {
    campaign::main()
}
