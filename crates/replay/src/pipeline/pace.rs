//! Data time -> wall time: hands a stream on no faster than asked. I/O (the clock).
//!
//! After the integration, never before it: the speed of a replay changes when a result is written,
//! not which bits it has.

use std::time::{Duration, Instant};
use strapd_attitude::record::Nanos;

/// Data handed on at once spans less than this, ns of data time at speed 1.
const SLICE_NANOS: i64 = 1_000_000;

/// A longer step of data time is not waited for.
const JUMP_NANOS: i64 = 10_000_000_000;

/// Paces a stream: data time advances `speed` times as fast as the wall clock.
#[derive(Debug)]
pub struct Pace {
    speed: f64,
    origin: Option<(Nanos, Instant)>,
    last: Option<Nanos>,
}

impl Pace {
    /// `None` = as fast as possible.
    #[must_use]
    pub fn new(speed: Option<f64>) -> Option<Pace> {
        speed.map(|speed| Pace {
            speed,
            origin: None,
            last: None,
        })
    }

    /// Number of the samples with these stamps that may go together now: at least one.
    pub fn take(&self, stamps: impl Iterator<Item = Nanos>) -> usize {
        let slice = self.slice_nanos();
        let mut first = None;
        stamps
            .take_while(|stamp| stamp.since(*first.get_or_insert(*stamp)).abs() < slice)
            .count()
            .max(1)
    }

    /// Sleeps until `stamp` is due. A stamp far from the last one (a clock jump, a long gap) restarts
    /// the origin instead of waiting; one a little before it, of another topic, goes at once.
    pub fn wait(&mut self, stamp: Nanos) {
        let wait = self.until(stamp, Instant::now());
        if wait > Duration::ZERO {
            std::thread::sleep(wait);
        }
    }

    /// Restarts at the next sample, as if it were the first.
    pub fn restart(&mut self) {
        self.origin = None;
        self.last = None;
    }

    /// Sets the speed from `now` on, as a multiple of the data's.
    pub fn set_speed(&mut self, speed: f64, now: Instant) {
        self.origin = self.origin.map(|(start, begun)| {
            let elapsed = now.saturating_duration_since(begun).as_secs_f64() * self.speed * 1e9;
            (Nanos(start.0.saturating_add(elapsed as i64)), now)
        });
        self.speed = speed;
    }

    /// Time after `now` at which `stamp` is due. It may be asked for the same stamp again.
    pub fn until(&mut self, stamp: Nanos, now: Instant) -> Duration {
        // In data time: at a low speed an ordinary step is long on the wall.
        let longest = JUMP_NANOS.max(self.slice_nanos().saturating_mul(2));
        let jumped = self
            .last
            .is_some_and(|last| stamp.since(last).saturating_abs() > longest);
        self.last = Some(stamp);
        if jumped {
            self.origin = None;
        }
        let (start, begun) = *self.origin.get_or_insert((stamp, now));
        let due = stamp.secs_since(start) / self.speed;
        let elapsed = now.duration_since(begun).as_secs_f64();
        Duration::try_from_secs_f64(due - elapsed).unwrap_or(Duration::ZERO)
    }

    fn slice_nanos(&self) -> i64 {
        (SLICE_NANOS as f64 * self.speed.max(1e-3)) as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_least_one_sample_goes_and_no_more_than_a_slice() {
        let Some(pace) = Pace::new(Some(1.0)) else {
            return;
        };
        let stamps = |n: i64, step: i64| (0..n).map(move |i| Nanos(i * step));
        assert_eq!(pace.take(stamps(10, 100_000_000)), 1);
        assert_eq!(pace.take(stamps(100, 250_000)), 4);
    }

    #[test]
    fn a_step_of_data_takes_its_time_however_slow_the_replay() {
        let now = Instant::now();
        for (speed, step_nanos) in [
            (1.0, 20_000_000),
            (0.001, 20_000_000),
            (0.01, 1_000_000_000),
        ] {
            let Some(mut pace) = Pace::new(Some(speed)) else {
                return;
            };
            assert_eq!(pace.until(Nanos(0), now), Duration::ZERO);
            let wait = pace.until(Nanos(step_nanos), now).as_secs_f64();
            let due = step_nanos as f64 * 1e-9 / speed;
            // Rounded to nanoseconds.
            assert!(
                (wait - due).abs() < 1e-6,
                "speed {speed}: {wait} s, due {due} s"
            );
        }
    }

    #[test]
    fn two_topics_that_take_turns_take_the_time_of_one() {
        let Some(mut pace) = Pace::new(Some(1.0)) else {
            return;
        };
        let now = Instant::now();
        let second = |k: i64| Nanos(k * 1_000_000_000);
        for k in 0..3 {
            // The second topic's stretch begins where the first one's began.
            for stamp in [second(k), second(k + 1), second(k), second(k + 1)] {
                let _ = pace.until(stamp, now);
            }
        }
        assert_eq!(pace.until(second(4), now), Duration::from_secs(4));
    }

    #[test]
    fn a_clock_jump_is_not_waited_for() {
        let Some(mut pace) = Pace::new(Some(1.0)) else {
            return;
        };
        let begun = Instant::now();
        pace.wait(Nanos(0));
        pace.wait(Nanos(3_600_000_000_000));
        pace.wait(Nanos(0));
        assert!(begun.elapsed() < Duration::from_secs(1));
    }
}
