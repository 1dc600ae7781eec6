//! The first intervals of a run beside the steps of their stamps -> what to say of them, once. Pure.
//!
//! Apart from the stream because a replay refuses a log whose intervals disagree ([`Mismatch`]), while a
//! daemon goes on: all it can do is say so.

use crate::serve::guard::fault::Fault;
use strapd_attitude::condition::Clock;
use strapd_attitude::estimate::{LEAST_INTERVALS, Mismatch};
use strapd_attitude::record::{RawSample, SampleKind};

/// Intervals after which those that agree are not looked at any longer.
const ENOUGH: usize = 512;

/// Verdict on whether they agree, as far as it is known.
#[derive(Debug, Default)]
enum Verdict {
    /// Not yet.
    #[default]
    Open,
    /// Agreement.
    Agreeing,
    /// Disagreement.
    Wrong(Mismatch),
}

/// The intervals of a run, as far as they are looked at.
#[derive(Debug, Default)]
pub(super) struct Intervals {
    /// Interval and stamp, ns.
    first: Vec<(i64, i64)>,
    verdict: Verdict,
    /// Mismatch still to be reported.
    unsaid: Option<Mismatch>,
    /// Times they were found to disagree.
    found: u64,
}

impl Intervals {
    /// Others will come: of another run, or of somebody else. A few of those before them count as well.
    pub(super) fn reopen(&mut self) {
        self.verdict = Verdict::Open;
    }

    /// A run begins.
    pub(super) fn begin(&mut self) {
        self.first.clear();
        self.verdict = Verdict::Open;
    }

    /// Takes the next sample of the run; looks at them all as often as their number has doubled.
    #[inline]
    pub(super) fn take(&mut self, raw: &RawSample, clock: Clock, kind: SampleKind) {
        if kind == SampleKind::Rate || !matches!(self.verdict, Verdict::Open) {
            return;
        }
        let Some(interval) = raw.interval_nanos.filter(|nanos| *nanos > 0) else {
            return;
        };
        let stamp = clock.read(raw).map_or(0, |stamp| stamp.0);
        self.first.push((interval, stamp));
        let count = self.first.len();
        if count < LEAST_INTERVALS || !count.is_power_of_two() {
            return;
        }
        let intervals = self.first.iter().map(|(interval, _)| *interval);
        let stamps = self.first.iter().map(|(_, stamp)| *stamp);
        if let Some(mismatch) = Mismatch::of(intervals, stamps, clock) {
            self.verdict = Verdict::Wrong(mismatch);
            self.unsaid = Some(mismatch);
            self.found += 1;
        } else if count >= ENOUGH {
            self.verdict = Verdict::Agreeing;
        }
        if !matches!(self.verdict, Verdict::Open) {
            self.first = Vec::new();
        }
    }

    /// Fault to report once to who sends them.
    pub(super) fn news(&mut self, id: &str) -> Option<Fault> {
        let mismatch = self.unsaid.take()?;
        Some(Fault {
            id: Some(id.to_owned()),
            ..Fault::new("interval_mismatch", said(&mismatch))
        })
    }

    /// Warning for `STATUS`.
    pub(super) fn warning(&self) -> Option<String> {
        match &self.verdict {
            Verdict::Wrong(mismatch) => Some(said(mismatch)),
            Verdict::Open | Verdict::Agreeing => None,
        }
    }

    /// Times they were found to disagree.
    pub(super) fn found(&self) -> u64 {
        self.found
    }
}

fn said(mismatch: &Mismatch) -> String {
    format!(
        "{mismatch}: one of the two is wrong, or most samples were left out; each is taken as it is, and what lies between is bridged. State the unit of the interval by its name (dt_s, dt_ms, dt_us or dt_ns), or start the daemon with --field dt=PATH:UNIT"
    )
}
