//! Data time -> wall time: hands a stream on no faster than asked. I/O (the clock).
//!
//! After the integration, never before it: the speed of a replay changes when a result is written,
//! not which bits it has.

use crate::record::Nanos;
use std::time::{Duration, Instant};

/// Largest share of data handed on at once, s of data time at speed 1.
const SLICE_NANOS: i64 = 5_000_000;

/// Paces a stream: data time advances `speed` times as fast as the wall clock.
#[derive(Debug)]
pub struct Pace {
    speed: f64,
    origin: Option<(Nanos, Instant)>,
}

impl Pace {
    /// `None` = as fast as possible.
    #[must_use]
    pub fn new(speed: Option<f64>) -> Option<Pace> {
        speed.map(|speed| Pace { speed, origin: None })
    }

    /// How many of the samples with these stamps may go together now: at least one.
    pub fn take(&self, stamps: impl Iterator<Item = Nanos>) -> usize {
        let slice = (SLICE_NANOS as f64 * self.speed.max(1e-3)) as i64;
        let mut first = None;
        stamps
            .take_while(|stamp| stamp.since(*first.get_or_insert(*stamp)).abs() <= slice)
            .count()
            .max(1)
    }

    /// Sleeps until `stamp` is due. A stamp before the origin, or far beyond the last (a clock
    /// jump), restarts the origin instead of waiting.
    pub fn wait(&mut self, stamp: Nanos) {
        const JUMP_SECS: f64 = 10.0;
        let now = Instant::now();
        let (start, begun) = *self.origin.get_or_insert((stamp, now));
        let due_secs = stamp.secs_since(start) / self.speed;
        let elapsed = now.duration_since(begun).as_secs_f64();
        let wait = due_secs - elapsed;
        if due_secs < 0.0 || wait > JUMP_SECS {
            self.origin = Some((stamp, now));
        } else if wait > 0.0 {
            std::thread::sleep(Duration::from_secs_f64(wait));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_least_one_sample_goes_and_no_more_than_a_slice() {
        let Some(pace) = Pace::new(Some(1.0)) else { return };
        let stamps = |n: i64, step: i64| (0..n).map(move |i| Nanos(i * step));
        assert_eq!(pace.take(stamps(10, 100_000_000)), 1);
        assert_eq!(pace.take(stamps(100, 1_000_000)), 6);
    }

    #[test]
    fn a_clock_jump_is_not_waited_for() {
        let Some(mut pace) = Pace::new(Some(1.0)) else { return };
        let begun = Instant::now();
        pace.wait(Nanos(0));
        pace.wait(Nanos(3_600_000_000_000));
        pace.wait(Nanos(0));
        assert!(begun.elapsed() < Duration::from_secs(1));
    }
}
