//! Stamps that do not go on while samples arrive -> what to say of the sensor, once. Pure.
//!
//! Apart from the losses because such samples are not lost: they wait for a later stamp, and one that never comes leaves
//! neither an attitude nor a count behind.

use crate::report::findings::{Finding, Severity};
use crate::serve::guard::fault::Fault;
use strapd_attitude::condition::Clock;
use strapd_attitude::record::{Nanos, RawSample};
use strapd_attitude::setting::TIME;

/// Samples with one stamp, and time from the arrival of the first to that of the last, s, that no batch has.
const SAMPLES: u64 = 24;
const SECS: f64 = 2.0;

/// Samples of a run that have the newest stamp.
#[derive(Debug, Default)]
pub(super) struct StillStamps {
    stamp: Option<Nanos>,
    /// Arrival of the first and of the last of them.
    arrived: [Nanos; 2],
    samples: u64,
    is_unsaid: bool,
}

impl StillStamps {
    /// Prepares to tell another sender what is wrong.
    pub(super) fn meet(&mut self) {
        self.is_unsaid = self.stands();
    }

    /// Begins a run.
    pub(super) fn begin(&mut self) {
        *self = StillStamps::default();
    }

    /// Takes the next sample of the run.
    #[inline]
    pub(super) fn take(&mut self, raw: &RawSample, clock: Clock) {
        let Some(stamp) = raw.header.filter(|_| clock == Clock::Header) else {
            return;
        };
        if self.stamp != Some(stamp) {
            *self = StillStamps {
                stamp: Some(stamp),
                arrived: [raw.log; 2],
                samples: 1,
                is_unsaid: false,
            };
            return;
        }
        let stood = self.stands();
        self.samples += 1;
        self.arrived[1] = raw.log;
        self.is_unsaid |= self.stands() && !stood;
    }

    fn secs(&self) -> f64 {
        let [first, last] = self.arrived;
        last.secs_since(first)
    }

    fn stands(&self) -> bool {
        self.samples >= SAMPLES && self.secs() >= SECS
    }

    /// Returns the fault to report to the sender, once.
    pub(super) fn news(&mut self, id: &str) -> Option<Fault> {
        let is_news = std::mem::take(&mut self.is_unsaid);
        let found = is_news.then(|| self.finding())??;
        Some(Fault {
            id: Some(id.to_owned()),
            ..Fault::new(Fault::STILL_STAMPS, found.line())
        })
    }

    /// The finding for `STATUS`.
    pub(super) fn finding(&self) -> Option<Finding> {
        let stamp = self.stamp.filter(|_| self.stands())?;
        let (samples, secs) = (self.samples, self.secs());
        let place = match stamp {
            Nanos(0) => "are all zero".to_owned(),
            Nanos(nanos) => format!("stand still at {:.6} s", nanos as f64 * 1e-9),
        };
        let what = format!("its stamps {place}: {samples} samples in {secs:.1} s");
        let evidence = [
            ("stamp_ns".to_owned(), stamp.0.into()),
            ("samples".to_owned(), samples.into()),
        ];
        Some(Finding {
            severity: Severity::Error,
            code: "still-stamps",
            topic: String::new(),
            what,
            evidence: evidence.into_iter().collect(),
            advice: "there is no attitude until they go on: mend the sender, or leave the stamp out and add `stamp=arrival` to the address, or start the daemon with".to_owned(),
            help: vec![vec![TIME.to("log")]],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Findings and faults of samples at 100 Hz with the stamps `stamp`, ns.
    fn told(stamp: impl Fn(i64) -> i64) -> (Option<Finding>, Vec<Fault>) {
        let mut still = StillStamps::default();
        let mut faults = Vec::new();
        for k in 0..400 {
            let raw = RawSample {
                header: Some(Nanos(stamp(k))),
                log: Nanos(k * 10_000_000),
                ..RawSample::default()
            };
            still.take(&raw, Clock::Header);
            faults.extend(still.news("imu"));
        }
        (still.finding(), faults)
    }

    #[test]
    fn a_clock_that_stands_still_or_is_zero_is_told_once_with_what_helps() {
        for (at, words) in [
            (0, "are all zero"),
            (5_000_000, "stand still at 0.005000 s"),
        ] {
            let (finding, faults) = told(|_| at);
            let Some(finding) = finding else {
                panic!("{words}")
            };
            assert!(finding.what.contains(words), "{}", finding.what);
            assert_eq!(finding.evidence["samples"], 400);
            let [fault] = faults.as_slice() else {
                panic!("{faults:?}")
            };
            assert!(fault.message.contains("time log"), "{}", fault.message);
        }
        // It stops on the way, and goes on again.
        assert!(told(|k| k.min(100) * 10_000_000).0.is_some());
        let goes_on = told(|k| if (50..300).contains(&k) { 50 } else { k });
        assert!(goes_on.0.is_none() && goes_on.1.len() == 1);
    }

    #[test]
    fn stamps_of_batches_and_of_whole_seconds_are_no_standing_clock() {
        for nanos in [1, 300_000_000, 1_000_000_000] {
            let (finding, faults) = told(|k| k * 10_000_000 / nanos * nanos);
            assert!(finding.is_none() && faults.is_empty(), "{nanos}");
        }
    }
}
