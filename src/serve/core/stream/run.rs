//! The first stamp of a connection -> whether the sensor's run goes on. Pure.
//!
//! A run is what one estimator integrates. Who connects again may go on where it was, may send
//! again what was sent before, or may begin anew with stamps that were used already; only the
//! stamps tell, and to integrate the same samples twice would be an attitude nobody has.

use crate::serve::protocol::wire::NAMELESS;
use std::time::Duration;
use strapd_attitude::record::{Nanos, RawSample};
use strapd_recording::decode::{Bare, Line};

/// Whether a sender's samples have a place of their own beside their stamps.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum OrderedBy {
    /// Place by stamp: the first stamp of a connection tells where it goes on.
    #[default]
    ByStamp,
    /// Yes, as of a stream that a broker keeps: what was taken is not taken again, and a stamp
    /// never begins a run.
    ByPosition,
}

/// Samples of one sensor from one client that came together.
#[derive(Clone, Copy, Debug)]
pub struct SampleRun<'a> {
    /// Number of the client they come from.
    pub client: u64,
    /// Contents of the first of their lines.
    pub head: &'a Line,
    /// Time at which they were received.
    pub received: Nanos,
    /// Place in their stream.
    pub placed: OrderedBy,
    /// The sender's number of each line, and where its samples end.
    pub lines: &'a [(Option<u64>, usize)],
    /// The samples.
    pub samples: &'a [RawSample],
    /// Stamps that are numbers without a unit, at their places; shorter where no more follow.
    pub bare: &'a [Option<Bare>],
    /// Whether a sample without a stamp has that of its arrival.
    pub by_arrival: bool,
    /// The number of the first line, 0 where it has none, and its beginning.
    pub first: (u64, &'a [u8]),
}

impl<'a> SampleRun<'a> {
    /// The sensor it is of.
    #[must_use]
    pub fn id(&self) -> &'a str {
        let id = self.head.id.as_deref();
        id.filter(|id| !id.is_empty()).unwrap_or(NAMELESS)
    }
}

/// Place of a connection's first sample.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum RunPlacement {
    /// Continuation behind everything that was taken.
    GoesOn,
    /// Repetition among what was taken.
    Again,
    /// Beginning of a run.
    Anew,
}

/// A run as far as it has come.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(in crate::serve) struct Span {
    /// First stamp, where that is known.
    pub(in crate::serve) first: Option<Nanos>,
    /// Last stamp.
    pub(in crate::serve) last: Nanos,
}

impl Span {
    /// Place of a connection whose first stamp is this. Further back than `window` nobody sends
    /// again.
    pub(super) fn standing(
        self,
        stamp: Nanos,
        window: Duration,
        placed: OrderedBy,
    ) -> RunPlacement {
        let window = i64::try_from(window.as_nanos()).unwrap_or(i64::MAX);
        if stamp > self.last {
            RunPlacement::GoesOn
        } else if placed == OrderedBy::ByPosition {
            RunPlacement::Again
        } else if self.first.is_some_and(|first| stamp <= first) || self.last.since(stamp) > window
        {
            RunPlacement::Anew
        } else {
            RunPlacement::Again
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_stamp_decides_unless_the_sender_knows_its_position() {
        let span = Span {
            first: Some(Nanos(100)),
            last: Nanos(200),
        };
        let window = Duration::from_nanos(50);
        for (stamp, by_stamps, by_position) in [
            (201, RunPlacement::GoesOn, RunPlacement::GoesOn),
            (200, RunPlacement::Again, RunPlacement::Again),
            (150, RunPlacement::Again, RunPlacement::Again),
            (149, RunPlacement::Anew, RunPlacement::Again),
            (100, RunPlacement::Anew, RunPlacement::Again),
            (i64::MIN, RunPlacement::Anew, RunPlacement::Again),
        ] {
            let of = |placed| span.standing(Nanos(stamp), window, placed);
            assert_eq!(of(OrderedBy::ByStamp), by_stamps, "{stamp}");
            assert_eq!(of(OrderedBy::ByPosition), by_position, "{stamp}");
        }
        // A short run: its first sample again, although within the window.
        let all = Duration::from_secs(60);
        assert_eq!(
            span.standing(Nanos(100), all, OrderedBy::ByStamp),
            RunPlacement::Anew
        );
        // Of a file of an older release the first stamp is not known.
        let old = Span {
            first: None,
            ..span
        };
        assert_eq!(
            old.standing(Nanos(100), all, OrderedBy::ByStamp),
            RunPlacement::Again
        );
    }
}
