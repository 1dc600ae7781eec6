//! Repeated events -> one log line for each cause in ten seconds or more, with how many were not logged. I/O.

use std::collections::HashMap;
use std::sync::{LazyLock, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Time between two lines of one cause.
const INTERVAL: Duration = Duration::from_secs(10);

/// Causes that are told apart at once, and what those beyond are called together: a name that somebody else gives
/// may be part of one.
const MOST: usize = 512;
const OTHERS: &str = "others";

/// Time from which each cause may be logged again, and how often it was not since.
static SAID: LazyLock<Mutex<Said>> = LazyLock::new(Mutex::default);

type Said = HashMap<String, (Instant, u64)>;

/// Informs, unless the same cause was spoken of just now.
pub(in crate::serve) fn info(cause: &str, what: &str) {
    if let Some(suppressed) = due(cause, INTERVAL, Instant::now()) {
        match suppressed {
            0 => tracing::info!("{what}"),
            n => tracing::info!("{what} (and {n} more like it since)"),
        }
    }
}

/// Warns, unless the same cause was warned of just now.
pub(in crate::serve) fn warn(cause: &str, what: &str) {
    warn_every(INTERVAL, cause, what);
}

/// Warns, unless the same cause was warned of within the `interval`.
pub(in crate::serve) fn warn_every(interval: Duration, cause: &str, what: &str) {
    if let Some(suppressed) = due(cause, interval, Instant::now()) {
        match suppressed {
            0 => tracing::warn!("{what}"),
            n => tracing::warn!("{what} (and {n} more like it since)"),
        }
    }
}

fn due(cause: &str, interval: Duration, now: Instant) -> Option<u64> {
    let mut said = SAID.lock().unwrap_or_else(PoisonError::into_inner);
    due_of(&mut said, cause, interval, now)
}

fn due_of(said: &mut Said, cause: &str, interval: Duration, now: Instant) -> Option<u64> {
    let cause = match said.len() >= MOST && !said.contains_key(cause) {
        true => {
            said.retain(|_, (next, _)| now < *next);
            if said.len() < MOST { cause } else { OTHERS }
        }
        false => cause,
    };
    let Some((next, suppressed)) = said.get_mut(cause) else {
        said.insert(cause.to_owned(), (now + interval, 0));
        return Some(0);
    };
    if now < *next {
        *suppressed += 1;
        return None;
    }
    *next = now + interval;
    Some(std::mem::take(suppressed))
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
            due("test b", 6 * INTERVAL, start + Duration::from_secs(10)),
            Some(0)
        );
        assert_eq!(
            due("test b", INTERVAL, start + Duration::from_secs(69)),
            None
        );
        assert_eq!(
            due("test a", INTERVAL, start + Duration::from_secs(11)),
            None
        );
    }

    #[test]
    fn ever_new_causes_are_one_beyond_some_and_are_forgotten() {
        let (mut known, start) = (Said::new(), Instant::now());
        let mut due = |n: u32, now| due_of(&mut known, &format!("test {n}"), INTERVAL, now);
        let said = (0..10_000).filter(|n| due(*n, start).is_some()).count();
        assert_eq!(said, MOST + 1);
        assert!(due(20_000, start + INTERVAL).is_some());
        assert_eq!(known.len(), 1);
    }
}
