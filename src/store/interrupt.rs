//! Signals that end a process -> whoever has something to take back first. I/O.
//!
//! Apart from the upload because it holds for the whole process: from the first upload on, SIGINT and SIGTERM are looked at
//! here; where none is under way they do what they always do: end the process, or what somebody else who listens (a page that is
//! served) makes of them.

use crate::serve::guard::shutdown::Signals;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicUsize, Ordering};
use tokio::sync::watch;

/// Uploads under way.
static UNDER_WAY: AtomicUsize = AtomicUsize::new(0);
/// The signal that came; 0 before.
static CAME: LazyLock<watch::Sender<i32>> = LazyLock::new(|| {
    #[cfg(unix)]
    tokio::spawn(look());
    watch::channel(0).0
});

/// While it lives, signals wait for it.
#[derive(Debug)]
pub(super) struct Interrupt {
    came: watch::Receiver<i32>,
}

/// Begins to look for signals.
pub(super) fn interrupt() -> Interrupt {
    UNDER_WAY.fetch_add(1, Ordering::SeqCst);
    Interrupt {
        came: CAME.subscribe(),
    }
}

impl Interrupt {
    /// Waits for one.
    pub(super) async fn come(&mut self) {
        if self.came.wait_for(|signal| *signal != 0).await.is_err() {
            std::future::pending::<()>().await;
        }
    }

    pub(super) fn has_come(&self) -> bool {
        *self.came.borrow() != 0
    }

    /// Ends the process by it.
    pub(super) fn end(&self) {
        end_by(*self.came.borrow());
    }
}

impl Drop for Interrupt {
    fn drop(&mut self) {
        UNDER_WAY.fetch_sub(1, Ordering::SeqCst);
    }
}

fn end_by(signal: i32) {
    #[cfg(unix)]
    let _ = signal_hook::low_level::emulate_default_handler(signal);
    #[cfg(not(unix))]
    let _ = signal;
}

#[cfg(unix)]
async fn look() {
    use tokio::signal::unix::{SignalKind, signal};
    let kinds = [SignalKind::interrupt(), SignalKind::terminate()];
    let [Ok(mut interrupt), Ok(mut terminate)] = kinds.map(signal) else {
        return;
    };
    loop {
        let came = tokio::select! {
            _ = interrupt.recv() => SignalKind::interrupt(),
            _ = terminate.recv() => SignalKind::terminate(),
        };
        match UNDER_WAY.load(Ordering::SeqCst) {
            0 if Signals::are_heard() => {}
            0 => end_by(came.as_raw_value()),
            _ => drop(CAME.send_replace(came.as_raw_value())),
        }
    }
}
