//! Samples whose stamps are bare numbers -> samples in time, once one unit is settled for all. Pure.
//!
//! Apart from the stream because samples wait here, and nowhere else in the daemon: at most
//! [`MOST_WAITING`], and no longer than [`LONGEST_WAIT`].

use std::time::Duration;
use strapd_attitude::record::TimeUnit;
use strapd_attitude::record::{Nanos, RawSample};
use strapd_recording::decode::{Ambiguous, Bare, MOST_WAITING, unit_of};

/// Time for which samples wait for others that tell their unit.
pub const LONGEST_WAIT: Duration = Duration::from_secs(2);

/// Unit, as far as it is known.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Unit {
    Open,
    Settled(TimeUnit),
    /// Ambiguous: such stamps are none.
    Ambiguous,
}

/// The unit of a stream's bare stamps, and the samples that wait for it.
#[derive(Debug)]
pub(super) struct Stamps {
    unit: Unit,
    waiting: Vec<(Option<u64>, RawSample, Option<Bare>)>,
    /// Time at which the first of them came.
    since: Nanos,
}

/// Samples that came together: as they came, or others in their place.
#[derive(Debug, Default)]
pub struct TimedSamples {
    /// The sender's number of each line, and where its samples end.
    pub lines: Vec<(Option<u64>, usize)>,
    /// The samples.
    pub samples: Vec<RawSample>,
}

impl TimedSamples {
    /// Adds a sample of the line with this number.
    pub(super) fn push(&mut self, seq: Option<u64>, sample: RawSample) {
        self.samples.push(sample);
        let end = self.samples.len();
        match self.lines.last_mut() {
            // Several samples of one line.
            Some((last, last_end)) if seq.is_some() && *last == seq => *last_end = end,
            _ => self.lines.push((seq, end)),
        }
    }
}

impl Stamps {
    pub(super) fn new(unit: Option<TimeUnit>) -> Stamps {
        Stamps {
            unit: unit.map_or(Unit::Open, Unit::Settled),
            waiting: Vec::new(),
            since: Nanos(0),
        }
    }

    pub(super) fn unit(&self) -> Option<TimeUnit> {
        match self.unit {
            Unit::Settled(unit) => Some(unit),
            Unit::Open | Unit::Ambiguous => None,
        }
    }

    /// Reopens the question of the unit.
    pub(super) fn reopen(&mut self) {
        self.unit = Unit::Open;
    }

    /// Whether samples wait.
    pub(super) fn is_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Whether some have waited for long enough.
    pub(super) fn is_overdue(&self, now: Nanos) -> bool {
        let longest = i64::try_from(LONGEST_WAIT.as_nanos()).unwrap_or(i64::MAX);
        self.is_waiting() && now.since(self.since) > longest
    }

    /// Takes samples with the bare stamps at their places, and gives those whose stamps are known by
    /// now; `None` where these are all of them, as they are.
    /// Where the unit cannot be told this comes with them, once: they and all others have no stamp.
    pub(super) fn take(
        &mut self,
        lines: &[(Option<u64>, usize)],
        samples: &[RawSample],
        bare: &[Option<Bare>],
        received: Nanos,
    ) -> (Option<TimedSamples>, Option<Ambiguous>) {
        if bare.is_empty() && self.waiting.is_empty() {
            return (None, None);
        }
        if self.waiting.is_empty() {
            self.since = received;
        }
        let mut ends = lines.iter().copied().peekable();
        for (n, sample) in samples.iter().enumerate() {
            while ends.next_if(|(_, end)| *end <= n).is_some() {}
            let seq = ends.peek().and_then(|(seq, _)| *seq);
            let number = bare.get(n).copied().flatten();
            self.waiting.push((seq, *sample, number));
        }
        let (taken, why) = self.release(self.is_overdue(received));
        (Some(taken), why)
    }

