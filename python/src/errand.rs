//! Work on a thread of its own -> its result, while Python is asked for signals. I/O: a thread.
//!
//! Apart from the work because readers of recordings know nothing of Python: whoever waits for one may press Ctrl-C
//! at any time,
//! also where the work cannot be asked. Then it is told to end, waited for a moment, and left to end by itself.

use crate::refusal;
use pyo3::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

/// Time between two looks for signals.
const PATIENCE: Duration = Duration::from_millis(50);
/// Time for which work that was told to end is waited for.
const GRACE: Duration = Duration::from_millis(300);

/// Whether the work was told to end.
#[derive(Clone, Debug, Default)]
pub struct Stopped(Arc<AtomicBool>);

impl Stopped {
    /// Whether it was.
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Does `work` without the GIL.
///
/// # Errors
/// What a handler of a signal has raised: `KeyboardInterrupt`; the system gives no thread.
pub fn run<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&Stopped) -> T + Send + 'static,
) -> PyResult<T> {
    let stopped = Stopped::default();
    let (done, mut result) = channel();
    let of_work = stopped.clone();
    let thread = std::thread::Builder::new()
        .name("strapd".to_owned())
        .spawn(move || {
            // Nobody waits any more: then nobody wants it.
            let _ = done.send(work(&of_work));
        })
        .map_err(|why| refusal::run(py, "failed", format!("no thread to work on: {why}")))?;
    loop {
        let (back, waited) = py.detach(move || wait(result, PATIENCE));
        result = back;
        match waited {
            Ok(found) => return Ok(found),
            Err(RecvTimeoutError::Timeout) => {
                if let Err(raised) = py.check_signals() {
                    stopped.0.store(true, Ordering::Relaxed);
                    py.detach(move || drop(wait(result, GRACE)));
                    return Err(raised);
                }
            }
            // It has panicked, which is a fault of ours: here as there.
            Err(RecvTimeoutError::Disconnected) => match py.detach(move || thread.join()) {
                Err(panic) => std::panic::resume_unwind(panic),
                Ok(()) => return Err(refusal::run(py, "failed", "the work ended with nothing")),
            },
        }
    }
}

/// The receiver goes in and comes back: it is for one thread at a time.
fn wait<T>(result: Receiver<T>, so_long: Duration) -> (Receiver<T>, Result<T, RecvTimeoutError>) {
    let waited = result.recv_timeout(so_long);
    (result, waited)
}
