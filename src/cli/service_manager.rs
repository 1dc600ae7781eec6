//! Words of the daemon to a service manager that asks for them (systemd): ready, stopping, alive. I/O.
//!
//! Apart from the daemon's command because only Unix has one.

#[cfg(unix)]
use sd_notify::{NotifyState, notify, watchdog_enabled};
#[cfg(unix)]
use std::time::Duration;

/// Tells it that the daemon is ready, and from then on that the runtime still turns.
#[cfg(unix)]
pub(super) fn ready() {
    // Nobody may have started us that wants to know.
    let _ = notify(&[NotifyState::Ready]);
    tokio::spawn(pat_the_watchdog());
}

/// Tells it that the daemon ends.
#[cfg(unix)]
pub(super) fn stopping() {
    let _ = notify(&[NotifyState::Stopping]);
}

#[cfg(unix)]
async fn pat_the_watchdog() {
    let Some(limit) = watchdog_enabled().filter(|limit| !limit.is_zero()) else {
        return;
    };
    let mut tick = tokio::time::interval((limit / 2).max(Duration::from_millis(1)));
    loop {
        tick.tick().await;
        let _ = notify(&[NotifyState::Watchdog]);
    }
}

/// Tells nobody: there is no service manager that asks.
#[cfg(not(unix))]
pub(super) fn ready() {}

/// Tells nobody.
#[cfg(not(unix))]
pub(super) fn stopping() {}
