//! Bounds on work -> processor time, which is the same on a busy machine; a bound by the clock is a last resort, ten
//! times as far.
#![allow(dead_code, unreachable_pub)]

use std::fmt::Display;
use std::time::{Duration, Instant};

/// Ratio of a bound by the clock to the one on processor time.
pub const LAST_RESORT: u32 = 10;

/// Time between two readings of the processor time, each of which costs ten microseconds.
const OFTEN: Duration = Duration::from_secs(1);

/// Processor time of this thread so far; `None` where the system does not tell.
pub fn spent() -> Option<Duration> {
    let stat = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanos = stat.split(' ').next()?.parse().ok()?;
    Some(Duration::from_nanos(nanos))
}

/// A watch on pieces of work of this thread, one after the other.
#[derive(Debug)]
pub struct Meter {
    lap: Instant,
    read: Instant,
    spent: Option<Duration>,
}

impl Meter {
    /// The first piece of work begins.
    pub fn start() -> Meter {
        let now = Instant::now();
        Meter {
            lap: now,
            read: now,
            spent: spent(),
        }
    }

    /// A piece of work has ended and the next begins; returns what the clock says of it.
    ///
    /// # Panics
    /// It has used more processor time than `limit`, or taken ten times as long by the clock.
    #[track_caller]
    pub fn lap(&mut self, limit: Duration, what: impl Display) -> Duration {
        let elapsed = self.lap.elapsed();
        // What took less by the clock has used less.
        if elapsed > limit {
            let used = spent()
                .zip(self.spent)
                .map(|(now, then)| now.saturating_sub(then));
            // A second of those before it is in it, at most.
            let most = limit + OFTEN;
            if let Some(used) = used {
                assert!(used <= most, "{what}: used {used:?} CPU of {limit:?}");
            }
            assert!(
                elapsed <= limit * LAST_RESORT,
                "{what}: timed out: {elapsed:?} by the clock, the last resort beside {limit:?} CPU (used: {used:?})"
            );
        }
        self.lap = Instant::now();
        if self.lap - self.read > OFTEN {
            self.read = self.lap;
            self.spent = spent();
        }
        elapsed
    }
}
