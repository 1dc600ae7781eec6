//! A peer that was lost -> how long to wait before it is called again. Pure but for chance.

use std::hash::{BuildHasher, RandomState};
use std::time::Duration;

/// The first wait before another attempt.
const FIRST_WAIT: Duration = Duration::from_millis(100);
/// The longest.
const LONGEST_WAIT: Duration = Duration::from_secs(5);

/// Wait before another attempt: ever longer, and never in step with others who lost the
/// same peer at the same time.
#[derive(Debug, Default)]
pub(in crate::serve) struct Redial {
    failures: u32,
    chance: RandomState,
}

impl Redial {
    /// Counts a failure; returns how long to wait.
    pub(in crate::serve) fn failed(&mut self) -> Duration {
        let whole = FIRST_WAIT * (1 << self.failures.min(6));
        let part = self.chance.hash_one(self.failures) % 512;
        self.failures = self.failures.saturating_add(1);
        // Between three and five quarters.
        let wait = whole.min(LONGEST_WAIT) * (768 + part as u32) / 1024;
        wait.min(LONGEST_WAIT)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attempts_come_ever_later_and_at_least_every_five_seconds() {
        let mut redial = Redial::default();
        let waits: Vec<f64> = (0..100).map(|_| redial.failed().as_secs_f64()).collect();
        for (n, wait) in waits.iter().enumerate() {
            let whole = (0.1 * 2f64.powi(n.min(6) as i32)).min(5.0);
            // A nanosecond for what a Duration rounds.
            assert!(
                (0.75 * whole - 1e-9..=1.25 * whole).contains(wait),
                "{n}: {wait}"
            );
            assert!(*wait <= 5.0);
        }
        assert!(waits.windows(2).skip(10).any(|w| w[0] != w[1]), "no jitter");
        let mut other = Redial::default();
        let others: Vec<f64> = (0..100).map(|_| other.failed().as_secs_f64()).collect();
        assert_ne!(waits, others, "two of them in step");
        redial.failures = 0;
        assert!(redial.failed() < Duration::from_millis(130));
    }
}
