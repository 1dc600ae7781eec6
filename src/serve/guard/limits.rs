//! Every bound of the daemon in one place, and what slows down what repeats. Pure: time is given.

use std::time::{Duration, Instant};

/// The bounds. The defaults are those of the documentation; tests shorten the times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Most connections at once, over all listeners, of those who converse (`--max-clients`).
    pub connections: usize,
    /// Most connections of plain HTTP beside them.
    pub http: usize,
    /// Most connections that have not shown the token that is asked for, beside them.
    pub unproven: usize,
    /// Most sensors (`--max-sensors`).
    pub sensors: usize,
    /// Most sensors of one connection, and numbers of packed streams it may bind.
    pub sensors_of_client: usize,
    /// Consecutive bad lines after which a connection is closed.
    pub errors_in_a_row: u32,
    /// Time by which the first line (or the head of the first HTTP request) must have come.
    pub first_line: Duration,
    /// Time that a client may take nothing while something waits for it.
    pub no_progress: Duration,
    /// Time for which a client that sends and watches nothing keeps its place when places are short.
    pub idle: Duration,
    /// Time between WebSocket pings (a client that answers none of two is closed), and for which nothing is sent to a
    /// watcher that has ended its side before it is asked whether it is still there.
    pub ping: Duration,
    /// Time for which a sensor sent by datagrams stays its sender's after the last.
    pub sender_silence: Duration,
    /// Time for which a sensor may be silent and keep its place (`--forget-after`); none: until another needs it.
    pub forget_after: Option<Duration>,
    /// Time by which a shutdown has drained.
    pub drain: Duration,
    /// Time by which a new connection may go back and send again what a sensor has sent before.
    pub state_window: Duration,
}

impl Default for Limits {
    fn default() -> Limits {
        Limits {
            connections: 256,
            http: 64,
            unproven: 256,
            sensors: 1024,
            sensors_of_client: 256,
            errors_in_a_row: 20,
            first_line: Duration::from_secs(10),
            no_progress: Duration::from_secs(10),
            idle: Duration::from_secs(60),
            ping: Duration::from_secs(15),
            sender_silence: Duration::from_secs(5),
            forget_after: None,
            drain: Duration::from_secs(2),
            state_window: Duration::from_secs(60),
        }
    }
}

impl Limits {
    /// Limits for so many sensors: a quarter of them from one connection, and no fewer than ever.
    #[must_use]
    pub fn of_sensors(sensors: usize) -> Limits {
        let few = Limits::default();
        Limits {
            sensors,
            sensors_of_client: few.sensors_of_client.max(sensors / 4),
            ..few
        }
    }

    /// The bounds for so many clients: as many may be about to show the token, and no fewer than ever.
    #[must_use]
    pub fn of_clients(self, connections: usize) -> Limits {
        Limits {
            connections,
            unproven: Limits::default().unproven.max(connections),
            ..self
        }
    }

    /// Most sensors of one peer, over all its connections: half of all, so that nobody takes them from
    /// everybody else, but no fewer than one connection may send.
    #[must_use]
    pub fn sensors_of_peer(&self) -> usize {
        (self.sensors / 2).max(self.sensors_of_client)
    }

    /// Interval at which a connection looks at its clocks.
    #[must_use]
    pub fn tick(&self) -> Duration {
        let shortest = self.first_line.min(self.no_progress).min(self.ping);
        (shortest / 8).clamp(Duration::from_millis(10), Duration::from_secs(1))
    }
}

/// Wait after an `accept` that failed: 10 ms, doubled up to 1 s; from the start again
/// after one that did not.
#[derive(Clone, Copy, Debug, Default)]
pub struct Backoff {
    failures: u32,
}

impl Backoff {
    /// Counts a failure; returns how long to wait.
    pub fn failed(&mut self) -> Duration {
        let wait = Duration::from_millis(10 << self.failures.min(7));
        self.failures += 1;
        wait.min(Duration::from_secs(1))
    }

    /// Counts a success.
    pub fn worked(&mut self) {
        self.failures = 0;
    }
}

/// Allowance of at most `burst` at once and one a second after that; the others are counted.
#[derive(Clone, Copy, Debug)]
pub struct Allowance {
    burst: u32,
    left: u32,
    since: Option<Instant>,
    suppressed: u64,
}

impl Allowance {
    /// Full.
    #[must_use]
    pub fn new(burst: u32) -> Allowance {
        Allowance {
            burst,
            left: burst,
            since: None,
            suppressed: 0,
        }
    }

    /// Whether one more may be said now: then how many were not said since the last.
    pub fn take(&mut self, now: Instant) -> Option<u64> {
        let since = *self.since.get_or_insert(now);
        let secs = now.saturating_duration_since(since).as_secs();
        if secs > 0 {
            self.left = self.burst.min(
                self.left
                    .saturating_add(u32::try_from(secs).unwrap_or(u32::MAX)),
            );
            self.since = Some(since + Duration::from_secs(secs));
        }
        if self.left == 0 {
            self.suppressed += 1;
            return None;
        }
        self.left -= 1;
        Some(std::mem::take(&mut self.suppressed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accept_is_tried_again_after_ten_milliseconds_and_at_most_a_second() {
        let mut backoff = Backoff::default();
        let waits: Vec<u128> = (0..40).map(|_| backoff.failed().as_millis()).collect();
        assert_eq!(waits[..9], [10, 20, 40, 80, 160, 320, 640, 1000, 1000]);
        assert_eq!(waits[39], 1000);
        backoff.worked();
        assert_eq!(backoff.failed().as_millis(), 10);
    }

    #[test]
    fn what_repeats_is_said_in_a_burst_and_then_once_a_second_with_its_count() {
        let start = Instant::now();
        let mut allowance = Allowance::new(3);
        let said: Vec<_> = (0..10).map(|_| allowance.take(start)).collect();
        assert_eq!(said[..4], [Some(0), Some(0), Some(0), None]);
        assert_eq!(allowance.take(start + Duration::from_millis(999)), None);
        assert_eq!(allowance.take(start + Duration::from_millis(1001)), Some(8));
        assert_eq!(allowance.take(start + Duration::from_millis(1002)), None);
        // An hour later it is full again, and no more than full.
        let later = start + Duration::from_secs(3600);
        let said: Vec<_> = (0..4).map(|_| allowance.take(later).is_some()).collect();
        assert_eq!(said, [true, true, true, false]);
    }
}
