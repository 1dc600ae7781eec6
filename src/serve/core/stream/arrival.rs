//! Samples without stamps, in the order in which they came -> samples stamped by their arrivals. Pure.
//!
//! Apart from the stamps of a sender because here samples wait, too, though for another thing: until a few arrivals tell
//! the step of the sensor ([`ArrivalClock`]). Forces and fields of their own have the stamp of the rate before them.

use super::stamps::TimedSamples;
use std::time::Duration;
use strapd_attitude::condition::{ArrivalClock, MOST_ARRIVALS};
use strapd_attitude::record::{Nanos, RawSample};

/// Time for which samples wait for others that tell their step, if there are enough, and at most.
const WAIT: Duration = Duration::from_secs(2);

/// Arrivals of a sensor, and the samples that wait for its step.
#[derive(Debug, Default)]
pub(super) struct Arrivals {
    clock: ArrivalClock,
    waiting: Vec<(Option<u64>, RawSample)>,
    /// Time at which the first of them came.
    since: Nanos,
    newest: Option<Nanos>,
    waited_secs: f64,
}

impl Arrivals {
    /// Whether samples wait.
    pub(super) fn is_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Whether some have waited for long enough.
    pub(super) fn is_overdue(&self, now: Nanos) -> bool {
        let longest = i64::try_from(WAIT.as_nanos()).unwrap_or(i64::MAX);
        self.is_waiting() && now.since(self.since) > longest
    }

    /// Takes samples with the sender's number of each line and where its samples end. Returns those whose stamps are
    /// known by now.
    pub(super) fn take(
        &mut self,
        lines: &[(Option<u64>, usize)],
        samples: &[RawSample],
        received: Nanos,
    ) -> TimedSamples {
        if self.waiting.is_empty() {
            self.since = received;
        }
        let mut ends = lines.iter().copied().peekable();
        for (n, sample) in samples.iter().enumerate() {
            while ends.next_if(|(_, end)| *end <= n).is_some() {}
            let seq = ends.peek().and_then(|(seq, _)| *seq);
            self.waiting.push((seq, *sample));
        }
        let arrivals: Vec<(Nanos, [f64; 3])> = samples
            .iter()
            .filter(|raw| !raw.is_beside)
            .map(|raw| (raw.log, raw.gyro.unwrap_or([f64::NAN; 3])))
            .collect();
        let mut stamps = Vec::new();
        self.clock.take(&arrivals, &mut stamps);
        let is_too_many = self.waiting.len() > 2 * MOST_ARRIVALS;
        if is_too_many || self.is_overdue(received) {
            self.clock.release(&mut stamps);
        }
        self.stamped(&stamps, received)
    }

    /// Releases those that wait, when nobody is to wait any longer.
    pub(super) fn release(&mut self) -> TimedSamples {
        let mut stamps = Vec::new();
        self.clock.release(&mut stamps);
        self.stamped(&stamps, self.since)
    }

    fn stamped(&mut self, stamps: &[Nanos], now: Nanos) -> TimedSamples {
        let mut taken = TimedSamples::default();
        if self.clock.is_waiting() {
            return taken;
        }
        self.waited_secs = self.waited_secs.max(now.secs_since(self.since));
        let mut stamps = stamps.iter();
        for (seq, mut sample) in self.waiting.drain(..) {
            if !sample.is_beside {
                self.newest = stamps.next().copied().or(self.newest);
            }
            sample.header = Some(self.newest.unwrap_or(sample.log));
            taken.push(seq, sample);
        }
        taken
    }

    /// State for `STATUS`.
    pub(super) fn status(&self) -> serde_json::Value {
        let report = self.clock.report();
        serde_json::json!({
            "rate_hz": report.map(|r| r.rate_hz), "batch": report.map(|r| r.batch),
            "latency_s": report.map(|r| r.latency_secs), "waited_s": self.waited_secs,
            "restarts": report.map_or(0, |r| r.restarts), "uneven": self.clock.is_uneven(),
        })
    }
}
