//! A file that may not grow further -> an error of the write, not the death of the process. I/O.
//!
//! Beyond `ulimit -f` the system sends SIGXFSZ, which ends a process that does not catch it, with its
//! output cut and no word said. Caught, the write fails with "file too large" like any other.

/// Catches SIGXFSZ for the whole process; for programs to call once, when they start.
pub fn make_size_limit_an_error() {
    #[cfg(unix)]
    {
        use std::sync::{Arc, atomic::AtomicBool};
        // What the handler sets is not needed: the failing write says it all.
        let caught = Arc::new(AtomicBool::new(false));
        if let Err(e) = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, caught) {
            tracing::warn!("a limit on file sizes will end the run without a word: {e}");
        }
    }
}
