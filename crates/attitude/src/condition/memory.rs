//! All a conditioner needs to go on exactly <-> plain numbers. Pure.
//!
//! Apart from the conditioner because it is read by another process: nothing in it is believed
//! unseen. Samples that have left are not kept: whoever sends them again is told by the stamps.

use super::gate::{Entry, MAX_STAMP, NO_ACCEL, finite_accel};
use super::spacing::Steps;
use super::timing::Previous;
use super::{Conditioner, Report};
use crate::record::{Nanos, RawSample, Status, Verdict};
use nalgebra::Vector3;

/// Most samples that wait for what follows them.
const MOST_WAITING: usize = 16;

/// Largest value of a sample, whatever its unit.
const LARGEST: f64 = 1e9;

/// State of a conditioner at one moment; [`Conditioner::recall`] restores it.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct Memory {
    /// Samples so far, and the stamp of the first where the clock counts samples.
    index: u64,
    index_base: Option<i64>,
    /// Stamp that `--start` and `--until` are counted from.
    trimmed_from: Option<i64>,
    rejected: bool,
    epoch: u32,
    high: Option<i64>,
    floor: Option<i64>,
    /// Older than the newest; and not older, but not yet timed.
    suspects: Vec<Row>,
    untimed: Vec<Row>,
    previous: Option<Before>,
    steps: Steps,
    first: Option<i64>,
    last: Option<i64>,
}

/// Stamp, start, value, epoch.
type Before = (i64, i64, [f64; 3], u32);

/// Stamp, log time, value, specific force, interval (0: none), epoch, status bits.
type Row = (i64, i64, [f64; 3], Option<[f64; 3]>, i64, u32, u16);

impl Memory {
    /// Whether a conditioner can have known it, whatever the settings.
    pub(crate) fn is_plausible(&self) -> bool {
        let stamps = [
            self.index_base,
            self.trimmed_from,
            self.high,
            self.floor,
            self.first,
            self.last,
        ];
        let rows = || self.suspects.iter().chain(&self.untimed);
        stamps
            .into_iter()
            .flatten()
            .chain(rows().map(|row| row.0))
            .chain(self.previous.iter().flat_map(|p| [p.0, p.1]))
            .all(|stamp| stamp.unsigned_abs() <= MAX_STAMP as u64)
            && rows().all(|row| row.2.iter().all(|v| v.abs() <= 2e4))
            && self
                .previous
                .iter()
                .all(|p| p.2.iter().all(|v| v.abs() <= LARGEST))
    }

    /// The last stamp that was used.
    #[must_use]
    pub fn last(&self) -> Option<Nanos> {
        self.last.map(Nanos)
    }
}

impl Conditioner {
    /// Returns the state; `None` before the first sample, and while more of them wait than is worth keeping.
    #[must_use]
    pub fn memory(&self) -> Option<Memory> {
        let untimed = self.order.untimed();
        let waiting = untimed.len().max(self.order.suspects().len());
        if self.zero.is_some() || !self.primed || waiting > MOST_WAITING {
            return None;
        }
        let nanos = |stamp: Option<Nanos>| stamp.map(|s| s.0);
        let rows = |entries: &[Entry]| entries.iter().map(row).collect();
        Some(Memory {
            index: self.index,
            index_base: self.index_clock.as_ref().and_then(|c| nanos(c.base())),
            trimmed_from: nanos(self.first_stamp),
            rejected: self.rejected,
            epoch: self.order.epoch(),
            high: nanos(self.order.high()),
            floor: nanos(self.order.floor()),
            suspects: rows(self.order.suspects()),
            untimed: rows(untimed),
            previous: self
                .timing
                .previous()
                .map(|p| (p.stamp.0, p.start.0, p.value.into(), p.epoch)),
            steps: self.timing.steps(),
            first: nanos(self.report.first),
            last: nanos(self.report.last),
        })
    }

    /// Goes on as the conditioner with the same settings would have that knew this. What was counted
    /// stays. `false`, and nothing has changed, when no conditioner can have known it.
    #[must_use]
    pub fn recall(&mut self, memory: &Memory) -> bool {
        let can_be = memory.is_plausible()
            && memory.suspects.len().max(memory.untimed.len()) <= MOST_WAITING
            && memory.untimed.is_sorted_by_key(|row| (row.5, row.0))
            && memory.index < u64::MAX / 4
            && memory.index_base.is_some() == self.index_clock.is_some();
        if !can_be || !self.timing.set_steps(&memory.steps) {
            return false;
        }
        self.index = memory.index;
        if let (Some(clock), Some(base)) = (&mut self.index_clock, memory.index_base) {
            clock.count_from(Nanos(base));
        }
        self.first_stamp = memory.trimmed_from.map(Nanos);
        self.rejected = memory.rejected;
        self.zero = None;
        self.primed = true;
        self.hold = self.window;
        self.order.recall(
            memory.untimed.iter().map(entry).collect(),
            memory.suspects.iter().map(entry).collect(),
            memory.epoch,
            memory.high.map(Nanos),
            memory.floor.map(Nanos),
        );
        self.timing.set_previous(
            memory
                .previous
                .map(|(stamp, start, value, epoch)| Previous {
                    stamp: Nanos(stamp),
                    start: Nanos(start),
                    value: Vector3::from(value),
                    epoch,
                }),
        );
        self.report.first = memory.first.map(Nanos);
        self.report.last = memory.last.map(Nanos);
        true
    }

    /// Begins as the run after one of which so much was counted.
    pub fn succeed(&mut self, counted: &Report) {
        self.report = counted.clone();
        self.report.first = None;
        self.report.last = None;
        self.report.spacing_nanos = None;
    }

    /// The stamp a sample has by the clock that is believed; `None` where it has none, or that clock
    /// reads no stamps. Zero is none but close to a clock's beginning, as `near` is.
    #[must_use]
    pub fn stamp_of(&self, raw: &RawSample, near: Nanos) -> Option<Nanos> {
        let is_one = |stamp: &Nanos| match stamp.0 {
            0 => near.0.abs() <= super::ZERO_IS_CLOSE_NANOS,
            stamp => stamp.unsigned_abs() <= MAX_STAMP as u64,
        };
        self.clock.read(raw).filter(is_one)
    }

    /// A sample came that its sender has sent before: it is counted, and nothing else.
    pub(crate) fn push_late(&mut self, stamp: Nanos) {
        self.report.note(Verdict::Late, self.index, Some(stamp));
    }
}

fn row(entry: &Entry) -> Row {
    (
        entry.stamp.0,
        entry.log.0,
        entry.value.into(),
        finite_accel(&entry.accel).map(Into::into),
        entry.interval,
        entry.epoch,
        entry.status.0,
    )
}

fn entry(&(stamp, log, value, accel, interval, epoch, status): &Row) -> Entry {
    Entry {
        stamp: Nanos(stamp),
        log: Nanos(log),
        value: Vector3::from(value),
        accel: accel.map_or(NO_ACCEL, Vector3::from),
        interval: interval.max(0),
        index: 0,
        epoch,
        status: Status(status),
    }
}