    /// Releases those whose stamps are known by now; all of them when nobody is to wait any longer.
    pub(super) fn release(&mut self, at_last: bool) -> (TimedSamples, Option<Ambiguous>) {
        let mut why = None;
        if self.unit == Unit::Open {
            let numbers = || self.waiting.iter().filter_map(|(_, _, bare)| *bare);
            let certain = numbers().next().and_then(Bare::certain_unit);
            let is_enough = numbers().nth(MOST_WAITING).is_some();
            if let Some(unit) = certain {
                self.unit = Unit::Settled(unit);
            } else if is_enough || (at_last && numbers().next().is_some()) {
                match unit_of(numbers().take(MOST_WAITING + 1)) {
                    Ok(unit) => self.unit = Unit::Settled(unit),
                    Err(ambiguous) => {
                        self.unit = Unit::Ambiguous;
                        why = Some(ambiguous);
                    }
                }
            }
        }
        let unit = match self.unit {
            Unit::Settled(unit) => Some(unit),
            Unit::Ambiguous => None,
            // None of those that wait would be bare but the last few.
            Unit::Open if !at_last && self.waiting.iter().any(|w| w.2.is_some()) => {
                return (TimedSamples::default(), None);
            }
            Unit::Open => None,
        };
        let mut taken = TimedSamples::default();
        for (seq, sample, bare) in self.waiting.drain(..) {
            let stamp = bare.zip(unit).map(|(bare, unit)| bare.in_unit(unit));
            let header = sample.header.or(stamp);
            taken.push(seq, RawSample { header, ..sample });
        }
        (taken, why)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn one(stamps: &mut Stamps, count: i64, received: i64) -> (Vec<Option<i64>>, bool) {
        let sample = RawSample::default();
        let bare = [Some(Bare::whole(count))];
        let (taken, why) = stamps.take(&[(None, 1)], &[sample], &bare, Nanos(received));
        let headers = taken
            .unwrap()
            .samples
            .iter()
            .map(|s| s.header.map(|h| h.0))
            .collect();
        (headers, why.is_some())
    }

    #[test]
    fn eight_wait_and_the_ninth_settles_the_unit_for_good() {
        let mut stamps = Stamps::new(None);
        for n in 0..8 {
            assert_eq!(one(&mut stamps, n * 5_000, 0), (vec![], false));
        }
        let (headers, _) = one(&mut stamps, 40_000, 0);
        let expected: Vec<_> = (0..9).map(|n| Some(n * 5_000_000)).collect();
        assert_eq!(headers, expected);
        // Any number is in microseconds now, also one that would be our time in another unit.
        assert_eq!(
            one(&mut stamps, 1_700_000_000, 0),
            (vec![Some(1_700_000_000_000)], false)
        );
        assert_eq!(stamps.unit(), Some(TimeUnit::Micro));
    }

    #[test]
    fn after_two_seconds_or_at_the_end_fewer_decide() {
        let mut stamps = Stamps::new(None);
        let at = |n: i64| 1_700_000_000_000 + n * 1_000;
        assert_eq!(one(&mut stamps, at(0), 0).0, []);
        assert_eq!(one(&mut stamps, at(1), 1_000_000_000).0, []);
        let (headers, _) = one(&mut stamps, at(2), 2_000_000_001);
        assert_eq!(headers, [0, 1, 2].map(|n| Some(at(n) * 1_000_000)));
        let mut stamps = Stamps::new(None);
        one(&mut stamps, 1_700_000_000, 0);
        let (taken, why) = stamps.release(true);
        assert_eq!(
            taken.samples[0].header,
            Some(Nanos(1_700_000_000_000_000_000))
        );
        assert!(why.is_none() && !stamps.is_waiting());
    }

    #[test]
    fn what_can_not_be_told_is_said_once_and_comes_without_stamps() {
        let mut stamps = Stamps::new(None);
        let mut said = 0;
        let mut headers = Vec::new();
        for n in 0..100 {
            let (some, why) = one(&mut stamps, n * 1_000_000, 0);
            headers.extend(some);
            said += u32::from(why);
        }
        assert_eq!((said, headers.len()), (1, 100));
        assert!(headers.iter().all(Option::is_none));
        // Who states the unit is not concerned, and nobody waits.
        let stated = RawSample {
            header: Some(Nanos(7)),
            ..RawSample::default()
        };
        assert!(
            stamps
                .take(&[(None, 1)], &[stated], &[], Nanos(0))
                .0
                .is_none()
        );
    }
}
