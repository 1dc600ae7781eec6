//! Headings measured by something else than the sensor -> corrections of its heading. Pure.
//!
//! A course of GNSS, the compass of a ship, another tracker: a number in the world of the attitudes, with a sigma, that
//! comes seldom and late. The heading is compared at the stamp of the measurement, not at its arrival; where nothing
//! else tells north, the first turns the world, and those after it correct the filter.

use super::heading::wrapped;
use crate::plausible::are_numbers;
use crate::record::Nanos;
use std::collections::VecDeque;
use std::f64::consts::TAU;

/// Time between the headings that are remembered, and for how long: what comes later than that is not used, ns.
const STEP: i64 = 100_000_000;
const PAST: i64 = 3_000_000_000;
/// Longest time over which a heading is carried by the rate at one instant, ns.
const CARRIED: i64 = 100_000_000;
/// Measurements that wait for their sample.
const MOST: usize = 64;
/// Correlation time of a source's errors, s: measurements closer than twice that share them.
const COLOURED_SECS: f64 = 1.0;
/// Sigmas beyond which a measurement is doubted.
const DOUBTED: f64 = 4.0;
/// Time for which measurements must contradict the heading, and agree, to be believed instead, s; and how much of it
/// one of them counts at most.
const BELIEVED_SECS: f64 = 10.0;
const MOST_SECS: f64 = 2.0;
/// Sine of the pitch above which a body has no heading.
const STEEPEST: f64 = 0.985;

/// Heading that something else than the sensor has measured.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct OutsideHeading {
    /// Heading of the body's x axis in the world of the attitudes, rad: its yaw.
    pub heading: f64,
    /// One standard deviation, rad.
    pub sigma: f64,
}

impl OutsideHeading {
    /// Whether it can be used: a finite heading of a few turns at most, and a sigma above zero.
    #[must_use]
    pub fn is_plausible(&self) -> bool {
        self.heading.abs() <= 10.0 * TAU && self.sigma > 0.0 && self.sigma <= TAU
    }
}

/// Counts of headings from outside.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct OutsideHeadingCounts {
    /// Number of those that corrected the heading, or turned the world.
    pub used: u64,
    /// Number of those so far off that they were doubted.
    pub doubted: u64,
    /// Number of those that no sample was near, or that came while the body pointed up or down.
    pub unpaired: u64,
    /// Number of times the world was turned by one.
    pub turns: u64,
}

/// Use of a measurement.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Use {
    /// The heading is off by so much (rad), with this variance (rad^2).
    Correct(f64, f64),
    /// The world is to be turned by so much (rad), and the heading known to this variance (rad^2).
    Turn(f64, f64),
}

/// The body at a sample: its stamp, and what of its attitude is compared.
#[derive(Clone, Copy, Debug)]
pub(super) struct Now {
    pub(super) stamp: Nanos,
    /// Heading as it is told, rad.
    pub(super) heading: f64,
    /// Rate of the heading, rad/s.
    pub(super) rate: f64,
    /// Sine of the pitch.
    pub(super) steepness: f64,
    /// Variance of the heading, rad^2.
    pub(super) variance: f64,
    /// Whether the heading means nothing outside until one is told.
    pub(super) is_free: bool,
}

/// Headings on their way to samples, and what was made of them.
#[derive(Clone, PartialEq, Debug, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default)
)]
pub(super) struct OutsideHeadings {
    /// Each with its stamp; without one it is of the next sample.
    waiting: VecDeque<(Option<Nanos>, OutsideHeading)>,
    /// Headings as they were told, a tenth of a second apart, of the last seconds; kept once a measurement has come.
    past: VecDeque<(Nanos, f64)>,
    /// Stamp of the last measurement that was compared.
    last: Option<Nanos>,
    /// Whether the heading is that of the measurements by now.
    has_begun: bool,
    /// Time for which measurements have contradicted the heading, s, and by how much the last did, rad.
    contradicted: f64,
    off: f64,
    pub(super) counts: OutsideHeadingCounts,
}

impl OutsideHeadings {
    /// Takes a measurement; without a stamp it is of the next sample.
    pub(super) fn take(&mut self, stamp: Option<Nanos>, measured: OutsideHeading) {
        if !measured.is_plausible() || self.waiting.len() >= MOST {
            self.counts.unpaired += 1;
            return;
        }
        self.waiting.push_back((stamp, measured));
    }

    /// Whether any has come.
    pub(super) fn is_unused(&self) -> bool {
        *self == OutsideHeadings::default()
    }

