//! What repeats -> one log line for each cause in ten seconds or more, with how many were not said. I/O.

use std::collections::HashMap;
use std::sync::{LazyLock, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Between two lines of one cause.
const INTERVAL: Duration = Duration::from_secs(10);

/// When each cause was said last, and how often it was not since. There are as many as there are
/// places that warn, and sources.
static SAID: LazyLock<Mutex<HashMap<String, (Instant, u64)>>> = LazyLock::new(Mutex::default);

/// Informs, unless the same cause was spoken of just now.
pub(super) fn info(cause: &str, what: &str) {
    if let Some(suppressed) = due(cause, INTERVAL, Instant::now()) {
        match suppressed {
            0 => tracing::info!("{what}"),
            n => tracing::info!("{what} (and {n} more like it since)"),
        }
    }
}

/// Warns, unless the same cause was warned of just now.
pub(super) fn warn(cause: &str, what: &str) {
    warn_every(INTERVAL, cause, what);
}

/// Warns, unless the same cause was warned of within the `interval`.
pub(super) fn warn_every(interval: Duration, cause: &str, what: &str) {
    if let Some(suppressed) = due(cause, interval, Instant::now()) {
        match suppressed {
            0 => tracing::warn!("{what}"),
            n => tracing::warn!("{what} (and {n} more like it since)"),
        }
    }
}

fn due(cause: &str, interval: Duration, now: Instant) -> Option<u64> {
    let mut said = SAID.lock().unwrap_or_else(PoisonError::into_inner);
    match said.get_mut(cause) {
        Some((last, suppressed)) if now.saturating_duration_since(*last) < interval => {
            *suppressed += 1;
            None
        }
        Some((last, suppressed)) => {
            *last = now;
            Some(std::mem::take(suppressed))
        }
        None => {
            said.insert(cause.to_owned(), (now, 0));
            Some(0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_line_in_ten_seconds_for_each_cause() {
        let start = Instant::now();
        assert_eq!(due("test a", INTERVAL, start), Some(0));
        assert_eq!(due("test b", INTERVAL, start), Some(0));
        for n in 1..10 {
            assert_eq!(
                due("test a", INTERVAL, start + Duration::from_secs(n)),
                None
            );
        }
        assert_eq!(
            due("test a", INTERVAL, start + Duration::from_secs(10)),
            Some(9)
        );
        assert_eq!(
            due("test b", 6 * INTERVAL, start + Duration::from_secs(59)),
            None
        );
        assert_eq!(
            due("test a", INTERVAL, start + Duration::from_secs(11)),
            None
        );
    }
}
