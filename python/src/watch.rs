//! How does a long call let Python go on, and hear Ctrl-C?

use crate::errors;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

/// How long Ctrl-C waits at most: a person does not notice a twentieth of a second.
const PATIENCE: Duration = Duration::from_millis(50);

/// The process in which the library's threads were first needed.
static OF_THREADS: OnceLock<u32> = OnceLock::new();

/// Refuses work that is shared among threads in a process that was forked after they were started: they did not come along, and it would wait
/// for them for ever.
pub(crate) fn needs_threads(py: Python<'_>) -> PyResult<()> {
    let ourselves = std::process::id();
    match *OF_THREADS.get_or_init(|| ourselves) == ourselves {
        true => Ok(()),
        false => {
            let text = "this process was forked from one that had used the library's threads, and has none of them: start workers by \
                        multiprocessing.get_context(\"spawn\") or \"forkserver\"";
            Err(errors::numbered(py, "CalibenchError", "Forked", text.to_string(), |_| Ok(())))
        }
    }
}

/// Runs `work` without the interpreter's lock, so that other threads of Python run meanwhile.
///
/// A `long` call is done by a thread of its own, while this one asks every 50 ms whether Ctrl-C was pressed. If so `KeyboardInterrupt` is
/// raised at once; the solver cannot be stopped half way, so its thread ends its work unseen. A short call is done here: starting a thread
/// would take longer than many a calibration.
pub(crate) fn detached<T: Send + 'static>(
    py: Python<'_>,
    long: bool,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    if !long {
        return Ok(py.detach(work));
    }
    interruptible(py, move |_| work())
}

/// Runs `work` in a thread of its own while this one asks every 50 ms whether Ctrl-C was pressed. If so `KeyboardInterrupt` is raised at
/// once, and `work` may see by its flag that nobody waits for it any more.
pub(crate) fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&AtomicBool) -> T + Send + 'static,
) -> PyResult<T> {
    let stop = Arc::new(AtomicBool::new(false));
    let seen = stop.clone();
    let (sender, mut receiver) = channel();
    std::thread::spawn(move || {
        // Nobody listens any more after Ctrl-C.
        let _ = sender.send(work(&seen));
    });
    loop {
        let (received, back) = py.detach(move || (receiver.recv_timeout(PATIENCE), receiver));
        receiver = back;
        match received {
            Ok(result) => return Ok(result),
            Err(RecvTimeoutError::Timeout) => {
                py.check_signals().inspect_err(|_| stop.store(true, Ordering::Relaxed))?;
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err(
                    "the calculation ended without a result: a fault of calibench",
                ));
            }
        }
    }
}