    /// Whether nothing in it can make work: bounded, and of numbers.
    pub(super) fn is_bounded(&self) -> bool {
        self.waiting.len() <= MOST
            && self.waiting.iter().all(|(_, one)| one.is_plausible())
            && self.past.len() <= (PAST / STEP) as usize + 2
            && are_numbers(self.past.iter().map(|(_, heading)| heading))
            && are_numbers(&[self.contradicted, self.off])
    }

    /// The heading means nothing outside again: the next measurement turns the world.
    pub(super) fn begin_anew(&mut self) {
        self.past.clear();
        (self.has_begun, self.contradicted, self.last) = (false, 0.0, None);
    }

    /// Ends it: no sample follows.
    pub(super) fn finish(&mut self) {
        self.counts.unpaired += self.waiting.len() as u64;
        self.waiting.clear();
    }

    /// Appends what the measurements up to this sample ask for: corrections, or one turn and no more.
    pub(super) fn at(&mut self, now: &Now, asked: &mut Vec<Use>) {
        while let Some((stamp, measured)) = self.waiting.front().copied() {
            let stamp = stamp.unwrap_or(now.stamp);
            if stamp > now.stamp {
                break;
            }
            self.waiting.pop_front();
            let Some(told) = self
                .told_at(stamp, now)
                .filter(|_| now.steepness.abs() < STEEPEST)
            else {
                self.counts.unpaired += 1;
                continue;
            };
            if let Some(wanted) = self.compare(stamp, measured, told, now) {
                asked.push(wanted);
                if matches!(wanted, Use::Turn(..)) {
                    return;
                }
            }
        }
        self.remember(now);
    }

    fn remember(&mut self, now: &Now) {
        let step = self
            .past
            .back()
            .map_or(i64::MAX, |(last, _)| now.stamp.since(*last));
        if step < 0 {
            self.past.clear();
        }
        if !(0..STEP).contains(&step) {
            self.past.push_back((now.stamp, now.heading));
        }
        while self
            .past
            .front()
            .is_some_and(|(first, _)| now.stamp.since(*first) > PAST)
        {
            self.past.pop_front();
        }
    }

    /// The heading as it was told at `stamp`, which is not after now.
    fn told_at(&self, stamp: Nanos, now: &Now) -> Option<f64> {
        let ago = now.stamp.since(stamp);
        if ago <= CARRIED {
            return Some(now.heading - now.rate * 1e-9 * ago as f64);
        }
        let after = self.past.iter().position(|(at, _)| *at >= stamp);
        let (later, before) = match after {
            Some(0) => return None,
            Some(after) => (self.past.get(after)?, self.past.get(after - 1)?),
            None => (&(now.stamp, now.heading), self.past.back()?),
        };
        let share = stamp.since(before.0) as f64 / later.0.since(before.0).max(1) as f64;
        Some(before.1 + share * wrapped(later.1 - before.1))
    }

    fn compare(
        &mut self,
        stamp: Nanos,
        measured: OutsideHeading,
        told: f64,
        now: &Now,
    ) -> Option<Use> {
        let off = wrapped(measured.heading - told);
        let white = measured.sigma * measured.sigma;
        let secs = self
            .last
            .map_or(f64::INFINITY, |last| stamp.secs_since(last).max(0.0));
        self.last = Some(self.last.map_or(stamp, |last| last.max(stamp)));
        if now.is_free && !self.has_begun {
            return Some(self.turn(off, white));
        }
        let sigmas = |off: f64, variance: f64| off.abs() / variance.sqrt();
        if sigmas(off, now.variance + white) > DOUBTED {
            self.counts.doubted += 1;
            let is_alike = sigmas(wrapped(off - self.off), 2.0 * white) <= DOUBTED;
            let before = if is_alike { self.contradicted } else { 0.0 };
            (self.contradicted, self.off) = (before + secs.min(MOST_SECS), off);
            // A magnetic field that says otherwise is not given up.
            let is_believed = now.is_free && self.contradicted >= BELIEVED_SECS;
            return is_believed.then(|| self.turn(off, white));
        }
        self.contradicted = (self.contradicted - 2.0 * secs.min(MOST_SECS)).max(0.0);
        self.has_begun = true;
        self.counts.used += 1;
        let shared = (2.0 * COLOURED_SECS / secs.max(1e-3)).max(1.0);
        Some(Use::Correct(off, white * shared))
    }

    fn turn(&mut self, off: f64, variance: f64) -> Use {
        self.counts.used += 1;
        self.counts.turns += 1;
        (self.has_begun, self.contradicted) = (true, 0.0);
        self.past.clear();
        Use::Turn(off, variance)
    }
}
