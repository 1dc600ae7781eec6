//! Samples of lines whose stamps are bare numbers -> the same with instants, once the unit of all is known. Pure.
//!
//! Apart from the lines because each sensor of a log has a unit of its own.

use super::stated_nanos::{StatedNanos, TooFast};
use crate::decode::{Ambiguous, Bare, Line, MOST_WAITING, unit_of};
use strapd_attitude::record::{Nanos, RawSample, TimeUnit};

/// Samples that wait at most, where few of them have bare numbers.
const MOST_HELD: usize = 1024;

/// Stamps that are bare numbers: their samples wait until the unit of all is known.
#[derive(Default, Debug)]
pub(super) struct BareStamps {
    unit: Option<TimeUnit>,
    waiting: Vec<(RawSample, Option<Bare>)>,
    /// Steps of the stamps that state their unit.
    stated: StatedNanos,
    /// The unit that they state.
    stated_unit: Option<TimeUnit>,
    /// Steps of the recorder's clock, of rows that carry it beside their stamp.
    arrivals: StatedNanos,
}

impl BareStamps {
    /// Takes the samples of a line; those whose stamps are known by now.
    ///
    /// # Errors
    /// Several units would do, or none.
    pub(super) fn take(
        &mut self,
        samples: &mut Vec<RawSample>,
        line: &Line,
    ) -> Result<impl Iterator<Item = RawSample>, Ambiguous> {
        let bare = line.bare.iter().copied().chain(std::iter::repeat(None));
        self.stated_unit = line.stamp_unit.or(self.stated_unit);
        for (raw, bare) in samples.drain(..).zip(bare) {
            if let (Some(stamp), None, false) = (raw.header, bare, raw.is_beside) {
                self.stated.take(stamp);
                if raw.log.0 != 0 {
                    self.arrivals.take(raw.log);
                }
            }
            self.waiting.push((raw, bare));
        }
        let mut numbers = self.numbers();
        let (first, ninth) = (numbers.next(), numbers.nth(MOST_WAITING - 1));
        let certain = first.and_then(Bare::certain_unit);
        drop(numbers);
        self.unit = self.unit.or(certain);
        let are_open = matches!((self.unit, first, ninth), (None, Some(_), None));
        self.release(!are_open || self.waiting.len() >= MOST_HELD)
    }

    /// Settles the unit, which is that of the stamps there are, at their end.
    ///
    /// # Errors
    /// Several units would do, or none.
    pub(super) fn settle(&mut self) -> Result<impl Iterator<Item = RawSample>, Ambiguous> {
        self.release(true)
    }

    /// Returns the fault of stamps whose name states their unit, if there is one. Where the recorder's clock
    /// ticks as a gyro does, no unit is guessed: its speed tells what the stamps are, and takes their place.
    pub(super) fn too_fast(&self) -> Option<TooFast> {
        self.stated
            .too_fast(self.stated_unit)
            .filter(|_| !self.arrivals.are_a_sensors())
    }

    /// Returns the number of their steps.
    pub(super) fn steps(&self) -> u64 {
        self.stated.steps()
    }

    /// Numbers of the samples that wait: what is of other sensors than the gyro comes at other steps.
    fn numbers(&self) -> impl Iterator<Item = Bare> {
        let own = self.waiting.iter().filter(|(raw, _)| !raw.is_beside);
        own.filter_map(|(_, bare)| *bare)
    }

    fn release(&mut self, are_known: bool) -> Result<impl Iterator<Item = RawSample>, Ambiguous> {
        if are_known && self.unit.is_none() && self.numbers().next().is_some() {
            self.unit = Some(unit_of(self.numbers().take(MOST_WAITING + 1))?);
        }
        let unit = self.unit.unwrap_or_default();
        let known = if are_known { self.waiting.len() } else { 0 };
        Ok(self.waiting.drain(..known).map(move |(raw, bare)| {
            let header = raw.header.or(bare.map(|bare| bare.in_unit(unit)));
            at_its_stamp(RawSample { header, ..raw })
        }))
    }
}

/// The sample with the times it has not: a line has none but the one in it; a row may.
fn at_its_stamp(raw: RawSample) -> RawSample {
    let stamp = raw.header.unwrap_or(Nanos(0));
    let log = Some(raw.log).filter(|log| log.0 != 0).unwrap_or(stamp);
    RawSample {
        log,
        publish: log,
        ..raw
    }
}
